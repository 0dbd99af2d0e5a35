"""Whether the standard errors of a fit cover: records of the plain disk, with every defect of the camera.

    python benches/python/discovery/coverage.py [--records 1000] [--jobs 2] [--first 0]

Prints, for every parameter, the root mean square of its errors over its standard errors, which is to be
between 0.9 and 1.1, with the interval that chance leaves it.
"""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor

os.environ.setdefault("OMP_NUM_THREADS", "1")  # the jobs are what runs in parallel
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from camera import PICTURE
from cases import Case, Record, draw
from information import ARM
from scipy import stats

import udd

SEED = 20261122
DURATION = 120.0


def truth(record: Record) -> dict[str, float]:
    """Return the true values of the fit's parameters."""
    device, camera = record.world.device, record.camera
    return {
        **{name: float(getattr(device, name)) for name in ("k0", "k1", "k2", "W")},
        **{name: float(getattr(camera, name)) for name in ("tilt", "scale", "lag", "row", "clock")},
        "shutter": camera.exposure**2 / 24,
        "lens": camera.lens * (ARM / PICTURE) ** 2,
        "y0": float(camera.offset[0]),
        "z0": float(camera.offset[1]),
        "right": float(camera.marks[0]),
        "up": float(camera.marks[1]),
    }


def z_scores(number: int) -> dict[str, float]:
    """Each parameter's error over its standard error, in one record."""
    record = draw(Case("coverage", (), number), SEED, DURATION, precise=False)
    fit = udd.fit(record.measurement, record.known)
    return {
        name: (fit.parameters[name] - value) / fit.errors[name]
        for name, value in truth(record).items()
        if name in fit.errors
    }


def main() -> int:
    """Draw, fit, print."""
    parser = argparse.ArgumentParser(
        prog="coverage", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--records", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="number of the first record")
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args()
    scores: dict[str, list[float]] = {}
    with ProcessPoolExecutor(given.jobs) as pool:
        for done, one in enumerate(pool.map(z_scores, range(given.first, given.first + given.records)), 1):
            for name, z in one.items():
                scores.setdefault(name, []).append(z)
            if done % 50 == 0:
                print(f"{done} records", file=sys.stderr, flush=True)
    print("| parameter | records | rms of z | 95 % by chance | median size, of a Gaussian's |")
    print("|---|---|---|---|---|")
    for name, result in scores.items():
        n, z = len(result), np.array(result)
        low, high = np.sqrt(stats.chi2.ppf([0.025, 0.975], n) / n)
        rms, middle = np.sqrt(np.mean(z**2)), np.median(np.abs(z)) / stats.norm.ppf(0.75)
        print(f"| {name} | {n} | {rms:.2f} | {low:.2f} to {high:.2f} | {middle:.2f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
