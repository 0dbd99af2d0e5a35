"""Test functions of bifurcations: what changes its sign where a branch bifurcates."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from .conservative_families import FamilyCurve
from .equilibrium_curve import EquilibriumCurve
from .floquet_multipliers import Multipliers, multipliers_at
from .flow_map import Floats
from .pseudo_arclength import CurvePoint
from .shooting_curve import PeriodicOrbitCurve

__all__ = ["FUNCTIONS", "TestFunctions", "test_functions_at"]

#: Which of the functions below is zero, by the kind of bifurcation.
FUNCTIONS = {
    "fold": "fold",
    "branch point": "unit_multiplier",
    "symmetry breaking": "period_doubling",
    "period doubling": "period_doubling",
    "Hopf": "complex_pair",
    "Neimark-Sacker": "complex_pair",
    "Krein collision": "collision",
}


@dataclass(frozen=True, eq=False)
class TestFunctions:
    """Test functions at a point on a branch, each zero at one kind of bifurcation; NaN where not decided.

    Attributes
    ----------
    fold : float
        The tangent's component along the parameter.
    unit_multiplier : float
        Zero where a multiplier is +1, or an eigenvalue 0: folds and branch points.
    period_doubling : float
        Zero where a multiplier is -1; NaN for equilibria.
    complex_pair : float
        Zero where two multipliers have the product 1, or two eigenvalues the sum 0: Neimark-Sacker and Hopf
        bifurcations where they are a complex pair.
    surfaces : ndarray
        Of equilibria: the functions of the law's switching surfaces.
    collision : float
        Of families where something is kept: zero where two pairs of multipliers meet, negative where they
        have left the unit circle (or the real axis) together; NaN with fewer pairs.
    values : ndarray of complex
        Multipliers across the flow of the map that closes the orbit, or eigenvalues.
    """

    fold: float
    unit_multiplier: float
    period_doubling: float
    complex_pair: float
    surfaces: Floats
    values: np.ndarray
    collision: float = float("nan")

    @property
    def pair(self) -> complex:
        """The complex number nearest to where a pair bifurcates, of positive imaginary part; 0 if none is."""
        turning = self.values[self.values.imag > 0]
        if not len(turning):
            return 0j
        away = np.abs(turning.real) if np.isnan(self.period_doubling) else np.abs(np.abs(turning) - 1.0)
        return complex(turning[np.argmin(away)])


def test_functions_at(curve: EquilibriumCurve | PeriodicOrbitCurve, place: CurvePoint) -> TestFunctions:
    """The functions at a point; for cycles they come from the runs that the point was corrected with."""
    fold = float(place.tangent[-1])
    if isinstance(curve, EquilibriumCurve):
        here = curve.at(place.u)
        matrix = here.by_state * curve.flow.clock
        values = np.linalg.eigvals(here.by_state).astype(complex)
        pairs = [a + b for a, b in combinations(values * curve.flow.clock, 2)]
        complex_pair = float(np.prod(pairs).real) if pairs else float("nan")
        return TestFunctions(
            fold, float(np.linalg.det(matrix)), float("nan"), complex_pair, here.surfaces, values
        )
    found = multipliers_at(curve, place.u)
    values = found.values
    if isinstance(curve, FamilyCurve) and found.decided:
        return _of_family(curve, place, found)
    if not found.decided:
        nothing = float("nan")
        return TestFunctions(fold, nothing, nothing, nothing, np.zeros(0), values)
    both = list(combinations(range(len(values)), 2))
    one, other = np.array(both, dtype=np.intp).reshape(-1, 2).T
    logs, phases = found.log[one] + found.log[other], found.phases[one] * found.phases[other]
    complex_pair = _less(logs, phases, 1.0) if both else float("nan")
    unit_multiplier, period_doubling = (_less(found.log, found.phases, unit) for unit in (1.0, -1.0))
    return TestFunctions(fold, unit_multiplier, period_doubling, complex_pair, np.zeros(0), values)


def _of_family(curve: FamilyCurve, place: CurvePoint, found: Multipliers) -> TestFunctions:
    """The functions where something is kept: one multiplier is 1, the others are pairs with the product 1.

    The fold is one of the kept quantity.
    """
    values = found.values
    others = np.delete(np.arange(len(values)), np.argmin(np.abs(values - 1.0)))
    log, phases = found.log[others], found.phases[others]
    first = place.tangent[: curve.flow.dim]
    fold = float(curve.slope(place.u) @ first) * np.sqrt(curve.pieces)
    unit_multiplier, period_doubling = (_less(log, phases, unit) for unit in (1.0, -1.0))
    return TestFunctions(
        fold,
        unit_multiplier,
        period_doubling,
        float("nan"),
        np.zeros(0),
        values,
        _discriminant(values[others]),
    )


def _discriminant(values: np.ndarray) -> float:
    """Return the scaled discriminant of the polynomial with the roots ``value + 1/value`` of two pairs.

    A simple zero where they meet, however near to each other the values themselves are there.
    """
    if len(values) != 4:
        return float("nan")
    sums = values.sum().real
    products = 0.5 * (values.sum() ** 2 - (values**2).sum()).real - 2.0
    return float((sums**2 - 4.0 * products) / (1.0 + sums**2 + abs(products)))


def _less(log: Floats, phases: np.ndarray, unit: float) -> float:
    """The product of ``(value - unit)/(1 + |value|)``, without overflow; values are ``phases * exp(log)``."""
    small = np.exp(-np.abs(log))
    inside = log <= 0.0
    parts = (np.where(inside, small, 1.0) * phases - np.where(inside, 1.0, small) * unit) / (1.0 + small)
    return float(np.prod(parts).real)
