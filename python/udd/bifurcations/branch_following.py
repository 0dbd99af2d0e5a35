"""Predictor-corrector continuation of a branch in one direction, with the events on the way."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from udd.errors import IntegrationError

from .bifurcation_functions import FUNCTIONS, TestFunctions, test_functions_at
from .bifurcation_location import bifurcations_between, location_error, pitchfork_at, point_at
from .branch import AnyCurve, BifurcationPoint
from .branch_solutions import solution_at
from .conservative_families import FamilyCurve
from .equilibrium_curve import EquilibriumCurve
from .error_bounds import rounding_of
from .nonsmooth import corner_ahead
from .periodic_orbits import has_shorter_period, pieces_for
from .pseudo_arclength import (
    CorrectorFailed,
    CurvePoint,
    natural_constraint,
    newton_corrector,
    predictor_corrector_step,
    tangent_at,
)
from .shooting_curve import PeriodicOrbitCurve

__all__ = ["BranchTrace", "ContinuationLimits", "follow_branch"]

_WATCHED = 6  # points in which a branch shows that it comes to a connection,
_CONVERGED = 1e-11  # by this relative change of its parameter
_GROWN = 1.005  # while the period grows by this factor
_ASIDE = 1e-9  # from a corner, in scaled unknowns
_SHRUNK = 0.1  # an orbit this much smaller than that before has shrunk to an equilibrium


@dataclass(frozen=True)
class ContinuationLimits:
    """How far a branch is followed.

    `step` and `longest` are arclengths in scaled unknowns; `until` tells of a bifurcation point whether it
    is the last that is wanted.
    """

    low: float
    high: float
    step: float
    longest: float
    most: int
    period: float
    until: Callable[[BifurcationPoint], bool]


@dataclass
class BranchTrace:
    """What was met on the way: points of the branch with their arclength, bifurcations, why it ends."""

    places: list[tuple[AnyCurve, CurvePoint, TestFunctions, float]]
    points: list[BifurcationPoint]
    end: str = ""


def follow_branch(curve: AnyCurve, start: CurvePoint, limits: ContinuationLimits) -> BranchTrace:
    """Follow a branch from `start` in the direction of its tangent."""
    here, step, arclength = start, limits.step, 0.0
    signs = test_functions_at(curve, here)
    way = BranchTrace([(curve, here, signs, 0.0)], [])
    while True:
        if len(way.places) > limits.most:
            way.end = "as many points as were wanted"
            return way
        if isinstance(curve, EquilibriumCurve):
            corner = corner_ahead(curve, here, step)
            if corner is not None:
                here, signs, arclength = _round_corner(curve, corner, way, limits, arclength, here)
                step = min(step, limits.step)
                if way.end:
                    return way
                continue
        try:
            there, gone, step = predictor_corrector_step(curve, here, step, limits.longest)
            after = test_functions_at(curve, there)
        except (CorrectorFailed, IntegrationError) as error:
            way.end = f"lost: {error}"
            return way
        _locate_bifurcations(curve, here, gone, signs, after, way, limits, arclength)
        if way.end:
            return way
        value = curve.value(there.u)
        if not limits.low <= value <= limits.high:
            way.end = f"{curve.name} = {_end_at_bound(curve, here, gone, way, arclength, limits):.6g}"
            return way
        arclength += gone
        if isinstance(curve, PeriodicOrbitCurve):
            if curve.period(there.u) > limits.period:
                way.places.append((curve, there, after, arclength))
                way.end = f"the period exceeds {limits.period:.6g}"
                return way
            # A new plane for the phase, and a finer mesh where the orbit has grown long.
            curve, there = _prepared(curve, there)
            if not isinstance(curve, FamilyCurve):
                after = replace(after, fold=float(there.tangent[-1]))
        here, signs = there, after
        way.places.append((curve, here, signs, arclength))
        if isinstance(curve, PeriodicOrbitCurve) and (near := _connection(way)) is not None:
            way.end = f"a connection near {near:.13g}: the period grows without bound"
            return way
        if len(way.places) > 8 and _closes(way.places[0], here, step):
            way.end = "the branch is closed"
            return way


def _locate_bifurcations(
    curve: AnyCurve,
    here: CurvePoint,
    gone: float,
    before: TestFunctions,
    after: TestFunctions,
    way: BranchTrace,
    limits: ContinuationLimits,
    arclength: float,
) -> None:
    """Note the bifurcations on a step."""
    for kind, sigma, place, signs in bifurcations_between(curve, here, gone, before, after):
        if kind == "end":
            # The parameter turns where no multiplier passes 1: the branch meets itself there.
            if isinstance(curve, EquilibriumCurve):
                sigma, place = _record_pitchfork(curve, here, gone, sigma, place, way, limits, arclength)
            else:
                way.places.append((curve, place, signs, arclength + sigma))
            way.end = _branch_origin(curve, place, here)
        else:
            errors = _errors(curve, here, sigma, place, gone, kind)
            _record_point(curve, place, signs, kind, errors, way, limits, arclength + sigma)
        if way.end:
            return


def _record_pitchfork(
    curve: EquilibriumCurve,
    here: CurvePoint,
    gone: float,
    sigma: float,
    place: CurvePoint,
    way: BranchTrace,
    limits: ContinuationLimits,
    arclength: float,
) -> tuple[float, CurvePoint]:
    """Note the pitchfork at which a side branch turns, and return its distance and place."""
    error = float("nan")
    # If the curve cannot be followed about it, the place is less accurate.
    with suppress(CorrectorFailed, IntegrationError):
        sigma, place, error = pitchfork_at(curve, here, gone, sigma)
    signs, errors = test_functions_at(curve, place), (error, float("nan"))
    _record_point(curve, place, signs, "branch point", errors, way, limits, arclength + sigma)
    return sigma, place


def _record_point(
    curve: AnyCurve,
    place: CurvePoint,
    signs: TestFunctions,
    kind: str,
    errors: tuple[float, float],
    way: BranchTrace,
    limits: ContinuationLimits,
    arclength: float,
) -> None:
    """Note a bifurcation point; the way ends with the last one that is wanted."""
    point = point_at(curve, kind, place, signs, solution_at(curve, place.u), arclength, errors)
    way.points.append(point)
    way.places.append((curve, place, signs, arclength))
    if limits.until(point):
        way.end = "the point that was wanted"


def _errors(
    curve: AnyCurve, here: CurvePoint, sigma: float, place: CurvePoint, gone: float, kind: str
) -> tuple[float, float]:
    try:
        return location_error(curve, here, sigma, place, gone, FUNCTIONS[kind])
    except (CorrectorFailed, IntegrationError):
        return float("nan"), float("nan")


def _branch_origin(curve: AnyCurve, place: CurvePoint, before: CurvePoint) -> str:
    """What it is that the branch begins or ends with."""
    value = curve.value(place.u)
    if isinstance(curve, EquilibriumCurve):
        return f"a branch point near {value:.5g}"
    size = float(np.ptp(curve.nodes(place.u) / curve.flow.size, axis=0).max())
    if size < _SHRUNK * float(np.ptp(curve.nodes(before.u) / curve.flow.size, axis=0).max()):
        what = "an equilibrium" if isinstance(curve, FamilyCurve) else "a Hopf bifurcation"
        return f"{what} near {value:.5g}"
    kind = has_shorter_period(curve, place.u)
    return f"{kind or 'a branch point'} near {value:.5g}"


def _end_at_bound(
    curve: AnyCurve,
    here: CurvePoint,
    gone: float,
    way: BranchTrace,
    arclength: float,
    limits: ContinuationLimits,
) -> float:
    """Add the point where the branch meets the bound."""
    beyond = curve.value(here.u + gone * here.tangent)
    bound = limits.high if beyond > limits.high else limits.low
    guess = here.u.copy()
    if here.tangent[-1] != 0.0:
        guess = guess + here.tangent * ((bound / curve.scale - guess[-1]) / here.tangent[-1])
    guess[-1] = bound / curve.scale
    try:
        u = newton_corrector(curve, guess, natural_constraint(guess))
        place = CurvePoint(u, tangent_at(curve, u, here.tangent))
        way.places.append(
            (curve, place, test_functions_at(curve, place), arclength + float(np.linalg.norm(u - here.u)))
        )
    except (CorrectorFailed, IntegrationError):
        pass  # the last point is inside
    return bound


def _prepared(curve: PeriodicOrbitCurve, place: CurvePoint) -> tuple[PeriodicOrbitCurve, CurvePoint]:
    """The curve with its phase fixed here, and cut into enough pieces; the tangent in its new equations."""
    flow, m = curve.flow, curve.pieces
    wanted = pieces_for(flow, curve.span(place.u))
    if 2 * wanted > 3 * m:
        times = -(-wanted // m)
        nodes, values = [curve.nodes(place.u)], curve.values_at(place.u)
        share, begins = np.full(m, curve.span(place.u) / (m * times)), curve.begins(place.u)
        for k in range(times - 1):
            nodes.append(flow.fly(values, nodes[-1], share, t=begins + k * share).x)
        fine = replace(curve, pieces=m * times)
        packed = np.stack(nodes, axis=1).reshape(m * times, flow.dim)
        u = fine.pack(packed, curve.span(place.u), curve.value(place.u))
        along = np.zeros((m, times, flow.dim))
        along[:, 0] = place.tangent[:-2].reshape(m, flow.dim)
        row = np.append(along.ravel(), place.tangent[-2:])
        fine.fix_phase(u)
        return fine, CurvePoint(u, tangent_at(fine, u, row))
    fresh = replace(curve)
    fresh.seen = curve.seen
    fresh.fix_phase(place.u)
    return fresh, CurvePoint(place.u, tangent_at(fresh, place.u, place.tangent))


def _connection(way: BranchTrace) -> float | None:
    """Where the parameter has come to a stand while the period goes on growing."""
    if len(way.places) < _WATCHED:
        return None
    last = [
        (curve, place.u)
        for curve, place, _, _ in way.places[-_WATCHED:]
        if isinstance(curve, PeriodicOrbitCurve)
    ]
    values = [curve.value(u) for curve, u in last]
    spans = [curve.span(u) for curve, u in last]
    still = max(values) - min(values) < _CONVERGED * max(abs(value) for value in values)
    growing = all(a < b for a, b in pairwise(spans)) and spans[-1] > _GROWN * spans[0]
    return values[-1] if still and growing else None


def _closes(first: tuple[AnyCurve, CurvePoint, TestFunctions, float], here: CurvePoint, step: float) -> bool:
    """Whether the branch has come back to where it began."""
    start = first[1]
    if len(start.u) != len(here.u):
        return False
    return bool(np.linalg.norm(start.u - here.u) < 0.5 * step and start.tangent @ here.tangent > 0.9)


def _round_corner(
    curve: EquilibriumCurve,
    corner: tuple[CurvePoint, CurvePoint],
    way: BranchTrace,
    limits: ContinuationLimits,
    arclength: float,
    here: CurvePoint,
) -> tuple[CurvePoint, TestFunctions, float]:
    """Go round a corner, where an equilibrium lies on a surface of the law."""
    arriving, leaving = corner
    gone = float(np.linalg.norm(arriving.u - here.u))
    before = test_functions_at(curve, here)
    # On the corner itself rounding would choose the side of the law.
    at = test_functions_at(curve, CurvePoint(arriving.u - _ASIDE * arriving.tangent, arriving.tangent))
    after = test_functions_at(curve, CurvePoint(leaving.u + _ASIDE * leaving.tangent, leaving.tangent))
    if gone > _ASIDE:
        _locate_bifurcations(curve, here, gone - _ASIDE, before, at, way, limits, arclength)
        if way.end:
            return here, before, arclength
    arclength += gone
    value = curve.value(arriving.u)
    if not limits.low <= value <= limits.high:
        way.end = f"{curve.name} = {_end_at_bound(curve, here, gone, way, arclength, limits):.6g}"
        return here, before, arclength
    kind = "nonsmooth fold" if arriving.tangent[-1] * leaving.tangent[-1] < 0.0 else "border collision"
    errors = float(rounding_of(value)), float("nan")
    _record_point(curve, arriving, at, kind, errors, way, limits, arclength)
    return leaving, after, arclength
