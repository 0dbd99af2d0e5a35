"""`udd fit`: the numbers of the known model."""

from __future__ import annotations

import argparse
from typing import Any

from .inputs import add_input, check_early, free_of, inputs_of, start_of
from .options import names, new
from .output import CommandResult, status_line


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "fit",
        run,
        "Fit the model to a film or a measurement, or to several jointly.",
        (
            "udd fit disk.csv --uncertainties",
            'udd fit driven.csv --model driven.json --columns "theta=position" --inputs "tau=torque"',
        ),
    )
    add_input(parser, several=True)
    parser.add_argument(
        "--uncertainties",
        action="store_true",
        help="list the sources of the uncertainty of each number: noise, camera, scale, priors, R, g",
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.fitting import fit

    check_early(args)
    given = inputs_of(args)
    with status_line() as tell:
        tell("fitting")
        fitted = fit(*given.measured, **options(args))
    if not args.uncertainties:
        return CommandResult(str(fitted), {**given.file_entry, **fitted.to_dict()})
    tables = fitted.budget()
    text = f"{fitted}\n\nexpanded uncertainties, and shares of the variance:\n{tables}"
    return CommandResult(text, {**given.file_entry, **fitted.to_dict(), **tables.to_dict()})


def options(args: argparse.Namespace) -> dict[str, Any]:
    """Options of `udd.fit` and `udd.discover`."""
    return {
        "free": free_of(args),
        "camera": not args.no_camera,
        "each": None if getattr(args, "each", None) is None else names([args.each]),
        "state0": start_of(args),
    }
