"""Multiple shooting for periodic orbits: pieces of orbits, their gaps, and a phase condition."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from .condensation import CyclicEquations
from .flow_map import Floats, SegmentEnds
from .pseudo_arclength import CurvePoint, tangent_at
from .solution_curve import NO_PARAMETER, SolutionCurve

__all__ = ["ShootingEquations"]

_DENSE = 61  # equations up to which a dense matrix is as fast


def _planes(rates: Floats) -> Floats:
    """Orthonormal bases (m, r, r - 1) of the planes across these rates (m, r)."""
    m, r = rates.shape
    stacked = np.concatenate([rates[:, :, None], np.broadcast_to(np.eye(r), (m, r, r))], axis=2)
    # The first vector of each basis is along the flow, which the pieces take to one another.
    bases, _ = np.linalg.qr(stacked)
    return bases[:, :, 1:]


@dataclass(eq=False)
class ShootingEquations(SolutionCurve):
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
            wanted = tuple(index for index in (self.parameter, self.second) if index != NO_PARAMETER)
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
            by_own = 0.0 if self.parameter == NO_PARAMETER else float(by_values[self.parameter])
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
