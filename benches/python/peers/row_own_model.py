"""A model of the user's own: Lorenz's of 1963, given to udd as text, one trajectory at rtol 1e-9."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from peers import udd_rows
from peers.harness import Entry, Row
from peers.problems import Array

BOUND = 1.5e-5  # what DOP853 at rtol 1e-9 leaves at t = 8, where neighbours have parted 1400 times
SPAN = 8.0
SIGMA, RHO, BETA = 10.0, 28.0, 8.0 / 3.0
START = (1.0, 1.0, 20.0)


def lorenz(t: float, y: Array) -> list[Any]:
    return [SIGMA * (y[1] - y[0]), y[0] * (RHO - y[2]) - y[1], y[0] * y[1] - BETA * y[2]]


@cache
def starts() -> Array:
    """States on the attractor, shape (32, 3)."""
    times = 20.0 + 5.0 * np.arange(32)
    run = solve_ivp(lorenz, (0.0, times[-1]), START, method="DOP853", rtol=1e-9, atol=1e-12, t_eval=times)
    return np.ascontiguousarray(run.y.T)


@cache
def references() -> Array:
    """Where `starts` are at t = SPAN."""

    def together(t: float, y: Array) -> Array:
        return np.concatenate(lorenz(t, y.reshape(3, -1)))

    run = solve_ivp(together, (0.0, SPAN), starts().T.ravel(), method="DOP853", rtol=3e-14, atol=1e-14)
    return np.ascontiguousarray(run.y[:, -1].reshape(3, -1).T)


def probe(final: Any) -> float:
    found = np.array([final(start, SPAN) for start in starts()])
    return float(np.median(np.abs(found - references()).max(axis=-1)))


def inspect(answer: Any) -> str:
    state = np.asarray(answer)
    return "" if np.isfinite(state).all() and np.abs(state).max() < 60 else f"ends at {state}"


def entry(setting: str, final: Any) -> Entry:
    """From ``final(start, t)``, the state at t."""

    def work(n: int) -> tuple[float, Any]:
        return n, final(np.array(START), float(n))

    return Entry(setting, work, lambda: probe(final))


def numba(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import dop853, numba_scalar

    run = numba_scalar.run_of(dop853.lorenz, 3, 3, 3)

    def final(start: Any, t: float) -> Any:
        return np.array(run(tuple(start.tolist()), (SIGMA, RHO, BETA), t, 0.01, rtol, atol))

    final(np.array(START), 1.0)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", final)


def heyoka(tol: float = 1e-7, fast_math: bool = True) -> Entry:
    from peers import heyoka_peer

    ta = heyoka_peer.single(heyoka_peer.lorenz(), 3, [SIGMA, RHO, BETA], tol, fast_math)

    def final(start: Any, t: float) -> Any:
        ta.time = 0.0
        ta.state[:] = start
        ta.propagate_until(t)
        return ta.state.copy()

    return entry(f"Taylor, tol {tol:g}" + (", fast math" if fast_math else ""), final)


def scipy() -> Entry:
    def final(start: Any, t: float) -> Any:
        run = solve_ivp(lorenz, (0.0, t), start, method="DOP853", rtol=1e-9, atol=1e-12, t_eval=[t])
        return run.y[:, -1]

    return entry("DOP853, rtol 1e-9, atol 1e-12", final)


ROW = Row(
    number=8,
    title="a model as text (Lorenz 1963), one trajectory, rtol 1e-9",
    unit="time units/s",
    bound=BOUND,
    error="state at t = 8",
    full=1_000_000,
    smallest=100,
    entries={
        "udd": lambda: entry(*udd_rows.own_model()),
        "heyoka": heyoka,
        "numba": numba,
        "SciPy": scipy,
    },
    inspect=inspect,
)
