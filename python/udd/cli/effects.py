"""`udd effects`: the library of effects."""

from __future__ import annotations

import argparse
import textwrap
from typing import TYPE_CHECKING, Any

from udd.errors import UddError

from .options import new
from .output import CommandResult
from .suggestions import meant

if TYPE_CHECKING:
    from udd.effects import Spec


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "effects",
        run,
        "List the effects that a model may be given, with equations, parameters and units.",
        ("udd effects", "udd effects relaxation"),
    )
    parser.add_argument("name", nargs="?", metavar="NAME", help="an effect, to be described in full")


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.effects import library

    specs = {spec.name: spec for spec in library()}
    if args.name is None:
        lines = [_line(spec) for spec in specs.values()]
        return CommandResult("\n".join(lines), {"effects": [_data(spec) for spec in specs.values()]})
    if args.name not in specs:
        raise UddError(f"no effect is called {args.name!r}{meant(args.name, specs)} (udd effects lists them)")
    spec = specs[args.name]
    return CommandResult(_detail(spec), _data(spec))


def _line(spec: Spec) -> str:
    given = ", ".join(f"{p.name} [{p.unit or '1'}]" for p in spec.parameters)
    return f"{spec.name:20} {spec.equation}   ({given})"


def _detail(spec: Spec) -> str:
    rows = [
        f"  {p.name} [{p.unit or '1'}], default {p.default:g}, from {p.range[0]:g} to {p.range[1]:g}"
        for p in spec.parameters
    ]
    command = f"--effect {spec.name}:{','.join(f'{p.name}={p.default:g}' for p in spec.parameters)}"
    return "\n".join(
        [
            f"{spec.name}: {spec.title}",
            f"  {spec.equation}",
            textwrap.fill(spec.meaning, 100, initial_indent="  ", subsequent_indent="  "),
            *rows,
            command,
        ]
    )


def _data(spec: Spec) -> dict[str, Any]:
    return {
        "name": spec.name,
        "title": spec.title,
        "equation": spec.equation,
        "meaning": spec.meaning,
        "bodies": list(spec.bodies),
        "parameters": [
            {"name": p.name, "unit": p.unit, "default": p.default, "low": p.range[0], "high": p.range[1]}
            for p in spec.parameters
        ],
    }
