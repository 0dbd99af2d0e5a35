"""How long a fit takes: `python fit.py` prints the time of fits of simulated films on one core.

Each record is a film of a chaotic disk with a camera's defects, as in the tests. The time is the best of
several turns, in CPU seconds, with the distance of the parameters from the truth.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

os.environ.update(RAYON_NUM_THREADS="1", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "support"))

import numpy as np

import simulated
import udd

NAMES = ("k0", "k1", "k2", "W")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", default="3000,15000", help="frames of the records")
    parser.add_argument("--records", type=int, default=3, help="records of each length")
    parser.add_argument("--turns", type=int, default=5)
    options = parser.parse_args()
    print("CPU seconds of one fit, and how many standard errors each parameter is off")
    for frames in map(int, options.frames.split(",")):
        for seed in range(options.records):
            truth = udd.Disk(0.039)
            measured, _states = simulated.film(truth, np.random.default_rng(seed), frames * 0.04)
            start = udd.Disk(0.039 * 1.04, k0=0.009, k1=0.12, k2=0.065)
            best = np.inf
            for _ in range(options.turns):
                began = time.process_time()
                fit = udd.fit(measured, start)
                best = min(best, time.process_time() - began)
            z = [(fit.parameters[n] - truth.parameters[n]) / fit.errors[n] for n in NAMES]
            off = ", ".join(f"{n} {value:+.2f}" for n, value in zip(NAMES, z, strict=True))
            print(f"{frames:6d} frames, record {seed}: {best:.4f} s; {off}; level {fit.level}", flush=True)


if __name__ == "__main__":
    main()
