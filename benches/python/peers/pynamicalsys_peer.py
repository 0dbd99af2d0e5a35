"""pynamicalsys: numba inside, Dormand-Prince 4(5)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from pynamicalsys import ContinuousDynamicalSystem

from peers.problems import K0, K1, K2, W


@njit
def equations(t: float, u: Any, p: Any) -> Any:
    return np.array([u[1] - u[0], u[0] * u[2], p[0] - u[0] * u[1]])


@njit
def jacobian(t: float, u: Any, p: Any) -> Any:
    return np.array([[-1.0, 1.0, 0.0], [u[2], 0.0, u[0]], [-u[1], -u[0], 0.0]])


@njit
def disk_equations(t: float, u: Any, p: Any) -> Any:
    k = max(K1 - K2 * abs(u[0]), K0)
    rate = (9.81 * u[1] - k * u[0] - u[2] * W * u[0]) / (0.0032 + u[1] * u[1] + u[2] * u[2])
    return np.array([rate, u[2] * u[0], W - u[1] * u[0], u[0]])


def system(rtol: float, atol: float) -> Any:
    result = ContinuousDynamicalSystem(
        equations_of_motion=equations, jacobian=jacobian, system_dimension=3, number_of_parameters=1
    )
    result.integrator("rk45", atol=atol, rtol=rtol)
    return result


def ending_at(ds: Any, start: Any, t: float, parameters: list[float]) -> Any:
    """The state at t: `evolve_system` goes one first step further, which is taken off here."""
    first = ds._ContinuousDynamicalSystem__get_initial_time_step(np.array(start), np.array(parameters))
    return ds.evolve_system(np.array(start), t - first, parameters=parameters)


def final(rtol: float, atol: float) -> Any:
    """``final(start, t)``."""
    ds = system(rtol, atol)
    return lambda start, t: ending_at(ds, start, t, [1.0])


def disk(rtol: float, atol: float) -> Any:
    """``final(start, t)`` of the disk, stepping over its kinks."""
    ds = ContinuousDynamicalSystem(
        equations_of_motion=disk_equations, system_dimension=4, number_of_parameters=1
    )
    ds.integrator("rk45", atol=atol, rtol=rtol)
    return lambda start, t: ending_at(ds, start, t, [W])


def spectrum(rtol: float, atol: float) -> Any:
    """``run(start, t)``: the exponents, and the state at t from a run without tangent vectors."""
    ds = system(rtol, atol)

    def run(start: Any, t: float) -> Any:
        if t < 100.0:  # where only the state is wanted
            return np.zeros(3), ending_at(ds, start, t, [1.0])
        return ds.lyapunov(np.array(start), t, parameters=[1.0]), None

    run(np.array([1.0, 1.0, 0.01]), 100.0)
    return run


def largest(rtol: float, atol: float) -> Any:
    """``run(w, starts, transient, t)``: the largest exponents; the states at t where t is short."""
    ds = system(rtol, atol)

    def run(w: Any, starts: Any, transient: float, end: float) -> Any:
        if end < 100.0:
            return None, np.array([ending_at(ds, s, end, [float(a)]) for a, s in zip(w, starts, strict=True)])
        results = [
            ds.lyapunov(np.array(s), end, parameters=[float(a)], transient_time=transient, num_exponents=1)
            for a, s in zip(w, starts, strict=True)
        ]
        return np.array(results, dtype=float), None

    return run


def points(rtol: float, atol: float) -> Any:
    """``points(start, n, w=1)``: the first n points on z = 0, z' > 0 (by linear interpolation)."""
    ds = system(rtol, atol)

    def run(start: Any, n: int, w: float = 1.0) -> Any:
        return ds.poincare_section(np.array(start), n, 2, 0.0, parameters=[w])[:, 1:]

    return run
