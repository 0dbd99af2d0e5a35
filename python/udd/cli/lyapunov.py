"""`udd lyapunov`: the largest exponent, or all of them."""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

from udd.errors import ConvergenceWarning, IntegrationError, UddError

from .options import new
from .output import CommandResult, is_terminal

_LARGEST = ("w", "lambda_1", "standard_error")
_SPECTRUM = (
    "w",
    *(f"{what}_{k}" for k in (1, 2, 3) for what in ("lambda", "standard_error")),
    "dimension",
    "verdict",
    "period",
)


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
        "Lyapunov exponents of the diffusionless Lorenz equations; the table is CSV.",
    )
    parser.add_argument("w", type=float, nargs="*", help="drives")
    parser.add_argument("--from", dest="first", type=float, help="first of equally spaced drives")
    parser.add_argument("--to", dest="last", type=float, help="the last")
    parser.add_argument("--n", type=int, help="how many")
    parser.add_argument("--B", type=float, default=0.0, help="damping (default 0)")
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
        help="dimensionless time of the run at most (default 100000, with --spectrum 200000)",
    )
    parser.add_argument(
        "--tol", type=float, default=1e-3, help="standard error to reach, of the largest (default 1e-3)"
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Do it; on Ctrl-C what is finished is kept."""
    from tqdm import tqdm

    drives = _drives(args)
    _check(args, drives)
    head, portions = (_SPECTRUM, _spectra) if args.spectrum else (_LARGEST, _exponents)
    rows: list[_Row] = []
    stopped = False
    if not args.json:
        print(",".join(head), flush=True)
    with tqdm(total=len(drives), unit="w", disable=not is_terminal() or len(drives) == 1, leave=False) as bar:
        try:
            for found in portions(drives, args):
                rows += found
                bar.update(len(found))
                if not args.json:
                    bar.clear()
                    print("\n".join(map(_line, found)), flush=True)
        except KeyboardInterrupt:
            stopped = True
    _tell(rows, args)
    if stopped:
        print(f"udd: stopped after {len(rows)} of {len(drives)}", file=sys.stderr)
    data = {
        "B": args.B,
        "complete": not stopped,
        "spectra" if args.spectrum else "exponents": [
            dict(zip(head, row.cells, strict=True)) for row in rows
        ],
    }
    return CommandResult("", data, 130 if stopped else 0)


def _drives(args: argparse.Namespace) -> list[float]:
    import numpy as np

    swept = [args.first, args.last, args.n]
    if args.w and any(x is not None for x in swept):
        raise UddError("give drives, or --from, --to and --n, not both")
    if args.w:
        return list(args.w)
    if any(x is None for x in swept):
        raise UddError("say at which drives: udd lyapunov 0.5 1 3.9, or --from 0.5 --to 8 --n 100")
    if args.n < 1:
        raise UddError(f"--n must be at least 1, not {args.n}")
    if not np.isfinite([args.first, args.last]).all():
        raise UddError(f"--from and --to must be finite, not {args.first} and {args.last}")
    return [float(w) for w in np.linspace(args.first, args.last, args.n)]


def _check(args: argparse.Namespace, drives: list[float]) -> None:
    from udd._util.validation import number
    from udd.models import DLE

    for w in drives:
        DLE(w, args.B)
    number("--tol", args.tol, above=0.0)
    if args.t is not None:
        number("--t", args.t, above=0.0)


def _exponents(drives: list[float], args: argparse.Namespace) -> Iterator[list[_Row]]:
    """The largest exponents, some drives at a time.

    `udd.lyapunov` would take all at once, but gives nothing before the end, and on Ctrl-C nothing at all.
    Here a portion has a packet of orbits for each core at first, and grows while it takes less than a second.
    """
    from udd.chaos.largest_exponent import PORTION, lyapunov

    first, size = 0, 8 * (os.cpu_count() or 1)
    while first < len(drives):
        portion = drives[first : first + size]
        start = time.monotonic()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            values, errors = lyapunov(
                portion, parameters={"B": args.B}, t=args.t, tol=args.tol, progress=False, with_error=True
            )
        table = zip(portion, values.tolist(), errors.tolist(), strict=True)
        yield [_Row(cells, cells[2] <= args.tol) for cells in table]
        first += len(portion)
        if time.monotonic() - start < 1.0:
            size = min(2 * size, PORTION)


def _spectra(drives: list[float], args: argparse.Namespace) -> Iterator[list[_Row]]:
    """All exponents, drive by drive."""
    from udd.chaos.spectrum import lyapunov_spectrum
    from udd.models import DLE

    for w in drives:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ConvergenceWarning)
                found = lyapunov_spectrum(DLE(w, args.B), t=args.t, tol=args.tol)
        except IntegrationError:
            yield [_Row((w, *[math.nan] * 7, "failed", math.nan), False)]
            continue
        pairs = zip(found.exponents.tolist(), found.standard_errors.tolist(), strict=True)
        cells = (w, *(x for pair in pairs for x in pair), found.dimension, found.verdict, found.period)
        yield [_Row(cells, found.converged)]


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
        message = f"{absent} of {len(rows)} solutions blew up and have no exponent"
        warnings.warn(message, ConvergenceWarning, stacklevel=3)
