"""Models as text by udd and by heyoka in one run: `python own_models.py` prints a table.

The models are Lorenz's of 1963, a double pendulum and chains of coupled Duffing oscillators. A rate is model
time per second of one core's processor time, the best of several turns that alternate between the two codes.
At equal tolerance both have rtol 1e-9. At equal error heyoka has the largest tolerance whose error is not
above udd's, at a time before neighbours part. heyoka's compilation is not counted. It needs the environment
of `make bench-peers`.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.update(RAYON_NUM_THREADS="1", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "support"))

import heyoka as hy
import numpy as np

import udd
from many_states import chain

RTOL = 1e-9
STARTS = 64
TOLERANCES = [10.0**k for k in np.arange(-5.0, -15.1, -0.5)]


def lorenz() -> tuple[udd.Model, Any, list[float], float, float]:
    """Return Lorenz's equations by both codes, a start, the time of the error and that of the rate."""
    model = udd.Model(
        ["x", "y", "z"],
        {"x": "s*(y - x)", "y": "x*(r - z) - y", "z": "x*y - b*z"},
        {"s": 10.0, "r": 28.0, "b": 8 / 3},
    )
    x, y, z = hy.make_vars("x", "y", "z")
    equations = [(x, 10.0 * (y - x)), (y, x * (28.0 - z) - y), (z, x * y - (8 / 3) * z)]
    return model, equations, [1.0, 1.0, 1.0], 8.0, 200.0


def double_pendulum() -> tuple[udd.Model, Any, list[float], float, float]:
    """Return the same of a double pendulum with two equal rods."""
    model = udd.Model(
        ["a", "b", "u", "v"],
        {
            "a": "u",
            "b": "v",
            "u": "(-3*g*sin(a) - g*sin(a - 2*b) - 2*sin(a - b)*(v^2 + u^2*cos(a - b)))/(3 - cos(2*a - 2*b))",
            "v": "2*sin(a - b)*(2*u^2 + 2*g*cos(a) + v^2*cos(a - b))/(3 - cos(2*a - 2*b))",
        },
        {"g": 9.81},
    )
    a, b, u, v = hy.make_vars("a", "b", "u", "v")
    g, below = 9.81, 3.0 - hy.cos(2.0 * a - 2.0 * b)
    s, c = hy.sin(a - b), hy.cos(a - b)
    equations = [
        (a, u),
        (b, v),
        (u, (-3 * g * hy.sin(a) - g * hy.sin(a - 2.0 * b) - 2.0 * s * (v**2 + u**2 * c)) / below),
        (v, 2.0 * s * (2.0 * u**2 + 2 * g * hy.cos(a) + v**2 * c) / below),
    ]
    return model, equations, [2.0, 1.0, 0.0, 0.0], 3.0, 60.0


def oscillators(count: int) -> tuple[udd.Model, Any, list[float], float, float]:
    """Return the same of a chain of coupled Duffing oscillators."""
    model = chain(count)
    names = list(model.state_names)
    variables = dict(zip(names, hy.make_vars(*names) if len(names) > 1 else (), strict=True))
    scope = {**variables, **model.parameters, "cos": hy.cos, "t": hy.time}
    equations = [(variables[n], eval(model.equations[n].replace("^", "**"), scope)) for n in names]
    return model, equations, np.linspace(0.8, -0.6, 2 * count).tolist(), 20.0, 400.0


MODELS: dict[str, Callable[[], tuple[udd.Model, Any, list[float], float, float]]] = {
    "Lorenz": lorenz,
    "double pendulum": double_pendulum,
    **{f"chain of {2 * n} states": (lambda n=n: oscillators(n)) for n in (1, 2, 3, 4, 6)},
}


def rates(turns: int, *work: Callable[[], None]) -> list[float]:
    """Return the least processor time of each work, in turns that alternate."""
    least = [np.inf] * len(work)
    for _ in range(turns):
        for k, run in enumerate(work):
            began = time.process_time()
            run()
            least[k] = min(least[k], time.process_time() - began)
    return least


def single(equations: Any, start: list[float], tol: float) -> Callable[[float], np.ndarray]:
    """Return heyoka's state at a time."""
    ta = hy.taylor_adaptive(equations, start, tol=tol, fast_math=True, compact_mode=False)

    def run(end: float) -> np.ndarray:
        ta.time = 0.0
        ta.state[:] = start
        ta.propagate_until(end)
        return ta.state.copy()

    return run


def batch(equations: Any, starts: np.ndarray, tol: float) -> Callable[[float], None]:
    """Return heyoka's run of all starts to a time, in batches of the processor's width."""
    width = hy.recommended_simd_size()
    ta = hy.taylor_adaptive_batch(
        equations, np.zeros((starts.shape[1], width)), tol=tol, fast_math=True, compact_mode=False
    )

    def run(end: float) -> None:
        for k in range(0, len(starts), width):
            ta.set_time(0.0)
            ta.state[:] = starts[k : k + width].T
            ta.propagate_until(end)

    return run


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=5)
    options = parser.parse_args()
    print("| model | udd | heyoka | ratio | error udd, heyoka | heyoka at equal error | ratio | "
          "ensemble udd | heyoka | ratio | at equal error | ratio |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for name, make in MODELS.items():
        model, equations, start, near, far = make()
        exact = udd.simulate(model, [0.0, near], start, method="dop853", rtol=3e-14, atol=1e-16).state[-1]

        def error(state: np.ndarray, exact: np.ndarray = exact) -> float:
            return float(np.abs(state - exact).max() / np.abs(exact).max())

        def simulated(end: float, model: Any = model, start: Any = start) -> np.ndarray:
            return udd.simulate(model, [0.0, end], start, method="taylor", rtol=RTOL, atol=1e-12).state[-1]

        of_udd = error(simulated(near))
        tol, of_heyoka = RTOL, error(single(equations, start, RTOL)(near))
        for tol in TOLERANCES:
            if error(single(equations, start, tol)(near)) <= of_udd:
                break
        runs = [single(equations, start, t) for t in (RTOL, tol)]
        least = rates(
            options.turns, lambda: simulated(far), lambda: runs[0](far), lambda: runs[1](far)  # noqa: B023
        )  # fmt: skip
        starts = np.array(start) + 1e-3 * np.random.default_rng(0).normal(size=(STARTS, len(start)))
        batches = [batch(equations, starts, t) for t in (RTOL, tol)]
        many = rates(
            options.turns,
            lambda: udd.ensemble(model, [0.0, far], starts, rtol=RTOL, atol=1e-12, threads=1),  # noqa: B023
            lambda: batches[0](far),  # noqa: B023
            lambda: batches[1](far),  # noqa: B023
        )
        u, h, e = (far / t for t in least)
        bu, bh, be = (STARTS * far / t for t in many)
        print(
            f"| {name} | {u:.2g} | {h:.2g} | {u / h:.2f} | {of_udd:.0e}, {of_heyoka:.0e} "
            f"| {e:.2g} (tol {tol:.0e}) "
            f"| {u / e:.2f} | {bu:.2g} | {bh:.2g} | {bu / bh:.2f} | {be:.2g} | {bu / be:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
