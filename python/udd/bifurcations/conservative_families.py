"""Cycles of a conservative model as a curve over their period or a conserved quantity."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from udd import _core
from udd.errors import ModelError
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .bifurcation_functions import TestFunctions, discriminant, product_less
from .condensation import CyclicEquations
from .floquet_multipliers import Multipliers
from .flow_map import Floats, FlowMap
from .pseudo_arclength import CurvePoint
from .shooting_curve import PeriodicOrbitCurve

__all__ = ["PERIOD", "Conserved", "FamilyCurve"]

PERIOD = "period"
"""The name of the parameter of a family without a given conserved quantity."""

_KEPT = 1e-9  # of the sizes of its terms: a rate of change below is zero
_PROBES = 16
_FREE = 1e-5  # a singular value below this part of the largest is that of the family


@dataclass(frozen=True, eq=False)
class Conserved:
    """A quantity that a model's motion keeps, as a formula of its states and parameters.

    Attributes
    ----------
    text : str
    law : FormulaModel
        The same states; the first of them has the quantity for its rate.
    """

    text: str
    law: FormulaModel

    @classmethod
    def of(cls, flow: FlowMap, text: str) -> Conserved:
        """Return the quantity with this formula."""
        model = flow.model
        states = list(model.state_names)
        try:
            law = FormulaModel(states, [text, *["0"] * (len(states) - 1)], _plain(model))
        except ModelError as error:
            known = ", ".join(flow.names) or "none"
            raise ModelError(
                f"{type(model).__name__} has no parameter {text!r}; it has {known}. "
                f"Nor is that {PERIOD!r} or the formula of a conserved quantity: {error}"
            ) from None
        made = cls(text, law)
        random = np.random.default_rng(6)
        for x in flow.size * random.uniform(-0.9, 0.9, (_PROBES, flow.dim)):
            _, slope = made.at(flow, x)
            parts = slope * model.rates(0.0, flow.full(x))[flow.kept]
            if abs(parts.sum()) > _KEPT * np.abs(parts).max(initial=0.0):
                raise ModelError(f"{text} is not kept along the motion of this model")
        return made

    def at(self, flow: FlowMap, x: Floats) -> tuple[float, Floats]:
        """Return the quantity at a reduced state, and its derivatives (r,)."""
        expansion = _core.expansion(self.law, 0.0, flow.full(x).tolist(), False)
        slope: Floats = expansion["by_state"][0, flow.kept]
        return float(expansion["rate"][0]), slope


def _plain(model: Model) -> dict[str, float]:
    return {name: value for name, value in model.parameters.items() if "." not in name}


@dataclass(eq=False)
class FamilyCurve(PeriodicOrbitCurve):
    """Scaled nodes of a cycle where something is kept, its time, and what singles it out of its family.

    Conservation makes one of the equations depend on the others. So the last gap may be of any size in the
    direction in which the quantity grows. This size is one more unknown, and zero in every solution (the
    unfolding of F. J. Munoz-Almaraz et al., Physica D 181 (2003) 1). If the family is followed over the
    period, this unknown has the place that the time has in other curves, and the time has the parameter's.
    Over a conserved quantity it is the difference of the orbit's quantity from the parameter.

    Attributes
    ----------
    conserved : Conserved or None
        By default the period singles cycles out.
    free : ndarray (r,)
        The direction of the last gap, in scaled coordinates.
    """

    family = True

    conserved: Conserved | None = None
    free: Floats | None = None

    def __post_init__(self) -> None:
        if self.conserved is None:
            self.scale = self.clock * (2.0 if self.symmetric else 1.0)

    @property
    def name(self) -> str:
        """The name of the quantity over which the family is followed."""
        return PERIOD if self.conserved is None else self.conserved.text

    def pack(self, nodes: Floats, span: float, value: float) -> Floats:
        """Unknowns from nodes (m, r), the time and the value of the conserved quantity."""
        u = super().pack(nodes, span, value)
        if self.conserved is None:
            u[-2:] = 0.0, span / self.clock
        return u

    def span(self, u: Floats) -> float:
        """Return the time until the orbit closes."""
        return float(u[-1 if self.conserved is None else -2] * self.clock)

    def anchored(self, u: Floats, first: bool = False) -> Self:
        """Return the curve with this orbit as the reference, and the direction in which its gap is free."""
        curve = super().anchored(u, first)
        curve.free = curve.slope(u)
        return curve

    def doubled(self, u: Floats) -> tuple[Self, Floats]:
        """Return the curve of cycles that close after twice the time, and two rounds of this one on it."""
        new, base = super().doubled(u)
        # Two rounds have the multiplier 1 twice here: one round separates conservation from bifurcation.
        new.free = self.slope(u)
        return new, base

    def in_unit(self, place: CurvePoint, scale: float) -> tuple[Self, CurvePoint]:
        """Return the curve and the place as they are: their unit is that of the period or of the quantity."""
        return self, place

    def is_in_a_family(self, u: Floats) -> bool:
        """Return False: the period or the conserved quantity singles the cycle out."""
        return False

    def slope(self, u: Floats) -> Floats:
        """Return the scaled direction (r,) in which the conserved quantity grows at the first node."""
        size, start = self.flow.size, self.nodes(u)[0]
        if self.conserved is not None:
            gradient: Floats = self.conserved.at(self.flow, start)[1] * size
            return gradient / (float(np.linalg.norm(gradient)) or 1.0)
        kept, sizes = self.kept_quantities(u)
        if self.free is None:
            return kept[:, -1]
        # Near a bifurcation the multiplier 1 comes twice as often: what is nearest to what was kept before.
        left = kept[:, np.append(sizes[:-1] < _FREE * sizes[0], True)]
        gradient = left @ (left.T @ self.free)
        return gradient / np.linalg.norm(gradient)

    def require_one(self, u: Floats) -> None:
        """Refuse cycles that do not come in a family of one dimension."""
        _, sizes = self.kept_quantities(u)
        kept = int((sizes < _FREE * sizes[0]).sum())
        if kept == 0:
            raise ModelError("no quantity is kept: cycles of this model do not come in families")
        if kept > 1:
            raise ModelError(f"{kept} quantities are kept, or the cycles near by all have the same period")

    def cyclic_equations(self, u: Floats) -> tuple[Floats, CyclicEquations]:
        """Return the scaled gaps, the last one with its free direction, and the phase, and derivatives."""
        residual, matrix = super().cyclic_equations(u)
        m, r = self.pieces, self.flow.dim
        free = self.slope(u) if self.free is None else self.free
        last, by_pair, pieces = slice((m - 1) * r, m * r), matrix.by_pair.copy(), matrix.pieces
        if self.conserved is None:
            residual[last] += free * u[-2]
            by_pair[:, :, 1] = by_pair[:, :, 0]
            by_pair[:, :, 0] = 0.0
            by_pair[-1, :, 0] = free
        else:
            # At the start of the last piece, whose gap then depends on no other node.
            at, slope = self.conserved.at(self.flow, self.nodes(u)[-1])
            residual[last] += free * (at - self.value(u)) / self.scale
            by_pair[-1, :, 1] = -free
            pieces = pieces.copy()
            pieces[-1] += np.outer(free, slope * self.flow.size * np.sqrt(m) / self.scale)
        return residual, replace(matrix, pieces=pieces, by_pair=by_pair)

    def _decided_functions(self, place: CurvePoint, multipliers: Multipliers) -> TestFunctions:
        """Return the functions where one multiplier is 1 and the others are pairs with the product 1.

        The fold is that of the kept quantity.
        """
        values = multipliers.values
        others = np.delete(np.arange(len(values)), np.argmin(np.abs(values - 1.0)))
        first = place.tangent[: self.flow.dim]
        fold = float(self.slope(place.u) @ first) * np.sqrt(self.pieces)
        plus, minus = (
            product_less(multipliers.log[others], multipliers.phases[others], unit) for unit in (1.0, -1.0)
        )
        return TestFunctions(values, fold, plus, minus, collision=discriminant(values[others]))

    def kind_at(self, name: str, here: TestFunctions) -> str:
        """Return the kind of bifurcation at a zero of the function `name`; "" if nothing bifurcates."""
        if name == "unit_multiplier":
            return "branch point"
        if name == "collision":
            # On the real axis: unstable before and after.
            turns = 1e-6 < abs(np.angle(here.pair)) < np.pi - 1e-6 and abs(abs(here.pair) - 1.0) <= 1e-3
            return "Krein collision" if turns else ""
        return super().kind_at(name, here)
