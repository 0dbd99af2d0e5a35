"""Two-parameter continuation of bifurcation points."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.keywords import renamed
from udd._util.labelled import of_states
from udd._util.validation import number, whole
from udd.errors import IntegrationError, ModelError

from .bifurcation_functions import FUNCTIONS
from .branch import BifurcationPoint
from .branch_continuation import bounds_of, in_unit_of, unit_of
from .branch_ends import hopf_end
from .branch_following import CLOSED
from .connecting_orbits import Connection
from .connection_curves import ConnectionWay
from .curves_born_at import BORN_AT
from .flow_map import Floats
from .locus_points import (
    ENDS,
    LocusPlace,
    LocusPoint,
    LocusTrace,
    Segment,
    outside,
    points_between,
    watched_functions,
)
from .pseudo_arclength import CorrectorFailed
from .solution_surface import SolutionSurface, SurfacePoint
from .solutions import Equilibrium, PeriodicOrbit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Locus", "locus"]

_TURN = 0.9  # Least cosine between one direction and the next.
_SHORTEST = 1e-6  # Shortest step.
_BESIDE = 0.02  # Step along a curve of Hopf points towards a Bautin point.
_TRIED = 40  # Number of these steps.
_LOOP = 8  # Least number of points of a closed curve.


@dataclass(frozen=True, eq=False)
class Locus(Drawable):
    """Bifurcation points of one kind over two parameters.

    Attributes
    ----------
    kind : str
    parameters : tuple of str
        The first is that of the point from which the curve was followed.
    values : ndarray, shape (n, 2)
        Their values along the curve.
    solutions : tuple of Equilibrium, PeriodicOrbit or Connection
        The solution that bifurcates at each of them.
    frequencies : ndarray, shape (n,)
        As in :class:`BifurcationPoint`.
    lyapunov_coefficients : ndarray, shape (n,)
        The first Lyapunov coefficients of Hopf bifurcations: at a zero the criticality changes.
    ends : tuple of str
        Why the curve ends, at its beginning and at its end.
    points : tuple of LocusPoint
        Cusps, Bogdanov-Takens points and others at which it changes, in their order along the curve.

    See Also
    --------
    udd.locus : makes it.
    udd.plot.locus : draw it.
    """

    kind: str
    parameters: tuple[str, str]
    values: Floats
    solutions: tuple[Equilibrium | PeriodicOrbit | Connection, ...]
    frequencies: Floats
    lyapunov_coefficients: Floats
    ends: tuple[str, str]
    points: tuple[LocusPoint, ...] = ()

    def __len__(self) -> int:
        return len(self.values)

    def to_xarray(self) -> xr.Dataset:
        """Return labelled arrays over ``place``: both parameters, every state and the coefficients.

        Returns
        -------
        xarray.Dataset
            Its special points are those of the dimension ``special``.
        """
        rests = [one.equilibrium if isinstance(one, Connection) else one for one in self.solutions]
        model = rests[0].model
        states, special = np.array([rest.state for rest in rests]), np.zeros((0, 2))
        if self.points:
            special = np.array([point.values for point in self.points])
        table = of_states(model.state_names, model.state_units, states, ["place"], {}, kind=self.kind)
        columns = {name: ("place", self.values[:, k]) for k, name in enumerate(self.parameters)}
        columns |= {f"special_{name}": ("special", special[:, k]) for k, name in enumerate(self.parameters)}
        columns |= {
            "frequency": ("place", self.frequencies),
            "lyapunov_coefficient": ("place", self.lyapunov_coefficients),
        }
        return table.assign_coords(special=[point.kind for point in self.points]).assign(columns)

    def __repr__(self) -> str:
        (a, b), (p, q) = self.values[[0, -1]], self.parameters
        special = "".join(
            f"; {point.kind} at ({point.values[0]:.10g}, {point.values[1]:.10g})" for point in self.points
        )
        return (
            f"<Locus of {self.kind} over {p} and {q}: {len(self)} points from ({a[0]:.6g}, {a[1]:.6g}) to "
            f"({b[0]:.6g}, {b[1]:.6g}){special}>"
        )


@renamed(step="ds", longest="ds_max", most="max_points")
@checked_arguments
def locus(
    point: BifurcationPoint | LocusPoint | Connection,
    parameter: str | None = None,
    bounds: Sequence[float] = (0.0, np.inf),
    *,
    within: Sequence[float] = (0.0, np.inf),
    ds: float = 0.05,
    ds_max: float = 0.2,
    max_points: int = 1000,
) -> Locus:
    """Follow a bifurcation point over a second parameter.

    Parameters
    ----------
    point : BifurcationPoint, LocusPoint or Connection
        A fold, a Hopf, Neimark-Sacker, symmetry-breaking or period-doubling point of
        :func:`udd.continuation`, or a homoclinic or heteroclinic orbit. At a point of another curve, the
        curve born there is followed: folds of cycles from a Bautin point, homoclinic orbits from a
        Bogdanov-Takens point.
    parameter : str, optional
        The second parameter; by default that of the other curve.
    bounds, within : (float, float)
        The curve ends where the second or the first parameter leaves these bounds.
    ds, ds_max : float
        The first and the longest step, in arclength. States count in typical sizes, a parameter in fifths of
        the way between its bounds, or in units of its value at the point if a bound is infinite.
    max_points : int
        Points at most, in either direction.

    Returns
    -------
    Locus

    Raises
    ------
    ModelError
        A point of another kind, or a parameter or option that cannot be used.

    See Also
    --------
    udd.continuation : finds the first point.
    udd.plot.locus : draw the curve.

    Notes
    -----
    Equilibria or cycles over two parameters are a surface, on which the zeros of the function that makes the
    bifurcation are a curve. It is followed by its arclength in the tangent planes of the surface, each point
    located by the secant method across the curve. So folds go on through cusps. Brent's method locates zeros
    of the normal form's coefficients along the curve: cusps, Bogdanov-Takens points (at which curves of Hopf
    points end), Bautin points (with a first Lyapunov coefficient of zero) and zero-Hopf points. Bounds come
    from the scatter of the values near by.

    A curve of homoclinic orbits has its equilibrium among the unknowns, so it passes close to a fold of that
    equilibrium. If it ends in the fold, the end is "a saddle-node of equilibria" with its extrapolated place.
    If the orbit lies outside the bounds of the second parameter, the curve begins where it enters them.

    References
    ----------
    Yu. A. Kuznetsov [24, 25].

    Examples
    --------
    Rotation becomes stable at ``w = (1 - B)/(B (1 + B))``:

    >>> import udd
    >>> rest = udd.equilibria(udd.DLE(2.5, B=0.2))[0]
    >>> hopf = udd.continuation(rest, "w", (1.0, 9.0)).points[0]
    >>> curve = udd.locus(hopf, "B", (0.1, 0.4))
    >>> w, B = curve.values.T
    >>> print(abs(w - (1 - B) / (B * (1 + B))).max() < 1e-10)
    True
    """
    if isinstance(point, LocusPoint):
        parameter = point.parameters[1] if parameter is None else parameter
        if parameter != point.parameters[1]:
            raise ModelError(f"the curve born there is one over {point.parameters[1]}, not {parameter}")
        if point.kind not in BORN_AT:
            raise ModelError(f"no curve is born at a {point.kind} point that could be followed")
        point = BORN_AT[point.kind](point, bounds_of(within))
    if parameter is None:
        raise ModelError("say which second parameter is varied")
    if isinstance(point, BifurcationPoint | Connection) and parameter == point.parameter:
        raise ModelError(f"the second parameter must be another than {parameter}")
    box = np.array([bounds_of(within), bounds_of(bounds)])
    ds = number("ds", ds, above=0.0)
    steps = ds, max(ds, number("ds_max", ds_max, above=0.0)), whole("max_points", max_points, 1)
    if isinstance(point, Connection):
        connections = ConnectionWay((point.parameter, parameter), box, *steps)
        start = connections.entered(point)
        back, on = (connections.follow(start, sense) for sense in (-1.0, 1.0))
    else:
        back, on = _followed(point, parameter, box, *steps)
    places = [*back.places[:0:-1], *on.places]
    solutions = tuple(place.solution for place in places)
    coefficients = [s.lyapunov_coefficient if isinstance(s, Equilibrium) else np.nan for s in solutions]
    return Locus(
        point.kind,
        (point.parameter, parameter),
        np.array([place.values for place in places]),
        solutions,
        np.array([place.frequency for place in places]),
        np.array(coefficients),
        (back.end, on.end or back.end),
        (*back.points[::-1], *on.points),
    )


def _followed(
    point: BifurcationPoint, parameter: str, box: Floats, step: float, longest: float, most: int
) -> tuple[LocusTrace, LocusTrace]:
    """Follow a bifurcation point over a second parameter in both directions."""
    if not isinstance(point, BifurcationPoint) or point._curve is None or point._place is None:
        raise ModelError("a bifurcation point of udd.continuation is needed")
    if point.kind not in FUNCTIONS or point.kind == "branch point":
        raise ModelError(f"a curve of points of the kind {point.kind} is not followed")
    if point._curve.family:
        raise ModelError("points of a family of cycles are not followed over a second parameter")
    second = point._curve.flow.index(parameter)
    start = np.array([point.value, point._curve.values_at(point._place.u)[second]])
    if (start < box[:, 0]).any() or (start > box[:, 1]).any():
        raise ModelError(f"the point itself, at {start[0]:g} and {start[1]:g}, lies outside the bounds")
    scaled = in_unit_of(point, *box[0])
    assert scaled._curve is not None and scaled._place is not None
    surface = SolutionSurface(scaled._curve, second, unit_of(start[1], *box[1]))
    way = _Way(surface, point.kind, box, step, longest, most)
    try:
        begin = surface.start(scaled._place)
        back = way.follow(begin, -1.0)
        if back.end == CLOSED:
            return back, LocusTrace([_place(surface, point.kind, begin)])
        return back, way.follow(begin, 1.0)
    except (CorrectorFailed, IntegrationError) as error:
        raise ModelError(f"the point cannot be followed: {error}") from None


def _place(surface: SolutionSurface, kind: str, point: SurfacePoint) -> LocusPlace:
    u, frequency = point.v[:-1], float("nan")
    if FUNCTIONS[kind] == "complex_pair":
        frequency = point.curve.frequency(u, point.functions)
    return LocusPlace(surface.values(point), point.curve.solution(u), frequency)


def _bautin_near(point: SurfacePoint, surface: SolutionSurface, box: Floats) -> list[LocusPoint]:
    """Find the Bautin point near a small cycle at its fold, along the curve of Hopf points."""
    hopf = hopf_end(point.curve, point.v[:-1])
    if hopf is None or hopf._curve is None or hopf._place is None:
        return []
    rests = SolutionSurface(hopf._curve, surface.second, surface.scale)
    way = _Way(rests, "Hopf", box, _BESIDE, _BESIDE, _TRIED)
    points = [one for sense in (1.0, -1.0) for one in way.follow(rests.start(hopf._place), sense).points]
    points = [one for one in points if one.kind == "Bautin"]
    here = surface.values(point)
    return sorted(points, key=lambda one: float(np.abs(one.values - here).max()))[:1]


@dataclass(frozen=True)
class _Way:
    """Settings for following a curve of bifurcations on the surface of solutions."""

    surface: SolutionSurface
    kind: str
    box: Floats
    step: float
    longest: float
    most: int

    def follow(self, start: SurfacePoint, sense: float) -> LocusTrace:
        """Return points from the start on; `sense` is that of the second parameter at first."""
        surface, here, step, first = self.surface, start, self.step, None
        along = np.append(np.zeros(len(start.v) - 1), sense)
        trace = LocusTrace([_place(surface, self.kind, start)])
        before: dict[str, float] | None = None
        while not trace.end:
            if len(trace.places) > self.most:
                trace.end = "as many points as were wanted"
                break
            try:
                surface, here = surface.anchored(here)
                slope = surface.slope(here, FUNCTIONS[self.kind])
                before = watched_functions(self.kind, here, slope) if before is None else before
                segment, ahead, after, step = self._step(surface, here, slope, along, step)
            except (CorrectorFailed, IntegrationError) as error:
                trace.end = f"lost: {error}"
                break
            first, there = ahead if first is None else first, segment.end
            self._note(trace, segment, before, after)
            if not trace.end:
                passed = (here.v - start.v) @ first < 0.0 <= (there.v - start.v) @ first
                near = np.linalg.norm(there.v - start.v) < 1.5 * segment.length
                trace.end = CLOSED if len(trace.places) > _LOOP and passed and near else ""
                trace.places.append(_place(surface, self.kind, there))
            here, along, before = there, there.v - here.v, after
            step = min(self.longest, 1.4 * step)
        return trace

    def _step(
        self, surface: SolutionSurface, here: SurfacePoint, slope: Floats, along: Floats, step: float
    ) -> tuple[Segment, Floats, dict[str, float], float]:
        """Return the next segment, the direction there, the functions at its end, and the step's length."""
        name, reason = FUNCTIONS[self.kind], "the curve turns too sharply"
        normal = slope / np.linalg.norm(slope)
        ahead = here.ahead(np.array([-normal[1], normal[0]]))
        ahead = ahead * (np.sign(ahead @ along) or 1.0)
        while step >= _SHORTEST:
            try:
                there = surface.zero(here, here.v + step * ahead, normal, name, step)
                after = watched_functions(self.kind, there, surface.slope(there, name))
                segment = Segment(surface, name, here, normal, there)
                if (there.v - here.v) @ ahead > _TURN * segment.length:
                    return segment, ahead, after, step
            except (CorrectorFailed, IntegrationError) as error:
                reason = str(error)
            step *= 0.5
        raise CorrectorFailed(reason)

    def _note(
        self, trace: LocusTrace, segment: Segment, before: dict[str, float], after: dict[str, float]
    ) -> None:
        """Note the special points of a segment, and the end of the curve if it ends there."""
        surface, here, there = segment.surface, segment.begin, segment.end
        if here.curve.vanishing_part(here.v[:-1], there.v[:-1]) is not None:
            # Folds of cycles are born at a Bautin point, where the cycles have no size.
            points = _bautin_near(here, surface, self.box) if self.kind == "fold" else []
            trace.points += points
            trace.end = "a Bautin point" if points else "lost: the cycles shrink to an equilibrium"
            return
        left = outside(self.surface.values(there), self.box)
        last = self._at_bounds(segment, left)
        for part, point in points_between(self.kind, segment, before, after):
            if left and (last is None or part > last[0]):
                continue
            trace.points.append(point)
            if point.kind in ENDS.get(self.kind, ()):
                trace.places.append(LocusPlace(point.values, point.solution, 0.0))
                trace.end = f"a {point.kind} point"
                return
        if left:
            trace.end = f"the bound {left[0][1] if last is None else last[1]:.6g}"
            if last is not None:
                trace.places.append(_place(surface, self.kind, last[2]))

    def _at_bounds(
        self, segment: Segment, left: list[tuple[int, float]]
    ) -> tuple[float, float, SurfacePoint] | None:
        """Return the part of a step after which the curve first meets a bound, the bound, and the point."""
        met = []
        for k, bound in left:

            def beyond(point: SurfacePoint, k: int = k, bound: float = bound) -> float:
                return float(self.surface.values(point)[k] - bound)

            # A segment that begins on the bound does not meet it.
            if abs(beyond(segment.begin)) > 1e-12 * (abs(bound) or 1.0):
                with suppress(CorrectorFailed, IntegrationError, ValueError, RuntimeError):
                    part, point = segment.zero(beyond)
                    met.append((part, bound, point))
        return min(met, key=lambda place: place[0], default=None)
