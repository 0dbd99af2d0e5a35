"""Test functions of bifurcations: what changes its sign where a branch bifurcates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .flow_map import Floats

__all__ = ["FUNCTIONS", "STILL", "TURNING", "TestFunctions", "discriminant", "product_less"]

STILL = 1e-5  # a tangent with less of the parameter
TURNING = 1e-6  # a pair with a smaller imaginary part (in radians) is none

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
    values : ndarray of complex
        Multipliers across the flow of the map that closes the orbit, or eigenvalues.
    fold : float
        The tangent's component along the parameter.
    unit_multiplier : float
        Zero where a multiplier is +1, or an eigenvalue 0: folds and branch points.
    period_doubling : float
        Zero where a multiplier is -1; NaN for equilibria.
    complex_pair : float
        Zero where two multipliers have the product 1, or two eigenvalues the sum 0: Neimark-Sacker and Hopf
        bifurcations where they are a complex pair.
    collision : float
        For families with a conserved quantity: zero where two pairs of multipliers meet, negative where they
        have left the unit circle (or the real axis) together; NaN with fewer pairs.
    """

    values: np.ndarray
    fold: float
    unit_multiplier: float = float("nan")
    period_doubling: float = float("nan")
    complex_pair: float = float("nan")
    collision: float = float("nan")

    @property
    def pair(self) -> complex:
        """The complex number nearest to where a pair bifurcates, of positive imaginary part; 0 if none is."""
        turning = self.values[self.values.imag > 0]
        if not len(turning):
            return 0j
        away = np.abs(turning.real) if np.isnan(self.period_doubling) else np.abs(np.abs(turning) - 1.0)
        return complex(turning[np.argmin(away)])


def discriminant(values: np.ndarray) -> float:
    """Return the scaled discriminant of the polynomial with the roots ``value + 1/value`` of two pairs.

    A simple zero where they meet, however near to each other the values themselves are there.
    """
    if len(values) != 4:
        return float("nan")
    sums = values.sum().real
    products = 0.5 * (values.sum() ** 2 - (values**2).sum()).real - 2.0
    return float((sums**2 - 4.0 * products) / (1.0 + sums**2 + abs(products)))


def product_less(log: Floats, phases: np.ndarray, unit: float) -> float:
    """Return the product of ``(value - unit)/(1 + |value|)`` of the values ``phases * exp(log)``."""
    small = np.exp(-np.abs(log))
    inside = log <= 0.0
    parts = (np.where(inside, small, 1.0) * phases - np.where(inside, 1.0, small) * unit) / (1.0 + small)
    return float(np.prod(parts).real)
