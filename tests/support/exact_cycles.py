"""Cycles of the DLE to 30 digits: a Taylor method in decimal arithmetic, and Newton's method."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np

import udd

_DIGITS, _ORDER, _STEPS = 36, 36, 40


def step(x: list[Decimal], w: Decimal, h: Decimal, B: Decimal = Decimal(0)) -> list[Decimal]:
    """The state of the (damped) equations a step later, by a power series."""
    a, b, c = ([value] for value in x)
    for k in range(_ORDER):
        az = sum((a[i] * c[k - i] for i in range(k + 1)), Decimal(0))
        ay = sum((a[i] * b[k - i] for i in range(k + 1)), Decimal(0))
        a.append((b[k] - a[k]) / (k + 1))
        b.append(az / (k + 1))
        c.append(((w if k == 0 else 0) - ay - B * w * c[k]) / (k + 1))
    ends = []
    for series in (a, b, c):
        value = Decimal(0)
        for term in reversed(series):
            value = value * h + term
        ends.append(value)
    return ends


def _flow(x: list[Decimal], w: Decimal, time: Decimal) -> list[Decimal]:
    """The state after a time."""
    for _ in range(_STEPS):
        x = step(x, w, time / _STEPS)
    return x


def symmetric_period(orbit: udd.PeriodicOrbit) -> Decimal:
    """The period of a symmetric cycle of the undamped DLE near one that is known to double precision."""
    w, half = orbit.model.parameters["w"], orbit.period / 2
    mirror = np.array([-1.0, -1.0, 1.0])

    def end(x: np.ndarray) -> np.ndarray:
        run = udd.simulate(orbit.model, [0.0, half], x, rtol=1e-13, atol=1e-14, method="taylor")
        return np.asarray(run.state[-1])

    # A matrix that is right to 1e-9 gains nine digits with every step.
    small = 1e-5
    matrix = np.zeros((4, 4))
    for k, e in enumerate(np.eye(3)):
        matrix[:3, k] = (
            mirror * (end(orbit.state + small * e) - end(orbit.state - small * e)) / (2 * small) - e
        )
    matrix[:3, 3] = mirror * orbit.model.rates(0.0, end(orbit.state))
    matrix[3, :3] = orbit.model.rates(0.0, orbit.state)
    inverse = [[Decimal(float(value)) for value in row] for row in np.linalg.inv(matrix)]
    with localcontext() as context:
        context.prec = _DIGITS
        x, time = [Decimal(float(value)) for value in orbit.state], Decimal(half)
        for _ in range(8):
            a, b, c = _flow(x, Decimal(w), time)
            gap = [-a - x[0], -b - x[1], c - x[2]]
            if max(abs(value) for value in gap) < Decimal(10) ** (5 - _DIGITS):
                break
            step = [sum((m * g for m, g in zip(row, gap, strict=False)), Decimal(0)) for row in inverse]
            x = [value - change for value, change in zip(x, step[:3], strict=True)]
            time -= step[3]
        else:
            raise AssertionError("the cycle is not found to 30 digits")
        return 2 * time
