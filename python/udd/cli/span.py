"""Options for the part of a record to use, and a hint about a pendulum that was held at first."""

from __future__ import annotations

import argparse
import math
import sys
from typing import TYPE_CHECKING

from udd.errors import UddError

if TYPE_CHECKING:
    from udd.measurement import Measurement


def add_span(parser: argparse.ArgumentParser) -> None:
    """Add the options for the ends of the part to use."""
    parser.add_argument(
        "--from",
        dest="begin",
        type=float,
        metavar="S",
        help="use the record from this time on [s], such as after a hand let go (default: its beginning)",
    )
    parser.add_argument(
        "--to",
        dest="end",
        type=float,
        metavar="S",
        help="use the record up to this time [s] (default: its end)",
    )


def part_of(args: argparse.Namespace, measurement: Measurement) -> Measurement:
    """Return the part of a record between ``--from`` and ``--to``.

    Raises
    ------
    UddError
        The part has fewer than two rows.
    """
    begin = -math.inf if args.begin is None else args.begin
    end = math.inf if args.end is None else args.end
    first, last = float(measurement.t[0]), float(measurement.t[-1])
    inside = (measurement.t >= begin) & (measurement.t <= end)
    if inside.sum() < 2:
        given = [
            f"{option} {value:.6g}"
            for option, value in (("--from", args.begin), ("--to", args.end))
            if value is not None
        ]
        raise UddError(
            f"{' '.join(given)} leaves {inside.sum()} rows of {args.file}; its times go from {first:.4g} to "
            f"{last:.4g} s"
        )
    return measurement if inside.all() else measurement.rows(inside)


def hint_at_rest(args: argparse.Namespace, measurement: Measurement) -> None:
    """Print the option that leaves out a beginning in which a pendulum was held."""
    from udd.measurement.gyroscope import starts_to_turn

    begin = starts_to_turn(measurement)
    if begin is not None:
        print(
            f"udd: {args.file}: the pendulum hardly turns before {begin:.3g} s; if a hand held it, leave "
            f"that out: --from {begin:.3g}",
            file=sys.stderr,
        )
