"""`udd simulate`: run a model."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd.errors import UddError

from .export import TABLES, OutputFile
from .model_options import add_dle, add_own, chosen, own_start
from .options import add_disk, add_pendulum, new, numbers
from .output import CommandResult

if TYPE_CHECKING:
    from udd.models import Model
    from udd.simulation.trajectory import Trajectory

_MOST = 10_000_000  # rows


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "simulate",
        run,
        "Run a model from an initial state; the table is CSV.",
        (
            "udd simulate --W 0.039 --t 20 --out run.csv",
            "udd simulate --model own.json --t 5 --state 1 0",
        ),
    )
    add_run(parser, "s; with --w without unit")
    add_dle(parser)
    parser.add_argument(
        "--dt", type=float, default=0.01, help="time between rows [s; with --w without unit] (default 0.01)"
    )
    parser.add_argument("--rtol", type=float, default=1e-9, help="relative tolerance (default 1e-9)")
    parser.add_argument("--atol", type=float, default=1e-12, help="absolute tolerance (default 1e-12)")
    parser.add_argument(
        "--out",
        type=Path,
        action=OutputFile,
        endings=TABLES,
        metavar="CSV",
        help="file to write (.csv or .txt); otherwise standard output",
    )
    add_pendulum(parser)
    add_own(parser)


def add_run(parser: argparse.ArgumentParser, unit: str = "s") -> None:
    """Add the options of a run of the disk."""
    add_disk(parser, "drive speed [m/s]")
    parser.add_argument("--t", type=float, default=60.0, help=f"length of the run [{unit}] (default 60)")
    parser.add_argument(
        "--state",
        nargs="+",
        metavar="X",
        help="initial state Omega Y Z beta [rad/s m m rad]; with --w omega y z; with --pendulum Omega theta",
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    model = _model(args)
    result = run_model(model, args, args.dt, args.rtol, args.atol)
    names, units = model.state_names, model.state_units
    end = ", ".join(
        f"{n} = {v:.6g}{' ' + u if u else ''}" for n, v, u in zip(names, result.state[-1], units, strict=True)
    )
    ended = "the disk left the wheels" if result.outcome == "ejected" else "finished"
    text = f"{ended} at t = {result.t[-1]:.6g}: {end}"
    data = {
        "model": repr(model),
        "outcome": result.outcome,
        "events": [{"kind": e.kind, "t": e.t, "state": e.state} for e in result.events],
        "stats": result.stats._asdict(),
    }
    if args.out is not None:
        from udd._util.atomic_files import write_whole

        write_whole(args.out, "".join(_csv(result)).encode())
        return CommandResult(
            f"{text}\nwritten: {args.out}", {**data, "end": result.state[-1], "file": args.out}
        )
    if not args.json:
        sys.stdout.writelines(_csv(result))
        print(f"udd: {text}", file=sys.stderr)
    return CommandResult("", {**data, "state_names": names, "t": result.t, "state": result.state})


def run_model(
    model: Model,
    args: argparse.Namespace,
    dt: float,
    rtol: float = 1e-9,
    atol: float = 1e-12,
    dense: bool = False,
) -> Trajectory:
    """Run a model for ``args.t`` from ``args.state``, with a row every `dt`."""
    import numpy as np

    from udd._util.validation import number
    from udd.simulation.trajectory import integrated

    length, step = number("--t", args.t, above=0.0), number("--dt", dt, above=0.0)
    rows = int(length / step + 1e-9) + 1
    if rows > _MOST:
        raise UddError(f"{rows} rows are too many (at most {_MOST}): a longer --dt would do")
    usual = own_start(args) if args.state is None else numbers(args.state, "--state")
    start = usual or model.profile.shown.run_start
    assert start is not None  # of every model that the command line offers
    return integrated(model, step * np.arange(rows), start, rtol=rtol, atol=atol, dense=dense)


def _model(args: argparse.Namespace) -> Model:
    return chosen(args, {name: getattr(args, name) for name in ("W", "w", "pendulum")})


def _csv(result: Trajectory) -> Iterator[str]:
    """Yield the run in the format of a measurement, line by line, with every digit."""
    model = result.model
    for name, value in model.parameters.items():
        yield f"# {name} = {value!r}\n"
    yield f"# source = udd simulate\n# outcome = {result.outcome}\n"
    yield ",".join(("t", *model.state_names)) + "\n"
    for t, row in zip(result.t.tolist(), result.state.tolist(), strict=True):
        yield ",".join(map(repr, (t, *row))) + "\n"
