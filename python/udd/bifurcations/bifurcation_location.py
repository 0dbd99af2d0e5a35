"""Location of bifurcation points between two points of a branch, with a bound of the error."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.polynomial import chebyshev

from udd.errors import IntegrationError

from .bifurcation_functions import FUNCTIONS, STILL, TestFunctions
from .branch import AnyCurve, BifurcationPoint
from .equilibrium_curve import EquilibriumCurve
from .error_bounds import rounding_of, scatter
from .flow_map import Floats
from .pseudo_arclength import (
    CorrectorFailed,
    CurvePoint,
    corrected_point,
    nearest_of_family,
    newton_corrector,
    predictor_corrector_step,
    tangent_at,
    zero_between,
)
from .shooting_curve import PeriodicOrbitCurve
from .solutions import Equilibrium

__all__ = [
    "bifurcations_between",
    "changes",
    "locate",
    "location_error",
    "nearest_bifurcation",
    "pitchfork_at",
    "point_at",
]

_NODES = 12  # Points of a curve about a pitchfork.
_ENOUGH = 8  # Least number of them.
_SAMPLES = 24  # Equilibria about a bifurcation, in which rounding shows.
_NEAR = 1e-5  # Their distance, in steps: within it the curve is a parabola.
_SHORT = 200  # Largest number of pieces of a cycle for which rounding is measured.
_STEPS = 24  # Steps along a curve, in either direction, until a bifurcation is met.
_SURE = 2.0  # Ratio of the bound to the largest scatter.


def changes(before: TestFunctions, after: TestFunctions) -> list[str]:
    """Return a mask of the functions that change their signs."""
    names = []
    for name in ("fold", "unit_multiplier", "period_doubling", "complex_pair", "collision"):
        a, b = getattr(before, name), getattr(after, name)
        if a * b < 0.0:
            names.append(name)
    return names


def bifurcations_between(
    curve: AnyCurve, a: CurvePoint, step: float, before: TestFunctions, after: TestFunctions
) -> list[tuple[str, float, CurvePoint, TestFunctions]]:
    """Kinds of bifurcation, distances from `a`, points and the functions there, in order.

    `a` is followed by a point at the distance `step`, where the functions are `after`.
    """
    changed = changes(before, after)
    passed = []
    for name in changed:
        if name == "unit_multiplier" and "fold" in changed:
            continue
        if name == "fold" and np.isnan([before.unit_multiplier, after.unit_multiplier]).any():
            continue  # not decided: towards a connection the parameter stands still, but for rounding
        if (
            name == "fold"
            and "unit_multiplier" not in changed
            and max(abs(before.fold), abs(after.fold)) < STILL
        ):
            continue
        try:
            if name == "fold" and "unit_multiplier" not in changed:
                sigma, place = turning(curve, a, step, before, after)
                passed.append(("end", sigma, place, curve.test_functions(place)))
                continue
            sigma, place = locate(curve, a, step, name)
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


def locate(curve: AnyCurve, a: CurvePoint, step: float, name: str) -> tuple[float, CurvePoint]:
    """Locate the zero of one of the functions between `a` and the point at the distance `step` after it."""

    def at(sigma: float) -> tuple[float, CurvePoint]:
        place = _beside(curve, a, sigma)
        return float(getattr(curve.test_functions(place), name)), place

    return zero_between(at, step)


def _beside(curve: AnyCurve, a: CurvePoint, distance: float) -> CurvePoint:
    """Return the point of the curve at a distance from `a`.

    Next to a branch point the equations leave a second direction free, in which rounding alone would move
    Newton's method: there it takes the shortest steps.
    """
    guess = a.u + distance * a.tangent
    try:
        u = newton_corrector(curve, guess, a.tangent)
    except CorrectorFailed:
        u = nearest_of_family(curve, guess, a.tangent)
    return CurvePoint(u, tangent_at(curve, u, a.tangent))


def location_error(
    curve: AnyCurve, a: CurvePoint, sigma: float, place: CurvePoint, step: float, name: str
) -> tuple[float, float]:
    """Return bounds of the errors of the value and of the period at a zero of the test function `name`.

    The bound of a cycle is how far both move when runs are less accurate. The bound of an equilibrium comes
    from the rounding of the test function, measured near its zero; the period is that of the cycles born
    there.
    """
    if curve.kind == "equilibrium":
        return _scatter(curve, a, sigma, place, step, name)

    def at(distance: float, own: PeriodicOrbitCurve = curve) -> tuple[float, Floats]:
        there = _beside(own, a, distance)
        pair = np.array([own.value(there.u), own.period(there.u)])
        return float(getattr(own.test_functions(there), name)), pair

    located = np.array([curve.value(place.u), curve.period(place.u)])
    aside = 1e-3 * step
    (low, first), (high, last) = at(sigma - aside), at(sigma + aside)
    moved, there = at(sigma, curve.coarse())
    here, _ = at(sigma)
    shift = (moved - here) * (last - first) / (high - low) if high != low else np.zeros(2)
    value, period = rounding_of(located) + np.abs(there - located) + np.abs(shift)
    if curve.pieces <= _SHORT:
        # Rounding is that of the largest numbers in the equations, which the value itself may not be.
        near = np.array([-1.0, -0.5, 0.5, 1.0])
        noise, fitted = scatter(near, np.array([at(sigma + _NEAR * step * x)[1] for x in near]), 2)
        noise = noise + np.abs(fitted[2] - located)
        value, period = value + _SURE * noise[0], period + _SURE * noise[1]
    return float(value), float(period)


def _scatter(
    curve: EquilibriumCurve, a: CurvePoint, sigma: float, place: CurvePoint, step: float, name: str
) -> tuple[float, float]:
    """Bounds of the errors of the value and of the period: from how those near by scatter about a curve."""
    distances = np.linspace(-1.0, 1.0, _SAMPLES)
    seen = []
    for distance in sigma + _NEAR * step * distances:
        there = corrected_point(curve, a.u + distance * a.tangent, a.tangent)
        signs = curve.test_functions(there)
        turning = abs(signs.pair.imag)
        period = 2.0 * np.pi / turning if name == "complex_pair" and turning else np.nan
        seen.append((float(getattr(signs, name)), curve.value(there.u), period))
    noise, fitted = scatter(distances, np.array(seen), 2)
    slope = np.abs(fitted[1])
    # So far along the branch the zero may be off.
    off = noise[0] / slope[0] if slope[0] > noise[0] else 0.0
    value, period = _SURE * (noise[1:] + off * slope[1:])
    return float(value + rounding_of(curve.value(place.u))), float(period + rounding_of(seen[0][2]))


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
                found = next((entry for entry in passed if entry[0] == kind), None)
                if found is not None:
                    _, sigma, place, at = found
                    errors = location_error(curve, here, sigma, place, gone, FUNCTIONS[kind])
                    points.append(point_at(curve, kind, place, at, errors=errors))
                    break
                here, signs = there, after
    begins = curve.value(guess)
    return min(points, key=lambda point: abs(point.value - begins), default=None)
