"""Ends of branches of cycles: a Hopf point, the branch from which they bifurcate, or their start."""

from __future__ import annotations

import numpy as np

from udd.errors import IntegrationError

from .bifurcation_location import nearest_bifurcation
from .branch import AnyCurve, BifurcationPoint
from .flow_map import Floats
from .periodic_orbits import half_of
from .pseudo_arclength import CorrectorFailed, natural_constraint

__all__ = ["hopf_end", "origin_of"]

_RATIO = 1.3  # Largest ratio of the cycle's period to that of the Hopf bifurcation.
_FARTHEST = 3.0  # Largest distance of the equilibrium from the cycle's centre, in sizes of the cycle.
_SHORTEST = 1e-4  # Shortest step along the other branch.


def hopf_end(curve: AnyCurve, u: Floats) -> BifurcationPoint | None:
    """Return the Hopf bifurcation from which a small cycle comes, as the branch of equilibria has it."""
    if curve.kind != "cycle" or curve.family:
        return None
    flow, size, period = curve.flow, curve.size(u), curve.period(u)
    centre = curve.around(u).mean(axis=0)
    rest, guess = curve.rests_near(centre, u)
    step = max(0.3 * size, _SHORTEST)
    point = nearest_bifurcation(rest, guess, natural_constraint(guess), "Hopf", step)
    if point is None or not 1.0 / _RATIO < period / point.period < _RATIO:
        return None
    away = np.linalg.norm((flow.reduced(point.solution.state) - centre) / flow.size)
    return point if away < _FARTHEST * size + _SHORTEST else None


def origin_of(curve: AnyCurve, u: Floats, step: float) -> BifurcationPoint | None:
    """Return the doubling or symmetry breaking of the cycle whose halves are nearly the same."""
    if curve.kind != "cycle":
        return None
    try:
        kind, half, nodes = half_of(curve, u)
    except (CorrectorFailed, IntegrationError):
        return None
    if not kind:
        return None
    guess = half.pack(nodes, 0.5 * curve.span(u), curve.value(u))
    return nearest_bifurcation(half, guess, natural_constraint(guess), kind, 0.5 * step)
