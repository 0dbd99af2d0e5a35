"""Periodic orbits as a curve over a parameter: their multipliers, bifurcations, shapes and errors."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Any, ClassVar, Literal, Self

import numpy as np

from udd.errors import IntegrationError

from .bifurcation_functions import STILL, TURNING, TestFunctions, product_less
from .equilibrium_curve import EquilibriumCurve
from .error_bounds import COARSE, SURE, rounding_of, scatter
from .floquet_multipliers import Multipliers, multipliers_at
from .flow_map import Floats
from .orbit_geometry import as_liouville, crossings_of, distance_of_nodes, extremes_of
from .pseudo_arclength import CorrectorFailed, CurvePoint, natural_constraint, newton_corrector
from .shooting_equations import ShootingEquations
from .solutions import PeriodicOrbit

__all__ = ["PeriodicOrbitCurve"]

_COLLAPSED = 0.02  # Size relative to that before, below which an orbit is an equilibrium.
_SHORT = 200  # Largest number of pieces of a cycle for which rounding is measured.
_NEAR = 1e-5  # Distance of cycles in which it shows, in steps: within it the curve is a parabola.
_EXACT = 1e-11  # a singular value below this part of the largest is zero but for rounding


class PeriodicOrbitCurve(ShootingEquations):
    """Cycles that solve the equations of shooting over a parameter."""

    kind: ClassVar[Literal["cycle"]] = "cycle"
    follows_liouville, crossings, extremes = as_liouville, crossings_of, extremes_of

    def solution(self, u: Floats) -> PeriodicOrbit:
        """Return the cycle with these unknowns."""
        multipliers = self.ordered(multipliers_at(self, u).values)
        gap = float(np.abs(self.equations(u)[0]).max())
        nodes, model = self.flow.full(self.nodes(u)), self.flow.with_values(self.values_at(u))
        return PeriodicOrbit(
            model, nodes[0], self.period(u), multipliers, self.symmetric, nodes, gap, (self, u)
        )

    def multiplier_errors(self, u: Floats) -> Floats:
        """Return bounds of the errors of the multipliers over the period, to first order."""
        closing = multipliers_at(self, u)
        # A symmetric cycle's are the squares of those of half a round.
        rounds = 2.0 if self.symmetric else 1.0
        sizes = np.abs(closing.values) ** rounds
        errors: Floats = (rounds * sizes * closing.error)[np.argsort(-sizes, kind="stable")]
        return errors

    def period_error(self, u: Floats) -> float:
        """Return a bound of the error of the period: how far it moves if runs are less accurate.

        A member of a family has no bound unless its period or energy is fixed: less accurate runs find
        another.
        """
        if self.is_in_a_family(u):
            return float("nan")
        period, coarse = self.period(u), self.coarse()
        try:
            moved = coarse.period(newton_corrector(coarse, u, natural_constraint(u)))
        except (CorrectorFailed, IntegrationError):
            return float("nan")
        return float(abs(moved - period) + rounding_of(period))

    def kept_quantities(self, u: Floats) -> tuple[Floats, Floats]:
        """Left singular vectors (r, r) of the closing map less 1 with the flow, and singular values (r,).

        A value of zero belongs to a conserved quantity: its vector points along the gradient, which is the
        left eigenvector of the multiplier 1 across the flow.
        """
        closing = self.flow.scaled(self.monodromy(u))
        rate = self.flow.rates(self.values_at(u), self.nodes(u)[0]) * self.clock / self.flow.size
        left, sizes, _ = np.linalg.svd(np.column_stack([closing - np.eye(self.flow.dim), rate]))
        return left, sizes

    def is_in_a_family(self, u: Floats) -> bool:
        """Return True if cycles near by solve the equations at the same parameters, to rounding."""
        if self.flow.forcing is not None:
            return False
        _, sizes = self.kept_quantities(u)
        return bool(sizes[-1] < _EXACT * sizes[0])

    def _shape(self, u: Floats) -> Floats:
        """Return the scaled distances (m, r) of the nodes from their centre."""
        scaled = self.around(u) / self.flow.size
        shape: Floats = (scaled - scaled.mean(axis=0))[: self.pieces]
        return shape

    def size(self, u: Floats) -> float:
        """Return the root mean square of an orbit's distance from its centre, in typical sizes."""
        return float(np.linalg.norm(self._shape(u))) / float(np.sqrt(self.pieces))

    def vanishing_part(self, a: Floats, b: Floats) -> float | None:
        """Return the part of a step after which the orbit has no size; None if it keeps one.

        Beyond a Hopf point the branch returns on the mirrored amplitude: the same cycles half a period later.
        """
        before, after = self._shape(a), self._shape(b)
        first = float(np.linalg.norm(before))
        last = float((before * after).sum()) / first if first else 0.0
        return first / (first - last) if first > 0.0 and last <= _COLLAPSED * first else None

    def coarse(self) -> Self:
        """Return the curve with less accurate runs."""
        return replace(self, loose=COARSE)

    def closes(self, start: CurvePoint, curve: Any, here: CurvePoint, there: CurvePoint, step: float) -> bool:
        """Return True if a branch passes its start on this curve between two points that lie `step` apart.

        Cycles are compared without regard to where on them the first node lies.
        """
        # Period and parameter; then the orbits themselves.
        first, along = self._numbers(start.u), start.tangent[-2:]
        before, after = curve._numbers(here.u), curve._numbers(there.u)
        if not (before - first) @ along < 0.0 <= (after - first) @ along:
            return False
        if np.linalg.norm(after - first) > 1.5 * step or there.tangent[-2:] @ along <= 0.0:
            return False
        return distance_of_nodes(self, start.u, curve, there.u) < 1.5 * step

    def _numbers(self, u: Floats) -> Floats:
        """Return the scaled time and parameter."""
        return np.array([self.span(u) / self.clock, u[-1]])

    def doubled(self, u: Floats) -> tuple[Self, Floats]:
        """Return the curve of cycles that close after twice the time, and two rounds of this one on it."""
        nodes = self.nodes(u)
        rounds = np.vstack([nodes, self.mirror * (nodes - self.shift)])
        shift = self.shift + self.mirror * self.shift
        plain = np.ones(self.flow.dim)
        new = replace(self, pieces=2 * self.pieces, mirror=plain, shift=shift, share=2.0 * self.share)
        base = new.pack(rounds, 2.0 * self.span(u), self.value(u))
        return new.anchored(base), base

    def rests_near(self, x: Floats, u: Floats) -> tuple[EquilibriumCurve, Floats]:
        """Return the curve of equilibria over the same parameter, and a state as unknowns of it."""
        rests = EquilibriumCurve(self.flow, self.values, self.parameter, self.scale)
        return rests, rests.pack(x, self.value(u))

    def first_state(self, u: Floats) -> Floats:
        """Return the first node as a state (dim,) of the model."""
        return self.flow.full(self.nodes(u)[0])

    def mirrors_itself(self, u: Floats) -> bool:
        """Return True if the cycle is its own mirror image."""
        return self.symmetric

    def ordered(self, values: np.ndarray) -> np.ndarray:
        """Return the multipliers over the period, largest first, from those of the closing map."""
        around = values**2 + 0.0 if self.symmetric else values
        return around[np.argsort(-np.abs(around), kind="stable")]

    def stable(self, values: np.ndarray) -> np.ndarray:
        """Return True for each row of multipliers (n, r) that all lie inside the unit circle."""
        return np.asarray(np.all(np.abs(values) < 1, axis=1))

    def test_functions(self, place: CurvePoint) -> TestFunctions:
        """Return the test functions at a point, from the runs that the point was corrected with."""
        multipliers = multipliers_at(self, place.u)
        if not multipliers.decided:
            return TestFunctions(multipliers.values, float(place.tangent[-1]))
        return self._decided_functions(place, multipliers)

    def _decided_functions(self, place: CurvePoint, multipliers: Multipliers) -> TestFunctions:
        pairs = list(combinations(range(len(multipliers.values)), 2))
        one, other = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        logs, phases = (
            multipliers.log[one] + multipliers.log[other],
            multipliers.phases[one] * multipliers.phases[other],
        )
        complex_pair = product_less(logs, phases, 1.0) if pairs else float("nan")
        plus, minus = (product_less(multipliers.log, multipliers.phases, unit) for unit in (1.0, -1.0))
        return TestFunctions(multipliers.values, float(place.tangent[-1]), plus, minus, complex_pair)

    def location_error(
        self, a: CurvePoint, sigma: float, place: CurvePoint, step: float, name: str
    ) -> tuple[float, float]:
        """Return bounds of the errors of value and period at a zero: how far less accurate runs move both."""

        def at(distance: float, curve: PeriodicOrbitCurve = self) -> tuple[float, Floats]:
            there = curve.beside(a, distance)
            pair = np.array([curve.value(there.u), curve.period(there.u)])
            return float(getattr(curve.test_functions(there), name)), pair

        located = np.array([self.value(place.u), self.period(place.u)])
        aside = 1e-3 * step
        (low, first), (high, last) = at(sigma - aside), at(sigma + aside)
        moved, there = at(sigma, self.coarse())
        here, _ = at(sigma)
        shift = (moved - here) * (last - first) / (high - low) if high != low else np.zeros(2)
        value, period = rounding_of(located) + np.abs(there - located) + np.abs(shift)
        if self.pieces <= _SHORT:
            # Rounding is that of the largest numbers in the equations, which the value itself may not be.
            near = np.array([-1.0, -0.5, 0.5, 1.0])
            noise, fitted = scatter(near, np.array([at(sigma + _NEAR * step * x)[1] for x in near]), 2)
            noise = noise + np.abs(fitted[2] - located)
            value, period = value + SURE * noise[0], period + SURE * noise[1]
        return float(value), float(period)

    def kind_at(self, name: str, here: TestFunctions) -> str:
        """Return the kind of bifurcation at a zero of the function `name`; "" if nothing bifurcates."""
        if name == "complex_pair":
            pair = here.pair
            turns = abs(np.angle(pair)) > TURNING and abs(abs(pair) - 1.0) < 1e-5
            return "Neimark-Sacker" if turns else ""
        if name == "period_doubling":
            return "symmetry breaking" if self.symmetric else "period doubling"
        # Towards a connection the parameter hardly moves, and whether it turns is lost in rounding.
        return "fold" if name == "fold" or abs(here.fold) <= STILL else "branch point"

    def frequency(self, u: Floats, here: TestFunctions) -> float:
        """Return the frequency of the pair that bifurcates there, per unit of time."""
        return float(np.angle(here.pair)) / self.span(u)
