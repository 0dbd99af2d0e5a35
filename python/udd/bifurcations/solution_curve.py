"""Curves of solutions over a parameter: the base of those of equilibria and of cycles."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

from .flow_map import Floats, FlowMap
from .pseudo_arclength import CurvePoint

__all__ = ["HELD", "SolutionCurve"]

HELD = -1
"""The index of a parameter that the model does not have: a cycle alone needs none."""


@dataclass(eq=False)
class SolutionCurve:
    """Scaled solutions and a parameter, the last of the unknowns.

    Attributes
    ----------
    flow : FlowMap
    values : ndarray
        The model's parameters; the one with the index `parameter` is varied (`HELD` for none).
    scale : float
        The unit of the parameter in the unknowns.
    second : int
        The index of another parameter by which derivatives are wanted, `HELD` for none.
    """

    flow: FlowMap
    values: Floats
    parameter: int
    scale: float
    second: int = field(default=HELD, kw_only=True)

    @property
    def name(self) -> str:
        """The parameter's name."""
        return self.flow.names[self.parameter]

    def value(self, u: Floats) -> float:
        """Return the parameter's value."""
        return float(u[-1] * self.scale)

    def values_at(self, u: Floats) -> Floats:
        """Return all parameters."""
        values = self.values.copy()
        if self.parameter != HELD:
            values[self.parameter] = self.value(u)
        return values

    def with_second(self, index: int, value: float) -> Self:
        """Return the curve at another value of a second parameter, with derivatives by it."""
        values = self.values.copy()
        values[index] = value
        return replace(self, values=values, second=index)

    def anchored(self, u: Floats) -> Self:
        """Return the curve with this solution as the reference of its phase, if it has a phase."""
        return self

    def prepared(self, place: CurvePoint) -> tuple[Self, CurvePoint]:
        """Return the curve for the next step from a place, and the place with its tangent there."""
        return self, place
