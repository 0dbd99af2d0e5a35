"""Curves of solutions over a parameter: the base of those of equilibria and of cycles."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import numpy as np

from udd.errors import ModelError

from .bifurcation_functions import TestFunctions
from .flow_map import Floats, FlowMap
from .normal_forms import Derivatives
from .pseudo_arclength import (
    CorrectorFailed,
    CurvePoint,
    nearest_of_family,
    newton_corrector,
    tangent_at,
    zero_between,
)

__all__ = ["NO_PARAMETER", "SolutionCurve"]

NO_PARAMETER = -1
"""The index of a parameter that the model does not have: a cycle alone needs none."""


@dataclass(eq=False)
class SolutionCurve:
    """Scaled solutions and a parameter, the last of the unknowns.

    Attributes
    ----------
    flow : FlowMap
    values : ndarray
        The model's parameters; the one with the index `parameter` is varied (`NO_PARAMETER` for none).
    scale : float
        The unit of the parameter in the unknowns.
    second : int
        The index of another parameter by which derivatives are wanted, `NO_PARAMETER` for none.
    """

    family: ClassVar[bool] = False  # True for cycles that no parameter of the model singles out

    flow: FlowMap
    values: Floats
    parameter: int
    scale: float
    second: int = field(default=NO_PARAMETER, kw_only=True)

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
        if self.parameter != NO_PARAMETER:
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

    def in_unit(self, place: CurvePoint, scale: float) -> tuple[Self, CurvePoint]:
        """Return the curve with its parameter in another unit, and the place on it."""
        factor = np.append(np.ones(len(place.u) - 1), self.scale / scale)
        along = place.tangent * factor
        return replace(self, scale=scale), CurvePoint(place.u * factor, along / np.linalg.norm(along))

    def equations(self, u: Floats) -> tuple[Floats, Any]:
        """Return the residuals of the equations and their derivatives."""
        raise NotImplementedError

    def test_functions(self, place: CurvePoint) -> TestFunctions:
        """Return the test functions at a point."""
        raise NotImplementedError

    def beside(self, a: CurvePoint, distance: float) -> CurvePoint:
        """Return the point of the curve at a distance from `a`.

        Next to a branch point the equations leave a second direction free, in which rounding alone would move
        Newton's method: there it takes the shortest steps.
        """
        guess = a.u + distance * a.tangent
        try:
            u = newton_corrector(self, guess, a.tangent)
        except CorrectorFailed:
            u = nearest_of_family(self, guess, a.tangent)
        return CurvePoint(u, tangent_at(self, u, a.tangent))

    def refine(self, a: CurvePoint, step: float, name: str) -> tuple[float, CurvePoint]:
        """Return the zero of a test function between `a` and the point at the distance `step` after it."""

        def at(sigma: float) -> tuple[float, CurvePoint]:
            place = self.beside(a, sigma)
            return float(getattr(self.test_functions(place), name)), place

        return zero_between(at, step)

    def coarse(self) -> Self:
        """Return the curve with less accurate runs; that of equilibria has none."""
        return self

    def closes(self, start: CurvePoint, curve: Any, here: CurvePoint, there: CurvePoint, step: float) -> bool:
        """Return True if a branch passes its start on this curve between two points that lie `step` apart."""
        gaps = [(point.u - start.u) @ start.tangent for point in (here, there)]
        near = np.linalg.norm(there.u - start.u) < 1.5 * step
        return bool(gaps[0] < 0.0 <= gaps[1] and near and start.tangent @ there.tangent > 0.0)

    def span(self, u: Floats) -> float:
        """Return the time until the orbit closes: 0 for equilibria."""
        return 0.0

    def size(self, u: Floats) -> float:
        """Return the root mean square of an orbit's distance from its centre; infinite for equilibria."""
        return np.inf

    def vanishing_part(self, a: Floats, b: Floats) -> float | None:
        """Return the part of a step after which an orbit has no size; None if it keeps one."""
        return None

    def crossings(self, u: Floats, section: str | None, direction: str | None) -> Floats:
        """Return the states (k, dim) at which a cycle crosses a section."""
        raise ModelError("equilibria do not cross a section")

    def corner_ahead(self, here: CurvePoint, step: float) -> tuple[CurvePoint, CurvePoint] | None:
        """Return the corner within the next step with the tangents that arrive there and leave it."""
        return None

    def follows_liouville(self, u: Floats) -> bool:
        """Return True if the multipliers agree with the divergence along the orbit; equilibria have none."""
        return True

    def lyapunov_error(self, place: CurvePoint, error: float) -> float:
        """Return a bound of the error of the first Lyapunov coefficient; NaN for cycles, which have none."""
        return float("nan")

    def normal_form(self, u: Floats) -> Derivatives | None:
        """Return the derivatives of which normal forms are made; None for cycles."""
        return None
