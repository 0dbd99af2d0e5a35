"""Equilibria as a curve over a parameter."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from udd import _core

from .bifurcation_functions import STILL, TURNING, TestFunctions
from .flow_map import Floats, FlowMap
from .pseudo_arclength import CurvePoint

__all__ = ["EquilibriumCurve", "expansion"]


@dataclass(frozen=True)
class Expansion:
    """The rates at a state, their derivatives, and the functions of the switching surfaces."""

    rate: Floats
    by_state: Floats
    by_parameter: Floats
    second: Floats
    third: Floats
    surfaces: Floats


def expansion(flow: FlowMap, values: Floats, x: Floats, higher: bool = False, t: float = 0.0) -> Expansion:
    """The rates' derivatives at a reduced state; second and third ones where `higher` asks for them."""
    model = flow.with_values(values)
    found = _core.expansion(model, t, flow.full(x).tolist(), higher)
    k = flow.kept
    second, third = found["second"], found["third"]
    if higher:
        second, third = second[np.ix_(k, k, k)], third[np.ix_(k, k, k, k)]
    by_parameter = found["by_parameter"][:, k]
    return Expansion(
        found["rate"][k], found["by_state"][np.ix_(k, k)], by_parameter, second, third, found["surfaces"]
    )


@dataclass(eq=False)
class EquilibriumCurve:
    """Scaled equilibria and the parameter: ``u = (x / size, parameter / scale)``.

    `values` are the model's parameters, of which the one with the index `parameter` is varied.
    """

    flow: FlowMap
    values: Floats
    parameter: int
    scale: float
    second: int = -1
    _rates: Floats = field(init=False)

    def __post_init__(self) -> None:
        # Rates are compared with what crosses the typical size in the typical time.
        self._rates = self.flow.clock / self.flow.size

    def with_second(self, index: int, value: float) -> EquilibriumCurve:
        """The curve at another value of a second parameter, by which derivatives are wanted too."""
        values = self.values.copy()
        values[index] = value
        return replace(self, values=values, second=index)

    def by_second(self, u: Floats, scale: float) -> Floats:
        """The scaled rates' derivatives by the second parameter, in these units of it."""
        column: Floats = self.at(u).by_parameter[self.second] * self._rates * scale
        return column

    def pack(self, x: Floats, value: float) -> Floats:
        """Unknowns from a state and the parameter's value."""
        return np.append(x / self.flow.size, value / self.scale)

    def state(self, u: Floats) -> Floats:
        """The reduced state."""
        return u[:-1] * self.flow.size

    @property
    def name(self) -> str:
        """The parameter's name."""
        return self.flow.names[self.parameter]

    def value(self, u: Floats) -> float:
        """The parameter's value."""
        return float(u[-1] * self.scale)

    def values_at(self, u: Floats) -> Floats:
        """All parameters."""
        values = self.values.copy()
        values[self.parameter] = self.value(u)
        return values

    def at(self, u: Floats) -> Expansion:
        """The rates and their first derivatives."""
        return expansion(self.flow, self.values_at(u), self.state(u))

    def equations(self, u: Floats) -> tuple[Floats, Floats]:
        """The scaled rates and their derivatives."""
        here = self.at(u)
        by_state = here.by_state * self._rates[:, None] * self.flow.size
        by_value = here.by_parameter[self.parameter] * self._rates * self.scale
        return here.rate * self._rates, np.column_stack([by_state, by_value])

    kind = "equilibrium"

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
        complex_pair, nothing = float(np.prod(pairs).real) if pairs else float("nan"), float("nan")
        determinant = float(np.linalg.det(here.by_state * self.flow.clock))
        fold = float(place.tangent[-1])
        return TestFunctions(fold, determinant, nothing, complex_pair, here.surfaces, values)

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
