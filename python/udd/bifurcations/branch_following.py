"""Predictor-corrector continuation of a branch in one direction, with the events on the way."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from udd.errors import IntegrationError

from .bifurcation_functions import FUNCTIONS, TestFunctions
from .bifurcation_location import bifurcations_between, pitchfork_at, point_at
from .branch import AnyCurve, BifurcationPoint
from .branch_ends import hopf_end, origin_of
from .error_bounds import rounding_of
from .flow_map import Floats
from .pseudo_arclength import (
    CorrectorFailed,
    CurvePoint,
    corrected_point,
    guess_at,
    natural_constraint,
    newton_corrector,
    predictor_corrector_step,
    tangent_at,
)

__all__ = ["CLOSED", "BranchTrace", "ContinuationLimits", "Station", "follow_branch"]

_WATCHED = 6  # Number of points in which a branch shows that it tends to a connection.
_CONVERGED = 1e-11  # Largest relative change of its parameter in these points.
_GROWN = 1.005  # Least growth of its period in these points.
_LOOP = 8  # Least number of points of a closed branch.
_NEARER = (1.0, 0.5, 0.2, 0.1, 0.05)  # Parts of a step, within which a pitchfork is located.
_ASIDE = 1e-9  # Distance from a corner, in scaled unknowns.
_SHRUNK = 0.1  # Size relative to that before, below which an orbit has shrunk to an equilibrium.
_SMALL = 0.1  # Typical sizes: a smaller orbit that cannot be followed may come from a Hopf point.
_BEFORE = 0.95  # Part of the way to a Hopf point at which the last cycle is kept.
CLOSED = "the branch is closed"


@dataclass(frozen=True)
class ContinuationLimits:
    """Limits of a branch.

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


class Station(NamedTuple):
    """A point of a branch: its curve, the test functions there, and how far along the branch it lies."""

    curve: AnyCurve
    place: CurvePoint
    functions: TestFunctions
    arclength: float


@dataclass
class BranchTrace:
    """One direction of a branch: points with their arclength, bifurcations, and why it ends."""

    places: list[Station]
    points: list[BifurcationPoint]
    end: str


def follow_branch(curve: AnyCurve, start: CurvePoint, limits: ContinuationLimits) -> BranchTrace:
    """Follow a branch from `start` in the direction of its tangent."""
    way = _Way([Station(curve, start, curve.test_functions(start), 0.0)], [], "", limits)
    here, step = way.places[0], limits.step
    while not way.end:
        if len(way.places) > limits.most:
            way.end = "as many points as were wanted"
            break
        corner = here.curve.corner_ahead(here.place, step)
        if corner is not None:
            here, step = way.round_corner(here, corner), min(step, limits.step)
            continue
        here, step = way.step_from(here, step)
    return way


@dataclass
class _Way(BranchTrace):
    """A branch that is being followed within limits."""

    limits: ContinuationLimits

    def step_from(self, here: Station, step: float) -> tuple[Station, float]:
        """Return the next point, after its bifurcations are noted, and the step to be tried next."""
        curve, place, limits = here.curve, here.place, self.limits
        try:
            there, gone, step = predictor_corrector_step(curve, place, step, limits.longest)
            after = curve.test_functions(there)
        except (CorrectorFailed, IntegrationError) as error:
            if curve.size(place.u) >= _SMALL or not self.ends_at_hopf(here, 0.0):
                self.end = f"lost: {error}"
            return here, step
        part = curve.vanishing_part(place.u, there.u)
        if part is not None and self.ends_at_hopf(here, part * gone):
            return here, step
        self.locate(here, gone, after)
        if self.end or self.leaves_bounds(here, gone, there.u):
            return here, step
        arclength, first = here.arclength + gone, self.places[0]
        if len(self.places) > _LOOP and first.curve.closes(first.place, curve, place, there, gone):
            self.places.append(Station(curve, there, after, arclength))
            self.points, self.end = _once(self.points), CLOSED
            return here, step
        if curve.period(there.u) > limits.period:
            self.places.append(Station(curve, there, after, arclength))
            self.end = f"the period exceeds {limits.period:.6g}"
            return here, step
        curve, there = curve.prepared(there)
        if not curve.family:
            after = replace(after, fold=float(there.tangent[-1]))
        self.places.append(Station(curve, there, after, arclength))
        if (value := _connection(self)) is not None:
            self.end = f"a connection near {value:.13g}: the period grows without bound"
        return self.places[-1], step

    def locate(self, here: Station, gone: float, after: TestFunctions) -> None:
        """Note the bifurcations on a step."""
        curve, place = here.curve, here.place
        for kind, sigma, there, signs in bifurcations_between(curve, place, gone, here.functions, after):
            if kind == "end":
                # The parameter turns where no multiplier passes 1: the branch meets itself there.
                self.note_origin(here, gone, sigma, there, signs)
            else:
                errors = float("nan"), float("nan")
                with suppress(CorrectorFailed, IntegrationError):
                    errors = curve.location_error(place, sigma, there, gone, FUNCTIONS[kind])
                self.note(Station(curve, there, signs, here.arclength + sigma), kind, errors)
            if self.end:
                return

    def ends_at_hopf(self, here: Station, distance: float) -> bool:
        """Note the Hopf point to which cycles shrink at a distance from `here`; return True if it exists."""
        curve, limits = here.curve, self.limits
        try:
            point = hopf_end(curve, here.place.u)
        except (CorrectorFailed, IntegrationError):
            return False
        if point is None:
            return False
        with suppress(CorrectorFailed, IntegrationError):
            gone = _BEFORE * distance
            tangent = here.place.tangent
            last = corrected_point(curve, here.place.u + gone * tangent, tangent)
            if gone > 0.0 and curve.vanishing_part(here.place.u, last.u) is None:
                after = curve.test_functions(last)
                self.locate(here, gone, after)
                if self.end:
                    return True
                if limits.low <= curve.value(last.u) <= limits.high:
                    self.places.append(Station(curve, last, after, here.arclength + gone))
        if not limits.low <= point.value <= limits.high:
            return False
        self.points.append(replace(point, arclength=here.arclength + distance))
        self.end = f"a Hopf bifurcation at {point.value:.10g}"
        return True

    def note_origin(
        self, here: Station, gone: float, sigma: float, place: CurvePoint, signs: TestFunctions
    ) -> None:
        """Note the bifurcation at which a side branch turns: it ends there."""
        curve = here.curve
        there = Station(curve, place, signs, here.arclength + sigma)
        if curve.family:
            self.places.append(there)
            size = curve.size(place.u) / curve.size(here.place.u)
            what = "an equilibrium" if size < _SHRUNK else "a branch point"
            self.end = f"{what} near {curve.value(place.u):.5g}"
            return
        point = origin_of(curve, place.u, gone)
        if point is not None:
            self.places.append(there)
            self.points.append(replace(point, arclength=there.arclength))
            self.end = f"a {point.kind} at {point.value:.10g}"
            return
        error = float("nan")
        # If the curve cannot be followed about it, not even nearer, the place is less accurate.
        for part in _NEARER:
            with suppress(CorrectorFailed, IntegrationError):
                sigma, place, error = pitchfork_at(curve, here.place, part * gone, sigma)
                break
        there = Station(curve, place, curve.test_functions(place), here.arclength + sigma)
        self.note(there, "branch point", (error, float("nan")))
        self.end = f"a branch point at {curve.value(place.u):.10g}"

    def note(self, there: Station, kind: str, errors: tuple[float, float]) -> None:
        """Note a bifurcation point; the way ends with the last one that is wanted."""
        curve, place, signs, arclength = there
        point = point_at(curve, kind, place, signs, arclength, errors)
        self.points.append(point)
        self.places.append(there)
        if self.limits.until(point):
            self.end = "the point that was wanted"

    def leaves_bounds(self, here: Station, gone: float, there: Floats) -> bool:
        """Return True if the branch meets a bound before `there`, and add the point where it does."""
        curve, place, limits = here.curve, here.place, self.limits
        if limits.low <= curve.value(there) <= limits.high:
            return False
        bound = limits.high if curve.value(place.u + gone * place.tangent) > limits.high else limits.low
        guess = guess_at(place, bound / curve.scale)
        with suppress(CorrectorFailed, IntegrationError):  # the last point is inside, then
            u = newton_corrector(curve, guess, natural_constraint(guess))
            last = CurvePoint(u, tangent_at(curve, u, place.tangent))
            arclength = here.arclength + float(np.linalg.norm(u - place.u))
            self.places.append(Station(curve, last, curve.test_functions(last), arclength))
        self.end = f"{curve.name} = {bound:.6g}"
        return True

    def round_corner(self, here: Station, corner: tuple[CurvePoint, CurvePoint]) -> Station:
        """Go round a corner, where an equilibrium lies on a surface of the law."""
        curve, (arriving, leaving) = here.curve, corner
        gone = float(np.linalg.norm(arriving.u - here.place.u))
        here = here._replace(functions=curve.test_functions(here.place))
        # On the corner itself rounding would choose the side of the law.
        at = curve.test_functions(CurvePoint(arriving.u - _ASIDE * arriving.tangent, arriving.tangent))
        after = curve.test_functions(CurvePoint(leaving.u + _ASIDE * leaving.tangent, leaving.tangent))
        if gone > _ASIDE:
            self.locate(here, gone - _ASIDE, at)
        if self.end or self.leaves_bounds(here, gone, arriving.u):
            return here
        kind = "nonsmooth fold" if arriving.tangent[-1] * leaving.tangent[-1] < 0.0 else "border collision"
        arclength, value = here.arclength + gone, curve.value(arriving.u)
        self.note(Station(curve, arriving, at, arclength), kind, (float(rounding_of(value)), float("nan")))
        return Station(curve, leaving, after, arclength)


def _connection(way: BranchTrace) -> float | None:
    """Return the parameter that has converged while the period goes on growing, or None."""
    if len(way.places) < _WATCHED:
        return None
    values = [curve.value(place.u) for curve, place, _, _ in way.places[-_WATCHED:]]
    spans = [curve.period(place.u) for curve, place, _, _ in way.places[-_WATCHED:]]
    still = max(values) - min(values) < _CONVERGED * max(abs(value) for value in values)
    growing = all(a < b for a, b in pairwise(spans)) and spans[-1] > _GROWN * spans[0]
    return values[-1] if still and growing else None


def _once(points: list[BifurcationPoint]) -> list[BifurcationPoint]:
    """Return the points of a closed branch without those that its last step repeats."""
    first, near = points[0] if points else None, 1e-6
    if len(points) < 2 or first is None or points[-1].kind != first.kind:
        return points
    return points[:-1] if abs(points[-1].value - first.value) < near * (abs(first.value) or 1.0) else points
