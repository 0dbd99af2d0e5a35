"""List sentences that a reader has to read twice, in docstrings, comments, messages and Markdown.

    python tools/prose.py               # all tracked files: counts per folder
    python tools/prose.py PATH ...      # each flagged sentence of these files or folders
    python tools/prose.py --diff REV    # the sentences that this change adds to REV
    python tools/prose.py --diff        # the same against the merge base with origin/main, or HEAD~1

The exit code of `--diff` is 1 if more than 1 % of the added sentences have a flagged word, or more than 4 %
of them (and more than one) have over 34 words. Text in backticks or quotation marks is never flagged.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import subprocess
import sys
import tokenize
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

MAX_WORDS = 34
MAX_FLAGGED = 0.01
MAX_LONG = 0.04
FEWEST_WORDS = 4  # shorter texts are keys, units and names
UNREAD = {"tools/prose.py", "tests/package/test_prose.py"}  # they list the words themselves

# What to write instead, by the pattern that is flagged. `^` is the start of a sentence.
ADVICE = {
    r"^(What|Whatever|Who|Whoever|Whose|Whether|That which|By how|From where|In which)\b(?!.*\?$)": "a noun",
    r"^Of (?!course\b)": "the subject first: 'With several records, X counts'",
    r"^Where\b(?!.*\?$)": "'If'",
    r"\b(is|are|was|were|be|been|being|also|not) told\b|\btold (by|of|from|what|how)\b": "reported, said",
    r"\btells? (of|what|how|whether|which)\b": "reports, says, warns",
    r"\btold apart\b|\btells? \S+( \S+)? (apart|from)\b": "distinguish",
    r"\b(is|are|was|were|be|been|being|what) held\b(?! out)": "fixed",
    r"\bheld (as|near|at|too|tightly|loosely)\b": "fixed at, with a small model error",
    r"\bforetells?\b|\bforetold\b": "predicts, predicted",
    r"\bastray\b": "diverges, converges to the wrong solution",
    r"\bbears? (it |this )?out\b|\bborne out\b": "confirms, is confirmed by",
    r"\b(takes?|took|taken) up (?!to\b|\d)": "absorbs, is confounded with",
    r"\btaken for\b|\btakes? \S+( \S+)? for (?!granted|the first)": "mistaken for, treated as",
    r"\blikeli(er|est)\b": "more probable, most probable",
    r"\bwants? (it|an?|the|to be|one|by)\b": "needs, requires",
    r"\b(is|are|was) good to\b": "is accurate to",
    r"\bby how much\b|\bhow much of\b|\bso much\b|\bas much as\b": "the amount, by name",
    r"\b(goes|go|went|comes?|came|coming) to (rest|an end)\b": "stops, ends",
    r"\bbeside\b": "with, next to, compared with",
    r"\bgive or take\b": "with a standard deviation of",
    r"\b(where|of which|if) there is none\b": "none, not available",
    r"\bready-made\b": "predefined",
    r"\bbent\b|\bbends it\b": "biased, distorted",
    r"\b(lies?|is) idle\b|\bmakes? up\b(?! of)": "is unused; consists of, imitates",
    r"\bstands? (in|for|at|there|where|once)\b": "is, is listed in, represents",
    r"\bleans? on\b": "depends on",
    r"\bnought\b|\bwhence\b|\bthereby\b|\banew\b|\ball told\b": "a plain word, such as 'again'",
    r"\bin the place of\b|\bother than such\b|\bone another's\b": "instead of; the noun itself",
}
RULES = [
    (re.compile(pattern, re.IGNORECASE if pattern[0] != "^" else 0), advice)
    for pattern, advice in ADVICE.items()
]
QUOTATION = re.compile(r"`[^`]*`|\"[^\"]*\"|“[^”]*”|(?<![\w'])'[^']*'(?!\w)")
SENTENCE_END = re.compile(r"(?<=[.;:?!])\s+(?=[A-Z`*(\[])")

Lines = list[tuple[int, str]]  # line numbers and what is written there


@dataclass(frozen=True)
class Sentence:
    """A sentence with the first and the last line of the file that it covers."""

    first: int
    last: int
    text: str

    def flagged_words(self) -> list[str]:
        """Return each flagged phrase with the advice for it."""
        plain = QUOTATION.sub("Q", self.text)
        return [f"{hit[0]!r}: {advice}" for rule, advice in RULES if (hit := rule.search(plain))]

    def is_long(self) -> bool:
        """Return True if the sentence has more than 34 words."""
        return len(self.text.split()) > MAX_WORDS


def split_sentences(paragraph: Lines) -> Iterator[Sentence]:
    """Split a paragraph into sentences of four words or more."""
    starts, text = [], ""
    for _, line in paragraph:
        starts.append(len(text))
        text += line.strip() + " "
    begin = 0
    for end in [match.start() for match in SENTENCE_END.finditer(text)] + [len(text)]:
        sentence = text[begin:end].strip()
        if len(sentence.split()) >= FEWEST_WORDS:
            leading = len(text[begin:end]) - len(text[begin:end].lstrip())
            first = bisect_right(starts, begin + leading) - 1
            last = bisect_right(starts, max(begin, end - 1)) - 1
            yield Sentence(paragraph[first][0], paragraph[last][0], sentence)
        begin = end


def split_paragraphs(lines: Lines) -> Iterator[Lines]:
    """Split lines at blank ones, gaps of the line numbers, list items, headings and numpydoc entries."""
    paragraph: Lines = []
    after_entry = False
    for number, line in lines:
        item = re.match(r"\s*([-*]|\d+\.)\s+", line)
        entry = re.match(r"\s*[\w.*]+(, [\w.*]+)* : \S", line)
        blank = not line.strip() or re.fullmatch(r"\s*[-=#~`]{3,}\s*", line)
        gap = paragraph and number > paragraph[-1][0] + 1
        if paragraph and (blank or item or gap or entry or after_entry):
            yield paragraph
            paragraph = []
        after_entry = entry is not None
        if not blank:
            paragraph.append((number, line[item.end() :] if item else line))
    if paragraph:
        yield paragraph


def read_python(source: str) -> Iterator[Lines]:
    """Yield docstrings without their examples, comments, and string literals."""
    rows = source.splitlines()
    inside_f_strings: set[ast.AST] = set()
    for node in ast.walk(ast.parse(source)):  # parents come before their children
        if isinstance(node, ast.JoinedStr):
            inside_f_strings.update(node.values)
            value = "".join(part.value if isinstance(part, ast.Constant) else "X" for part in node.values)  # type: ignore[misc]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in inside_f_strings:
            value = node.value
        else:
            continue
        if '"""' in rows[node.lineno - 1]:
            text = list(enumerate(rows[node.lineno - 1 : node.end_lineno], node.lineno))
            text[0] = (text[0][0], text[0][1].split('"""', 1)[1])
            yield without_examples([(number, row.replace('"""', "")) for number, row in text])
        else:
            yield [(node.lineno, " ".join(value.split()))]
    block: Lines = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT or re.match(r"#( type:| noqa|!)", token.string):
            continue
        comment = (token.start[0], token.string.lstrip("#: "))
        if token.line[: token.start[1]].strip():  # after code: no part of the comment below it
            yield [comment]
        else:
            block.append(comment)
    yield block


def without_examples(lines: Lines) -> Lines:
    """Blank the doctests, each from its prompt to the next blank line."""
    kept, is_example = [], False
    for number, line in lines:
        is_example = line.lstrip().startswith(">>>") or (is_example and bool(line.strip()))
        kept.append((number, "" if is_example else line))
    return kept


def read_rust(source: str) -> Iterator[Lines]:
    """Yield comments and string literals."""
    comments: Lines = []
    for number, row in enumerate(source.splitlines(), 1):
        comment = re.search(r"(?:^|\s)//[/!]?(?:\s(.*))?$", row)
        if comment:
            comments.append((number, comment[1] or ""))
        for text in re.findall(r'"((?:[^"\\]|\\.)+)"', row[: comment.start()] if comment else row):
            yield [(number, text)]
    yield comments


def read_markdown(source: str) -> Iterator[Lines]:
    """Yield paragraphs and list items without code, tables, headings and the front matter."""
    prose: Lines = []
    is_code = is_header = False
    for number, row in enumerate(source.splitlines(), 1):
        if row == "---" and (number == 1 or is_header):
            is_header = not is_header
        if row.lstrip().startswith("```"):
            is_code = not is_code
        skipped = is_code or is_header or re.match(r"    |\||#|:::|---|\(\w+\)=|\s*```|!\[|:\w+:", row)
        prose.append((number, "" if skipped else row))
    yield prose


READERS: dict[str, Callable[[str], Iterator[Lines]]] = {
    ".py": read_python,
    ".pyi": read_python,
    ".rs": read_rust,
    ".md": read_markdown,
}


def sentences_of(path: Path) -> Iterator[Sentence]:
    """Yield the sentences of one file."""
    for text in READERS[path.suffix](path.read_text(encoding="utf-8")):
        for paragraph in split_paragraphs(text):
            yield from split_sentences(paragraph)


def git(*arguments: str) -> str | None:
    """Return what git prints, or None if it fails."""
    done = subprocess.run(["git", *arguments], capture_output=True, text=True, encoding="utf-8")
    return done.stdout if done.returncode == 0 else None


def base_of_change() -> str | None:
    """Return the revision that the change starts from, or None if the history is too short to know."""
    head = git("rev-parse", "HEAD")
    base = git("merge-base", "HEAD", "origin/main")
    if base and base != head:
        return base.strip()
    parent = git("rev-parse", "--verify", "--quiet", "HEAD~1")
    return parent.strip() if parent else None


def added_lines(revision: str) -> dict[str, set[int]]:
    """Return the lines that the working tree adds to a revision, by file; untracked files count in full."""
    added: dict[str, set[int]] = {}
    changes = git(
        "diff", "--unified=0", "--no-ext-diff", "--src-prefix=a/", "--dst-prefix=b/", "--relative", revision
    )
    if changes is None:
        sys.exit(f"prose: git knows no revision {revision!r}; give a commit, a branch or a tag")
    name = ""
    for row in changes.splitlines():
        if row.startswith("+++ "):
            name = row[6:]
        elif hunk := re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", row):
            start, count = int(hunk[1]), int(hunk[2] or 1)
            added.setdefault(name, set()).update(range(start, start + count))
    for name in (git("ls-files", "--others", "--exclude-standard") or "").splitlines():
        if Path(name).suffix in READERS:
            added[name] = set(range(1, 1 + len(Path(name).read_bytes().splitlines())))
    return added


def report(files: list[str], lines: dict[str, set[int]] | None, *, listed: bool) -> bool:
    """Print the flagged sentences of files and their counts; return True if they are below the limits."""
    total, flagged, long = Counter[str](), Counter[str](), Counter[str]()
    for name in files:
        folder = "/".join(Path(name).parts[: 3 if name.startswith("python/") else 1])
        for sentence in sentences_of(Path(name)):
            if lines is not None and lines[name].isdisjoint(range(sentence.first, sentence.last + 1)):
                continue
            words = sentence.flagged_words()
            total[folder] += 1
            flagged[folder] += bool(words)
            long[folder] += sentence.is_long()
            reasons = words + [f"{len(sentence.text.split())} words"] * sentence.is_long()
            if listed and reasons:
                print(f"{name}:{sentence.first}: {'; '.join(reasons)}\n    {sentence.text[:200]}")
    if not listed:
        for folder, count in total.most_common():
            print(f"{folder:28} {count:6} sentences, {flagged[folder]:5} flagged, {long[folder]:5} long")
    count, words_count, long_count = total.total(), flagged.total(), long.total()
    share = 100 / max(count, 1)
    print(
        f"prose: {count} sentences, {words_count} with flagged words ({words_count * share:.1f} %), "
        f"{long_count} of more than {MAX_WORDS} words ({long_count * share:.1f} %)"
    )
    return words_count <= MAX_FLAGGED * count and long_count <= max(1, MAX_LONG * count)


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("paths", nargs="*", help="files or folders; all tracked files by default")
    parser.add_argument(
        "--diff", nargs="?", const="", metavar="REV", help="only sentences that are added to REV"
    )
    given = parser.parse_args()
    lines: dict[str, set[int]] | None = None
    if given.diff is not None:
        revision = given.diff or base_of_change()
        if revision is None:
            print("prose: found no earlier commit to compare with (a shallow clone?); nothing is checked")
            return 0
        lines = added_lines(revision)
    names = (
        git("ls-files", "--cached", "--others", "--exclude-standard", "--", *given.paths) or ""
    ).splitlines()
    files = [
        name for name in names if Path(name).suffix in READERS and name not in UNREAD and Path(name).is_file()
    ]
    if lines is not None:
        files = [name for name in files if name in lines]
    passed = report(files, lines, listed=bool(given.paths) or lines is not None)
    if lines is not None and not passed:
        print("prose: more than 1 % flagged or 4 % long; see 'Writing' in CONTRIBUTING.md")
    return int(lines is not None and not passed)


if __name__ == "__main__":
    sys.exit(main())
