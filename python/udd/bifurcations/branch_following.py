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
from .branch_ends import closes, hopf_end, origin_of, size_of, vanishing_part
from .branch_solutions import solution_at
from .conservative_families import FamilyCurve
from .equilibrium_curve import EquilibriumCurve
from .error_bounds import rounding_of
from .nonsmooth import corner_ahead
from .periodic_orbits import pieces_for
from .pseudo_arclength import (
    CorrectorFailed,
    CurvePoint,
    natural_constraint,
    newton_corrector,
    predictor_corrector_step,
    tangent_at,
)
from .shooting_curve import PeriodicOrbitCurve

__all__ = ["CLOSED", "BranchTrace", "ContinuationLimits", "follow_branch"]

_WATCHED = 6  # points in which a branch shows that it comes to a connection,
_CONVERGED = 1e-11  # by this relative change of its parameter
_GROWN = 1.005  # while the period grows by this factor
_LOOP = 8  # points at least of a closed branch
_NEARER = (1.0, 0.5, 0.2, 0.1, 0.05)  # parts of a step, within which a pitchfork is located
_ASIDE = 1e-9  # from a corner, in scaled unknowns
_SHRUNK = 0.1  # an orbit this much smaller than that before has shrunk to an equilibrium
_SMALL = 0.1  # typical sizes: where no smaller orbit is found, this one may have come from a Hopf bifurcation
_BEFORE = 0.95  # of the way to a Hopf point is the last cycle that is kept
CLOSED = "the branch is closed"


@dataclass(frozen=True)
class ContinuationLimits:
    """How far a branch is followed.

    `step` and `longest` are arclengths in scaled unknowns; `until` returns True for the bifurcation point
    that ends the branch.
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
    """One direction of a branch: points with their arclength, bifurcations, and why it ends."""

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
            small = isinstance(curve, PeriodicOrbitCurve) and size_of(curve, here.u) < _SMALL
            if not small or not _record_hopf(curve, here, 0.0, signs, way, limits, arclength):
                way.end = f"lost: {error}"
            return way
        part = vanishing_part(curve, here.u, there.u)
        if part is not None and _record_hopf(curve, here, part * gone, signs, way, limits, arclength):
            return way
        _locate_bifurcations(curve, here, gone, signs, after, way, limits, arclength)
        if way.end:
            return way
        value = curve.value(there.u)
        if not limits.low <= value <= limits.high:
            way.end = f"{curve.name} = {_end_at_bound(curve, here, gone, way, arclength, limits):.6g}"
            return way
        arclength += gone
        if len(way.places) > _LOOP and closes(way.places[0][:2], curve, here, there, gone):
            way.places.append((curve, there, after, arclength))
            way.points = _once(way.points)
            way.end = CLOSED
            return way
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
            _record_origin(curve, here, gone, sigma, place, signs, way, limits, arclength)
        else:
            errors = _errors(curve, here, sigma, place, gone, kind)
            _record_point(curve, place, signs, kind, errors, way, limits, arclength + sigma)
        if way.end:
            return


def _record_hopf(
    curve: AnyCurve,
    here: CurvePoint,
    distance: float,
    before: TestFunctions,
    way: BranchTrace,
    limits: ContinuationLimits,
    arclength: float,
) -> bool:
    """Note the Hopf point to which cycles shrink at a distance from `here`; False if there is none."""
    if not isinstance(curve, PeriodicOrbitCurve) or isinstance(curve, FamilyCurve):
        return False
    try:
        point = hopf_end(curve, here.u)
    except (CorrectorFailed, IntegrationError):
        return False
    if point is None:
        return False
    with suppress(CorrectorFailed, IntegrationError):
        near = _BEFORE * distance
        u = newton_corrector(curve, here.u + near * here.tangent, here.tangent)
        last = CurvePoint(u, tangent_at(curve, u, here.tangent))
        if near > 0.0 and vanishing_part(curve, here.u, u) is None:
            after = test_functions_at(curve, last)
            _locate_bifurcations(curve, here, near, before, after, way, limits, arclength)
            if way.end:
                return True
            if limits.low <= curve.value(u) <= limits.high:
                way.places.append((curve, last, after, arclength + near))
    if not limits.low <= point.value <= limits.high:
        return False
    way.points.append(replace(point, arclength=arclength + distance))
    way.end = f"a Hopf bifurcation at {point.value:.10g}"
    return True


def _record_origin(
    curve: AnyCurve,
    here: CurvePoint,
    gone: float,
    sigma: float,
    place: CurvePoint,
    signs: TestFunctions,
    way: BranchTrace,
    limits: ContinuationLimits,
    arclength: float,
) -> None:
    """Note the bifurcation at which a side branch turns: it ends there."""
    value = curve.value(place.u)
    if isinstance(curve, FamilyCurve):
        way.places.append((curve, place, signs, arclength + sigma))
        size = size_of(curve, place.u) / size_of(curve, here.u)
        way.end = f"{'an equilibrium' if size < _SHRUNK else 'a branch point'} near {value:.5g}"
        return
    point = origin_of(curve, place.u, gone) if isinstance(curve, PeriodicOrbitCurve) else None
    if point is not None:
        way.places.append((curve, place, signs, arclength + sigma))
        way.points.append(replace(point, arclength=arclength + sigma))
        way.end = f"a {point.kind} at {point.value:.10g}"
        return
    error = float("nan")
    # If the curve cannot be followed about it, not even nearer, the place is less accurate.
    for part in _NEARER:
        with suppress(CorrectorFailed, IntegrationError):
            sigma, place, error = pitchfork_at(curve, here, part * gone, sigma)
            break
    signs, errors = test_functions_at(curve, place), (error, float("nan"))
    _record_point(curve, place, signs, "branch point", errors, way, limits, arclength + sigma)
    way.end = f"a branch point at {curve.value(place.u):.10g}"


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


def _once(points: list[BifurcationPoint]) -> list[BifurcationPoint]:
    """The points of a closed branch; those that come again on its last step once."""
    first, near = points[0] if points else None, 1e-6
    if len(points) < 2 or first is None or points[-1].kind != first.kind:
        return points
    return points[:-1] if abs(points[-1].value - first.value) < near * (abs(first.value) or 1.0) else points


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
