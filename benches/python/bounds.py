"""Bounds of errors against values of 30 digits and more: the error over the bound, none above 1.

Periods by power series in decimal arithmetic and Newton's method, Hopf points by fractions, homoclinic orbits
of the damped equations by power series from the unstable manifold of the saddle.
"""

from __future__ import annotations

import sys
from decimal import Decimal, getcontext
from fractions import Fraction
from pathlib import Path

import numpy as np

import udd

sys.path.append(str(Path(__file__).parents[2] / "tests" / "support"))

from exact_cycles import step, symmetric_period

_DIGITS, _STEP = 50, Decimal("0.1")


def row(what: str, value: float, known: Decimal, bound: float) -> float:
    """Print a row of the table; its last number."""
    error = float(abs(Decimal(value) - known))
    print(f"| {what} | {known:.30g} | {error:.1e} | {bound:.1e} | {error / bound:.2f} |", flush=True)
    return error / bound


def periods() -> list[float]:
    """Of the symmetric cycle of the DLE."""
    found = []
    for w in (7.1, 7.5, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 30.0, 50.0, 70.0, 100.0):
        orbit = udd.periodic_orbit(udd.DLE(w))
        found.append(row(f"period at w = {w:g}", orbit.period, symmetric_period(orbit), orbit.period_error))
    return found


def hopf_points() -> list[float]:
    """Of the rotating states of the damped equations: w = (1 - B)/(B (1 + B)), frequency sqrt((1 - B)/B)."""
    found = []
    for B in (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9):
        b = Fraction(B)
        exact = (1 - b) / (b * (1 + b))
        rests = udd.equilibria(udd.DLE(0.8 * float(exact), B=B))
        start = next(rest for rest in rests if rest.state[0] > 1e-3)
        (hopf,) = udd.continuation(start, "w", (0.5 * float(exact), 2.0 * float(exact))).points
        known = Decimal(exact.numerator) / Decimal(exact.denominator)
        found.append(row(f"Hopf point at B = {B:g}", hopf.value, known, hopf.error))
        squared = (1 - b) / b
        turn = 2 * PI / (Decimal(squared.numerator) / Decimal(squared.denominator)).sqrt()
        found.append(row(f"its period at B = {B:g}", hopf.period, turn, hopf.period_error))
    return found


def homoclinic_orbits() -> list[float]:
    """Of the saddle at z = 1/B, at the end of the cycles that the Hopf point gives rise to."""
    found = []
    for B in (0.15, 0.2, 0.3):
        rests = udd.equilibria(udd.DLE(2.5, B=B))
        start = next(rest for rest in rests if rest.state[0] > 1e-3)
        hopf = udd.continuation(start, "w", (0.5, 30.0)).find("Hopf")[0]
        one = udd.connection(udd.continuation(hopf, max_period=16.0))
        known = homoclinic(Decimal(one.value), Decimal(B))
        found.append(row(f"homoclinic orbit at B = {B:g}", one.value, known, one.error))
    return found


def homoclinic(near: Decimal, B: Decimal) -> Decimal:
    """Where the saddle's unstable manifold comes back to it, by secants."""
    growing = (-1 + (1 + 4 / B).sqrt()) / 2
    small = Decimal("1e-22")

    def after(w: Decimal, steps: int) -> list[list[Decimal]]:
        states = [[small, small * (1 + growing), 1 / B]]
        for _ in range(steps):
            states.append(step(states[-1], w, _STEP, B))
        return states

    # It comes back nearest to the saddle once it has been far away.
    path = np.array([[float(value) for value in state] for state in after(near, 600)])
    far = np.hypot(path[:, 0], path[:, 1])
    peak = int(np.argmax(far > 0.5))
    last = peak + 1 + int(np.argmin(far[peak + 1 :]))

    def beside(w: Decimal) -> Decimal:
        """The part along the growing direction, by its left eigenvector (growing, 1)."""
        x, y, _ = after(w, last)[-1]
        return growing * x + y

    a, b = near, near + Decimal("1e-13")
    at = beside(a), beside(b)
    for _ in range(12):
        if at[0] == at[1]:
            break
        a, b = b, b - at[1] * (b - a) / (at[1] - at[0])
        if abs(b - a) < Decimal("1e-36"):
            break
        at = at[1], beside(b)
    return b


if __name__ == "__main__":
    getcontext().prec = _DIGITS
    PI = Decimal("3.14159265358979323846264338327950288419716939937510")
    print("| what | known | error | bound | error/bound |")
    print("|---|---|---|---|---|")
    shares = [*periods(), *hopf_points(), *homoclinic_orbits()]
    print(f"{len(shares)} numbers, the largest error over its bound {max(shares):.2f}")
