"""How well undeclared effects are found: simulated records, drawn laws, a camera with its defects.

    python benches/python/discovery [--batches three,nulls] [--records 3] [--jobs 2] [--json out.json]

Batches: "three" (each effect of the library at three times its detection limit), "library" (at 1 to 10
times), "foreign" (laws in no library, 3 to 10 times), "strong" (each of these, 0.3 to 3 times gravity's pull
on the motion: torques in units of g Y, velocities in units of the drive, r.m.s.), "pairs" (two at once, 3 to
10 times each), "nulls" (no effect: all the camera's defects together, and each alone and strong), "sensors"
(no effect: a disk, a pendulum and a cart, whose sensors have steps, are slow, hum, drift, are read 1000 times
a second, or whose support moves), "films" (no effect, by way of a film and the tracker). The detection limit
is the amplitude at which chi2 is expected to
fall by what it takes to be accepted. Drives, starts, devices, cameras, laws, shapes and sizes are drawn from
the seed, which was fixed before the first run. The generator shares no code with udd.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # the jobs are what runs in parallel
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import table
from cases import BATCHES, cases
from scoring import Score, score

SEED = 20261204


def main() -> int:
    """Score the records, print the tables; 1 where a record failed."""
    parser = argparse.ArgumentParser(
        prog="discovery", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--batches", default="three,foreign,pairs,nulls", help=f"of {', '.join(BATCHES)}")
    parser.add_argument("--records", type=int, default=1, help="of each kind in each batch")
    parser.add_argument("--only", default="", help="words of which a case's title must hold one")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--duration", type=float, default=120.0, help="s of film")
    parser.add_argument(
        "--precise", action="store_true", help="noise of 0.05 mm and 1 mrad instead of 0.5 mm and 10 mrad"
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path, help="write every record's score there too")
    given = parser.parse_args()
    unknown = set(given.batches.split(",")) - set(BATCHES)
    if unknown:
        parser.error(f"there is no batch {', '.join(sorted(unknown))}; there are {', '.join(BATCHES)}")
    words = [word for word in given.only.split(",") if word]
    wanted = [case for batch in given.batches.split(",") for case in cases(batch, given.records)]
    wanted = [case for case in wanted if not words or any(word in case.title for word in words)]

    scores: list[Score] = []
    with ProcessPoolExecutor(given.jobs) as pool:
        jobs = [pool.submit(score, case, given.seed, given.duration, given.precise) for case in wanted]
        for job in as_completed(jobs):
            scores.append(job.result())
            print(table.line(scores[-1]), file=sys.stderr, flush=True)
            if given.json:
                rows = [one.to_dict() for one in scores]
                part = given.json.with_suffix(".part")
                part.write_text(
                    json.dumps({"seed": given.seed, "duration_s": given.duration, "records": rows})
                )
                part.replace(given.json)
    print(table.report(scores))
    return int(any(one.error for one in scores))


if __name__ == "__main__":
    sys.exit(main())
