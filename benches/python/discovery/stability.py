"""Ask for the verdicts of ten records again, with a little more or less information.

    python benches/python/discovery/stability.py [--number 0] [--only quadratic,nothing]

Each record of the batch "near" is passed to `udd.discover` as it is, without its first frame, with every
second frame, with its noise stated, on one thread, and with ``camera=False``. Verdict and effects must
stay, or get weaker if information was taken away.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from near import ANGLE_NOISE, NOISE, NearCase

import udd

SEED = 20261204
RECORDS = (
    "pendulum: power 1.5",
    "pendulum: quadratic",
    "pendulum: brake near an angle",
    "pendulum: dry",
    "pendulum: two weak",
    "pendulum: nothing",
    "disk: power 1.5",
    "disk: quadratic",
    "disk: cubic spring",
    "disk: nothing",
)
CHANGES = (
    "as it is",
    "first frame dropped",
    "every second frame",
    "noise stated",
    "one thread",
    "camera=False",
)
#: Changes that take information away: a weaker verdict is right there.
POORER = ("every second frame", "camera=False")
STRENGTH = (
    "search not finished",
    "fits the first part, not confirmed",
    "effect present, form not identified",
    "effect identified",
)


def changed(record: udd.Measurement, change: str) -> udd.Measurement:
    """Return the record as it is passed on under a change."""
    if change == "first frame dropped":
        return record.rows(np.arange(1, len(record)))
    if change == "every second frame":
        return record.rows(np.arange(0, len(record), 2))
    if change == "noise stated":
        sigma = {name: ANGLE_NOISE if name in ("theta", "beta") else NOISE for name in record.names}
        return replace(record, sigma=[list(sigma.values())] * len(record))
    return record


def ask(title: str, number: int, change: str) -> str:
    """Return the verdict and the names of the effects, in a line."""
    if change == "one thread" and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    drawn = NearCase(title, number).drawn(SEED)
    options = {"camera": False} if change == "camera=False" else {}
    answer = udd.discover(changed(drawn.measurement, change), drawn.known, **options)
    return f"{answer.verdict}: {', '.join(one.effect.name for one in answer.effects) or '-'}"


def is_stable(first: str, other: str, change: str) -> bool:
    """Return True if a verdict stayed, or got weaker because information was taken away."""
    if first == other:
        return True
    before, after = (line.partition(":")[0] for line in (first, other))
    if change not in POORER or not {before, after} <= {*STRENGTH, "nothing missing"}:
        return False
    if after == "nothing missing":
        return before != "effect identified"
    return before in STRENGTH and STRENGTH.index(after) < STRENGTH.index(before)


def table(titles: Sequence[str], number: int) -> int:
    """Print a block for each record; return how many verdicts changed."""
    count = 0
    for title in titles:
        lines = {}
        for change in CHANGES:
            call = [sys.executable, __file__, "--ask", title, change, "--number", str(number)]
            run = subprocess.run(call, capture_output=True, text=True, check=False)
            lines[change] = run.stdout.strip() or run.stderr.strip().splitlines()[-1]
            stays = is_stable(lines["as it is"], lines[change], change)
            count += not stays
            print(f"{title:30s} {change:20s} {'' if stays else 'CHANGED '}{lines[change]}", flush=True)
    print(f"{count} of {len(CHANGES) - 1} x {len(titles)} verdicts changed")
    return count


def main() -> int:
    """Ask for one verdict, or print the table; 1 if a verdict changed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--number", type=int, default=0)
    parser.add_argument("--only", default="", help="words of which a record's title must hold one")
    parser.add_argument("--ask", nargs=2, metavar=("TITLE", "CHANGE"), help="print one verdict")
    given = parser.parse_args()
    if given.ask:
        print(ask(given.ask[0], given.number, given.ask[1]))
        return 0
    words = [word for word in given.only.split(",") if word]
    titles = [title for title in RECORDS if not words or any(word in title for word in words)]
    return int(table(titles, given.number) > 0)


if __name__ == "__main__":
    sys.exit(main())
