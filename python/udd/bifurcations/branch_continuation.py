"""Numerical continuation of equilibria and periodic orbits in a parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.keywords import renamed
from udd._util.validation import number, whole
from udd.errors import ModelError
from udd.models import Model, beyond_the_edge

from .branch import AnyCurve, BifurcationPoint, Branch
from .branch_following import CLOSED, BranchTrace, ContinuationLimits, Station, follow_branch
from .branch_switching import born_at
from .conservative_families import PERIOD, Conserved, FamilyCurve
from .equilibrium_curve import EquilibriumCurve
from .flow_map import Floats, flow_of
from .forced_orbits import require_period
from .pseudo_arclength import CorrectorFailed, CurvePoint, natural_constraint, newton_corrector, tangent_at
from .shooting_curve import PeriodicOrbitCurve
from .solution_curve import NO_PARAMETER
from .solutions import Equilibrium, PeriodicOrbit

__all__ = ["bounds_of", "branch_from", "continuation", "in_unit_of", "unit_of"]


@renamed(step="ds", longest="ds_max", most="max_points", period="max_period")
@checked_arguments
def continuation(
    start: Equilibrium | PeriodicOrbit | BifurcationPoint,
    parameter: str | None = None,
    bounds: Sequence[float] = (0.0, np.inf),
    *,
    direction: Literal["both", "up", "down"] = "both",
    ds: float = 0.02,
    ds_max: float = 0.1,
    max_points: int = 2000,
    max_period: float | None = None,
    until: str | Callable[[BifurcationPoint], bool] | None = None,
    amplitude: float = 0.01,
) -> Branch:
    """Follow an equilibrium or a cycle over a parameter, through folds, and locate its bifurcations.

    Parameters
    ----------
    start : Equilibrium, PeriodicOrbit or BifurcationPoint
        From :func:`udd.equilibria`, :func:`udd.periodic_orbit`, or from another branch. From a bifurcation
        point the branch that is born there is followed, away from it: cycles from a Hopf bifurcation, cycles
        of twice the period from a period doubling.
    parameter : str, optional
        One of ``model.parameters``; by default that of the bifurcation point. Cycles of a conservative model
        come in families while all parameters stay. These are followed over ``"period"``, or over the formula
        of a conserved quantity such as ``"v^2/2 - cos(x)"``.
    bounds : (float, float)
        The branch ends where the parameter leaves them.
    direction : {"both", "up", "down"}
        The direction of the parameter from the start on.
    ds, ds_max : float
        The first and the longest step, in arclength. States count in typical sizes, the parameter in fifths
        of the way between the bounds, or in units of its value at the start if a bound is infinite.
    max_points : int
        Points at most, in either direction.
    max_period : float, optional
        A branch of cycles ends where the period exceeds this, by default 40 typical times, or 8
        times that of the start.
    until : str or callable, optional
        A kind of bifurcation whose first point ends the branch, or a function that returns True for the
        :class:`BifurcationPoint` that ends it.
    amplitude : float
        How far from a bifurcation point its new branch is looked for first. It is halved, and the first step
        with it, until the branch does as the normal form of the bifurcation says.

    Returns
    -------
    Branch

    Raises
    ------
    ModelError
        A parameter or option that cannot be used; a point where no branch is born.

    See Also
    --------
    udd.locus : bifurcations over a second parameter.
    udd.diagram : branches with section points.
    udd.plot.branches : draw the branch.

    Notes
    -----
    The curve is followed by its arclength (H. B. Keller, 1977): a step along the tangent, then Newton's
    method in the plane across it. Brent's method locates folds, and zeros of ``det(M - 1)``, ``det(M + 1)``
    and the products of pairs of multipliers less 1 (for equilibria: eigenvalues and their sums). Each value
    comes from a newly corrected orbit. A symmetric cycle is followed over half its period; it loses the
    symmetry at a multiplier -1.

    Multipliers come from a periodic Schur decomposition of the pieces' derivatives, so that weak ones are
    accurate next to strong ones. No bifurcation is reported if rounding leaves their sign open, or if their
    product contradicts Liouville's formula. If an equilibrium meets a surface on which the law has a kink (a
    border collision), the branch lands on the surface and goes on with the other law's tangent.

    References
    ----------
    H. B. Keller [26]. Bifurcations: Yu. A. Kuznetsov [24].

    Examples
    --------
    The symmetric figure-eight of the diffusionless Lorenz equations loses its symmetry:

    >>> import udd
    >>> branch = udd.continuation(udd.periodic_orbit(udd.DLE(10.0)), "w", (6.5, 12.0))
    >>> [(point.kind, round(point.value, 9)) for point in branch.points]
    [('symmetry breaking', 7.096426431)]

    The swings of a pendulum, from small ones to those that nearly stand upside down:

    >>> swings = udd.Model(["x", "v"], ["v", "-sin(x)"])
    >>> family = udd.continuation(udd.periodic_orbit(swings, [1.0, 0.0]), "v^2/2 - cos(x)", (-0.999, 0.99))
    >>> print(family.periods[[0, -1]].round(6))
    [ 6.283971 16.15703 ]
    """
    if isinstance(start, BifurcationPoint):
        parameter = start.parameter if parameter is None else parameter
        if parameter != start.parameter:
            raise ModelError(f"the branch born there is one over {start.parameter}, not {parameter}")
    elif not isinstance(start, Equilibrium | PeriodicOrbit):
        raise ModelError(
            "the start must come from udd.equilibria, udd.periodic_orbit or a branch's points, "
            f"not {type(start).__name__}"
        )
    if parameter is None:
        raise ModelError("say which parameter is varied")
    if direction not in ("both", "up", "down"):
        raise ModelError(f"direction must be both, up or down, not {direction!r}")
    low, high = bounds_of(bounds)
    ds = number("ds", ds, above=0.0)
    ds_max = max(number("ds_max", ds_max, above=0.0), ds)
    if isinstance(start, BifurcationPoint):
        size = number("amplitude", amplitude, above=0.0)
        curve, place, off = born_at(in_unit_of(start, low, high), size)
        ds *= min(1.0, off / size)
        model = start.solution.model
    else:
        model = start.model
        curve, place = _at(start, parameter, low, high)
    value = curve.value(place.u)
    if not low <= value <= high:
        raise ModelError(
            f"the start, at {parameter} = {value:.6g}, lies outside the bounds {low:g} to {high:g}"
        )
    limit = max(40.0 * curve.flow.clock, 8.0 * curve.span(place.u))
    limit = limit if max_period is None else number("max_period", max_period, above=0.0)
    wanted = until if callable(until) else lambda point: bool(point.kind == until)
    limits = ContinuationLimits(low, high, ds, ds_max, whole("max_points", max_points, 1), limit, wanted)
    if isinstance(start, BifurcationPoint):
        return branch_from([follow_branch(curve, place, limits)], model, parameter, f"born at a {start.kind}")
    up = place if place.tangent[-1] >= 0 else place.reversed()
    ways: list[BranchTrace] = []
    for begin in {"both": (up.reversed(), up), "down": (up.reversed(),), "up": (up,)}[direction]:
        if not ways or ways[0].end != CLOSED:
            ways.append(follow_branch(curve, begin, limits))
    return branch_from(ways, model, parameter, "the start")


def bounds_of(bounds: Sequence[float]) -> tuple[float, float]:
    """Checked bounds of a parameter."""
    try:
        low, high = (float(bound) for bound in bounds)
    except (TypeError, ValueError):
        raise ModelError(f"bounds must be two numbers, not {bounds!r}") from None
    if not low < high:
        raise ModelError(f"the first of the bounds must be below the second, not {low:g} and {high:g}")
    return low, high


def unit_of(value: float, low: float, high: float) -> float:
    """Return the unit of a parameter: a fifth of the way between its bounds, else its own size."""
    return (high - low) / 5.0 if np.isfinite(high - low) else abs(value) or 1.0


def in_unit_of(point: BifurcationPoint, low: float, high: float) -> BifurcationPoint:
    """Return the point with its parameter in the unit of these bounds, unless they are infinite."""
    curve, place = point._curve, point._place
    if curve is None or place is None or not np.isfinite(high - low):
        return point
    curve, place = curve.in_unit(place, unit_of(point.value, low, high))
    return replace(point, _curve=curve, _place=place)


def _at(
    start: Equilibrium | PeriodicOrbit, parameter: str, low: float, high: float
) -> tuple[AnyCurve, CurvePoint]:
    """Return the curve through a solution, and the place there."""
    curve: AnyCurve
    if isinstance(start, Equilibrium):
        curve, u = _through_rest(start, parameter, low, high)
    else:
        curve, u = _through_cycle(start, parameter, low, high)
    row = natural_constraint(u)
    try:
        u = newton_corrector(curve, u, row)
        curve = curve.anchored(u)
        return curve, CurvePoint(u, tangent_at(curve, u, row))
    except CorrectorFailed as error:
        reason = str(error)
        if isinstance(start, PeriodicOrbit) and start.neutral:
            reason = "where energy is kept cycles come in families, of which no parameter singles out one"
        raise ModelError(f"the start cannot be followed: {reason}") from None


def _through_rest(
    start: Equilibrium, parameter: str, low: float, high: float
) -> tuple[EquilibriumCurve, Floats]:
    """Return the curve through an equilibrium, and its unknowns."""
    flow = flow_of(beyond_the_edge(start.model), np.atleast_2d(start.state))
    index = flow.index(parameter)
    value = float(flow.values[index])
    curve = EquilibriumCurve(flow, flow.values, index, unit_of(value, low, high))
    return curve, curve.pack(flow.reduced(start.state), value)


def _through_cycle(
    start: PeriodicOrbit, parameter: str, low: float, high: float
) -> tuple[PeriodicOrbitCurve, Floats]:
    """Return the curve through a cycle, over a parameter of the model or along its family."""
    if start._solved is None:
        raise ModelError("this cycle was not made by udd.periodic_orbit")
    old, v = start._solved
    forcing = old.flow.forcing
    given = flow_of(beyond_the_edge(start.model), np.atleast_2d(start.state), forcing=forcing)
    family = parameter not in given.names
    if family and forcing is not None:
        raise ModelError(f"a forced cycle is followed over a parameter, not over {parameter}")
    if forcing is not None:
        require_period(given.model, forcing, given.kept, given.size, parameter)
    flow, nodes, span = replace(old.flow, model=given.model), old.nodes(v), old.span(v)
    index = NO_PARAMETER if family else flow.index(parameter)
    quantity = Conserved.of(flow, parameter) if family and parameter != PERIOD else None
    value = 0.0 if family else float(flow.values[index])
    value = value if quantity is None else quantity.at(flow, nodes[0])[0]
    shape = old.pieces, old.mirror, old.shift, old.reference, old.across, old.share
    common = flow, flow.values, index, unit_of(value, low, high), span, *shape
    if not family:
        curve = PeriodicOrbitCurve(*common)
        u = curve.pack(nodes, span, value)
    else:
        curve = of_family = FamilyCurve(*common, conserved=quantity)
        u = curve.pack(nodes, span, value)
        of_family.require_one(u)
    return curve.anchored(u), u


def branch_from(ways: list[BranchTrace], model: Model, parameter: str, begin: str) -> Branch:
    """Make a branch of one way, or of two that begin at the same place, the first of them reversed."""
    if len(ways) == 2:
        back, on = ways
        length = back.places[-1][3]
        turned = [Station(c, p.reversed(), s, length - a) for c, p, s, a in back.places[::-1]]
        entries = [*turned[:-1], *(Station(c, p, s, length + a) for c, p, s, a in on.places)]
        points = [replace(p, arclength=length - p.arclength) for p in reversed(back.points)]
        points += [replace(p, arclength=length + p.arclength) for p in on.points]
        ends = (back.end, on.end)
    else:
        way = ways[0]
        entries, points, ends = way.places, way.points, (CLOSED if way.end == CLOSED else begin, way.end)
    values = np.array([curve.value(place.u) for curve, place, _, _ in entries])
    table = np.array([curve.ordered(signs.values) for curve, _, signs, _ in entries])
    first, last, place = entries[0][0], *entries[-1][:2]
    return Branch(
        model,
        parameter,
        first.kind,
        values,
        np.array([curve.first_state(place.u) for curve, place, _, _ in entries]),
        np.array([curve.period(place.u) for curve, place, _, _ in entries]),
        table,
        first.stable(table),
        last.mirrors_itself(place.u),
        np.array([a for _, _, _, a in entries]),
        tuple(points),
        ends,
        tuple((curve, place) for curve, place, _, _ in entries),
    )
