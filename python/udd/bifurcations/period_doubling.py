"""The next doubling of a cascade, solved for along the amplitude of the doubled cycle."""

from __future__ import annotations

import numpy as np

from udd.errors import IntegrationError

from .bifurcation_functions import TestFunctions
from .bifurcation_location import location_error, point_at
from .branch import BifurcationPoint, Branch
from .branch_continuation import branch_from
from .branch_following import BranchTrace, Station
from .branch_switching import doubled
from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed, CurvePoint, corrected_point
from .shooting_curve import PeriodicOrbitCurve

__all__ = ["next_doubling"]

_KIND = "period doubling"
_MOST = 12  # Largest number of orbits of the secant method.
_NOISE = 1e-5  # Size of the test function that may be rounding.
_EXACT = 1e-11  # Relative error of the square of the amplitude, where the secant method ends.
_WAY = (0.1, 0.5, 1.0)  # Parts of the expected square: each orbit is the guess of the next.
_FARTHEST = 1e4  # Largest ratio of the expected square to that of the first amplitude.


def next_doubling(point: BifurcationPoint, ahead: float, amplitude: float) -> Branch:
    """Return the branch born at a doubling, up to the doubling of its own: a few points of it.

    The next one is about `ahead` off in the parameter; the branch is looked for first at a small `amplitude`.
    By the normal form, parameter and multiplier are nearly linear in the square of the amplitude. The bend of
    the parameter says where the next doubling is expected, and the secant method finds the multiplier -1.
    CorrectorFailed: it is not there.
    """
    curve, start = point._curve, point._place
    if not isinstance(curve, PeriodicOrbitCurve) or start is None:
        raise CorrectorFailed("the point is not one of a cycle")
    new, base, row = doubled(curve, start)
    orbits: dict[float, tuple[CurvePoint, TestFunctions]] = {}

    def at(square: float, near: Floats) -> Floats:
        """Return the orbit at the square of an amplitude, from another one."""
        before = float(row @ (near - base))
        bent = near - base - before * row
        # The part across the amplitude grows with its square.
        guess = base + square**0.5 * row + bent * (square / before**2 if before else 0.0)
        try:
            place = corrected_point(new, guess, row)
        except IntegrationError as error:
            raise CorrectorFailed(str(error)) from None
        orbits[square] = place, new.test_functions(place)
        return place.u

    square = amplitude**2
    u = at(square, base)
    for part in _WAY:
        expected = ahead * square / (new.value(u) - point.value)
        if not 0.0 < expected < _FARTHEST * amplitude**2:
            raise CorrectorFailed("the branch does not lead there")
        square = part * expected
        u = at(square, u)
    value = orbits[square][1].period_doubling
    # From the birth to the doubling the multiplier falls from 1 to -1: half of it and 1, nearly along a line.
    other = square * (1.0 + float(np.clip(value, -0.3, 0.3)))
    for _ in range(_MOST):
        if not 0.0 < other < 4.0 * square:
            raise CorrectorFailed("the multiplier does not fall to -1")
        if abs(other - square) <= _EXACT * square:
            break
        u = at(other, u)
        before, value = value, orbits[other][1].period_doubling
        if abs(before) < _NOISE and abs(value) >= 0.5 * abs(before):
            break  # as near as rounding lets it come
        if not np.isfinite(value) or value == before:
            raise CorrectorFailed("the multiplier does not fall to -1")
        square, other = other, other - value * (other - square) / (value - before)
    else:
        raise CorrectorFailed("the secant method does not converge")
    place, signs = orbits[square]
    size = square**0.5
    errors = location_error(
        new, CurvePoint(place.u - size * place.tangent, place.tangent), size, place, size, "period_doubling"
    )
    own = point_at(new, _KIND, place, signs, size, errors)
    # Orbits beyond the doubling, from the secant method, are left out.
    places = [Station(new, *orbits[s], s**0.5) for s in sorted(orbits) if s <= square]
    way = BranchTrace(places, [own], "the point that was wanted")
    return branch_from([way], point.solution.model, point.parameter, f"born at a {_KIND}")
