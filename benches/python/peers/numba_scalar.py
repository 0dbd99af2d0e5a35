"""numba: DOP853 hand-written for one system, one trajectory at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from peers import dop853

FAST = {"fastmath": True, "error_model": "numpy", "nogil": True}


def compiled(name: str, arguments: str, lines: list[str], result: str) -> Callable[..., Any]:
    """A function of straight-line source, compiled and inlined where it is called."""
    source = f"def {name}({arguments}):\n{dop853.indented(lines, 1)}\n    return {result}\n"
    scope: dict[str, Any] = {}
    exec(source, scope)
    compiled: Callable[..., Any] = njit(forceinline=True, **FAST)(scope[name])
    return compiled


def tuple_of(names: list[str]) -> str:
    return "(" + ", ".join(names) + ",)"


def unpacked(dim: int, parameters: int) -> list[str]:
    names = dop853.names
    return [
        tuple_of(names("y", dim)) + " = y",
        tuple_of(names("k0_", dim)) + " = k",
        tuple_of(names("p", parameters)) + " = p",
    ]


@cache
def rates_of(rates: dop853.Rates, dim: int, parameters: int) -> Callable[..., Any]:
    """``rates(y, p)`` on tuples."""
    names = dop853.names
    lines = unpacked(dim, parameters)
    values = list(rates(names("y", dim), names("p", parameters)))
    return compiled("rates", "y, p", [lines[0], lines[2]], tuple_of(values))


@cache
def step_of(rates: dop853.Rates, dim: int, parameters: int, controlled: int) -> Callable[..., Any]:
    """``step(y, k, h, rtol, atol, p)``: the new state, its rates, the error's square, the stages."""
    names = dop853.names
    stages = [f"k{i}_{c}" for i in range(1, 12) for c in range(dim)]
    lines = unpacked(dim, parameters) + dop853.step(rates, dim, parameters, controlled)
    result = f"{tuple_of(names('n', dim))}, {tuple_of(names('k12_', dim))}, err2, {tuple_of(stages)}"
    return compiled("step", "y, k, h, rtol, atol, p", lines, result)


@cache
def dense_of(rates: dop853.Rates, dim: int, parameters: int) -> Callable[..., Any]:
    """``dense(y, k, n, kn, stages, h, p)``: per component the coefficients of the interpolant."""
    names = dop853.names
    stages = [f"k{i}_{c}" for i in range(1, 12) for c in range(dim)]
    lines = [
        *unpacked(dim, parameters),
        tuple_of(names("n", dim)) + " = n",
        tuple_of(names("k12_", dim)) + " = kn",
        tuple_of(stages) + " = stages",
        *dop853.dense(rates, dim, parameters),
    ]
    result = tuple_of([tuple_of([f"y{c}"] + [f"f{i}_{c}" for i in range(7)]) for c in range(dim)])
    return compiled("dense", "y, k, n, kn, stages, h, p", lines, result)


@intrinsic
def bits_of(context: Any, value: Any) -> Any:
    """The bits of a float as an integer."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.bitcast(given[0], ir.IntType(64))

    return types.int64(types.float64), emit


@intrinsic
def float_of(context: Any, value: Any) -> Any:
    """The float with these bits."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.bitcast(given[0], ir.DoubleType())

    return types.float64(types.int64), emit


ONE = int(np.float64(1.0).view(np.int64))


@njit(forceinline=True, **FAST)
def factor(err2: float) -> float:
    """Return the ratio of the next step to this one, before limits: 0.9 err^(-1/8).

    A float's bits are its logarithm, nearly: the root is a shift, good to half a percent, and a step's length
    needs no more. It vectorises and takes a cycle where four square roots take a hundred.
    """
    return 0.9 * float_of((ONE + (ONE >> 4)) - (bits_of(err2 + 1e-24) >> 4))


@njit(forceinline=True, **FAST)
def interpolated(f: tuple[float, ...], x: float) -> float:
    """A component at the fraction x of the step."""
    z = 1.0 - x
    inner = f[4] + x * (f[5] + z * (f[6] + x * f[7]))
    return f[0] + x * (f[1] + z * (f[2] + x * (f[3] + z * inner)))


@njit(**FAST)
def crossing(f: tuple[float, ...], level: float) -> float:
    """The fraction of the step at which a component that changes sides passes `level`."""
    low, high = 0.0, 1.0
    below, above = f[0] - level, f[0] + f[1] - level
    x = 1.0
    side = 0
    for _ in range(60):
        x = low + (high - low) * below / (below - above)
        value = interpolated(f, x) - level
        if abs(value) < 1e-13 or high - low < 1e-14:
            break
        # Illinois: the secant, with an end's weight halved when it stays twice.
        if (value < 0.0) == (below < 0.0):
            low, below = x, value
            if side == 1:
                above *= 0.5
            side = 1
        else:
            high, above = x, value
            if side == -1:
                below *= 0.5
            side = -1
    return x


@cache
def run_of(rates: dop853.Rates, dim: int, parameters: int, controlled: int) -> Callable[..., Any]:
    """``run(y, p, end, h, rtol, atol)``: the state at the time `end`; the first step tried is `h` long."""
    step, begin = step_of(rates, dim, parameters, controlled), rates_of(rates, dim, parameters)

    @njit(**FAST)
    def run(y: Any, p: Any, end: float, h: float, rtol: float, atol: float) -> Any:
        k = begin(y, p)
        t, most = 0.0, 5.0
        while t < end:
            h = min(h, end - t)
            n, kn, err2, _ = step(y, k, h, rtol, atol, p)
            change = factor(err2)
            if err2 < 1.0:
                t += h
                y, k = n, kn
                h *= min(most, change)
                most = 5.0
            else:
                h *= max(0.2, change)
                most = 1.0
        return y

    compiled: Callable[..., Any] = run
    return compiled


def final(
    rates: dop853.Rates, parameters: tuple[float, ...], rtol: float, atol: float
) -> tuple[str, Callable[[Any, float], Any]]:
    """The setting, and ``final(start, t)``: the state at t of one trajectory of three equations."""
    run = run_of(rates, 3, len(parameters), 3)

    def end_state(start: Any, t: float) -> Any:
        return np.array(run(tuple(np.asarray(start).tolist()), parameters, t, 0.01, rtol, atol))

    end_state((1.0, 1.0, 1.0), 1.0)
    return f"DOP853, rtol {rtol:g}, atol {atol:g}", end_state


@cache
def crossings_of(
    rates: dop853.Rates, dim: int, parameters: int, controlled: int, level: int
) -> Callable[..., Any]:
    """``cross(y, p, skipped, points, rtol, atol)`` fills `points` (n, dim).

    They are where the component `level` passes zero upwards, after so many skipped.
    """
    step, begin = step_of(rates, dim, parameters, controlled), rates_of(rates, dim, parameters)
    dense = dense_of(rates, dim, parameters)

    @njit(**FAST)
    def cross(y: Any, p: Any, skipped: int, points: Any, rtol: float, atol: float) -> None:
        k = begin(y, p)
        h, most, i = 0.05, 5.0, -skipped
        while i < len(points):
            n, kn, err2, stages = step(y, k, h, rtol, atol, p)
            change = factor(err2)
            if err2 < 1.0:
                if y[level] < 0.0 <= n[level]:
                    if i >= 0:
                        f = dense(y, k, n, kn, stages, h, p)
                        x = crossing(f[level], 0.0)
                        for c in range(dim):
                            points[i, c] = interpolated(f[c], x)
                    i += 1
                y, k = n, kn
                h *= min(most, change)
                most = 5.0
            else:
                h *= max(0.2, change)
                most = 1.0

    compiled: Callable[..., Any] = cross
    return compiled
