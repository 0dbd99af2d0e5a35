"""`udd lyapunov`: the largest exponent."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from typing import Any

from udd.errors import ConvergenceWarning, UddError

from .answer import Answer, watched
from .options import new

_HEAD = "w,lambda_1,standard_error"


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "lyapunov",
        run,
        "Largest Lyapunov exponent of the diffusionless Lorenz equations; the table is CSV.",
    )
    parser.add_argument("w", type=float, nargs="*", help="drives")
    parser.add_argument("--from", dest="first", type=float, help="first of equally spaced drives")
    parser.add_argument("--to", dest="last", type=float, help="the last")
    parser.add_argument("--n", type=int, help="how many")
    parser.add_argument("--B", type=float, default=0.0, help="damping (default 0)")
    parser.add_argument("--t", type=float, help="length of the run at most (default 100000)")
    parser.add_argument("--tol", type=float, default=1e-3, help="standard error to reach (default 1e-3)")


def run(args: argparse.Namespace) -> Answer:
    """Do it; on Ctrl-C what is finished is kept."""
    from tqdm import tqdm

    drives = _drives(args)
    _check(args, drives)
    rows: list[tuple[float, float, float]] = []
    size = 4 * (os.cpu_count() or 1)
    stopped = False
    if not args.json:
        print(_HEAD, flush=True)
    with tqdm(total=len(drives), unit="w", disable=not watched() or len(drives) <= size, leave=False) as bar:
        try:
            for k in range(0, len(drives), size):
                found = _exponents(drives[k : k + size], args)
                rows += found
                bar.update(len(found))
                if not args.json:
                    bar.clear()
                    print("\n".join(",".join(f"{x:.10g}" for x in row) for row in found), flush=True)
        except KeyboardInterrupt:
            stopped = True
    missed = sum(row[2] > args.tol for row in rows)
    if missed:
        warnings.warn(
            f"{missed} of {len(rows)} exponents have a standard error above {args.tol:g}: "
            "a longer --t would help",
            ConvergenceWarning,
            stacklevel=2,
        )
    if stopped:
        print(f"udd: stopped after {len(rows)} of {len(drives)}", file=sys.stderr)
    keys = _HEAD.split(",")
    data = {
        "B": args.B,
        "complete": not stopped,
        "exponents": [dict(zip(keys, row, strict=True)) for row in rows],
    }
    return Answer("", data, 130 if stopped else 0)


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
    from udd._validate import number
    from udd.models import DLE

    for w in drives:
        DLE(w, args.B)
    number("--tol", args.tol, above=0.0)
    if args.t is not None:
        number("--t", args.t, above=0.0)


def _exponents(drives: list[float], args: argparse.Namespace) -> list[tuple[float, float, float]]:
    from udd.exponents import lyapunov
    from udd.models import DLE

    options: dict[str, Any] = {"t": args.t, "tol": args.tol, "with_error": True}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        if args.B == 0:
            values, errors = lyapunov(drives, **options)
            return list(zip(drives, values.tolist(), errors.tolist(), strict=True))
        return [(w, *lyapunov(DLE(w, args.B), **options)) for w in drives]
