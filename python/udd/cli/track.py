"""`udd track`: from a film to a measurement."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

from udd.errors import UddError

from .answer import Answer
from .inputs import add_partial, tracked
from .options import new, numbers


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(commands, "track", run, "Measure the motion of the disk in a film; the table is CSV.")
    parser.add_argument(
        "file", type=Path, metavar="FILM", help="a film by a camera at rest, the four colour marks in view"
    )
    parser.add_argument("--out", type=Path, metavar="CSV", help="file to write; otherwise standard output")
    parser.add_argument(
        "--disk-radius", type=float, default=0.08, metavar="M", help="sets the scale (default 0.08)"
    )
    parser.add_argument(
        "--pivot", metavar="U,V", help="contact in the picture [pixels]; found where not given"
    )
    add_partial(parser)
    parser.add_argument("--W", type=float, help="drive speed [m/s], to be noted in the header")


def run(args: argparse.Namespace) -> Answer:
    """Do it."""
    import numpy as np

    from udd._validate import number

    if args.out is not None and not args.out.parent.is_dir():
        raise UddError(f"{args.out}: there is no folder {args.out.parent}")
    more = {} if args.W is None else {"W": number("W", args.W, least=0.0)}
    pivot = None
    if args.pivot is not None:
        place = numbers([args.pivot], "--pivot")
        if len(place) != 2:
            raise UddError(f"--pivot must be two numbers U,V, not {args.pivot}")
        pivot = (place[0], place[1])
    m = tracked(args, args.disk_radius, pivot).with_meta(**more)
    usable = int(m.seen.sum())
    text = f"{usable} of {len(m)} frames usable, {m.duration:.2f} s"
    data: dict[str, Any] = {
        "frames": len(m),
        "usable": usable,
        "duration_s": m.duration,
        "meta": dict(m.meta),
    }
    if m.sigma is not None:
        spread = np.nanmedian(m.sigma, axis=0)
        y, z, beta = 1e3 * spread
        text += f"; median standard errors {y:.2g} mm, {z:.2g} mm, {beta:.2g} mrad"
        data["sigma_median"] = dict(zip(m.names, spread, strict=True))
    if args.out is not None:
        m.to_csv(args.out)
        return Answer(f"{text}\nwritten: {args.out}", {**data, "file": args.out})
    if not args.json:
        with tempfile.TemporaryDirectory() as folder:
            table = Path(folder) / "table.csv"
            m.to_csv(table)
            sys.stdout.write(table.read_text(encoding="utf-8"))
        print(f"udd: {text}", file=sys.stderr)
    return Answer("", data)
