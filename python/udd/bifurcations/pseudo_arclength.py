"""Pseudo-arclength continuation: tangent predictor, Newton corrector."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from scipy import optimize

from udd.errors import IntegrationError

from .flow_map import Floats

__all__ = [
    "CorrectorFailed",
    "Curve",
    "CurvePoint",
    "corrected_point",
    "dense_equations",
    "guess_at",
    "natural_constraint",
    "nearest_of_family",
    "newton",
    "newton_corrector",
    "predictor_corrector_step",
    "tangent_at",
    "zero_between",
]

_ENOUGH = 1e-11  # Size of the last Newton step, in scaled unknowns.
_NOISE = 1e-9  # The same if rounding keeps the steps from getting smaller.
_MOST = 8  # Newton steps from a good guess.
_TURN = 0.95  # Least cosine between one tangent and the next.
_MOVED = 0.25  # Largest distance of the curve from the tangent, in steps.
_STRAIGHT = 0.995  # Least cosine after which the next step may be longer.


Place = TypeVar("Place")


class CorrectorFailed(Exception):
    """Newton's method did not converge."""


class Matrix(Protocol):
    """Derivatives (n, n + 1) with a structure of their own."""

    def toarray(self) -> Floats:
        """Return the matrix as an array."""
        ...

    def solve(self, row: Floats, right: Floats) -> Floats:
        """Return the unknowns for these right sides, of which the last is that of one more `row`."""
        ...


class Curve(Protocol):
    """`n` equations for `n + 1` scaled unknowns."""

    def equations(self, u: Floats) -> tuple[Floats, Floats | Matrix]:
        """Residuals (n,) and their derivatives (n, n + 1)."""
        ...


@dataclass(frozen=True, eq=False)
class CurvePoint:
    """A point of the curve and the direction in which it goes on."""

    u: Floats
    tangent: Floats

    def reversed(self) -> CurvePoint:
        """Return the point in the other direction."""
        return CurvePoint(self.u, -self.tangent)


def solve(matrix: Floats | Matrix, row: Floats, right: Floats) -> Floats:
    """Return the solution of the equations below which one more row stands."""
    result: Floats
    if isinstance(matrix, np.ndarray):
        full = np.vstack([matrix, row])
        try:
            result = np.asarray(np.linalg.solve(full, right), dtype=np.float64)
        except np.linalg.LinAlgError:
            result = np.asarray(np.linalg.lstsq(full, right, rcond=None)[0], dtype=np.float64)
        return result
    try:
        result = matrix.solve(row, right)
    except np.linalg.LinAlgError:
        raise CorrectorFailed("the equations are singular") from None
    return result


def dense_equations(curve: Curve, u: Floats) -> tuple[Floats, Floats]:
    """Return the residuals and their derivatives as an array."""
    residual, matrix = curve.equations(u)
    return residual, matrix if isinstance(matrix, np.ndarray) else matrix.toarray()


def natural_constraint(u: Floats) -> Floats:
    """Return the row that fixes the parameter, which is the last of the unknowns."""
    row = np.zeros(len(u))
    row[-1] = 1.0
    return row


def guess_at(place: CurvePoint, last: float, least: float = 0.0) -> Floats:
    """Return the point of a tangent with this parameter; the place itself if the parameter stands still."""
    guess = place.u.copy()
    if abs(place.tangent[-1]) > least:
        guess = guess + place.tangent * ((last - guess[-1]) / place.tangent[-1])
    guess[-1] = last
    return guess


def newton(
    step_at: Callable[[Floats], Floats], guess: Floats, patience: int = _MOST, longest: float = np.inf
) -> Floats:
    """Return where steps from a guess arrive; no component changes by more than `longest` in one of them."""
    u, before = guess.copy(), np.inf
    for _ in range(patience):
        try:
            step = step_at(u)
        except IntegrationError as error:
            raise CorrectorFailed(str(error)) from None
        size = float(np.abs(step).max())
        if not np.isfinite(size) or (size > 1e3 and longest > 1e3):
            raise CorrectorFailed("Newton's method diverges")
        u = u + step * (min(1.0, longest / size) if size > 0.0 else 1.0)
        if size < _ENOUGH or (size < _NOISE and size > 0.1 * before):
            return u
        before = size
    raise CorrectorFailed("Newton's method does not converge")


def newton_corrector(
    curve: Curve, guess: Floats, row: Floats, patience: int = _MOST, longest: float = np.inf
) -> Floats:
    """Return the point of the curve in the plane through `guess` across `row`, by Newton's method."""

    def step_at(u: Floats) -> Floats:
        residual, matrix = curve.equations(u)
        return solve(matrix, row, np.append(-residual, row @ (guess - u)))

    return newton(step_at, guess, patience, longest)


def corrected_point(curve: Curve, guess: Floats, along: Floats, patience: int = _MOST) -> CurvePoint:
    """Return the point of the curve across `along`, with the tangent in the same sense."""
    u = newton_corrector(curve, guess, along, patience)
    return CurvePoint(u, tangent_at(curve, u, along))


def zero_between(at: Callable[[float], tuple[float, Place]], step: float) -> tuple[float, Place]:
    """Return the zero of a function between 0 and `step`, and the place there, by Brent's method.

    `at` returns the value at a distance, and the place. ValueError: the value does not change its sign.
    """
    places: dict[float, Place] = {}

    def value(distance: float) -> float:
        number, places[distance] = at(distance)
        return number

    zero = float(optimize.brentq(value, 0.0, step, xtol=1e-15, rtol=1e-14, maxiter=60))
    if zero not in places:
        value(zero)
    return zero, places[zero]


def nearest_of_family(
    curve: Curve, guess: Floats, row: Floats, patience: int = _MOST, singular: float = 1e-7
) -> Floats:
    """Return a solution in the plane through `guess` of equations that are singular but can be solved.

    By the method of Gauss and Newton: each step is the shortest of those that solve the linear equations;
    singular values below `singular` times the largest count as zero.
    """

    def step_at(u: Floats) -> Floats:
        residual, dense = dense_equations(curve, u)
        full, right = np.vstack([dense, row]), np.append(-residual, row @ (guess - u))
        return np.asarray(np.linalg.lstsq(full, right, rcond=singular)[0], dtype=np.float64)

    return newton(step_at, guess, patience)


def tangent_at(curve: Curve, u: Floats, along: Floats) -> Floats:
    """Return the unit tangent at a point, in the sense of `along`."""
    _, matrix = curve.equations(u)
    t = solve(matrix, along, np.append(np.zeros(len(u) - 1), 1.0))
    unit: Floats = t / np.linalg.norm(t)
    return unit


def predictor_corrector_step(
    curve: Curve, here: CurvePoint, step: float, longest: float, shortest: float = 1e-8
) -> tuple[CurvePoint, float, float]:
    """Return the next point along the curve, its distance, and the step to be tried next."""
    reason = "the curve turns too sharply"
    while step >= shortest:
        try:
            guess = here.u + step * here.tangent
            there = corrected_point(curve, guess, here.tangent)
        except (CorrectorFailed, IntegrationError) as error:
            step, reason = 0.5 * step, str(error)
            continue
        turn = float(there.tangent @ here.tangent)
        # A curve that turns no more does not move further: it would be another one.
        if turn < _TURN or np.linalg.norm(there.u - guess) > _MOVED * step:
            step *= 0.5
            continue
        # Steps may grow if the curve is nearly straight.
        return there, step, min(step * (1.5 if turn > _STRAIGHT else 1.0), longest)
    raise CorrectorFailed(reason)
