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
    completion,
    continuation,
    demo,
    discover,
    effects,
    example,
    film,
    fit,
    forecast,
    lyapunov,
    paper,
    poincare,
    sheet,
    simulate,
    sweep,
    track,
)
from .suggestions import meant

#: The commands, in the groups in which the help lists them.
GROUPS = {
    "begin": (demo, example, app),
    "films": (sheet, film, track),
    "measurements": (fit, discover, forecast, effects),
    "dynamics": (simulate, lyapunov, poincare, bifurcation, basins, continuation, sweep),
    "more": (paper, completion),
}


class Parser(argparse.ArgumentParser):
    """An ArgumentParser that takes ``-1e-3`` and ``-1,2`` for values, and says what may be meant."""

    summary = ""
    examples: tuple[str, ...] = ()

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        kwargs["allow_abbrev"] = False
        super().__init__(*args, **kwargs)
        self._negative_number_matcher = re.compile(r"^-\.?\d")
        self.register("type", float, _number)
        self.register("type", int, _whole)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse what is left over here, where the usage is the command's own."""
        given, rest = super().parse_known_args(args, namespace)
        if rest:
            option_strings = [option for action in self._actions for option in action.option_strings]
            option = rest[0].partition("=")[0]
            hint = meant(option, option_strings) if option.startswith("-") else ""
            self.error(f"unrecognized arguments: {' '.join(rest)}{hint}")
        return given, rest

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Refuse a value that is no choice, with the nearest one."""
        if action.choices is not None and value not in action.choices:
            choices = [str(choice) for choice in action.choices]
            what = "no command" if isinstance(action, argparse._SubParsersAction) else "invalid choice"
            message = (
                f"{what}: {str(value)!r:.60}{meant(str(value), choices)} (choose from {', '.join(choices)})"
            )
            raise argparse.ArgumentError(action, message)


class _Version(argparse.Action):
    """The option that prints the version, which is looked up only then."""

    def __init__(self, option_strings: list[str], dest: str, help: str | None = None) -> None:
        super().__init__(option_strings, dest, nargs=0, default=argparse.SUPPRESS, help=help)

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(f"udd {version_of('udd')}")
        parser.exit()


def make_parser() -> argparse.ArgumentParser:
    """Make the parser of the whole command line."""
    parser = Parser(
        prog="udd",
        usage="udd [--version] [--help] COMMAND ...",
        description="The laboratory of the upward-driven disk: film it, fit it, find what the model lacks.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, help="show program's version number and exit")
    # The groups below list the commands.
    commands = parser.add_subparsers(
        metavar="COMMAND", required=True, help=argparse.SUPPRESS, parser_class=Parser, prog="udd"
    )
    lists = []
    for group, members in GROUPS.items():
        before = set(commands.choices)
        for command in members:
            command.add(commands)
        made = [name for name in commands.choices if name not in before]
        lines = [f"  {name:13} {commands.choices[name].summary}" for name in made]
        lists.append("\n".join([f"{group}:", *lines]))
    notes = (
        "Begin with `udd demo`, or `udd example all`. Each command has a help with examples: udd fit --help"
    )
    commands.choices["completion"].set_defaults(whole_parser=parser)
    parser.epilog = "\n\n".join([*lists, notes])
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
