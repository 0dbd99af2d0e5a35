"""The how-to guides and the lesson: every code block runs, in a folder with the examples."""

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
SLOW = {"film.mp4", "discover", "paper", "--uncertainties", "example"}


def blocks(page: Path, language: str) -> list[str]:
    text = page.read_text(encoding="utf-8")
    assert set(re.findall(r"^ *```(\S+)$", text, re.MULTILINE)) <= RUN | SHOWN, page.name
    return re.findall(rf"^ *```{language}\n(.*?)^ *```$", text, re.DOTALL | re.MULTILINE)


def commands(page: Path) -> list[str]:
    return [line.strip() for block in blocks(page, "console") for line in block.splitlines()]


# `test_command_page.py` runs the commands of that page.
ELSEWHERE = set(
    re.findall(
        r"^    (udd .*?)(?:\s+#.*)?$", (DOCS / "command-line.md").read_text(encoding="utf-8"), re.MULTILINE
    )
)
COMMANDS = [command for page in PAGES for command in commands(page) if command not in ELSEWHERE]
COMMANDS = list(dict.fromkeys(COMMANDS))


def run(command: str) -> None:
    program, *arguments = shlex.split(command)
    assert program == "udd"
    assert main(arguments) in ((0, 3) if arguments[0] == "track" else (0,))


def is_slow(command: str) -> bool:
    return bool(SLOW & set(shlex.split(command)))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "page", [page for page in PAGES if blocks(page, "python")], ids=lambda page: page.stem
)
def test_the_python_blocks_of_a_guide_run(page: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    names: dict[str, object] = {}
    for block in blocks(page, "python"):
        exec(compile(block, page.name, "exec"), names)
    plt.close("all")


# A command that depends on another one's file is in `test_a_slow_command_of_a_guide_runs`.
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("command", [command for command in COMMANDS if not is_slow(command)])
def test_a_command_of_a_guide_runs(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    if command == "udd --version":
        with pytest.raises(SystemExit):
            run(command)
        return
    if command.startswith("udd fit clock.csv"):
        run("udd track clock.mp4 --bob red --length 0.8 --out clock.csv")
    run(command)


# The test below asks whether the parser accepts the same commands.
@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("command", [command for command in COMMANDS if is_slow(command)])
def test_a_slow_command_of_a_guide_runs(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    run(command)


@pytest.mark.parametrize("command", [command for command in COMMANDS if is_slow(command)])
def test_a_slow_command_of_a_guide_is_understood(command: str, folder: Path) -> None:
    args = make_parser().parse_args(shlex.split(command)[1:])
    for path in [*(getattr(args, "files", None) or []), getattr(args, "file", None)]:
        assert path is None or (folder / path).exists()


def test_there_are_thirty_guides_each_a_question_of_at_most_a_page() -> None:
    guides = [page for page in PAGES if page.parent.name == "howto" and page.stem != "index"]
    assert len(guides) == 30
    for page in guides:
        lines = page.read_text(encoding="utf-8").splitlines()
        assert len(lines) <= 70, page.name
        assert blocks(page, "python") or blocks(page, "console"), page.name
