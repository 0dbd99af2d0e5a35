"""`udd fit`: the numbers of the known model."""

from __future__ import annotations

import argparse
from typing import Any

from .answer import Answer, telling
from .inputs import add_input, check_early, measurement_of, model_of
from .options import new


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(commands, "fit", run, "Fit the model to a film or a measurement.")
    add_input(parser)


def run(args: argparse.Namespace) -> Answer:
    """Do it."""
    from udd.fitting import fit

    check_early(args)
    measurement, _film = measurement_of(args)
    model = model_of(args, measurement)
    with telling() as tell:
        tell("fitting")
        found = fit(measurement, model, **options(args))
    return Answer(str(found), {"file": args.file, **found.to_dict()})


def options(args: argparse.Namespace) -> dict[str, Any]:
    """Options of `udd.fit` and `udd.discover`."""
    free = None if args.free is None else [name.strip() for name in args.free.split(",") if name.strip()]
    return {"free": free, "camera": not args.no_camera}
