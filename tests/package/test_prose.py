"""`tools/prose.py`: the sentences that it flags, the lines that it reads, and the change that it judges."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "prose.py"


@pytest.fixture(scope="module")
def prose() -> ModuleType:
    spec = importlib.util.spec_from_file_location("prose", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["prose"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "sentence",
    [
        "What is fixed distorts the fit.",
        "Whether the orbit is bounded.",
        "Of several records X counts.",
        "Where the law is flat the fit fails.",
        "The scale is told by the marks.",
        "This tells whether it converged.",
        "The drive was held as stated.",
        "The model foretells the next frames.",
        "The search goes astray at once.",
        "Free runs bear it out.",
        "The drive takes up the effect.",
        "The value is good to 1e-12.",
        "The decrease says by how much chi2 falls.",
        "The disk comes to rest here.",
        "Plot the fit beside the data.",
        "The noise is 2 mm, give or take as much.",
        "A ready-made option is checked too.",
    ],
)
def test_flags_a_sentence_with_a_word_of_the_table(prose: ModuleType, sentence: str) -> None:
    assert prose.Sentence(1, 1, sentence).flagged_words()


@pytest.mark.parametrize(
    "sentence",
    [
        "Fixed parameters distort the fit.",
        "What does each line of the report mean?",
        "Of course the orbit is bounded.",
        "Records are held out for the test.",
        "The verdict `held as stated` is printed.",
        'The word "astray" is flagged.',
        "Return True if the orbit is bounded.",
        "It takes 3 s of one core.",
        "The tool gives the answer to 12 digits.",
    ],
)
def test_leaves_plain_sentences_quotations_and_questions(prose: ModuleType, sentence: str) -> None:
    assert prose.Sentence(1, 1, sentence).flagged_words() == []


def test_a_long_sentence_has_more_than_34_words(prose: ModuleType) -> None:
    assert not prose.Sentence(1, 1, " ".join(["word"] * 34)).is_long()
    assert prose.Sentence(1, 1, " ".join(["word"] * 35)).is_long()


PYTHON = '''"""Compute the spectrum of a model.

The orbit starts
at the origin. It must be bounded.

>>> print("What is told here is an example")
what it prints is not read
"""

def spectrum(t):
    """Compute a spectrum.

    Parameters
    ----------
    t : ndarray, shape (n,)
        times of the frames
    dt : float
        longest step that is allowed
    """
    return t  # returns the times themselves


# The first comment has
# two lines.
raise ValueError(f"the step is {step}, below the limit of 1")
'''

RUST = """//! The integrator of the core.
fn f() { // lands on the surface of a switch
    panic!("the step fell below the limit");
}
"""

MARKDOWN = """# What a heading says is no sentence

The first paragraph has
two lines.

- The first item stays alone.
- The second item does, too.

| what | a table is | no prose |

```python
what = "code is no prose either"
```
"""


@pytest.mark.parametrize(
    ("name", "source", "expected"),
    [
        (
            "a.py",
            PYTHON,
            {
                (1, 1, "Compute the spectrum of a model."),
                (3, 4, "The orbit starts at the origin."),
                (4, 4, "It must be bounded."),
                (15, 15, "t : ndarray, shape (n,)"),
                (16, 16, "times of the frames"),
                (18, 18, "longest step that is allowed"),
                (20, 20, "returns the times themselves"),
                (23, 24, "The first comment has two lines."),
                (25, 25, "the step is X, below the limit of 1"),
            },
        ),
        (
            "a.rs",
            RUST,
            {
                (1, 2, "The integrator of the core. lands on the surface of a switch"),
                (3, 3, "the step fell below the limit"),
            },
        ),
        (
            "a.md",
            MARKDOWN,
            {
                (3, 4, "The first paragraph has two lines."),
                (6, 6, "The first item stays alone."),
                (7, 7, "The second item does, too."),
            },
        ),
    ],
)
def test_reads_sentences_with_their_lines(
    prose: ModuleType, tmp_path: Path, name: str, source: str, expected: set[tuple[int, int, str]]
) -> None:
    path = tmp_path / name
    path.write_text(source, encoding="utf-8")
    assert {(s.first, s.last, s.text) for s in prose.sentences_of(path)} == expected


class Repository:
    """A repository of one Markdown file, and the script run in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.git("init", "--quiet", "--initial-branch=main")

    def git(self, *arguments: str) -> None:
        identity = ["-c", "user.name=A", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
        subprocess.run(["git", *identity, *arguments], cwd=self.folder, check=True, capture_output=True)

    def add(self, sentence: str, name: str = "a.md", *, commit: bool = True) -> None:
        with (self.folder / name).open("a", encoding="utf-8") as file:
            file.write(sentence + "\n\n")
        if commit:
            self.git("add", name)
            self.git("commit", "--quiet", "--message", "Add a sentence")

    def check(self, *arguments: str) -> tuple[int, str]:
        command = [sys.executable, str(SCRIPT), *(arguments or ["--diff"])]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, encoding="utf-8")
        return done.returncode, done.stdout + done.stderr


FLAGGED = "What is told here is flagged."
PLAIN = "This sentence is plain English."


@pytest.fixture
def repository(tmp_path: Path) -> Repository:
    made = Repository(tmp_path)
    made.add(FLAGGED)
    return made


def test_judges_only_what_the_last_commit_adds(repository: Repository) -> None:
    repository.add(PLAIN)
    code, printed = repository.check()
    assert code == 0 and "1 sentences, 0 with flagged words" in printed
    repository.add(FLAGGED)
    code, printed = repository.check()
    assert code == 1 and "a.md:5: " in printed and "'What'" in printed


def test_judges_edits_and_new_files_that_are_not_committed(repository: Repository) -> None:
    repository.add(PLAIN)
    repository.add(FLAGGED, "new.md", commit=False)
    code, printed = repository.check()
    assert code == 1 and "new.md:1: " in printed


def test_judges_a_branch_against_its_merge_base(repository: Repository) -> None:
    repository.git("update-ref", "refs/remotes/origin/main", "HEAD")
    repository.add("What is told first is flagged.")
    repository.add(PLAIN)
    code, printed = repository.check()
    assert code == 1 and "2 sentences, 1 with flagged words" in printed


def test_one_percent_of_flagged_sentences_passes(repository: Repository) -> None:
    repository.add("\n\n".join([PLAIN] * 99 + [FLAGGED]))
    assert repository.check()[0] == 0


def test_a_single_long_sentence_passes_and_two_of_two_fail(repository: Repository) -> None:
    repository.add("word " * 40)
    assert repository.check()[0] == 0
    repository.add("word " * 40, commit=False)
    assert repository.check("--diff", "HEAD~1")[0] == 1


def test_passes_with_a_remark_if_the_history_is_too_short(repository: Repository) -> None:
    code, printed = repository.check()
    assert code == 0 and "nothing is checked" in printed


def test_names_a_revision_that_does_not_exist(repository: Repository) -> None:
    code, printed = repository.check("--diff", "nowhere")
    assert code == 1 and "'nowhere'" in printed and "Traceback" not in printed
