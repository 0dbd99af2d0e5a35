"""The commands and their options."""

from __future__ import annotations

import argparse
import re
from typing import Any

from udd._util.number_text import number_in
from udd._util.versions import version_of

from . import (
    app,
    basins,
    bifurcation,
    continuation,
    demo,
    discover,
    film,
    fit,
    forecast,
    lyapunov,
    paper,
    poincare,
    simulate,
    sweep,
    track,
)

_COMMANDS = (
    demo,
    simulate,
    lyapunov,
    poincare,
    bifurcation,
    continuation,
    basins,
    sweep,
    film,
    track,
    fit,
    forecast,
    discover,
    paper,
    app,
)


class Parser(argparse.ArgumentParser):
    """An ArgumentParser that takes ``-1e-3`` and ``-1,2`` for values and names the decimal sign."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        kwargs["allow_abbrev"] = False
        super().__init__(*args, **kwargs)
        self._negative_number_matcher = re.compile(r"^-\.?\d")
        self.register("type", float, _number)
        self.register("type", int, _whole)


def make_parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    parser = Parser(
        prog="udd",
        description="The laboratory of the upward-driven disk: film it, fit it, find what the model lacks.",
        epilog="Begin with `udd demo`. Each command has its own help: udd discover --help",
    )
    parser.add_argument("--version", action="version", version=f"udd {version_of('udd')}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for command in _COMMANDS:
        command.add(commands)
    return parser


def _number(text: str) -> float:
    """Return the number that an option's text holds, for argparse."""
    try:
        return number_in(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _whole(text: str) -> int:
    """Return the whole number that an option's text holds, for argparse."""
    try:
        if not text.isascii() or "_" in text:
            raise ValueError
        return int(text)
    except ValueError:
        hint = ", without a sign for thousands" if re.fullmatch(r"\d+([.,]\d{3})+", text) else ""
        raise argparse.ArgumentTypeError(f"a whole number is needed{hint}, not {text[:60]!r}") from None
