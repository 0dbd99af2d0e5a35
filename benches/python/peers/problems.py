"""The work all codes do, and tight references for it from SciPy.

The accuracy of a code is its error at the end of a moderate span (t = 30 at w = 1, where neighbouring orbits
have separated by a factor of about 500): the median over starts of the largest error of a component. Two
codes are compared only if both meet the bound of the row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

START = (1.0, 1.0, 0.01)
DRIVES = np.linspace(0.05, 10.0, 1000)
SPAN = 30.0

# The disk of the paper, in SI units.
W, K0, K1, K2 = 0.039, 0.012, 0.103, 0.055
KINK = (K1 - K0) / K2
DISK_START = (3.75, 0.0046, 5e-5, 0.0)
DISK_SPAN = 8.0
DISK_SCALE = np.array([10.0, 0.01, 0.05, 10.0])


def dle(t: float, y: Array, w: float = 1.0) -> list[float]:
    return [y[1] - y[0], y[0] * y[2], w - y[0] * y[1]]


# Lorenz's equations of 1963, which udd is given as text.
SIGMA, RHO, BETA = 10.0, 28.0, 8.0 / 3.0


def lorenz(t: float, y: Array) -> list[Any]:
    return [SIGMA * (y[1] - y[0]), y[0] * (RHO - y[2]) - y[1], y[0] * y[1] - BETA * y[2]]


@dataclass(frozen=True)
class Flow:
    """Three equations, and from where and how long their runs are compared."""

    rates: Callable[[float, Array], list[Any]]
    parameters: tuple[float, ...]
    start: tuple[float, float, float]
    first: float
    """When the run from `start` is first on the attractor, where it is probed every so often from then on."""
    every: float
    span: float
    """The time over which errors are measured."""
    size: float
    """No component gets beyond this."""


DLE = Flow(dle, (1.0,), START, first=40.0, every=30.0, span=SPAN, size=30.0)
LORENZ = Flow(lorenz, (SIGMA, RHO, BETA), (1.0, 1.0, 20.0), first=20.0, every=5.0, span=8.0, size=60.0)


def dle_tangent(t: float, y: Array, w: float = 1.0) -> list[float]:
    """State and one tangent vector."""
    return [
        *dle(t, y, w),
        y[4] - y[3],
        y[3] * y[2] + y[0] * y[5],
        -(y[3] * y[1] + y[0] * y[4]),
    ]


def friction(Omega: float) -> float:
    return max(K1 - K2 * abs(Omega), K0)


def disk(t: float, y: Array, drive: float = W) -> list[float]:
    """Omega, Y, Z, beta."""
    inertia = 0.0032 + y[1] * y[1] + y[2] * y[2]
    torque = 9.81 * y[1] - friction(y[0]) * y[0] - y[2] * drive * y[0]
    return [torque / inertia, y[2] * y[0], drive - y[1] * y[0], y[0]]


def random_starts(count: int, seed: int = 1) -> Array:
    """Starts for ensembles, shape (count, 3)."""
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (count, 3))


def by_scipy(flow: Flow, rtol: float, atol: float) -> Callable[[Any, float], Array]:
    """``final(start, t)``, the state at t, by SciPy's DOP853."""

    def final(start: Any, t: float) -> Array:
        run = solve_ivp(flow.rates, (0.0, t), start, method="DOP853", rtol=rtol, atol=atol, t_eval=[t])
        state: Array = run.y[:, -1]
        return state

    return final


@cache
def probe_starts(flow: Flow = DLE) -> Array:
    """States on the attractor from which the accuracy is measured, shape (32, 3)."""
    times = flow.first + flow.every * np.arange(32)
    run = solve_ivp(
        flow.rates, (0.0, times[-1]), flow.start, method="DOP853", rtol=1e-9, atol=1e-12, t_eval=times
    )
    return np.ascontiguousarray(run.y.T)


@cache
def reference_states(flow: Flow = DLE) -> Array:
    """Where `probe_starts` are after the flow's span."""

    def together(t: float, y: Array) -> Array:
        return np.concatenate(flow.rates(t, y.reshape(3, -1)))

    final = by_scipy(replace(flow, rates=together), 3e-14, 1e-15)
    return np.ascontiguousarray(final(probe_starts(flow).T.ravel(), flow.span).reshape(3, -1).T)


def state_error(result: Any, flow: Flow = DLE) -> float:
    """The median over `probe_starts` of the largest error of a component after the flow's span."""
    return float(np.median(np.abs(np.asarray(result) - reference_states(flow)).max(axis=-1)))


SECTION_POINTS = 5  # reached from `probe_starts` at about t = SPAN


@cache
def reference_points() -> Array:
    """The point number SECTION_POINTS on z = 0, z' > 0 from each of `probe_starts`: omega and y."""

    def height(t: float, y: Array) -> float:
        return float(y[2])

    height.direction = 1.0  # type: ignore[attr-defined]
    height.terminal = SECTION_POINTS  # type: ignore[attr-defined]
    results = []
    for start in probe_starts():
        run = solve_ivp(dle, (0.0, 500.0), start, method="DOP853", rtol=3e-14, atol=1e-15, events=height)
        results.append(run.y_events[0][-1][:2])
    return np.array(results)


def point_error(result: Array) -> float:
    return float(np.median(np.abs(np.asarray(result)[:, :2] - reference_points()).max(axis=-1)))


def branch(Omega: float) -> tuple[float, float]:
    """The friction coefficient k = a + b Omega on the piece where Omega is."""
    if abs(Omega) >= KINK:
        return K0, 0.0
    return K1, -K2 if Omega > 0 else K2


def smooth_disk(t: float, y: Array, a: float, b: float) -> list[float]:
    """The disk with k = a + b Omega everywhere."""
    inertia = 0.0032 + y[1] * y[1] + y[2] * y[2]
    torque = 9.81 * y[1] - (a + b * y[0]) * y[0] - y[2] * W * y[0]
    return [torque / inertia, y[2] * y[0], W - y[1] * y[0], y[0]]


def disk_pieces(start: Array, end: float, rtol: float, atol: float) -> Array:
    """The disk with SciPy, stopped at every kink of the friction and continued on the other side."""

    def surface(value: float) -> object:
        def crossing(t: float, y: Array, *_: float) -> float:
            return float(y[0]) - value

        crossing.terminal = True  # type: ignore[attr-defined]
        return crossing

    kinks = (-KINK, 0.0, KINK)
    surfaces = [surface(value) for value in kinks]
    t, state = 0.0, np.array(start, dtype=float)
    while t < end:
        run = solve_ivp(
            smooth_disk,
            (t, end),
            state,
            method="DOP853",
            rtol=rtol,
            atol=atol,
            events=surfaces,
            args=branch(float(state[0])),
        )
        t, state = float(run.t[-1]), run.y[:, -1]
        if run.status == 1:
            hit = [len(times) > 0 for times in run.t_events].index(True)
            # Just past the kink, so that it is not found again.
            state[0] = kinks[hit] + np.sign(disk(t, state)[0]) * 4e-16
    return state


@cache
def disk_starts() -> Array:
    """States of the disk, shape (16, 4)."""
    times = 10.0 + 4.0 * np.arange(16)
    run = solve_ivp(disk, (0.0, times[-1]), DISK_START, method="DOP853", rtol=1e-9, atol=1e-13, t_eval=times)
    starts = np.ascontiguousarray(run.y.T)
    starts[:, 3] = 0.0
    return starts


@cache
def reference_disk() -> Array:
    return np.array([disk_pieces(start, DISK_SPAN, 3e-14, 1e-17) for start in disk_starts()])


def disk_error(result: Array) -> float:
    """The median over `disk_starts` of the largest error, relative to DISK_SCALE, after DISK_SPAN seconds."""
    return float(np.median(np.abs((np.asarray(result) - reference_disk()) / DISK_SCALE).max(axis=-1)))
