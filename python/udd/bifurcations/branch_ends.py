"""Ends of branches of cycles: a Hopf point, the branch from which they bifurcate, or their start."""

from __future__ import annotations

import numpy as np

from udd.errors import IntegrationError

from .bifurcation_location import nearest_bifurcation
from .branch import AnyCurve, BifurcationPoint
from .equilibrium_curve import EquilibriumCurve
from .flow_map import Floats
from .periodic_orbits import half_of
from .pseudo_arclength import CorrectorFailed, CurvePoint, natural_constraint
from .shooting_curve import PeriodicOrbitCurve

__all__ = ["closes", "hopf_end", "origin_of", "size_of", "vanishing_part"]

_RATIO = 1.3  # Largest ratio of the cycle's period to that of the Hopf bifurcation.
_FARTHEST = 3.0  # Largest distance of the equilibrium from the cycle's centre, in sizes of the cycle.
_COLLAPSED = 0.02  # Size relative to that before, below which an orbit is an equilibrium.
_SHORTEST = 1e-4  # Shortest step along the other branch.


def vanishing_part(curve: AnyCurve, a: Floats, b: Floats) -> float | None:
    """Return the part of the step from `a` to `b` after which the orbit has no size; None if it keeps one.

    Beyond a Hopf point the branch returns on the mirrored amplitude: the same cycles, half a period later.
    """
    if not isinstance(curve, PeriodicOrbitCurve):
        return None
    before, after = _shape(curve, a), _shape(curve, b)
    first = float(np.linalg.norm(before))
    last = float((before * after).sum()) / first if first else 0.0
    return first / (first - last) if first > 0.0 and last <= _COLLAPSED * first else None


def size_of(curve: PeriodicOrbitCurve, u: Floats) -> float:
    """Return the root mean square of an orbit's distance from its centre, in typical sizes."""
    return float(np.linalg.norm(_shape(curve, u))) / float(np.sqrt(curve.pieces))


def _shape(curve: PeriodicOrbitCurve, u: Floats) -> Floats:
    scaled = curve.around(u) / curve.flow.size
    shape: Floats = (scaled - scaled.mean(axis=0))[: curve.pieces]
    return shape


def hopf_end(curve: PeriodicOrbitCurve, u: Floats) -> BifurcationPoint | None:
    """Return the Hopf bifurcation from which a small cycle comes, as the branch of equilibria has it."""
    flow, size, period = curve.flow, size_of(curve, u), curve.period(u)
    rest = EquilibriumCurve(flow, curve.values, curve.parameter, curve.scale)
    centre = curve.around(u).mean(axis=0)
    guess = rest.pack(centre, curve.value(u))
    step = max(0.3 * size, _SHORTEST)
    point = nearest_bifurcation(rest, guess, natural_constraint(guess), "Hopf", step)
    if point is None or not 1.0 / _RATIO < period / point.period < _RATIO:
        return None
    away = np.linalg.norm((flow.reduced(point.solution.state) - centre) / flow.size)
    return point if away < _FARTHEST * size + _SHORTEST else None


def origin_of(curve: PeriodicOrbitCurve, u: Floats, step: float) -> BifurcationPoint | None:
    """Return the doubling or symmetry breaking of the cycle whose halves are nearly the same."""
    try:
        kind, half, nodes = half_of(curve, u)
    except (CorrectorFailed, IntegrationError):
        return None
    if not kind:
        return None
    guess = half.pack(nodes, 0.5 * curve.span(u), curve.value(u))
    return nearest_bifurcation(half, guess, natural_constraint(guess), kind, 0.5 * step)


def closes(
    start: tuple[AnyCurve, CurvePoint], curve: AnyCurve, here: CurvePoint, there: CurvePoint, step: float
) -> bool:
    """Return True if the branch passes its start between two points that lie `step` apart.

    Cycles are compared without regard to where on them the first node lies.
    """
    first, place = start
    if isinstance(curve, PeriodicOrbitCurve) and isinstance(first, PeriodicOrbitCurve):
        # Period and parameter; then the orbits themselves.
        known, along = _numbers(first, place.u), place.tangent[-2:]
        before, after = _numbers(curve, here.u), _numbers(curve, there.u)
        if not (before - known) @ along < 0.0 <= (after - known) @ along:
            return False
        if np.linalg.norm(after - known) > 1.5 * step or there.tangent[-2:] @ along <= 0.0:
            return False
        return _distance(first, place.u, curve, there.u) < 1.5 * step
    if not isinstance(curve, type(first)):
        return False
    gaps = [(point.u - place.u) @ place.tangent for point in (here, there)]
    near = np.linalg.norm(there.u - place.u) < 1.5 * step
    return bool(gaps[0] < 0.0 <= gaps[1] and near and place.tangent @ there.tangent > 0.0)


def _numbers(curve: PeriodicOrbitCurve, u: Floats) -> Floats:
    return np.array([curve.span(u) / curve.clock, u[-1]])


def _distance(first: PeriodicOrbitCurve, u: Floats, second: PeriodicOrbitCurve, v: Floats) -> float:
    """Return the largest distance of an orbit's nodes from the polygon of the other, in typical sizes."""
    from .orbit_geometry import orbit_states

    flow = first.flow
    around = flow.reduced(orbit_states(second, v))
    nodes = first.around(u)
    gaps = nodes[:, None] - around[None]
    gaps = (gaps + flow.turns(gaps)) / flow.size
    sides = np.roll(around, -1, axis=0) - around
    sides = (sides + flow.turns(sides)) / flow.size
    squared = np.maximum((sides**2).sum(axis=1), 1e-300)
    part = np.clip((gaps * sides).sum(axis=2) / squared, 0.0, 1.0)
    away = np.linalg.norm(gaps - part[:, :, None] * sides, axis=2)
    return float(away.min(axis=1).max())
