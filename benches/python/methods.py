"""Work and precision of the methods: `python methods.py` prints the table behind ``method="auto"``.

Each model is run by each method at several tolerances. The error is that of the state at the end, compared
with a run at rtol = 1e-14: the median over starts, relative to the size of the motion.
"""

from __future__ import annotations

import time

import numpy as np

import udd

effects = udd.effects
disk = udd.Disk(0.039, edge="ignore")
MODELS = {
    "DLE, w = 1": (udd.DLE(1.0), 30.0, np.array([1.0, 1.0, 0.01])),
    "disk": (disk, 4.0, np.array([3.0, 0.005, 0.0, 0.0])),
    "disk, relaxation": (disk.with_effects(effects.relaxation(b=5.0)), 4.0, np.array([3.0, 0.005, 0.0, 0.0])),
    "disk, Coulomb": (disk.with_effects(effects.coulomb(c=0.002)), 4.0, np.array([3.0, 0.005, 0.0, 0.0])),
    "disk, sticking": (
        disk.with_effects(effects.coulomb(c=0.002, treatment="set-valued")),
        4.0,
        np.array([3.0, 0.005, 0.0, 0.0]),
    ),
    "pendulum": (udd.Pendulum(0.5, k0=0.01), 20.0, np.array([0.0, 1.0])),
    "pendulum, drag": (
        udd.Pendulum(0.5, k0=0.01).with_effects(effects.quadratic_drag(c=0.01)),
        20.0,
        np.array([0.0, 1.0]),
    ),
}
METHODS = ("dopri5", "dop853", "taylor")
LONGER = 30
RTOL = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)


def measured(
    model: udd.models.Model, end: float, start: np.ndarray, method: str, rtol: float
) -> tuple[float, float]:
    """The error at the end and the model's time per second of work."""
    scale = np.abs(start) + 1e-3
    starts = start + 0.1 * scale * np.random.default_rng(0).uniform(-1.0, 1.0, (8, len(start)))

    def last(s: np.ndarray, rtol: float, method: str, times: int = 1) -> np.ndarray:
        run = udd.simulate(model, [0.0, times * end], s, rtol=rtol, atol=1e-3 * rtol, method=method)
        return run.state[-1]

    exact = [last(s, 1e-14, "dop853") for s in starts]
    results = [last(s, rtol, method) for s in starts]
    # Longer runs, beside which the call itself takes no time; the best of several turns.
    rate = 0.0
    for _ in range(5):
        began = time.perf_counter()
        for s in starts[:2]:
            last(s, rtol, method, LONGER)
        rate = max(rate, 2 * LONGER * end / (time.perf_counter() - began))
    size = np.abs(exact).max(axis=0)
    return float(np.median(np.abs(np.subtract(results, exact) / size).max(axis=1))), rate


def main() -> None:
    print("model                rtol    " + "".join(f"{m:>8s}: error, model time/s" for m in METHODS))
    for name, (model, end, start) in MODELS.items():
        for rtol in RTOL:
            figures = [measured(model, end, start, method, rtol) for method in METHODS]
            line = "".join(f"{error:17.1e} {rate:13.2e} " for error, rate in figures)
            print(f"{name:19s} {rtol:7.0e}  {line}", flush=True)


if __name__ == "__main__":
    main()
