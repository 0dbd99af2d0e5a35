"""The figure-eight of the DLE from w = 10 down to w = 5: udd and other packages from PyPI.

Prints for each the time, the points, the error of the period at w = 7.1, and where the symmetry breaks.
"""

from __future__ import annotations

import contextlib
import io
import time
from typing import Any

import numpy as np
from scipy.integrate import solve_bvp

PERIOD = 3.98808575286  # at w = 7.1, of independent integrators
BREAKING = 7.09642643066


def row(name: str, seconds: float, points: int, period: float, breaking: float | None) -> None:
    """Print a row of the table."""
    place = "not told" if breaking is None else f"{breaking:.11f} ({abs(breaking - BREAKING):.0e} off)"
    error = abs(period - PERIOD)
    print(f"{name:28s} {seconds:8.2f} s  {points:4d} points  period {error:.0e} off  symmetry breaks {place}")


def by_udd() -> None:
    """Multiple shooting by udd."""
    import udd

    start = time.perf_counter()
    branch = udd.continuation(udd.periodic_orbit(udd.DLE(10.0)), "w", (5.0, 10.0), direction="down")
    seconds = time.perf_counter() - start
    (orbit,) = branch.at(7.1)
    assert isinstance(orbit, udd.PeriodicOrbit)
    row("udd", seconds, len(branch), orbit.period, branch.points[0].value)


def first_orbit(n: int) -> tuple[np.ndarray, float]:
    """States (3, n) on the cycle at w = 10, for the others to start from."""
    import udd

    orbit = udd.periodic_orbit(udd.DLE(10.0))
    run = orbit.trajectory(n)
    return run.state[:-1].T, orbit.period


def by_solve_bvp() -> None:
    """Continue as a user of SciPy would: collocation by solve_bvp at one value after the other."""
    states, period = first_orbit(200)
    t, guess = np.linspace(0.0, 1.0, 201), np.column_stack([states, states[:, 0]])
    results = {}
    start = time.perf_counter()
    values = [*np.arange(10.0, 7.05, -0.1), *np.arange(7.0, 4.95, -0.1)]
    for w in values:

        def law(s: np.ndarray, x: np.ndarray, p: np.ndarray, w: float = w) -> np.ndarray:
            rates = np.array([x[1] - x[0], x[0] * x[2], w - x[0] * x[1]])
            return np.asarray(p[0] * rates)

        def ends(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
            return np.array([*(b - a), a[2]])

        if w == values[0]:
            k = int(np.argmin(np.abs(guess[2, :-1])))
            guess = np.column_stack([np.roll(guess[:, :-1], -k, axis=1), guess[:, k]])
        made = solve_bvp(law, ends, t, guess, p=[period], tol=1e-9, max_nodes=20000)
        t, guess, period = made.x, made.y, float(made.p[0])
        results[round(float(w), 3)] = period
    row("scipy.solve_bvp, tol 1e-9", time.perf_counter() - start, len(values), results[7.1], None)


def by_bice() -> None:
    """Finite differences of order 8 in time and pseudo-arclength by bice."""
    import matplotlib

    matplotlib.use("Agg")
    from bice import Equation, Problem
    from bice.continuation import NaturalContinuation, TimePeriodicOrbitHandler
    from bice.core.solvers import MyNewtonSolver

    class Law(Equation):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.w, self.u = 10.0, np.array([1.0, 1.0, 0.0])

        def rhs(self, u: Any) -> Any:
            return np.array([u[1] - u[0], u[0] * u[2], self.w - u[0] * u[1]])

        def jacobian(self, u: Any) -> Any:
            return np.array([[-1.0, 1.0, 0.0], [u[2], 0.0, u[0]], [-u[1], -u[0], 0.0]])

    n = 100
    states, period = first_orbit(n)
    problem, law = Problem(), Law()
    problem.add_equation(law)
    orbit = TimePeriodicOrbitHandler(law, period, n)
    orbit.u = np.append(states.T.ravel(), period)
    problem.remove_equation(law)
    problem.add_equation(orbit)
    problem.newton_solver = MyNewtonSolver()
    problem.continuation_stepper = NaturalContinuation()
    problem.continuation_stepper.ds = -0.1
    problem.continuation_parameter = (law, "w")
    problem.settings.neigs = 0
    result, points = {}, 0
    start = time.perf_counter()
    with contextlib.redirect_stdout(io.StringIO()):
        while law.w > 5.0 and points < 400:
            problem.continuation_step()
            points += 1
            result[law.w] = orbit.T
    seconds = time.perf_counter() - start
    near = min(result, key=lambda w: abs(w - 7.1))
    row(f"bice, {n} times (w = {near:.4f})", seconds, points, result[near], None)


if __name__ == "__main__":
    for peer in (by_udd, by_solve_bvp, by_bice):
        try:
            peer()
        except ImportError as error:
            print(f"{peer.__name__}: {error}")
