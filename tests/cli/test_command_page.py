"""All commands on the documentation's page, and in the help of each command, run in a fresh folder."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from udd.cli import main
from udd.cli.parser import make_parser
from udd.examples import make

PAGE = Path(__file__).resolve().parents[2] / "docs" / "command-line.md"
#: Commands with these words take from ten seconds to minutes and run at night.
SLOW = (
    "demo",
    "discover",
    "paper",
    "film.mp4",
    "forecast",
    "--uncertainties",
    "--cascade",
    "--crises",
    "film",
)


def commands() -> list[str]:
    lines = re.findall(r"^    udd (.*)", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    subparsers = next(action for action in make_parser()._actions if action.choices)
    shown = [one for parser in subparsers.choices.values() for one in parser.examples]  # type: ignore[union-attr]
    helped = [one.removeprefix("udd ") for one in shown if one.startswith("udd ")]
    every = [re.split(r"\s+#\s|\s>\s", line)[0].strip() for line in (*lines, *helped)]
    return [one for one in dict.fromkeys(every) if not one.startswith("app") and one != "example all"]


def is_slow(command: str) -> bool:
    words = shlex.split(command)
    return any(word in SLOW for word in words)


def run(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    if command.startswith("completion"):
        pytest.importorskip("shtab")
    for word in shlex.split(command):
        if word.endswith(".zarr") and Path(word).exists():
            return  # the sweep is there
    assert main(shlex.split(command)) == 0


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("command", [one for one in commands() if not is_slow(one)])
def test_a_command_of_the_page_runs(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(command, folder, monkeypatch)


# The test above asks the same of the faster commands, the one below of every option.
@pytest.mark.nightly
@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("command", [one for one in commands() if is_slow(one)])
def test_a_slow_command_of_the_page_runs(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if command.startswith("fit clock.csv"):
        run("track clock.mp4 --bob red --length 0.8 --out clock.csv", folder, monkeypatch)
    run(command, folder, monkeypatch)


@pytest.mark.parametrize("command", commands())
def test_a_command_of_the_page_is_understood(
    command: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    args = make_parser().parse_args(shlex.split(command))
    for name in ("files", "file", "model", "spec", "config"):
        value = getattr(args, name, None)
        for path in value if isinstance(value, list) else [value]:
            made_before = path is None or str(path) in ("clock.csv",)
            assert made_before or path.exists(), f"{path} is not among the examples"


def test_a_pipe_gets_a_first_line_within_a_second_and_then_more(folder: Path) -> None:
    """Only the command's time counts: the start of Python depends on the load of the machine."""
    code = """
import sys, time
from udd.cli import main, output
output._FIRST, output._PAUSE = 0.05, 0.1
start = time.monotonic()
main(["lyapunov", "1", "2", "--t", "20000", "--tol", "1e-9"])
print(time.monotonic() - start, file=sys.stderr)
"""
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)
    lines = made.stderr.splitlines()
    assert lines[0].startswith("udd: lyapunov is at work"), made.stderr
    assert float(lines[-1]) < 0.3 or sum("lyapunov" in line or "values" in line for line in lines) > 1


def test_every_command_has_two_examples() -> None:
    subparsers = next(action for action in make_parser()._actions if action.choices)
    for name, parser in subparsers.choices.items():  # type: ignore[union-attr]
        assert len(parser.examples) == 2, name
        assert all(example in parser.format_help() for example in parser.examples)


def test_the_tables_are_what_the_simulation_makes() -> None:
    for name, text in make.tables().items():
        shipped = (Path(make.__file__).parent / name).read_text(encoding="utf-8")
        assert shipped == text, f"python -m udd.examples.make writes another {name}"
