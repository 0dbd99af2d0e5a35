"""`udd completion`: completion of commands and options in a shell."""

from __future__ import annotations

import argparse
from typing import Any

from .options import new
from .output import CommandResult


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "completion",
        run,
        "Print a script with which a shell completes commands and options.",
        ('eval "$(udd completion bash)"', "udd completion zsh > ~/.zfunc/_udd"),
    )
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"), help="for which shell")


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    import shtab

    script = shtab.complete(args.whole_parser, shell=args.shell)
    return CommandResult(script, {"shell": args.shell, "script": script})
