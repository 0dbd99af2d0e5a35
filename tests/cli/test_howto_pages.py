"""The how-to guides and the lesson: all code of a page runs in order, in an empty folder."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from udd.cli import main
from udd.cli.parser import make_parser

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = [*sorted((DOCS / "howto").glob("*.md")), DOCS / "tutorials" / "lesson.md"]
#: Blocks in these languages run; the others are settings, installations and output.
RUN, SHOWN = {"python", "console"}, {"text", "toml", "{toctree}"}
#: Commands with these words take from some seconds to minutes; they run at night.
SLOW = {"film.mp4", "discover", "paper", "--uncertainties"}


def blocks(page: Path) -> list[tuple[str, str]]:
    """Return the language and the text of each block that runs, in order."""
    text = page.read_text(encoding="utf-8")
    assert set(re.findall(r"^ *```(\S+)$", text, re.MULTILINE)) <= RUN | SHOWN, page.name
    return re.findall(r"^ *```(python|console)\n(.*?)^ *```$", text, re.DOTALL | re.MULTILINE)


def commands(block: str) -> list[list[str]]:
    """Return the arguments of each command `udd` in a block."""
    words = [shlex.split(line) for line in block.splitlines()]
    assert all(program == "udd" for program, *_ in words)
    return [arguments for _, *arguments in words]


def is_slow(arguments: list[str]) -> bool:
    return bool(SLOW & set(arguments))


def has_slow_command(page: Path) -> bool:
    return any(
        is_slow(c) for language, block in blocks(page) if language == "console" for c in commands(block)
    )


def run(arguments: list[str]) -> None:
    if arguments == ["--version"]:
        with pytest.raises(SystemExit, match="0"):
            main(arguments)
        return
    assert main(arguments) in ((0, 3) if arguments[0] == "track" else (0,))


def understand(arguments: list[str]) -> None:
    """Parse a command, and check that the files that it reads are there."""
    args = make_parser().parse_args(arguments)
    for path in [*(getattr(args, "files", None) or []), getattr(args, "file", None)]:
        assert path is None or Path(path).exists(), f"{path} is not among the files of the page"


def follow(page: Path, *, at_night: bool) -> None:
    """Run all blocks of a page in the working folder; by day slow commands are only parsed."""
    names: dict[str, object] = {}
    for language, block in blocks(page):
        if language == "python":
            exec(compile(block, page.name, "exec"), names)
            continue
        for arguments in commands(block):
            if is_slow(arguments) and not at_night:
                understand(arguments)
            else:
                run(arguments)
    plt.close("all")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=lambda page: page.stem)
def test_a_guide_runs_in_an_empty_folder(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    follow(page, at_night=False)


# The test above parses the slow commands of the same pages.
@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "page", [page for page in PAGES if has_slow_command(page)], ids=lambda page: page.stem
)
def test_a_guide_with_slow_commands_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    follow(page, at_night=True)


def test_there_are_thirty_guides_each_a_question_of_at_most_a_page() -> None:
    guides = [page for page in PAGES if page.parent.name == "howto" and page.stem != "index"]
    assert len(guides) == 30
    for page in guides:
        lines = page.read_text(encoding="utf-8").splitlines()
        assert len(lines) <= 70, page.name
        assert blocks(page), page.name
