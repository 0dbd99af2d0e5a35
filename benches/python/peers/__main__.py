"""python -m peers [--rows 1,3] [--only udd,numba] [--quick] [--limit limit.txt] [--json out.json]"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from pathlib import Path

from peers import machine

machine.settle()

from peers import harness, table  # noqa: E402  (numba and jax read the environment once)

ROWS = ("trajectory", "spectrum", "sweep", "starts", "section", "bifurcation", "disk", "own_model")


def main() -> int:
    """Measure, print the tables; 1 where an answer is wrong."""
    parser = argparse.ArgumentParser(prog="python -m peers", description="udd beside its peers")
    parser.add_argument("--rows", default="1,2,3,4,5,6,7,8", help="numbers of the rows, such as 1,3")
    parser.add_argument("--only", default="", help="names of the codes, such as udd,numba")
    parser.add_argument("--quick", action="store_true", help="a smoke run: short, once, the fast codes only")
    parser.add_argument("--repeats", type=int, default=7, help="turns, each code once in each")
    parser.add_argument("--seconds", type=float, default=1.0, help="what one timed run takes, about")
    parser.add_argument("--limit", type=Path, help="what `make bench ARGS=--limit` printed on this machine")
    parser.add_argument("--json", type=Path, help="write the figures there too")
    given = parser.parse_args()
    repeats, seconds = (1, 0.02) if given.quick else (given.repeats, given.seconds)
    only = {name.strip() for name in given.only.split(",") if name.strip()}
    if given.quick and not only:
        only = {"udd", "numba", "lanes", "heyoka"}

    most = table.limits(given.limit.read_text()) if given.limit else {}
    if given.limit and not most:
        parser.error(f"{given.limit} is not what `make bench ARGS=--limit` prints")

    done, wrong = [], []
    for number in sorted({int(n) for n in given.rows.split(",")}):
        if not 1 <= number <= len(ROWS):
            parser.error(f"there is no row {number}; there are 1 to {len(ROWS)}")
        row: harness.Row = importlib.import_module(f"peers.row_{ROWS[number - 1]}").ROW
        print(f"row {number}: {row.title}", file=sys.stderr, flush=True)
        results = harness.measure(row, only, repeats, seconds)
        done.append((row, results))
        own = [result for result in results if result.name == "udd" and result.entry is not None]
        wrong += [f"row {number}" for result in own if not result.counts(row.bound)]

    versions = machine.versions()
    print(f"Machine: {machine.processor()}.")
    print("Versions: " + ", ".join(f"{name} {number}" for name, number in versions.items()) + ".\n")
    print(table.summary(done, most) + "\n")
    for row, results in done:
        print(table.details(row, results) + "\n")
    if given.json:
        data = {
            "machine": machine.processor(),
            "versions": versions,
            "repeats": repeats,
            "rows": [table.as_data(row, results) for row, results in done],
        }
        partial = given.json.with_name(given.json.name + ".partial")
        partial.write_text(json.dumps(data, indent=1))
        partial.replace(given.json)
    if wrong:
        print("udd's answer is wrong or not accurate enough: " + ", ".join(wrong), file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
