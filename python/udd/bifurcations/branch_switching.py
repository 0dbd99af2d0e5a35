"""Branch switching: from a bifurcation point to the branch that is born there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from udd.errors import IntegrationError, ModelError

from .bifurcation_location import changes
from .branch import AnyCurve, BifurcationPoint
from .equilibrium_curve import EquilibriumCurve, expansion
from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed, CurvePoint, corrected_point, dense_equations, tangent_at
from .shooting_curve import PeriodicOrbitCurve

__all__ = ["BIRTHS", "born_at", "doubled"]

_HALVINGS = 24
_BENT = 1.5  # Largest difference from 4 of the ratio of distances at an amplitude and at half of it.
_ROUNDING = 1e-6  # Size of a test function below which its sign is rounding.
_STILL = 1e-9  # Change below which the parameter is constant, as where a conservative cycle is born.


def born_at(point: BifurcationPoint, amplitude: float) -> tuple[AnyCurve, CurvePoint, float]:
    """Return the curve of the solutions that bifurcate at a point, a place on it, and the amplitude there.

    The place's tangent leads away. The amplitude is halved until nothing more bifurcates between the point
    and the place.
    """
    curve, place = point._curve, point._place
    if curve is None or place is None:
        raise ModelError("this bifurcation point was not made by udd.continuation")
    if point.kind not in BIRTHS:
        raise ModelError(f"no branch is born at a {point.kind}: the branch itself goes on")
    new, base, row = BIRTHS[point.kind](curve, place)
    begins = new.value(base)  # over the period a family of two rounds begins at twice the value

    def at(size: float) -> CurvePoint | None:
        try:
            return corrected_point(new, base + size * row, row, patience=20)
        except (CorrectorFailed, IntegrationError):
            return None

    # Nearer and nearer to the point: the branch may bend away from its first direction.
    for size in (amplitude * np.array([1.0, 0.3, 0.1, 3.0, 0.03])).tolist():
        begin = at(size)
        if begin is None:
            continue
        for _ in range(_HALVINGS):
            nearer = at(0.5 * size)
            if nearer is None or _nothing_between(new, point, begins, nearer, begin):
                break
            begin, size = nearer, 0.5 * size
        new = new.anchored(begin.u)
        return new, CurvePoint(begin.u, tangent_at(new, begin.u, row)), size
    where = f"the {point.kind} at {point.parameter} = {point.value:.10g}"
    raise ModelError(
        f"the branch born at {where} is not found at amplitudes of {0.03 * amplitude:.2g} to "
        f"{3 * amplitude:.2g}"
    )


def _nothing_between(
    curve: AnyCurve, point: BifurcationPoint, begins: float, half: CurvePoint, whole: CurvePoint
) -> bool:
    """Return True if a branch agrees with its normal form up to an amplitude and up to half of it.

    It `begins` at this value of the parameter.
    """
    before, after = curve.test_functions(half), curve.test_functions(whole)
    # A function that vanishes all along, as with a conserved energy, changes its sign by rounding.
    clear = [max(abs(getattr(s, name)) for s in (before, after)) for name in changes(before, after)]
    if any(size > _ROUNDING for size in clear):
        return False
    if point.kind == "branch point":
        return True
    # At birth no multiplier is negative: they are squares, or exponentials of eigenvalues.
    if after.period_doubling < 0.0:
        return False
    # The parameter moves with the square of the amplitude.
    first, last = (curve.value(place.u) - begins for place in (half, whole))
    still = abs(last) < _STILL * curve.scale
    return still or abs(last / first - 4.0) < _BENT if first else still


def doubled(curve: PeriodicOrbitCurve, place: CurvePoint) -> tuple[PeriodicOrbitCurve, Floats, Floats]:
    """Twice the time, and the direction in which the two rounds differ."""
    u = place.u
    values, vectors = np.linalg.eig(curve.monodromy(u))
    k = int(np.argmin(np.abs(values + 1.0)))
    along = vectors[:, k].real
    moves = [along]
    for matrix in curve.flight(u).by_state[:-1]:
        moves.append(matrix @ moves[-1])
    first = np.array(moves)
    new, base = curve.doubled(u)
    row = new.pack(np.vstack([first, -curve.mirror * first]), 0.0, 0.0)
    return new, base, row / np.linalg.norm(row)


def _from_rest(curve: EquilibriumCurve, place: CurvePoint) -> tuple[PeriodicOrbitCurve, Floats, Floats]:
    """Return an ellipse around the equilibrium."""
    flow, values, x = curve.flow, curve.values_at(place.u), curve.state(place.u)
    numbers, vectors = np.linalg.eig(expansion(flow, values, x).by_state)
    turning = np.flatnonzero(numbers.imag > 0)
    k = turning[np.argmin(np.abs(numbers[turning].real))]
    period = 2.0 * np.pi / float(numbers[k].imag)
    pieces = max(4, flow.pieces_for(period))
    phases = np.exp(2j * np.pi * np.arange(pieces) / pieces)
    away = np.outer(phases, vectors[:, k]).real
    ones, rest = np.ones(flow.dim), np.tile(x, (pieces, 1))
    new = PeriodicOrbitCurve(
        flow, curve.values, curve.parameter, curve.scale, period, pieces, ones, 0.0 * ones, rest, 0.0 * rest
    )
    base = new.pack(rest, period, curve.value(place.u))
    row = new.pack(away, 0.0, 0.0)
    # At rest there is no flow: the phase is that of the ellipse, along which the linear law turns.
    new = new.anchored_along(rest, away @ expansion(flow, values, x).by_state.T)
    return new, base, row / np.linalg.norm(row)


def _crossing(curve: AnyCurve, place: CurvePoint) -> tuple[AnyCurve, Floats, Floats]:
    """Return the other of two directions that the equations leave free."""
    free = np.linalg.svd(dense_equations(curve, place.u)[1])[2][-2:]
    rest = free - np.outer(free @ place.tangent, place.tangent)
    row = rest[np.argmax(np.linalg.norm(rest, axis=1))]
    return curve.anchored(place.u), place.u, row / np.linalg.norm(row)


#: Functions for the curve that is born at a kind of bifurcation, the solution there, and the direction.
BIRTHS: dict[str, Callable[[Any, CurvePoint], tuple[AnyCurve, Floats, Floats]]] = {
    "Hopf": _from_rest,
    "symmetry breaking": doubled,
    "period doubling": doubled,
    "branch point": _crossing,
}
