"""Equilibria on a surface where the law changes: corners of their branches."""

from __future__ import annotations

import numpy as np

from .flow import Floats
from .path import Lost, Place, correct, tangent_at
from .rest_curve import RestCurve

__all__ = ["corner_ahead"]

_ON = 1e-13  # of the surface's function, relative to its change over the step
_BEYOND = 1e-7  # so far beyond the corner the law of the other side is asked, in scaled unknowns


def corner_ahead(curve: RestCurve, here: Place, step: float) -> tuple[Place, Place] | None:
    """The corner within the next step, if there is one.

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
    place = here
    for _ in range(30):
        value = float(curve.at(place.u).surfaces[j])
        if abs(value) <= _ON * scale:
            break
        # Newton's method on the near side, from which the curve is smooth.
        small = 1e-6
        slope = (float(curve.at(place.u + small * place.tangent).surfaces[j]) - value) / small
        distance = float(np.clip(-value / slope, -step, step)) if slope else 0.0
        try:
            u = correct(curve, place.u + distance * here.tangent, here.tangent)
        except Lost:
            return None
        side = np.sign(values[j])
        tangent = tangent_at(curve, u, here.tangent) if side * curve.at(u).surfaces[j] > 0 else place.tangent
        place = Place(u, tangent)
    else:
        return None
    leaving = _other_tangent(curve, place, j, float(np.sign(values[j])))
    return place, Place(place.u, leaving)


def _other_tangent(curve: RestCurve, place: Place, j: int, side: float) -> Floats:
    """The tangent that leaves a corner to the other side of surface `j`."""
    beyond = place.u + _BEYOND * place.tangent
    _, matrix = curve.equations(beyond)
    # What the equations of the other side leave free.
    tangent: Floats = np.linalg.svd(matrix)[2][-1]
    change = float(curve.at(place.u + _BEYOND * tangent).surfaces[j] - curve.at(place.u).surfaces[j])
    return tangent if change * side < 0.0 else -tangent
