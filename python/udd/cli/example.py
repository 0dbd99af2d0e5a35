"""`udd example`: small tables and films to try the commands on."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .options import new
from .output import CommandResult


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "example",
        run,
        "Write example files into a folder: disk, pendulum, phone, driven, or all.",
        ("udd example pendulum", "udd example all --out examples"),
    )
    parser.add_argument(
        "name",
        metavar="NAME",
        help="disk, pendulum, phone (a gyroscope), driven (with its model), or all, with films too",
    )
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="DIR", help="folder (default: the working folder)"
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.examples import write

    made = write(args.name, args.out)
    return CommandResult("\n".join(map(str, made)), {"files": made})
