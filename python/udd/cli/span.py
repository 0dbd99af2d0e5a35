"""Options for the part of a record to use, and a hint about a pendulum in a hand."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

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
    """Return the part of a record that the options ask for; hint at a pendulum that is at rest first."""
    from udd.measurement.time_span import between

    part = between(measurement, args.begin, args.end)
    if part.names == ("Omega",):
        _hint_at_rest(args, part)
    return part


def _hint_at_rest(args: argparse.Namespace, measurement: Measurement) -> None:
    """Print the option that leaves out the beginning, if the pendulum does not turn there."""
    from udd.measurement.gyroscope import starts_to_turn

    begin = starts_to_turn(measurement)
    if begin is not None:
        print(
            f"udd: {args.file}: the pendulum hardly turns before {begin:.3g} s; if a hand held it, leave "
            f"that out: --from {begin:.3g}",
            file=sys.stderr,
        )
