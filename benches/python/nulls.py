"""How many effects are reported where there is none: simulated records with a camera's defects.

    python benches/python/nulls.py [--records 20] [--seed 20261121]

Drives and starts are drawn from the seed, which was fixed before the first run.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

import udd

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
import simulated


def main() -> None:
    """Print a line per record and the count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=20)
    parser.add_argument("--seed", type=int, default=20261121)
    arguments = parser.parse_args()
    wrong = 0
    for k, rng in enumerate(np.random.default_rng(arguments.seed).spawn(arguments.records)):
        drive = rng.uniform(0.012, 0.09)
        model = udd.Disk(drive)
        camera = simulated.Camera(
            offset=tuple(rng.normal(0, 1e-3, 2)),
            tilt=rng.normal(0, 0.015),
            scale=rng.normal(0, 0.003),
            lag=rng.normal(0, 3e-3),
            clock=rng.normal(0, 1e-3),
            row=rng.normal(0, 0.01),
        )
        begin = time.perf_counter()
        measured, _states = simulated.film(model, rng, 60.0, camera)
        found = udd.discover(measured, udd.Disk(drive))
        best = found.scans[0][0]
        wrong += bool(found.effects)
        names = ", ".join(f.title for f in found.effects) or "-"
        print(
            f"{k:3d}  W = {drive:.4f}  {found.verdict}: {names}; best candidate {best.candidate.title} "
            f"chi2 {best.chi2:.1f}; chi2/dof {found.baseline.scatter:.2f}; "
            f"{time.perf_counter() - begin:.1f} s",
            flush=True,
        )
    print(f"{wrong} of {arguments.records} records without an effect were said to have one")


if __name__ == "__main__":
    main()
