"""Equilibria as a curve over a parameter."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from udd import _core

from .flow_map import Floats, FlowMap

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
