"""How well undeclared effects are found: simulated records, drawn laws, a camera with its defects.

    python benches/python/discovery [--batches three,nulls] [--records 3] [--jobs 2] [--json out.json]

Batches: "three" (each effect of the library at three times its detection limit), "library" (at 1 to 10
times), "foreign" (laws in no library, 3 to 10 times), "strong" (each of these, 0.3 to 3 times gravity's pull
on the motion: torques in units of g Y, velocities in units of the drive, r.m.s.), "pairs" (two at once, 3 to
10 times each), "nulls" (no effect: all the camera's defects together, and each alone and strong), "sensors"
(no effect: a disk, a pendulum and a cart, whose sensors have steps, are slow, hum, drift, are read 1000 times
a second, or whose support moves), "films" (no effect, by way of a film and the tracker), "machines"
(simulated twins of real pendulums, sliders and the like, each under three sets of options), "driven"
(machines with a measured input, their sensors quantised and slow; also without an effect), "near" (laws
near the library, not in it: which claims are right?). The limit is the amplitude at which chi2 is expected to
fall by what it takes to be accepted. Drives, starts, devices, cameras,
laws, shapes and sizes are drawn from the seed, which was fixed before the first run. The generator shares no
code with udd.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # the jobs are what runs in parallel
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import driven_machines
import machines
import table
from cases import BATCHES, cases
from machined import MachineScore, machine_line, machine_report, machine_score
from machines import machine_cases
from near import NearScore, near_cases, near_line, near_report, near_score
from scoring import Score, score

#: Batches of machines: what is drawn, and how it is handed over.
MACHINES = {"machines": (machines.KINDS, machines.OPTIONS), "driven": (driven_machines.KINDS, ("default",))}

NAMES = (*BATCHES, *MACHINES, "near")

SEED = 20261204


def main() -> int:
    """Score the records, print the tables; 1 where a record failed."""
    parser = argparse.ArgumentParser(
        prog="discovery", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--batches", default="three,foreign,pairs,nulls", help=f"of {', '.join(NAMES)}")
    parser.add_argument("--records", type=int, default=1, help="of each kind in each batch")
    parser.add_argument("--first", type=int, default=0, help="number of the first, to go on with a table")
    parser.add_argument("--only", default="", help="words of which a case's title must hold one")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--duration", type=float, default=120.0, help="s of film")
    parser.add_argument(
        "--precise", action="store_true", help="noise of 0.05 mm and 1 mrad instead of 0.5 mm and 10 mrad"
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path, help="write every record's score there too")
    given = parser.parse_args()
    batches = given.batches.split(",")
    unknown = set(batches) - set(NAMES)
    if unknown:
        parser.error(f"there is no batch {', '.join(sorted(unknown))}; there are {', '.join(NAMES)}")
    words = [word for word in given.only.split(",") if word]
    numbers = range(given.first, given.first + given.records)
    wanted = [case for batch in batches if batch in BATCHES for case in cases(batch, numbers)]
    wanted = [case for case in wanted if not words or any(word in case.title for word in words)]
    twins = [case for b in batches if b in MACHINES for case in machine_cases(numbers, *MACHINES[b])]
    twins = [case for case in twins if not words or any(word in case.label for word in words)]
    nearby = [case for case in near_cases(numbers) if "near" in batches]
    nearby = [case for case in nearby if not words or any(word in case.title for word in words)]

    scores: list[Score] = []
    twin_scores: list[MachineScore] = []
    near_scores: list[NearScore] = []
    with ProcessPoolExecutor(given.jobs) as pool:
        jobs: list[Future[Any]] = [
            pool.submit(score, case, given.seed, given.duration, given.precise) for case in wanted
        ]
        jobs += [pool.submit(machine_score, case, given.seed) for case in twins]
        jobs += [pool.submit(near_score, case, given.seed) for case in nearby]
        for job in as_completed(jobs):
            one = job.result()
            if isinstance(one, Score):
                scores.append(one)
                said = table.line(one)
            elif isinstance(one, MachineScore):
                twin_scores.append(one)
                said = machine_line(one)
            else:
                near_scores.append(one)
                said = near_line(one)
            print(said, file=sys.stderr, flush=True)
            if given.json:
                rows = [one.to_dict() for one in (*scores, *twin_scores, *near_scores)]
                part = given.json.with_suffix(".part")
                part.write_text(
                    json.dumps({"seed": given.seed, "duration_s": given.duration, "records": rows})
                )
                part.replace(given.json)
    if scores:
        print(table.report(scores))
    if twin_scores:
        print(machine_report(twin_scores))
    if near_scores:
        print(near_report(near_scores))
    return int(any(one.error for one in (*scores, *twin_scores, *near_scores)))


if __name__ == "__main__":
    sys.exit(main())
