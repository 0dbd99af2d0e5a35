"""Could a film tell friction that depends on the load from the relaxation of the rolling constraint?

Records are simulated with one of the two and fitted with each, the camera free. The difference in log
evidence gives the preferred one; below 2 (two standard deviations) they cannot be distinguished.

    python load_friction.py 4        four records of each kind
"""

from __future__ import annotations

import sys
import warnings
from itertools import product
from pathlib import Path

import numpy as np

import udd

sys.path.append(str(Path(__file__).parents[2] / "tests" / "support"))

from simulated import Camera, film

TRUTHS = [("load_friction", 0.3), ("load_friction", 0.03), ("relaxation", 6.0), ("relaxation", 0.6)]
AMPLITUDE = {"load_friction": "a", "relaxation": "b"}
DRIVES = [(0.042,), (0.042, 0.071)]  # drives in m/s, of records that are fitted together
NOISES = (5e-4, 2e-3)  # m; of angles 14 times as many rad
LENGTHS = (20.0, 60.0)  # s of each record


def evidence(records: list[udd.Measurement], drives: tuple[float, ...], name: str) -> float:
    """The logarithm of the records' likelihood under one of the two."""
    models = [udd.Disk(W, effects=[getattr(udd.effects, name)()]) for W in drives]
    return udd.fit(records, models).evidence


def main(count: int) -> None:
    """Print a row for each truth, set of drives, noise and length."""
    warnings.simplefilter("ignore")
    heads = ("truth", "W, cm/s", "noise, mm", "length, s", "log evidence, right less other")
    print("|", " | ".join([*heads, "told right", "told wrong"]), "|")
    print("|---|---|---|---|---|---|---|")
    for truth, value in TRUTHS:
        (other,) = set(AMPLITUDE) - {truth}
        effect = getattr(udd.effects, truth)(**{AMPLITUDE[truth]: value})
        for drives, noise, length in product(DRIVES, NOISES, LENGTHS):
            more = []
            for k in range(count):
                random = np.random.default_rng([k, round(1e5 * noise)])
                camera = Camera(noise=noise, angle_noise=14 * noise)
                records = [film(udd.Disk(W, effects=[effect]), random, length, camera)[0] for W in drives]
                more.append(evidence(records, drives, truth) - evidence(records, drives, other))
            told, astray = sum(d > 2.0 for d in more), sum(d < -2.0 for d in more)
            what = ", ".join(f"{100 * W:.1f}" for W in drives)
            each = ", ".join(f"{d:.1f}" for d in more)
            print(
                f"| {truth} {value:g} | {what} | {1e3 * noise:g} | {length:g} | {each} | {told} | {astray} |",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4)
