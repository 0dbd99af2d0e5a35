"""Saddle cycles with one multiplier alone on its side of the unit circle, and the plane across their flow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from udd.errors import ModelError

from .branch import Branch, cycles_of
from .flow_map import Floats, FlowMap
from .shooting_curve import PeriodicOrbitCurve
from .solutions import PeriodicOrbit

__all__ = ["SaddleCycle", "saddle_at", "saddles_of"]

_LANDINGS = 20  # Newton steps to the plane at most


@dataclass(frozen=True, eq=False)
class SaddleCycle:
    """A state of a cycle, the scaled rate there, and the right and left vectors of one multiplier."""

    flow: FlowMap
    values: Floats
    value: float
    state: Floats
    rate: Floats
    right: Floats
    left: Floats
    multiplier: float
    cycle: PeriodicOrbit

    @classmethod
    def of(cls, curve: PeriodicOrbitCurve, u: Floats, growing: bool = True) -> SaddleCycle | None:
        """Return the cycle if a positive multiplier is the only one that grows (or decays); else None."""
        flow, values = curve.flow, curve.values_at(u)
        closing = curve.monodromy(u)
        # A symmetric cycle is taken over the whole period: in the mirror the sides may change.
        numbers, right = np.linalg.eig(flow.scaled(closing @ closing if curve.symmetric else closing))
        places = np.flatnonzero((np.abs(numbers - 1.0) > 1e-6) & ((np.abs(numbers) > 1.0) == growing))
        if len(places) != 1 or abs(numbers[places[0]].imag) > 0.0 or numbers[places[0]].real < 0.0:
            return None
        place = int(places[0])
        vector = right[:, place].real
        left = np.linalg.inv(right)[place]
        turned = left.real * (right[:, place] @ left).real  # both may have been scaled by the same phase
        norm, state = float(np.linalg.norm(vector)), curve.nodes(u)[0]
        rate, number = flow.rates(values, state) / flow.size, float(numbers[place].real)
        value, cycle = curve.value(u), curve.solution(u)
        return cls(flow, values, value, state, rate, vector / norm, turned * norm, number, cycle)

    def facing(self, other: SaddleCycle | None) -> SaddleCycle:
        """Return it with the vectors turned to those of a neighbour: an eigenvector's sign is arbitrary."""
        if other is None or self.right @ other.right > 0.0:
            return self
        return replace(self, right=-self.right, left=-self.left)

    def mirrored(self, mirror: Floats) -> SaddleCycle:
        """Return its image by signs (r,)."""
        state, rate = mirror * self.state, mirror * self.rate
        return replace(self, state=state, rate=rate, right=mirror * self.right, left=mirror * self.left)

    def moved(self, part: float) -> SaddleCycle:
        """Return it at the node nearest to a part of the period, with the vectors carried along there."""
        assert self.cycle._solved is not None
        curve, u = self.cycle._solved
        nodes, m = curve.around(u), curve.pieces
        last = len(nodes)
        pieces = self.flow.scaled(curve.flight(u).by_state)
        if last > m:
            pieces = np.concatenate([pieces, curve.mirror[:, None] * pieces * curve.mirror])
        k = round(part * last) % last
        right, left = self.right, self.left
        for piece in pieces[:k]:
            right = piece @ right
        # The left vector is that at the end, carried back: so it is accurate.
        for piece in pieces[: k - 1 if k else None : -1]:
            left = left @ piece
        right = right / np.linalg.norm(right)
        rate = self.flow.rates(self.values, nodes[k]) / self.flow.size
        return replace(self, state=nodes[k], rate=rate, right=right, left=left / (left @ right))

    @property
    def period(self) -> float:
        """The cycle's."""
        return self.cycle.period

    def height(self, x: Floats) -> Floats:
        """Return the distances of states (..., r) from the other manifold's tangent."""
        height: Floats = ((x - self.state) / self.flow.size) @ self.left
        return height

    def distance(self, x: Floats) -> Floats:
        """Return the distances of states (..., r) from the cycle's state."""
        gap: Floats = np.linalg.norm((x - self.state) / self.flow.size, axis=-1)
        return gap

    @cached_property
    def plane(self) -> str:
        """The plane through the state across the flow, as an expression."""
        names = [self.flow.model.state_names[k] for k in self.flow.kept]
        weights = self.rate / self.flow.size / np.linalg.norm(self.rate)
        terms = zip(names, weights.tolist(), self.state.tolist(), strict=True)
        return " + ".join(f"({weight!r})*({name} - ({x!r}))" for name, weight, x in terms)

    def ahead(self, x: Floats) -> Floats:
        """About when states (..., r) crossed the plane."""
        ahead: Floats = (((x - self.state) / self.flow.size) @ self.rate) / (self.rate @ self.rate)
        return ahead

    def landed(self, x: Floats, loose: float) -> Floats:
        """Follow states (n, r) to the plane, forward or backward in time."""
        clock = self.flow.clock
        for _ in range(_LANDINGS):
            late = -self.ahead(x)
            if np.abs(late).max() < 1e-13 * clock:
                break
            x = self.flow.fly_each(self.values, x, np.clip(late, -0.2 * clock, 0.2 * clock), loose)
        return x


def saddles_of(branch: Branch, growing: bool = True, least: float = 0.0) -> Iterator[SaddleCycle | None]:
    """Yield the saddle cycles of a branch with vectors that change smoothly; None for its other cycles."""
    last: SaddleCycle | None = None
    for cycle in cycles_of(branch):
        saddle = SaddleCycle.of(*cycle, growing)
        if saddle is None or saddle.multiplier < least:
            yield None
        else:
            last = saddle.facing(last)
            yield last


def saddle_at(branch: Branch, value: float, like: SaddleCycle, growing: bool = True) -> SaddleCycle:
    """Return the saddle cycle of a branch at a value of the parameter that is nearest to another one."""
    cycles = [orbit for orbit in branch.at(value) if isinstance(orbit, PeriodicOrbit)]
    for orbit in sorted(cycles, key=lambda orbit: float(like.distance(like.flow.reduced(orbit.state)))):
        assert orbit._solved is not None
        saddle = SaddleCycle.of(*orbit._solved, growing)
        if saddle is not None:
            return saddle.facing(like)
    raise ModelError(f"no saddle cycle is found at {value:.10g}")
