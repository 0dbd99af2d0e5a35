"""`udd fit`: the numbers of the known model."""

from __future__ import annotations

import argparse
from typing import Any

from .inputs import add_input, check_early, inputs_of, start_of
from .options import new
from .output import CommandResult, status_line


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(commands, "fit", run, "Fit the model to a film or a measurement, or to several jointly.")
    add_input(parser, several=True)
    parser.add_argument(
        "--budget",
        action="store_true",
        help="say from what the uncertainty of each number comes: noise, camera, scale, priors, R, g",
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.fitting import fit

    check_early(args)
    given = inputs_of(args)
    with status_line() as tell:
        tell("fitting")
        found = fit(*given.measured, **options(args))
    if not args.budget:
        return CommandResult(str(found), {**given.told, **found.to_dict()})
    tables = found.budget()
    text = f"{found}\n\nexpanded uncertainties, and shares of the variance:\n{tables}"
    return CommandResult(text, {**given.told, **found.to_dict(), **tables.to_dict()})


def options(args: argparse.Namespace) -> dict[str, Any]:
    """Options of `udd.fit` and `udd.discover`."""
    return {
        "free": _names(args.free),
        "camera": not args.no_camera,
        "each": _names(getattr(args, "each", None)),
        "state0": start_of(args),
    }


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]
