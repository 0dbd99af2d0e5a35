"""What states cost: `python states.py` prints what steps and fits of 2 to 12 of them take on one core.

The model is a chain of 1, 2, 4 and 6 coupled Duffing oscillators. A step's cost is divided by the number of
operations in the formulas; a fit of b and k is of records of several lengths, with a noise of 0.02. All are
CPU seconds, the best of several turns.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

os.environ.update(RAYON_NUM_THREADS="1", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "support"))

import numpy as np

import udd
from many_states import chain

METHODS = ("dopri5", "dop853", "taylor", "rodas")


def best(turns: int, work: Callable[[], Any]) -> tuple[float, Any]:
    """The least time of several turns, and what came out."""
    least, result = np.inf, None
    for _ in range(turns):
        began = time.process_time()
        result = work()
        least = min(least, time.process_time() - began)
    return least, result


def operations(model: udd.models.Model) -> int:
    """The operations in a model's formulas."""
    return sum(len(re.findall(r"[-+*/^]|cos", text)) for text in model.equations.values())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--frames", default="500,1000,2000", help="frames of the records")
    options = parser.parse_args()

    print("microseconds of a step, and nanoseconds of it for each operation of the formulas")
    print("states  operations" + "".join(f"{method:>18s}" for method in METHODS))
    for oscillators in (1, 2, 4, 6):
        model = chain(oscillators)
        start, count = np.linspace(0.8, -0.6, 2 * oscillators), operations(model)
        line = f"{2 * oscillators:6d}  {count:10d}"
        for method in METHODS:
            run = partial(udd.simulate, model, [0.0, 400.0], start, method=method, rtol=1e-8)
            taken, result = best(options.turns, run)
            step = taken / (result.stats.accepted + result.stats.rejected)
            line += f"{1e6 * step:10.2f} {1e9 * step / count:7.1f}"
        print(line, flush=True)

    lengths = [int(frames) for frames in options.frames.split(",")]
    print("\nseconds of a fit, and microseconds of it for each frame")
    print("states" + "".join(f"{frames:>16d} frames" for frames in lengths))
    for oscillators in (1, 2, 4, 6):
        model, line = chain(oscillators), f"{2 * oscillators:6d}"
        for frames in lengths:
            t = 0.05 * np.arange(frames)
            state = udd.simulate(model, t, np.linspace(0.8, -0.6, 2 * oscillators), rtol=1e-10).state
            state = state + 0.02 * np.random.default_rng(0).standard_normal(state.shape)
            seen = udd.Measurement(t, dict(zip(model.state_names, state.T, strict=True)))
            guess = model.replace(b=0.9, k=0.65)
            taken, _ = best(options.turns, partial(udd.fit, seen, guess, free=["b", "k"]))
            line += f"{taken:14.3f} {1e6 * taken / frames:8.1f}"
        print(line, flush=True)


if __name__ == "__main__":
    main()
