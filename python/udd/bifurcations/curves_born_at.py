"""Curves that are born at points of codimension two: folds of cycles and homoclinic orbits."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from udd.errors import IntegrationError, ModelError

from .bifurcation_functions import FUNCTIONS
from .bifurcation_location import point_at
from .branch import BifurcationPoint
from .branch_continuation import continuation
from .connecting_orbits import Connection, connection
from .locus_points import LocusPoint
from .pseudo_arclength import CorrectorFailed
from .solution_surface import SurfacePoint

__all__ = ["BORN_AT"]

_STEPS = (0.1, 0.2, 0.05, 0.4, 0.02)  # along the curve of Hopf points, in scaled unknowns
_ROUNDS = 40.0  # periods of the Hopf bifurcation, up to which its cycles are followed


def fold_of_cycles_at(point: LocusPoint, bounds: Sequence[float]) -> BifurcationPoint:
    """Return the fold of the cycles near a Bautin point, at a nearby value of the second parameter."""
    inner = -point.coefficients["l2"]
    for hopf in _hopf_points(point):
        # The cycles turn on the side where the two coefficients differ in sign.
        if hopf.lyapunov_coefficient * inner <= 0.0:
            continue
        cycles = continuation(hopf, hopf.parameter, bounds, until="fold", max_points=200)
        if cycles.find("fold"):
            return cycles.find("fold")[0]
    raise ModelError(f"no fold of cycles is found near the Bautin point at {_where(point)}")


def homoclinic_at(point: LocusPoint, bounds: Sequence[float]) -> Connection:
    """Return the homoclinic orbit in which the cycles near a Bogdanov-Takens point end."""
    for hopf in _hopf_points(point):
        cycles = continuation(hopf, hopf.parameter, bounds, max_period=_ROUNDS * hopf.period, max_points=400)
        try:
            orbit = connection(cycles)
        except ModelError:
            continue
        if orbit.kind == "homoclinic":
            return orbit
    raise ModelError(f"no homoclinic orbit is found near the Bogdanov-Takens point at {_where(point)}")


def _where(point: LocusPoint) -> str:
    return ", ".join(f"{name} = {v:.6g}" for name, v in zip(point.parameters, point.values, strict=True))


def _hopf_points(point: LocusPoint) -> list[BifurcationPoint]:
    """Hopf points on the curve of them through a point, at several distances on both sides."""
    surface, place = point._surface, point._place
    if surface is None or place is None:
        raise ModelError("this point was not made by udd.locus")
    name, points = FUNCTIONS["Hopf"], []
    try:
        slope = surface.slope(place, name)
    except (CorrectorFailed, IntegrationError) as error:
        raise ModelError(f"the Hopf points near {_where(point)} cannot be followed: {error}") from None
    normal = slope / np.linalg.norm(slope)
    along = place.ahead(np.array([-normal[1], normal[0]]))
    for step in _STEPS:
        for sign in (1.0, -1.0):
            try:
                there = surface.zero(place, place.v + sign * step * along, normal, name, step)
                points += _as_hopf(there)
            except (CorrectorFailed, IntegrationError):
                continue
    return points


def _as_hopf(there: SurfacePoint) -> list[BifurcationPoint]:
    """Return the point as one of its branch over the first parameter; None without a complex pair."""
    signs = there.functions
    pair = signs.pair
    if abs(pair.imag) * there.curve.flow.clock < 1e-4 or abs(pair.real) > 1e-6 * abs(pair.imag):
        return []
    return [point_at(there.curve, "Hopf", there.place, signs)]


#: Functions for a point of the curve that is born at a kind of point of codimension two.
BORN_AT: dict[str, Callable[[LocusPoint, Sequence[float]], BifurcationPoint | Connection]] = {
    "Bautin": fold_of_cycles_at,
    "Bogdanov-Takens": homoclinic_at,
}
