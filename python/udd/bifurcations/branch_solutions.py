"""Equilibria and cycles on a branch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from udd.errors import IntegrationError

from .equilibrium_curve import EquilibriumCurve
from .equilibrium_search import equilibrium_at
from .error_bounds import rounding_of
from .flow_map import Floats
from .periodic_orbits import cycle_at
from .pseudo_arclength import CorrectorFailed, CurvePoint, natural_constraint, newton_corrector
from .shooting_curve import PeriodicOrbitCurve
from .solutions import Equilibrium, PeriodicOrbit

_SAMPLES = 12  # equilibria about a Hopf point, in which rounding shows,
_NEAR = 1e-5  # so near along the branch


def solution_at(curve: EquilibriumCurve | PeriodicOrbitCurve, u: Floats) -> Equilibrium | PeriodicOrbit:
    """The equilibrium or cycle with these unknowns."""
    if isinstance(curve, EquilibriumCurve):
        return equilibrium_at(curve.flow, curve.values_at(u), curve.state(u))
    return cycle_at(curve, u)


def lyapunov_error_of(curve: EquilibriumCurve, place: CurvePoint, error: float) -> float:
    """A bound of the error of the first Lyapunov coefficient where the parameter has this error.

    From the scatter of its values near by, and from how it changes along the branch.
    """
    near = np.linspace(-1.0, 1.0, _SAMPLES)
    seen = []
    for distance in (_NEAR * near).tolist():
        solution = solution_at(
            curve, newton_corrector(curve, place.u + distance * place.tangent, place.tangent)
        )
        seen.append(solution.lyapunov_coefficient if isinstance(solution, Equilibrium) else np.nan)
    powers = np.vander(near, 3)
    fitted = np.linalg.lstsq(powers, np.array(seen), rcond=None)[0]
    noise = float(np.abs(powers @ fitted - seen).max())
    off = error / max(abs(float(place.tangent[-1])) * curve.scale, 1e-300) / _NEAR
    return 2.0 * (noise + abs(float(fitted[1])) * off) + float(rounding_of(fitted[2]))


def solutions_at(
    places: Sequence[tuple[EquilibriumCurve | PeriodicOrbitCurve, CurvePoint]], values: Floats, value: float
) -> list[Equilibrium | PeriodicOrbit]:
    """The solutions at a value of the parameter, of a branch with these places at these values."""
    found = []
    for i in range(len(values) - 1):
        a, b = values[i], values[i + 1]
        if not min(a, b) <= value <= max(a, b) or (value == b and i + 2 < len(values)):
            continue
        curve, place = places[i if abs(value - a) <= abs(value - b) else i + 1]
        guess = place.u.copy()
        if abs(place.tangent[-1]) > 1e-3:
            guess = guess + place.tangent * ((value / curve.scale - guess[-1]) / place.tangent[-1])
        guess[-1] = value / curve.scale
        if isinstance(curve, PeriodicOrbitCurve):
            curve.fix_phase(place.u)
        try:
            found.append(
                solution_at(curve, newton_corrector(curve, guess, natural_constraint(guess), patience=20))
            )
        except (CorrectorFailed, IntegrationError):
            continue
    return found
