"""Saddle-nodes on invariant circles (SNIC): cycles that end where two equilibria are born on them."""

from __future__ import annotations

import numpy as np
from scipy import optimize

from udd.errors import IntegrationError

from .bifurcation_location import nearest_bifurcation
from .branch import BifurcationPoint, Branch
from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed
from .shooting_curve import PeriodicOrbitCurve

__all__ = ["saddle_node_on"]

_BESIDE = 1e-2  # Distance from the fold, along the branch of equilibria, where its location starts.
_NEAR = 0.5  # Largest distance of the fold from the slowest node of the cycle, in typical sizes.
_GROWN = 1.2  # Growth of the period over the places that are compared.
_AGREES = 1.3  # Largest factor by which the square of the period times the distance changes.


def saddle_node_on(branch: Branch, curve: PeriodicOrbitCurve, u: Floats) -> BifurcationPoint | None:
    """Find the fold of equilibria at which the longest cycles of a branch end, or None; `u` is the longest.

    The period grows there with the inverse square root of the distance in the parameter, not with its
    logarithm, as towards an orbit homoclinic to a saddle.
    """
    fold = _fold_near(curve, u)
    if fold is None:
        return None
    near = np.flatnonzero(branch.periods >= branch.periods.max() / _GROWN**3)
    away, periods = np.abs(branch.values[near] - fold.value), branch.periods[near]
    if periods.max() < _GROWN * periods.min():
        return None
    square = periods**2 * away
    return fold if square.min() > 0.0 and square.max() < _AGREES * square.min() else None


def _fold_near(curve: PeriodicOrbitCurve, u: Floats) -> BifurcationPoint | None:
    """Return the fold of equilibria near the slowest node of a cycle."""
    flow, slow = curve.flow, curve.nodes(u)[int(np.argmin(curve.speeds(u)))]
    rests, begin = curve.rests_near(slow, u)

    def equations(y: Floats) -> Floats:
        residual, matrix = rests.equations(y)
        return np.append(residual, np.linalg.det(matrix[:, :-1]))

    try:
        found = optimize.root(equations, begin)
        guess = found.x
        if not found.success or np.linalg.norm(rests.state(guess) / flow.size - slow / flow.size) > _NEAR:
            return None
        along = np.linalg.svd(rests.equations(guess)[1])[2][-1]
        return nearest_bifurcation(rests, guess - _BESIDE * along, along, "fold", 2.0 * _BESIDE)
    except (CorrectorFailed, IntegrationError, ValueError, np.linalg.LinAlgError):
        return None
