"""Border collisions: equilibria on a surface where the law changes, corners of their branches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed, CurvePoint, corrected_point

if TYPE_CHECKING:
    from .equilibrium_curve import EquilibriumCurve

__all__ = ["next_corner"]

_ON = 1e-13  # Size of the surface's function, relative to its change over the step, that is zero.
_PART = 0.7  # Longest step, in distances to the surface.
_LAST = 3e-8  # Longest last step: the square of it is rounding.
_SMALL = 1e-6  # Step for the slope of the surface's function along the branch.
_BEYOND = 1e-7  # Distance beyond the corner at which the other law is evaluated, in scaled unknowns.


def next_corner(
    curve: EquilibriumCurve, here: CurvePoint, step: float
) -> tuple[CurvePoint, CurvePoint] | None:
    """Return the corner within the next step, or None.

    The place with the tangent that arrives there, and with the tangent that leaves it.
    """
    values = curve.at(here.u).surfaces
    if not len(values):
        return None
    ahead = curve.at(here.u + step * here.tangent).surfaces
    crossed = [j for j in range(len(values)) if values[j] * ahead[j] < 0.0]
    if not crossed:
        return None
    j = min(crossed, key=lambda j: values[j] / (values[j] - ahead[j]))
    scale = abs(float(values[j] - ahead[j]))
    if abs(values[j]) <= 1e3 * _ON * scale:
        return None  # it starts on the corner
    side = float(np.sign(values[j]))
    place = _approached(curve, here, j, side, step)
    if place is None:
        return None
    leaving = _other_tangent(curve, place, j, side)
    return place, CurvePoint(place.u, leaving)


def _approached(
    curve: EquilibriumCurve, here: CurvePoint, j: int, side: float, step: float
) -> CurvePoint | None:
    """Return the corner at which a branch arrives on surface `j`.

    Behind the surface the branch may not go on, so that Newton's method never steps over it: all but the last
    step end before.
    """
    place, part = here, _PART
    for _ in range(100):
        value = float(curve.at(place.u).surfaces[j])
        back = place.u - _SMALL * place.tangent
        slope = (value - float(curve.at(back).surfaces[j])) / _SMALL
        if slope * side >= 0.0:
            return None  # the branch has turned away
        distance = -value / slope
        if distance < _LAST:
            # The remaining piece of the curve is straight to rounding.
            return CurvePoint(place.u + distance * place.tangent, place.tangent)
        guess = place.u + part * min(distance, step) * place.tangent
        try:
            there = corrected_point(curve, guess, place.tangent)
            if side * float(curve.at(there.u).surfaces[j]) <= 0.0:
                raise CorrectorFailed("the step leads over the surface")
        except CorrectorFailed:
            part *= 0.5
            continue
        place = there
    return None


def _other_tangent(curve: EquilibriumCurve, place: CurvePoint, j: int, side: float) -> Floats:
    """Return the tangent that leaves a corner to the other side of surface `j`."""
    beyond = place.u + _BEYOND * place.tangent
    _, matrix = curve.equations(beyond)
    # The direction that the equations of the other side leave free.
    tangent: Floats = np.linalg.svd(matrix)[2][-1]
    change = float(curve.at(place.u + _BEYOND * tangent).surfaces[j] - curve.at(place.u).surfaces[j])
    return tangent if change * side < 0.0 else -tangent
