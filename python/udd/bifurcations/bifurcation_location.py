"""Location of bifurcation points between two points of a branch, with a bound of the error."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.polynomial import chebyshev

from udd.errors import IntegrationError

from .bifurcation_functions import FUNCTIONS, STILL, TestFunctions
from .branch import AnyCurve, BifurcationPoint
from .error_bounds import rounding_of
from .flow_map import Floats
from .pseudo_arclength import (
    CorrectorFailed,
    CurvePoint,
    corrected_point,
    newton_corrector,
    predictor_corrector_step,
)
from .solutions import Equilibrium

__all__ = [
    "bifurcations_between",
    "changes",
    "nearest_bifurcation",
    "pitchfork_at",
    "point_at",
]

_NODES = 12  # Points of a curve about a pitchfork.
_ENOUGH = 8  # Least number of them.
_STEPS = 24  # Steps along a curve, in either direction, until a bifurcation is met.


def changes(before: TestFunctions, after: TestFunctions) -> list[str]:
    """Return the names of the functions that change their signs."""
    names = ("fold", "unit_multiplier", "period_doubling", "complex_pair", "collision")
    return [name for name in names if getattr(before, name) * getattr(after, name) < 0.0]


def bifurcations_between(
    curve: AnyCurve, a: CurvePoint, step: float, before: TestFunctions, after: TestFunctions
) -> list[tuple[str, float, CurvePoint, TestFunctions]]:
    """Kinds of bifurcation, distances from `a`, points and the functions there, in order.

    `a` is followed by a point at the distance `step`, where the functions are `after`.
    """
    changed = changes(before, after)
    turns = "fold" in changed and "unit_multiplier" not in changed
    still = max(abs(before.fold), abs(after.fold)) < STILL
    # Towards a connection the parameter stands still, but for rounding.
    undecided = np.isnan([before.unit_multiplier, after.unit_multiplier]).any()
    passed = []
    for name in changed:
        if name == "unit_multiplier" and "fold" in changed:
            continue
        if name == "fold" and (undecided or (turns and still)):
            continue
        try:
            if name == "fold" and turns:
                sigma, place = turning(curve, a, step, before, after)
                passed.append(("end", sigma, place, curve.test_functions(place)))
                continue
            sigma, place = curve.refine(a, step, name)
        except (CorrectorFailed, ValueError):
            continue
        here = curve.test_functions(place)
        if not curve.follows_liouville(place.u):
            continue
        kind = curve.kind_at(name, here)
        if kind:
            passed.append((kind, sigma, place, here))
    return sorted(passed, key=lambda one: one[1])


def turning(
    curve: AnyCurve, a: CurvePoint, step: float, before: TestFunctions, after: TestFunctions
) -> tuple[float, CurvePoint]:
    """About where the parameter turns at a branch point, near which the equations are nearly singular."""
    low, high = (0.0, before.fold), (step, after.fold)
    sigma, place = 0.0, a
    for _ in range(6):
        middle = (low[0] * high[1] - high[0] * low[1]) / (high[1] - low[1])
        try:
            place = corrected_point(curve, a.u + middle * a.tangent, a.tangent)
        except CorrectorFailed:
            break
        fold = curve.test_functions(place).fold
        if abs(fold) > max(abs(before.fold), abs(after.fold)):
            # On the other branch: the equations are singular here, and this is the place.
            return middle, CurvePoint(a.u + middle * a.tangent, a.tangent)
        sigma = middle
        if fold * low[1] > 0.0:
            low = (middle, fold)
        else:
            high = (middle, fold)
    return sigma, place


def pitchfork_at(
    curve: AnyCurve, a: CurvePoint, step: float, sigma: float
) -> tuple[float, CurvePoint, float]:
    """Find the pitchfork near the distance `sigma` from `a`, where the parameter turns along its side branch.

    The equations are singular there. The curve is smooth, so that polynomials through its points about the
    pitchfork, none of them too near, give it to rounding. The bound of the parameter's error is what one
    degree less changes. CorrectorFailed: the curve cannot be followed about the pitchfork.
    """
    width = 0.5 * step
    distances = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    points: list[Floats] = []
    where: list[float] = []
    for x in distances.tolist():
        # Too near to the pitchfork itself Newton's method fails: the others do.
        with suppress(CorrectorFailed):
            points.append(newton_corrector(curve, a.u + (sigma + width * x) * a.tangent, a.tangent))
            where.append(x)
    many = len(points)
    if many < _ENOUGH:
        raise CorrectorFailed("the curve cannot be followed about the pitchfork")
    fits = [_turning_of(np.array(where), np.array(points), degree) for degree in (many - 2, many - 1)]
    (_, before, _), (x, u, along) = fits
    error = abs(float(u[-1] - before[-1])) * curve.scale + float(rounding_of(curve.value(u)))
    return sigma + width * x, CurvePoint(u, along / np.linalg.norm(along)), error


def _turning_of(distances: Floats, points: Floats, degree: int) -> tuple[float, Floats, Floats]:
    """Return the distance at which the parameter turns, the point and its slope, by polynomials."""
    table = chebyshev.chebfit(distances, points, degree)
    slope = chebyshev.chebder(table)
    roots = chebyshev.chebroots(slope[:, -1])
    real = roots.real[(np.abs(roots.imag) < STILL) & (np.abs(roots.real) < 1.0)]
    if not len(real):
        raise CorrectorFailed("the parameter does not turn there")
    x = float(real[np.argmin(np.abs(real))])
    return x, np.asarray(chebyshev.chebval(x, table)), np.asarray(chebyshev.chebval(x, slope))


def point_at(
    curve: AnyCurve,
    kind: str,
    place: CurvePoint,
    signs: TestFunctions,
    arclength: float = 0.0,
    errors: tuple[float, float] = (float("nan"), float("nan")),
) -> BifurcationPoint:
    """Return the bifurcation point at a place, with the frequency and coefficient that belong to its kind."""
    frequency = coefficient = float("nan")
    solution = curve.solution(place.u)
    if kind in ("Hopf", "Neimark-Sacker"):
        frequency = curve.frequency(place.u, signs)
    if kind == "Hopf" and isinstance(solution, Equilibrium):
        coefficient = solution.lyapunov_coefficient
    value = curve.value(place.u)
    return BifurcationPoint(
        kind, curve.name, value, *errors, solution, arclength, frequency, coefficient, curve, place
    )


def nearest_bifurcation(
    curve: AnyCurve, guess: Floats, row: Floats, kind: str, step: float
) -> BifurcationPoint | None:
    """Return the bifurcation of a kind that is nearest to a guess, along its curve in both directions."""
    points: list[BifurcationPoint] = []
    for sense in (1.0, -1.0):
        with suppress(CorrectorFailed, IntegrationError):
            begin = corrected_point(curve, guess, row, patience=20)
            here, size = CurvePoint(begin.u, sense * begin.tangent), step
            signs = curve.test_functions(here)
            for _ in range(_STEPS):
                there, gone, size = predictor_corrector_step(curve, here, size, step)
                after = curve.test_functions(there)
                passed = bifurcations_between(curve, here, gone, signs, after)
                crossing = next((entry for entry in passed if entry[0] == kind), None)
                if crossing is not None:
                    _, sigma, place, at = crossing
                    errors = curve.location_error(here, sigma, place, gone, FUNCTIONS[kind])
                    points.append(point_at(curve, kind, place, at, errors=errors))
                    break
                here, signs = there, after
    begins = curve.value(guess)
    return min(points, key=lambda point: abs(point.value - begins), default=None)
