"""Write the reference of the command line from the parser itself, before Sphinx reads the pages."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

INTRODUCTION = """# Commands and their options

This page is made from the parser of `udd`, so it lists what `udd COMMAND --help` prints.
[The command line](../../command-line.md) has
examples to run, exit codes and conventions.
"""


def page() -> str:
    """Return the Markdown of the page: a section for each command."""
    from udd.cli.parser import make_parser

    commands = next(
        action for action in make_parser()._actions if isinstance(action, argparse._SubParsersAction)
    )
    return "\n".join([INTRODUCTION, *("\n".join(section(*item)) for item in commands.choices.items())])


def section(name: str, parser: Any) -> Iterator[str]:
    """Yield the lines of one command: usage, options by group, examples."""
    usage = " ".join(parser.format_usage().removeprefix("usage:").split())
    yield from [f"## udd {name}", "", parser.description, "", "```text", usage, "```", ""]
    for group in parser._action_groups:
        actions = [a for a in group._group_actions if a.help != argparse.SUPPRESS and a.dest != "help"]
        if actions:
            yield from [f"**{group.title}**", "", "| option | meaning |", "|---|---|"]
            yield from (row(action, parser) for action in actions)
            yield ""
    yield from ["```console", *parser.examples, "```", ""]


def row(action: argparse.Action, parser: argparse.ArgumentParser) -> str:
    """Return the row of a table for one option."""
    value = parser._get_formatter()._format_args(action, action.metavar or action.dest.upper())
    names = [f"{name} {value}".strip() for name in action.option_strings] or [value]
    text = (action.help or "") % {**vars(action), "prog": parser.prog}
    cells = [", ".join(f"`{name}`" for name in names), text]
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def write(app: Any) -> None:
    """Write the page if it changed, so that Sphinx does not read it again without need."""
    path = Path(app.srcdir) / "api" / "generated" / "commands.md"
    path.parent.mkdir(exist_ok=True)
    text = page()
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def setup(app: Any) -> dict[str, bool]:
    """Connect the writer to the start of the build."""
    app.connect("builder-inited", write, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
