"""Equilibria as a curve over a parameter."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar, Literal

import numpy as np

from udd import _core

from .bifurcation_functions import STILL, TURNING, TestFunctions
from .error_bounds import SURE, rounding_of, scatter
from .flow_map import Floats, FlowMap
from .nonsmooth import next_corner
from .normal_forms import Derivatives, first_lyapunov_coefficient
from .pseudo_arclength import CurvePoint, corrected_point, newton_corrector
from .solution_curve import SolutionCurve
from .solutions import Equilibrium, kind_of_rest

__all__ = ["EquilibriumCurve", "equilibrium_at", "expansion"]

_SAMPLES = 12  # Equilibria about a Hopf point, in which rounding shows.
_NEAR = 1e-5  # Their distance along the branch.


@dataclass(frozen=True, eq=False)
class Expansion(Derivatives):
    """The rates at a state, their derivatives, and the functions of the switching surfaces."""

    rate: Floats
    by_parameter: Floats
    surfaces: Floats


def expansion(flow: FlowMap, values: Floats, x: Floats, higher: bool = False, t: float = 0.0) -> Expansion:
    """Return the rates' derivatives at a reduced state; with `higher` also the second and third ones."""
    model = flow.with_values(values)
    derivatives = _core.expansion(model, t, flow.full(x).tolist(), higher)
    k = flow.kept
    second, third = derivatives["second"], derivatives["third"]
    if higher:
        second, third = second[np.ix_(k, k, k)], third[np.ix_(k, k, k, k)]
    rate, by_state, by_parameter = (derivatives[name] for name in ("rate", "by_state", "by_parameter"))
    return Expansion(
        by_state[np.ix_(k, k)], second, third, rate[k], by_parameter[:, k], derivatives["surfaces"]
    )


def equilibrium_at(flow: FlowMap, values: Floats, x: Floats) -> Equilibrium:
    """Return the equilibrium at a state with its eigenvalues, kind and Lyapunov coefficient."""
    here = expansion(flow, values, x, higher=True)
    eigenvalues = np.linalg.eigvals(here.by_state).astype(complex)
    eigenvalues = eigenvalues[np.argsort(-eigenvalues.real, kind="stable")]
    residual = float(np.abs(here.rate * flow.clock / flow.size).max())
    coefficient = first_lyapunov_coefficient(here)
    model = flow.with_values(values)
    return Equilibrium(model, flow.full(x), eigenvalues, kind_of_rest(eigenvalues), residual, coefficient)


@dataclass(eq=False)
class EquilibriumCurve(SolutionCurve):
    """Scaled equilibria and the parameter: ``u = (x / size, parameter / scale)``."""

    @property
    def _rates(self) -> Floats:
        """The unit of the rates: they are compared with what crosses the typical size in the typical time."""
        unit: Floats = self.flow.clock / self.flow.size
        return unit

    def by_second(self, u: Floats, scale: float) -> Floats:
        """Return the scaled rates' derivatives by the second parameter, in these units of it."""
        column: Floats = self.at(u).by_parameter[self.second] * self._rates * scale
        return column

    def pack(self, x: Floats, value: float) -> Floats:
        """Unknowns from a state and the parameter's value."""
        return np.append(x / self.flow.size, value / self.scale)

    def state(self, u: Floats) -> Floats:
        """Return the reduced state."""
        return u[:-1] * self.flow.size

    def at(self, u: Floats) -> Expansion:
        """Return the rates and their first derivatives."""
        return expansion(self.flow, self.values_at(u), self.state(u))

    def equations(self, u: Floats) -> tuple[Floats, Floats]:
        """Return the scaled rates and their derivatives."""
        here = self.at(u)
        by_state = here.by_state * self._rates[:, None] * self.flow.size
        by_value = here.by_parameter[self.parameter] * self._rates * self.scale
        return here.rate * self._rates, np.column_stack([by_state, by_value])

    kind: ClassVar[Literal["equilibrium"]] = "equilibrium"
    corner_ahead = next_corner

    def solution(self, u: Floats) -> Equilibrium:
        """Return the equilibrium with these unknowns."""
        return equilibrium_at(self.flow, self.values_at(u), self.state(u))

    def lyapunov_error(self, place: CurvePoint, error: float) -> float:
        """Return a bound of the error of the first Lyapunov coefficient if the parameter has this error.

        From the scatter of its values near by, and from how it changes along the branch.
        """
        near = np.linspace(-1.0, 1.0, _SAMPLES)
        points = (newton_corrector(self, place.u + _NEAR * x * place.tangent, place.tangent) for x in near)
        noise, fitted = scatter(near, np.array([self.solution(u).lyapunov_coefficient for u in points]), 2)
        off = error / max(abs(float(place.tangent[-1])) * self.scale, 1e-300) / _NEAR
        return 2.0 * (float(noise) + abs(float(fitted[1])) * off) + float(rounding_of(fitted[2]))

    def normal_form(self, u: Floats) -> Derivatives:
        """Return the derivatives of which normal forms are made."""
        return expansion(self.flow, self.values_at(u), self.state(u), higher=True)

    def extremes(self, u: Floats) -> tuple[Floats, Floats]:
        """Return the least and the largest values of the components: twice the equilibrium."""
        state = self.first_state(u)
        return state, state

    def first_state(self, u: Floats) -> Floats:
        """Return the equilibrium as a state (dim,) of the model."""
        return self.flow.full(self.state(u))

    def period(self, u: Floats) -> float:
        """Return NaN: equilibria have no period."""
        return float("nan")

    def mirrors_itself(self, u: Floats) -> bool:
        """Return True if the equilibrium is its own mirror image."""
        mirror, x = self.flow.mirror, self.state(u)
        return mirror is not None and bool(np.allclose(mirror * x, x, atol=1e-12))

    def ordered(self, values: np.ndarray) -> np.ndarray:
        """Return eigenvalues with the largest real part first."""
        return values[np.argsort(-values.real, kind="stable")]

    def stable(self, values: np.ndarray) -> np.ndarray:
        """Return True for each row of eigenvalues (n, r) that all have negative real parts."""
        return np.asarray(np.all(values.real < 0, axis=1))

    def test_functions(self, place: CurvePoint) -> TestFunctions:
        """Return the test functions at a point."""
        here = self.at(place.u)
        values = np.linalg.eigvals(here.by_state).astype(complex)
        pairs = [a + b for a, b in combinations(values * self.flow.clock, 2)]
        complex_pair = float(np.prod(pairs).real) if pairs else float("nan")
        determinant = float(np.linalg.det(here.by_state * self.flow.clock))
        return TestFunctions(values, float(place.tangent[-1]), determinant, complex_pair=complex_pair)

    def location_error(
        self, a: CurvePoint, sigma: float, place: CurvePoint, step: float, name: str
    ) -> tuple[float, float]:
        """Return bounds of the errors of the value and of the period of the cycles born at a zero.

        They come from how those near by scatter about a curve: from the rounding of the test function.
        """
        distances = np.linspace(-1.0, 1.0, 2 * _SAMPLES)
        seen = []
        for distance in sigma + _NEAR * step * distances:
            there = corrected_point(self, a.u + distance * a.tangent, a.tangent)
            signs = self.test_functions(there)
            turning = abs(signs.pair.imag)
            period = 2.0 * np.pi / turning if name == "complex_pair" and turning else np.nan
            seen.append((float(getattr(signs, name)), self.value(there.u), period))
        noise, fitted = scatter(distances, np.array(seen), 2)
        slope = np.abs(fitted[1])
        # So far along the branch the zero may be off.
        off = noise[0] / slope[0] if slope[0] > noise[0] else 0.0
        value, period = SURE * (noise[1:] + off * slope[1:])
        return float(value + rounding_of(self.value(place.u))), float(period + rounding_of(seen[0][2]))

    def kind_at(self, name: str, here: TestFunctions) -> str:
        """Return the kind of bifurcation at a zero of the function `name`; "" if nothing bifurcates."""
        if name == "complex_pair":
            pair = here.pair  # two real ones make a neutral saddle
            turns = abs(pair.imag) * self.flow.clock > TURNING
            return "Hopf" if turns and abs(pair.real) < 1e-6 * abs(pair.imag) else ""
        return "fold" if name == "fold" or abs(here.fold) <= STILL else "branch point"

    def frequency(self, u: Floats, here: TestFunctions) -> float:
        """Return the frequency of the pair that bifurcates there, per unit of time."""
        return here.pair.imag
