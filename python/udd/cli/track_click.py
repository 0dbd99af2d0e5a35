"""`udd track --click`: what is known of a film by clicks, written down before the film is tracked."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from udd.errors import UddError

from .output import is_terminal

_HEAD = """Clicked in {film}, by udd track --click; to be edited, and used again with --config.
Values with a standard error in [sigma] are first guesses, which the film improves."""


def check(args: argparse.Namespace) -> None:
    """Refuse what clicks are not for, before a window opens."""
    target: Path = args.click
    if args.camera is not None:
        raise UddError(
            "--click is for a film that is there: record it first (--camera), then click in it (--click)"
        )
    if args.file is not None and args.file.is_dir():
        raise UddError(
            "--click is for one film, not for a folder: click in one of its films, then say --config with "
            f"{target.name} for the folder"
        )
    if args.bob is not None:
        raise UddError("--click is for a disk: of a pendulum --bob and --length are enough")
    if target.is_dir():
        raise UddError(f"{target} is a folder, not a file to write to")
    if target.exists():
        raise UddError(f"{target} is there already: use it with --config, or say another name to --click")
    if not target.parent.is_dir():
        raise UddError(f"{target}: there is no folder {target.parent}")


def clicked(args: argparse.Namespace, options: dict[str, Any]) -> tuple[dict[str, Any], str, dict[str, Any]]:
    """Ask for clicks; return the completed options, a line with the file's name, and the same as data.

    Values of the options and the config are not asked for; they are written down with the rest.
    """
    from udd.tracking import click, write_config
    from udd.tracking.calibration.config import as_said

    options_so_far = {} if args.config is None else dict(as_said(args.config)[1])
    given = {"disk_radius": args.disk_radius, **options}
    options_so_far |= {name: value for name, value in given.items() if value is not None and name != "config"}
    if is_terminal():
        print("udd: looking for a calm frame; a window opens then", file=sys.stderr)
    answers = click(args.file, distance=args.distance, config=options_so_far)
    write_config(args.click, answers, comment=_HEAD.format(film=args.file.name))
    args.config = args.click
    line = f"what was clicked is written: {args.click}"
    return {**options, "config": args.click}, f"{line}\n", {"clicked": answers, "config": args.click}
