"""Points of a curve of bifurcations at which it changes: kinds, places, normal forms and bounds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from udd.errors import IntegrationError

from .connecting_orbits import Connection
from .equilibrium_curve import EquilibriumCurve, expansion
from .error_bounds import SURE, rounding_of, scatter
from .flow_map import Floats
from .normal_forms import (
    Derivatives,
    bogdanov_takens_coefficients,
    cusp_coefficient,
    first_lyapunov_coefficient,
    second_lyapunov_coefficient,
    zero_hopf_coefficients,
)
from .pseudo_arclength import CorrectorFailed, zero_between
from .solution_surface import SolutionSurface, SurfacePoint
from .solutions import Equilibrium, PeriodicOrbit

__all__ = [
    "ENDS",
    "LocusPlace",
    "LocusPoint",
    "LocusTrace",
    "Segment",
    "outside",
    "points_between",
    "watched_functions",
]

_NEAR = 1e-4  # Radians in a typical time, or from 1: a pair this near to the axis is real.
_ZERO = 1e-3  # Size of a function at its zero, relative to its values before and after.
_SAMPLES = 8  # Points about a special one, in which rounding shows.
_ASIDE = 1e-3  # Their distance, in lengths of the segment.

#: Functions whose zeros are special points, by the kind of the curve.
_WATCHED = {
    "fold": ("bend", "complex_pair", "period_doubling"),
    "Hopf": ("unit_multiplier", "lyapunov"),
    "Neimark-Sacker": ("unit_multiplier", "period_doubling"),
}

#: Kinds of special points of cycles with two multipliers 1 or -1, and with one and a pair on the unit circle.
_DOUBLE = {1.0: "1:1 resonance", -1.0: "1:2 resonance"}
_WITH_PAIR = {1.0: "fold-Neimark-Sacker", -1.0: "flip-Neimark-Sacker"}

#: Names of the normal form's coefficients and their formula, by the kind of the special point.
_NORMAL_FORMS: dict[str, tuple[tuple[str, ...], Callable[[Derivatives], float | tuple[float, float]]]] = {
    "cusp": (("c",), cusp_coefficient),
    "Bogdanov-Takens": (("a", "b"), bogdanov_takens_coefficients),
    "zero-Hopf": (("s", "theta"), zero_hopf_coefficients),
}

#: Kinds at which a curve ends: beyond, its points are no bifurcations of its kind.
ENDS = {"Hopf": ("Bogdanov-Takens",), "Neimark-Sacker": ("1:1 resonance", "1:2 resonance")}


@dataclass(frozen=True, eq=False)
class LocusPoint:
    """Point of codimension two: a point of a curve of bifurcations with a second condition.

    Attributes
    ----------
    kind : str
        For equilibria "cusp", "Bogdanov-Takens", "Bautin" and "zero-Hopf". For cycles "cusp",
        "1:1 resonance", "1:2 resonance", "fold-flip", "fold-Neimark-Sacker" and "flip-Neimark-Sacker".
    parameters : tuple of str
    values, errors : ndarray, shape (2,)
        The parameters' values, and bounds of their errors.
    solution : Equilibrium or PeriodicOrbit
    coefficients, coefficient_errors : dict of str to float
        Those of the normal form, with bounds; empty for cycles. A cusp has "c", a Bogdanov-Takens point "a"
        and "b". A Bautin point has "l2" (the second Lyapunov coefficient), a zero-Hopf point "s" and
        "theta".

    See Also
    --------
    udd.locus : finds it on the curve.
    udd.plot.locus : draw the curve with its points.

    References
    ----------
    Yu. A. Kuznetsov [24, 25].
    """

    kind: str
    parameters: tuple[str, str]
    values: Floats
    errors: Floats
    solution: Equilibrium | PeriodicOrbit
    coefficients: dict[str, float]
    coefficient_errors: dict[str, float]
    _surface: SolutionSurface | None = field(default=None, repr=False)
    _place: SurfacePoint | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        pairs = zip(self.parameters, self.values, self.errors, strict=True)
        where = ", ".join(f"{name} = {value:.12g} (error below {error:.1g})" for name, value, error in pairs)
        numbers = "".join(f", {name} = {value:.6g}" for name, value in self.coefficients.items())
        return f"<{self.kind} at {where}{numbers}>"


@dataclass(frozen=True, eq=False)
class LocusPlace:
    """A place on a curve over two parameters: their values, the solution there, and the frequency."""

    values: Floats
    solution: Equilibrium | PeriodicOrbit | Connection
    frequency: float = float("nan")


@dataclass
class LocusTrace:
    """One direction of a curve over two parameters: places, special points, and why it ends."""

    places: list[LocusPlace]
    points: list[LocusPoint] = field(default_factory=list)
    end: str = ""


def outside(values: Floats, box: Floats) -> list[tuple[int, float]]:
    """Return which parameters have left their bounds (k, 2), and these bounds."""
    pairs = zip(values.tolist(), box.tolist(), strict=True)
    return [(k, low if v < low else high) for k, (v, (low, high)) in enumerate(pairs) if not low <= v <= high]


@dataclass(frozen=True, eq=False)
class Segment:
    """A step along a curve of zeros of a test function, from one point of the surface to the next."""

    surface: SolutionSurface
    name: str
    begin: SurfacePoint
    normal: Floats
    end: SurfacePoint

    @property
    def length(self) -> float:
        """The distance of the two points, in scaled unknowns."""
        return float(np.linalg.norm(self.end.v - self.begin.v))

    def coarse(self) -> Segment:
        """Return the step with less accurate runs."""
        coarse = replace(self.surface, curve=self.surface.curve.coarse())
        return replace(self, surface=coarse)

    def at(self, part: float) -> SurfacePoint:
        """Return the point of the curve at a part of the way."""
        if part == 0.0:
            return self.begin
        guess = self.begin.v + part * (self.end.v - self.begin.v)
        # If the surface is curved, the guess misses it by the square of the step.
        return self.surface.zero(self.begin, guess, self.normal, self.name, self.length)

    def zero(self, function: Callable[[SurfacePoint], float]) -> tuple[float, SurfacePoint]:
        """Return the part of the way after which a function is zero, and the point there."""

        def value(part: float) -> tuple[float, SurfacePoint]:
            point = self.at(part)
            return function(point), point

        return zero_between(value, 1.0)


def watched_functions(kind: str, point: SurfacePoint, slope: Floats) -> dict[str, float]:
    """Return the functions whose zeros are special points, by name; `slope` is that of its function."""
    signs, values = point.functions, {}
    for name in _WATCHED.get(kind, ("unit_multiplier", "complex_pair")):
        if name == "lyapunov":
            at = point.curve.normal_form(point.v[:-1])
            values[name] = float("nan") if at is None else first_lyapunov_coefficient(at)
        else:
            values[name] = float(slope[0]) if name == "bend" else getattr(signs, name)
    return values


def _function(kind: str, name: str, segment: Segment) -> Callable[[SurfacePoint], float]:
    """Return the function of this name at a point of a segment."""

    def value(point: SurfacePoint) -> float:
        if name != "bend":
            return watched_functions(kind, point, np.zeros(2))[name]
        at = point.curve.normal_form(point.v[:-1])
        return float(segment.surface.slope(point, segment.name)[0]) if at is None else _bend(point, at)

    return value


def _bend(point: SurfacePoint, at: Derivatives) -> float:
    """Return the rate of change of the first parameter's slope along a branch of equilibria at its fold."""
    curve, place = point.curve, point.place
    assert curve.kind == "equilibrium"
    size = curve.flow.size
    along = place.tangent[:-1] * size
    left = np.linalg.svd(at.by_state / size[:, None] * size)[0][:, -1]
    by_value = curve.at(place.u).by_parameter[curve.parameter] * curve.scale
    return -float(left @ (at.b(along, along) / size)) / float(left @ (by_value / size))


def points_between(
    kind: str, segment: Segment, before: dict[str, float], after: dict[str, float]
) -> list[tuple[float, LocusPoint]]:
    """Return the special points on a step between whose ends these functions change their signs, in order."""
    changed = [name for name, value in before.items() if value * after[name] < 0.0]
    points = []
    for name in changed:
        if name == "lyapunov" and "unit_multiplier" in changed:
            continue  # it may pass infinity there
        function = _function(kind, name, segment)
        try:
            part, place = segment.zero(function)
        except (CorrectorFailed, IntegrationError, ValueError, RuntimeError):
            continue
        if not abs(function(place)) <= _ZERO * max(abs(before[name]), abs(after[name])):
            continue
        what = _named(kind, name, place)
        if what:
            points.append((part, _point(what, segment, part, place, function)))
    return sorted(points, key=lambda one: one[0])


def _named(kind: str, name: str, point: SurfacePoint) -> str:
    """Return the kind of the special point at which a function is zero; "" where nothing bifurcates."""
    if name in ("bend", "lyapunov"):
        return "cusp" if name == "bend" else "Bautin"
    values = point.functions.values
    if point.curve.kind == "equilibrium":
        return _of_eigenvalues(values * point.curve.flow.clock)
    return _of_multipliers(kind, name, values)


def _of_eigenvalues(values: np.ndarray) -> str:
    others = np.delete(values, np.argmin(np.abs(values)))
    if np.abs(others).min(initial=np.inf) < _NEAR:
        return "Bogdanov-Takens"
    pair = others[np.abs(others.imag) > _NEAR]
    return "zero-Hopf" if len(pair) and np.abs(pair.real).min() < _NEAR else ""


def _of_multipliers(kind: str, name: str, values: np.ndarray) -> str:
    if kind == "Neimark-Sacker":
        number = 1.0 if name == "unit_multiplier" else -1.0
        real = np.abs(values.imag) == 0.0
        single, pair = (np.abs(values[mask] - number).min(initial=np.inf) for mask in (real, ~real))
        return (_WITH_PAIR if single < pair else _DOUBLE)[number]
    if name in ("period_doubling", "unit_multiplier"):
        return "fold-flip"
    number = -1.0 if kind in ("period doubling", "symmetry breaking") else 1.0
    others = np.delete(values, np.argmin(np.abs(values - number)))
    if np.abs(others - number).min(initial=np.inf) < _NEAR**0.5:
        return _DOUBLE[number]
    turning = others[np.abs(others.imag) > _NEAR]
    return _WITH_PAIR[number] if len(turning) and np.abs(np.abs(turning) - 1.0).min() < _NEAR else ""


def _second_lyapunov(curve: EquilibriumCurve, u: Floats) -> float:
    flow, values = curve.flow, curve.values_at(u)
    return second_lyapunov_coefficient(
        lambda x: expansion(flow, values, x, higher=True), curve.state(u), flow.size
    )


def _coefficients(kind: str, point: SurfacePoint) -> dict[str, float]:
    """Return the normal form's coefficients."""
    curve, u = point.curve, point.v[:-1]
    if curve.kind != "equilibrium":
        return {}
    if kind == "Bautin":
        return {"l2": _second_lyapunov(curve, u)}
    names, formula = _NORMAL_FORMS[kind]
    return dict(zip(names, np.atleast_1d(formula(curve.normal_form(u))).tolist(), strict=True))


def _point(
    kind: str, segment: Segment, part: float, place: SurfacePoint, function: Callable[[SurfacePoint], float]
) -> LocusPoint:
    surface = segment.surface
    numbers, curve = _coefficients(kind, place), place.curve
    values = np.array([*surface.values(place), *numbers.values()])
    try:
        errors = _scatter(kind, segment, part, function) + rounding_of(values)
    except (CorrectorFailed, IntegrationError, ValueError, np.linalg.LinAlgError):
        errors = np.full(len(values), np.nan)
    names = curve.name, curve.flow.names[surface.second]
    bounds = dict(zip(numbers, errors[2:].tolist(), strict=True))
    solution = curve.solution(place.v[:-1])
    return LocusPoint(kind, names, values[:2], errors[:2], solution, numbers, bounds, surface, place)


def _scatter(kind: str, segment: Segment, part: float, function: Callable[[SurfacePoint], float]) -> Floats:
    """Bounds of the errors of both parameters and of the coefficients.

    From how the values near by scatter about a smooth curve; of cycles also how far they move if the runs are
    less accurate.
    """

    def seen(where: float, own: Segment = segment) -> list[float]:
        point = own.at(where)
        return [function(point), *own.surface.values(point), *_coefficients(kind, point).values()]

    near = np.linspace(-1.0, 1.0, _SAMPLES)
    noise, fitted = scatter(near, np.array([seen(part + _ASIDE * x) for x in near]), 3)
    gap, slope = noise[0], np.abs(fitted[2])
    if segment.surface.curve.kind == "cycle":
        moved = np.abs(np.array(seen(part, segment.coarse())) - seen(part))
        gap, noise = gap + moved[0], noise + moved
    off = gap / slope[0] if slope[0] > gap else np.nan
    # The slope counts in samples' distances, and so does this distance from the zero.
    bounds: Floats = SURE * (noise[1:] + off * slope[1:])
    return bounds
