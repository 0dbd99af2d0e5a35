"""Periodic orbits as a curve over a parameter: multiple shooting with a phase condition."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Any, ClassVar, Literal, Self

import numpy as np

from udd.errors import IntegrationError

from .bifurcation_functions import STILL, TURNING, TestFunctions, product_less
from .condensation import CyclicEquations
from .equilibrium_curve import EquilibriumCurve
from .error_bounds import COARSE, rounding_of
from .floquet_multipliers import Multipliers, multipliers_at
from .flow_map import Floats, SegmentEnds
from .orbit_geometry import as_liouville, crossings_of, distance_of_nodes, extremes_of
from .pseudo_arclength import CorrectorFailed, CurvePoint, natural_constraint, newton_corrector, tangent_at
from .solution_curve import HELD, SolutionCurve
from .solutions import PeriodicOrbit

__all__ = ["PeriodicOrbitCurve"]

_DENSE = 61  # equations up to which a dense matrix is as fast
_COLLAPSED = 0.02  # Size relative to that before, below which an orbit is an equilibrium.
_EXACT = 1e-11  # a singular value below this part of the largest is zero but for rounding


def _planes(rates: Floats) -> Floats:
    """Orthonormal bases (m, r, r - 1) of the planes across these rates (m, r)."""
    m, r = rates.shape
    stacked = np.concatenate([rates[:, :, None], np.broadcast_to(np.eye(r), (m, r, r))], axis=2)
    # The first vector of each basis is along the flow, which the pieces take to one another.
    bases, _ = np.linalg.qr(stacked)
    return bases[:, :, 1:]


@dataclass(eq=False)
class PeriodicOrbitCurve(SolutionCurve):
    """Scaled nodes of an orbit that closes after the time `span`, and that time, and the parameter.

    The orbit is cut into pieces of equal time. The end of the last one, reflected by the signs of `mirror`
    and turned by `shift`, must be the start of the first one. So a symmetric cycle is followed over half its
    period. The phase is fixed by an integral condition: all nodes together do not move
    along the flow of a reference orbit. That of a forced model is fixed by the time, and instead the orbit
    lasts as long as the forcing says.

    Attributes
    ----------
    clock : float
        The unit of time in the unknowns.
    pieces : int
    mirror : ndarray (r,)
        Signs, all of them +1 where there is no mirror.
    shift : ndarray (r,)
        Turns of angles that are added at the end.
    reference, across : ndarray (m, r)
        The nodes of the reference orbit, and the weights of the nodes' distances from them.
    share : float
        The number of the forcing's periods after which the orbit closes.
    loose : float
        Multiplies the tolerances of the runs.
    """

    clock: float
    pieces: int
    mirror: Floats
    shift: Floats
    reference: Floats
    across: Floats
    share: float = 1.0
    loose: float = 1.0
    _last: dict[bytes, SegmentEnds] = field(default_factory=dict, init=False, repr=False)

    def pack(self, nodes: Floats, span: float, value: float) -> Floats:
        """Unknowns from nodes (m, r), the time and the parameter's value."""
        weight = 1.0 / np.sqrt(self.pieces)
        scaled = (nodes / self.flow.size * weight).ravel()
        return np.append(scaled, [span / self.clock, value / self.scale])

    def nodes(self, u: Floats) -> Floats:
        """Return the nodes (m, r)."""
        nodes: Floats = u[:-2].reshape(self.pieces, -1) * self.flow.size * np.sqrt(self.pieces)
        return nodes

    def span(self, u: Floats) -> float:
        """Return the time until the orbit closes."""
        return float(u[-2] * self.clock)

    @property
    def symmetric(self) -> bool:
        """True if the orbit closes in the mirror, after half its period."""
        return bool((self.mirror < 0).any())

    def period(self, u: Floats) -> float:
        """Return the time until the orbit is back at its start."""
        return self.span(u) * (2.0 if self.symmetric else 1.0)

    def anchored(self, u: Floats, first: bool = False) -> Self:
        """Return the curve with this orbit as the reference, or with the `first` of its nodes alone."""
        if self.flow.forcing is not None:
            return self
        rates = self.flow.rates(self.values_at(u), self.nodes(u), self.begins(u))
        if first:
            rates[1:] = 0.0
        return self.anchored_along(self.nodes(u), rates)

    def anchored_along(self, nodes: Floats, rates: Floats) -> Self:
        """Return the curve of orbits that do not move along these rates (m, r) from reference nodes."""
        across = rates / np.linalg.norm(rates / self.flow.size) / self.flow.size**2
        curve = replace(self, reference=nodes, across=across)
        curve._last = self._last  # runs do not depend on the phase
        return curve

    def begins(self, u: Floats) -> Floats:
        """Return the times at which the pieces begin (m,); 0 without a forcing."""
        if self.flow.forcing is None:
            return np.zeros(self.pieces)
        return np.linspace(0.0, self.span(u), self.pieces, endpoint=False)

    def prepared(self, place: CurvePoint) -> tuple[Self, CurvePoint]:
        """Return the curve with its phase fixed here, cut into enough pieces, and the place on it."""
        flow, m, u, row = self.flow, self.pieces, place.u, place.tangent
        fine, wanted = self, flow.pieces_for(self.span(u))
        if 2 * wanted > 3 * m:
            times = -(-wanted // m)
            nodes, values = [self.nodes(u)], self.values_at(u)
            share, begins = np.full(m, self.span(u) / (m * times)), self.begins(u)
            for k in range(times - 1):
                nodes.append(flow.fly(values, nodes[-1], share, t=begins + k * share).x)
            fine = replace(self, pieces=m * times)
            packed = np.stack(nodes, axis=1).reshape(m * times, flow.dim)
            u = fine.pack(packed, self.span(u), self.value(u))
            along = np.zeros((m, times, flow.dim))
            along[:, 0] = row[:-2].reshape(m, flow.dim)
            row = np.append(along.ravel(), row[-2:])
        fine = fine.anchored(u)
        return fine, CurvePoint(u, tangent_at(fine, u, row))

    def around(self, u: Floats) -> Floats:
        """Return nodes all around the cycle, those of the mirrored half too."""
        nodes = self.nodes(u)
        return np.vstack([nodes, self.mirror * nodes]) if self.symmetric else nodes

    def speeds(self, u: Floats) -> Floats:
        """Return the speeds (m,) at the nodes, in typical sizes per typical time."""
        flow = self.flow
        rates = flow.rates(self.values_at(u), self.nodes(u))
        speeds: Floats = np.linalg.norm(rates * flow.clock / flow.size, axis=1)
        return speeds

    @cached_property
    def _signs(self) -> Floats:
        """Signs (m, r) of the ends of the pieces: the last one is mirrored."""
        signs = np.ones((self.pieces, self.flow.dim))
        signs[-1] = self.mirror
        return signs

    def flight(self, u: Floats) -> SegmentEnds:
        """Return the ends of the pieces, with derivatives by the parameter."""
        key = u.tobytes()
        if key not in self._last:
            spans = np.full(self.pieces, self.span(u) / self.pieces)
            wanted = tuple(index for index in (self.parameter, self.second) if index != HELD)
            ends = self.flow.fly(self.values_at(u), self.nodes(u), spans, wanted, self.loose, self.begins(u))
            self._last.clear()
            self._last[key] = ends
        return self._last[key]

    def equations(self, u: Floats) -> tuple[Floats, Floats | CyclicEquations]:
        """Return the scaled gaps between the pieces and the phase, and their derivatives."""
        residual, matrix = self.cyclic_equations(u)
        return residual, matrix.toarray() if len(residual) <= _DENSE else matrix

    def cyclic_equations(self, u: Floats) -> tuple[Floats, CyclicEquations]:
        """Return the same with the derivatives piece by piece."""
        m, r, size = self.pieces, self.flow.dim, self.flow.size
        weight = 1.0 / np.sqrt(m)
        nodes, flight = self.nodes(u), self.flight(u)
        turn = self._signs
        ends = flight.x * turn
        ends[-1] += self.shift
        gaps = (ends - np.roll(nodes, -1, axis=0)) / size
        by_state = self.flow.scaled(flight.by_state * turn[:, :, None]) / weight
        by_span = flight.rate * turn / size * (self.clock / m)
        by_value = flight.by_parameter[:, :, 0] * turn / size * self.scale
        forcing = self.flow.forcing
        if forcing is None:
            phase, along = float((self.across * (nodes - self.reference)).sum()), self.across * size / weight
            last = np.zeros(2)
        else:
            # A piece also begins later if the pieces before it take longer.
            rates = self.flow.rates(self.values_at(u), self.nodes(u), self.begins(u))
            moved = flight.rate - np.einsum("mij,mj->mi", flight.by_state, rates)
            by_span = by_span + moved * turn / size * (np.arange(m)[:, None] * self.clock / m)
            period, by_values = forcing.period(self.values_at(u))
            phase, along = (self.span(u) - self.share * period) / self.clock, np.zeros((m, r))
            by_own = 0.0 if self.parameter == HELD else float(by_values[self.parameter])
            last = np.array([1.0, -self.share * by_own * self.scale / self.clock])
        residual = np.append(gaps.ravel(), phase)
        by_pair = np.stack([by_span, by_value], axis=2)
        return residual, CyclicEquations(by_state, 1.0 / weight, by_pair, along, last)

    def by_second(self, u: Floats, scale: float) -> Floats:
        """Return the equations' derivatives by the second parameter, in these units of it."""
        turn = self._signs
        by_value = self.flight(u).by_parameter[:, :, 1] * turn / self.flow.size * scale
        phase, forcing = 0.0, self.flow.forcing
        if forcing is not None:
            by_values = forcing.period(self.values_at(u))[1]
            phase = -self.share * float(by_values[self.second]) * scale / self.clock
        return np.append(by_value.ravel(), phase)

    def monodromy(self, u: Floats) -> Floats:
        """Return the derivative (r, r) of the map from the first node to where the orbit closes."""
        product = np.eye(self.flow.dim)
        for matrix in self.flight(u).by_state:
            product = matrix @ product
        return self.mirror[:, None] * product

    def factors_across(self, u: Floats) -> Floats:
        """Return the pieces' derivatives (m, r - 1, r - 1) from plane to plane across the flow, scaled.

        Their product has the multipliers of the map that closes the orbit, the one along the flow left out.
        A forced model keeps the whole derivatives (m, r, r), with all multipliers of the stroboscopic map.
        """
        size, flight = self.flow.size, self.flight(u)
        turn = self._signs
        scaled = self.flow.scaled(flight.by_state * turn[:, :, None])
        if self.flow.forcing is not None:
            return np.ascontiguousarray(scaled)
        # The next piece begins at the end of this one, in the same plane.
        after = _planes(flight.rate * turn / size)
        before = np.roll(after, 1, axis=0)
        factors: Floats = np.swapaxes(after, 1, 2) @ scaled @ before
        return np.ascontiguousarray(factors)

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
