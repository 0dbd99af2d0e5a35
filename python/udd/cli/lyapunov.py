"""`udd lyapunov`: the largest exponent, or all of them."""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from udd.errors import ConvergenceWarning, IntegrationError, UddError

from .model_options import add_others, model_of, own_start
from .options import new, numbers, refuse_others
from .output import CommandResult, shown_progress

if TYPE_CHECKING:
    from udd.models import Model

_LARGEST = ("lambda_1", "standard_error")


class _Row(NamedTuple):
    """The table's cells for a drive, and whether the largest exponent's standard error met the tolerance."""

    cells: tuple[float | str, ...]
    converged: bool


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "lyapunov",
        run,
        "Lyapunov exponents of the diffusionless Lorenz equations, or of another model; the table is CSV.",
        ("udd lyapunov 1 3.9 7.1", "udd lyapunov --disk 0.039 --ignore-edge --t 200 --tol 0.1"),
    )
    parser.add_argument("w", type=float, nargs="*", help="drives of the diffusionless Lorenz equations")
    parser.add_argument("--over", metavar="NAME", help="the parameter that is varied (default: the drive)")
    parser.add_argument("--from", dest="first", type=float, help="the first of equally spaced values")
    parser.add_argument("--to", dest="last", type=float, help="the last")
    parser.add_argument("--n", type=int, help="how many")
    parser.add_argument("--B", type=float, help="damping of these equations (default 0)")
    parser.add_argument(
        "--spectrum",
        action="store_true",
        help="all exponents, the Kaplan-Yorke dimension, a verdict (chaos, periodic orbit, torus, "
        "equilibrium, escapes, undecided) and the period of a periodic orbit; without it the largest "
        "exponent only",
    )
    parser.add_argument(
        "--t",
        type=float,
        help="time of the run at most (default 100000 typical times of the model, with --spectrum 200000)",
    )
    parser.add_argument(
        "--tol", type=float, default=1e-3, help="standard error to reach, of the largest (default 1e-3)"
    )
    parser.add_argument("--state", metavar="X,X,X", help="initial state, for another model")
    add_others(parser)


def run(args: argparse.Namespace) -> CommandResult:
    """Do it; on Ctrl-C what is finished is kept."""
    from udd._util.progress import progress_bar

    swept = _swept(args)
    drives = swept.values
    head, portions = (
        (swept.spectrum_head, _spectra) if args.spectrum else ((swept.name, *_LARGEST), _exponents)
    )
    rows: list[_Row] = []
    stopped = False
    if not args.json:
        print(",".join(head), flush=True)
    with progress_bar(len(drives), "value", shown_progress() if len(drives) > 1 else False) as bar:
        try:
            for portion in portions(swept, args):
                rows += portion
                bar.update(len(portion))
                if not args.json:
                    bar.clear()
                    print("\n".join(map(_line, portion)), flush=True)
        except KeyboardInterrupt:
            stopped = True
    _tell(rows, args)
    if stopped:
        print(f"udd: stopped after {len(rows)} of {len(drives)}", file=sys.stderr)
    data = {
        **({"B": args.B or 0.0} if swept.is_dle else {"model": repr(swept.model)}),
        "complete": not stopped,
        "spectra" if args.spectrum else "exponents": [
            dict(zip(head, row.cells, strict=True)) for row in rows
        ],
    }
    return CommandResult("", data, 130 if stopped else 0)


class _Swept(NamedTuple):
    """A model, the parameter that is varied, and its values."""

    model: Model
    name: str
    values: list[float]
    start: list[float] | None
    is_dle: bool

    @property
    def spectrum_head(self) -> tuple[str, ...]:
        """The columns of a table of spectra."""
        numbers = range(1, len(self.model.state_names) + 1)
        pairs = (f"{what}_{k}" for k in numbers for what in ("lambda", "standard_error"))
        return (self.name, *pairs, "dimension", "verdict", "period")


def _swept(args: argparse.Namespace) -> _Swept:
    """Read and check the options before the work."""
    import numpy as np

    from udd._util.validation import number
    from udd.models import DLE

    number("--tol", args.tol, above=0.0)
    if args.t is not None:
        number("--t", args.t, above=0.0)
    grid = [args.first, args.last, args.n]
    values = None
    if any(x is not None for x in grid):
        if args.w:
            raise UddError("give drives, or --from, --to and --n, not both")
        if any(x is None for x in grid):
            raise UddError("say at which values: --from 0.5 --to 8 --n 100, all three of them")
        if args.n < 1:
            raise UddError(f"--n must be at least 1, not {args.n}")
        if not np.isfinite([args.first, args.last]).all():
            raise UddError(f"--from and --to must be finite, not {args.first} and {args.last}")
        values = [float(x) for x in np.linspace(args.first, args.last, args.n)]
    other = any(getattr(args, name) is not None for name in ("W", "pendulum", "model"))
    if other and args.w:
        raise UddError(
            "numbers without an option are drives of the DLE, but another model is given; remove one of them"
        )
    if other or args.over == "W":
        args.w = None
        first = None if values is None or args.over not in (None, "W") else values[0]
        model = model_of(args, {} if first is None or args.W is not None else {"W": first})
        name = args.over or ("W" if "W" in model.parameters else next(iter(model.parameters), ""))
        _require(model, name)
        start = own_start(args) if args.state is None else numbers([args.state], "--state")
        return _Swept(model, name, values or [float(model.parameters[name])], start, False)
    values = values or list(args.w)
    if not values:
        raise UddError(
            "say at which drives: udd lyapunov 0.5 1 3.9, or --from 0.5 --to 8 --n 100; or another model: "
            "--disk W, --pendulum LENGTH, --model FILE"
        )
    refuse_others(args, "dle")
    name = args.over or "w"
    base = DLE(1.0, 0.0 if args.B is None else args.B)
    _require(base, name)
    for value in values:
        base.replace(**{name: value})
    start = None if args.state is None else numbers([args.state], "--state")
    return _Swept(base, name, values, start, True)


def _require(model: Model, name: str) -> None:
    if name not in model.parameters:
        raise UddError(f"--over: the model has no parameter {name!r}; it has {', '.join(model.parameters)}")


def _exponents(swept: _Swept, args: argparse.Namespace) -> Iterator[list[_Row]]:
    """Compute the largest exponents, some values at a time.

    `udd.lyapunov` would take all at once, but gives nothing before the end, and on Ctrl-C nothing at all.
    Here a portion has a packet of orbits for each core at first, and grows while it takes less than a second.
    """
    from udd.chaos.largest_exponent import PORTION, lyapunov

    first, size = 0, 8 * (os.cpu_count() or 1)
    while first < len(swept.values):
        portion = swept.values[first : first + size]
        start = time.monotonic()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            values, errors = lyapunov(
                swept.model,
                parameters={swept.name: portion},
                t=args.t,
                tol=args.tol,
                state0=swept.start,
                progress=False,
                with_error=True,
            )
        table = zip(portion, values.tolist(), errors.tolist(), strict=True)
        yield [_Row(cells, cells[2] <= args.tol) for cells in table]
        first += len(portion)
        if time.monotonic() - start < 1.0:
            size = min(2 * size, PORTION)


def _spectra(swept: _Swept, args: argparse.Namespace) -> Iterator[list[_Row]]:
    """Compute all exponents, value by value."""
    from udd.chaos.spectrum import lyapunov_spectrum

    for value in swept.values:
        model = swept.model.with_parameters({swept.name: value})
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ConvergenceWarning)
                spectrum = lyapunov_spectrum(model, t=args.t, tol=args.tol, state0=swept.start)
        except IntegrationError:
            absent = [math.nan] * (2 * len(model.state_names) + 1)
            yield [_Row((value, *absent, "failed", math.nan), False)]
            continue
        pairs = zip(spectrum.exponents.tolist(), spectrum.standard_errors.tolist(), strict=True)
        cells = (
            value,
            *(x for pair in pairs for x in pair),
            spectrum.dimension,
            spectrum.verdict,
            spectrum.period,
        )
        yield [_Row(cells, spectrum.converged)]


def _line(row: _Row) -> str:
    return ",".join(cell if isinstance(cell, str) else f"{cell:.10g}" for cell in row.cells)


def _tell(rows: list[_Row], args: argparse.Namespace) -> None:
    """Warn of exponents that are not sure, and of those that are not there."""
    absent = sum(math.isnan(float(row.cells[1])) for row in rows)
    missed = sum(not row.converged for row in rows) - absent
    if missed:
        warnings.warn(
            f"{missed} of {len(rows)} exponents have a standard error above {args.tol:g}: "
            "a longer --t would help",
            ConvergenceWarning,
            stacklevel=3,
        )
    if absent:
        message = f"{absent} of {len(rows)} solutions blew up and have no exponent; try another --state"
        warnings.warn(message, ConvergenceWarning, stacklevel=3)
