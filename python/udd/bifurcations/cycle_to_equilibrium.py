"""Heteroclinic orbits between an equilibrium and a saddle cycle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd.errors import IntegrationError, ModelError

from .branch import Branch, cycles_of
from .equilibrium_search import equilibrium_at, refined
from .error_bounds import COARSE, rounding_of
from .flow_map import Floats
from .invariant_manifolds import direction_alone
from .shooting_curve import PeriodicOrbitCurve
from .solutions import Equilibrium, PeriodicOrbit

__all__ = ["CycleConnection", "cycle_connections"]

_AWAY = 1e-6  # from the equilibrium, in typical sizes, the manifold begins as a straight line
_FINE = 24  # states looked at in a typical time
_PARTS = 8  # of a piece of the cycle, with which the manifold is compared
_NEAR = 1.0  # a passage at a larger distance, in typical sizes, is none
_LEFT = 0.5  # further away it has left the equilibrium
_FAR = 30.0  # typical sizes, beyond which nothing comes back
_LEAVES = 80.0  # typical times that it takes at most to leave the equilibrium and to come to the cycle
_ROUNDS = 12  # about the cycle at most, until the parameter stands
_STANDS = 1e-13  # by this relative change
_ONTO = 1e-4  # typical sizes: so near the orbit comes to the cycle in the end
_STEPS = 50


@dataclass(frozen=True, eq=False)
class CycleConnection(Drawable):
    """An orbit between an equilibrium and a saddle cycle.

    Attributes
    ----------
    kind : {"equilibrium to cycle", "cycle to equilibrium"}
    parameter : str
    value : float
        The parameter's value: at others there is no such orbit.
    error : float
        A bound of the value's error: how far it moved with the last round about the cycle, how far it moves
        when runs are a hundred times less accurate, and when the orbit begins ten times further from the
        equilibrium.
    equilibrium : Equilibrium
    cycle : PeriodicOrbit
        Both at the value.
    """

    kind: str
    parameter: str
    value: float
    error: float
    equilibrium: Equilibrium
    cycle: PeriodicOrbit

    def __repr__(self) -> str:
        return (
            f"<connection, {self.kind}, at {self.parameter} = {self.value:.13g} "
            f"(error below {self.error:.1g}), period {self.cycle.period:.8g}>"
        )


@checked_arguments
def cycle_connections(branch: Branch, equilibrium: Equilibrium) -> list[CycleConnection]:
    """Where an equilibrium and the cycles of a branch are connected.

    Parameters
    ----------
    branch : Branch
        Of saddle cycles with one multiplier outside the unit circle (or one inside).
    equilibrium : Equilibrium
        With one growing direction (or one decaying), at any value of the branch's parameter.

    Returns
    -------
    list of CycleConnection
        In the order of their values.

    Raises
    ------
    ModelError
        No branch of cycles over a parameter of the model, or an equilibrium with no direction on its own.

    Notes
    -----
    The equilibrium's manifold of one dimension passes the stable manifold of the saddle cycle on another side
    before the value than after it. There a chaotic set that had been a transient becomes an attractor, or the
    reverse: its basin's edge is that manifold (a boundary crisis; of the Lorenz equations at r = 24.06, by
    J. Kaplan and J. Yorke, Communications in Mathematical Physics 67 (1979) 93). Only the first passage is
    looked at, and two connections between neighbouring points of the branch are missed.

    Examples
    --------
    Below this drive the chaos of the damped equations is an attractor, above it a transient:

    >>> import udd
    >>> rests = udd.equilibria(udd.DLE(2.5, B=0.2))
    >>> hopf = udd.continuation(rests[0], "w", (1.0, 9.0)).points[0]
    >>> saddle = next(rest for rest in rests if abs(rest.state[0]) < 1e-9)
    >>> (one,) = udd.cycle_connections(udd.continuation(hopf, max_period=16.0), saddle)
    >>> print(one.kind, round(one.value, 9))
    equilibrium to cycle 3.691730046
    """
    curve = cycles_of(branch)
    if not isinstance(equilibrium, Equilibrium):
        raise ModelError(f"an equilibrium is needed, not {equilibrium!r}")
    growing = equilibrium.eigenvalues.real > 0.0
    if 1 not in (growing.sum(), (~growing).sum()):
        raise ModelError("the equilibrium has no eigenvalue alone on its side of the imaginary axis")
    found = []
    guess = curve.flow.reduced(equilibrium.state)
    time = 1.0 if growing.sum() == 1 else -1.0
    for sign in (1.0, -1.0):
        for mirrored in (False, True):
            if mirrored and (curve.flow.mirror is None or sign < 0.0 or curve.symmetric):
                continue
            found += _Search(branch, guess, time, sign, mirrored).connections()
    distinct: list[CycleConnection] = []
    for one in sorted(found, key=lambda one: one.value):
        # The two sides of an equilibrium on the axis of the symmetry are mirror images.
        if not distinct or one.value - distinct[-1].value > 1e-9 * abs(one.value):
            distinct.append(one)
    return distinct


@dataclass(frozen=True)
class _Round:
    """A cycle: states (n, r), the rates there, and left eigenvectors across its other manifold, scaled."""

    states: Floats
    along: Floats
    left: Floats
    period: float


class _Search:
    """One side of an equilibrium's manifold, and the cycles of a branch (or their mirror images)."""

    def __init__(self, branch: Branch, guess: Floats, time: float, sign: float, mirrored: bool) -> None:
        curve = branch._places[0][0]
        assert isinstance(curve, PeriodicOrbitCurve)
        self.branch, self.flow = branch, curve.flow
        self.guess, self.time, self.sign = guess, time, sign
        self.mirror = (
            curve.flow.mirror if mirrored and curve.flow.mirror is not None else np.ones(curve.flow.dim)
        )
        self.away, self.loose = _AWAY, 1.0
        self.facing: Floats | None = None

    def connections(self) -> list[CycleConnection]:
        """Those between neighbouring cycles of the branch that are passed on two sides."""
        sides: list[tuple[float, float] | None] = []
        for curve, place in self.branch._places:
            assert isinstance(curve, PeriodicOrbitCurve)
            try:
                sides.append(self._side(curve, place.u))
            except IntegrationError:
                sides.append(None)  # it goes away for good
        found = []
        for (i, one), (j, other) in pairwise(enumerate(sides)):
            if one is None or other is None or one[1] * other[1] >= 0.0:
                continue
            if abs(one[0] - other[0]) > 1.5 * self.flow.clock:
                continue
            try:
                found.append(self._located(self.branch.values[i], self.branch.values[j], one, other))
            except (ModelError, IntegrationError):
                continue  # the passage was another one, or another cycle's
        return found

    def _side(self, curve: PeriodicOrbitCurve, u: Floats) -> tuple[float, float] | None:
        """When the manifold first comes to the cycle, and on which side."""
        around = self._round(curve, u)
        values = curve.values_at(u)
        start = self._start(values)
        if around is None or start is None:
            return None
        step = self.time * self.flow.clock / _FINE
        last, before, left = np.inf, np.inf, False
        for k, x in enumerate(self._run(values, start, step), 1):
            away = np.linalg.norm((x - around.states) / self.flow.size, axis=1).min()
            if not away < _FAR:
                return None
            left = left or bool(np.linalg.norm((x - start) / self.flow.size) > _LEFT)
            if left and before > last < away and last < _NEAR:
                at = (k - 1) * step
                return float(at), self._height(values, start, around, float(at))[0]
            before, last = last, float(away)
        return None

    def _run(self, values: Floats, x: Floats, step: float) -> Iterator[Floats]:
        """The states after each step of time, a typical time of them in one call."""
        spans = np.arange(1.0, _FINE + 1.0) * step
        for _ in range(round(_LEAVES)):
            states = self.flow.fly(values, np.tile(x, (_FINE, 1)), spans, loose=self.loose).x
            yield from states
            x = states[-1]

    def _start(self, values: Floats) -> Floats | None:
        rest = refined(self.flow, values, self.guess)
        if rest is None:
            return None
        way = direction_alone(self.flow, values, rest, self.time)
        if way is None or way.number == 0.0:
            return None
        return np.asarray(rest + self.flow.size * self.sign * self.away * way.vector)

    def _round(self, curve: PeriodicOrbitCurve, u: Floats) -> _Round | None:
        """The cycle, if one multiplier is alone on its side of the unit circle, and positive."""
        flow, size, values = self.flow, self.flow.size, curve.values_at(u)
        nodes, span = curve.nodes(u), curve.span(u) / curve.pieces
        numbers, left = np.linalg.eig(flow.scaled(curve.monodromy(u)).T)
        across = np.abs(numbers - 1.0) > 1e-6
        outside = across & ((np.abs(numbers) > 1.0) == (self.time > 0.0))
        if outside.sum() != 1 or abs(numbers[outside][0].imag) > 0.0 or numbers[outside][0].real < 0.0:
            return None
        own = left[:, outside][:, 0].real
        # An eigenvector's sign is arbitrary; the sides are those of the last cycle looked at.
        if self.facing is not None and own @ self.facing < 0.0:
            own = -own
        self.facing = own
        pieces = flow.scaled(curve.flight(u).by_state)
        # The left eigenvector at a node is that at the first, carried back from the end.
        lefts = [own * curve.mirror]
        for matrix in pieces[:0:-1]:
            lefts.append(lefts[-1] @ matrix)
        lefts = [own, *[one / np.linalg.norm(one) for one in lefts[:0:-1]]]
        states, vectors = [], []
        for part in range(_PARTS):
            gone = flow.fly(values, nodes, np.full(len(nodes), span * part / _PARTS))
            for i, vector in enumerate(lefts):
                states.append(gone.x[i])
                vectors.append(np.linalg.solve(flow.scaled(gone.by_state[i]).T, vector))
        x, vectors_ = np.array(states), np.array(vectors)
        if curve.symmetric:
            x, vectors_ = np.vstack([x, curve.mirror * x]), np.vstack([vectors_, curve.mirror * vectors_])
        x, vectors_ = self.mirror * x, self.mirror * vectors_
        rates = flow.with_values(values).rates(0.0, flow.full(x))[:, flow.kept] / size
        norms = np.linalg.norm(vectors_, axis=1, keepdims=True)
        return _Round(x, rates, vectors_ / norms, curve.period(u))

    def _height(self, values: Floats, start: Floats, around: _Round, at: float) -> tuple[float, float]:
        """How far it is at a time from the tangent of the cycle's other manifold, and from the cycle."""
        flow = self.flow
        pieces = max(1, int(np.ceil(abs(at) / flow.clock)))
        x = start
        for _ in range(pieces):
            x = flow.fly(values, x[np.newaxis], np.array([at / pieces]), loose=self.loose).x[0]
        k = int(np.argmin(np.linalg.norm((x - around.states) / flow.size, axis=1)))
        for _ in range(_STEPS):
            # To the plane across the flow at that state.
            ahead = float(around.along[k] @ ((x - around.states[k]) / flow.size))
            late = -ahead / float(around.along[k] @ around.along[k])
            if abs(late) < 1e-13 * flow.clock:
                break
            late = float(np.clip(late, -0.2 * flow.clock, 0.2 * flow.clock))
            x = flow.fly(values, x[np.newaxis], np.array([late]), loose=self.loose).x[0]
        gap = (x - around.states[k]) / flow.size
        return float(around.left[k] @ gap), float(np.linalg.norm(gap))

    def _located(
        self, low: float, high: float, one: tuple[float, float], other: tuple[float, float]
    ) -> CycleConnection:
        """The value between two of the parameter, by more and more rounds about the cycle."""
        curve, place = min(self.branch._places, key=lambda own: abs(own[0].value(own[1].u) - low))
        assert isinstance(curve, PeriodicOrbitCurve)
        near, self.facing = curve.nodes(place.u)[0], None
        self._round(curve, place.u)
        at = one[0] if abs(one[1]) < abs(other[1]) else other[0]
        ends = self._at(low, at, 0, near)[0], self._at(high, at, 0, near)[0]
        if ends[0] * ends[1] >= 0.0:
            raise ModelError("the cycle is passed on one side")
        value = float(brentq(lambda w: self._at(w, at, 0, near)[0], low, high, xtol=1e-9 * abs(high)))
        moved = np.inf
        for rounds in range(1, _ROUNDS):
            after = self._zero(value, at, rounds, near, min(moved, abs(high - low)))
            moved, value = abs(after - value), after
            if moved < _STANDS * abs(value):
                break
        if not self._at(value, at, rounds, near)[1] < _ONTO:
            raise ModelError("the orbit does not come to the cycle")
        error = moved
        for away, loose in ((10.0 * _AWAY, 1.0), (_AWAY, COARSE)):
            self.away, self.loose = away, loose
            error += abs(self._zero(value, at, rounds, near, 1e-6 * abs(value)) - value)
        self.away, self.loose = _AWAY, 1.0
        cycle = self._cycle(value, near)
        assert cycle._curve is not None and cycle._unknowns is not None
        values = cycle._curve.values_at(cycle._unknowns)
        rest = equilibrium_at(self.flow, values, self.guess)
        kind = "equilibrium to cycle" if self.time > 0.0 else "cycle to equilibrium"
        error += float(rounding_of(value))
        return CycleConnection(kind, self.branch.parameter, value, error, rest, cycle)

    def _zero(self, value: float, at: float, rounds: int, near: Floats, step: float) -> float:
        """Where the height vanishes near a value, by secants."""
        step = max(step, 1e-7 * abs(value))
        a, b = value, value + 0.1 * step
        fa, fb = (self._at(w, at, rounds, near)[0] for w in (a, b))
        for _ in range(_STEPS):
            if fa == fb:
                break
            a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
            if abs(b - a) < 0.1 * _STANDS * abs(b):
                break
            fb = self._at(b, at, rounds, near)[0]
        if not np.isfinite(b) or abs(b - value) > 10.0 * step:
            raise ModelError("the value does not settle")
        return float(b)

    def _at(self, value: float, at: float, rounds: int, near: Floats) -> tuple[float, float]:
        """The height and the distance at a value of the parameter, some rounds after a time."""
        cycle = self._cycle(value, near)
        curve, u = cycle._curve, cycle._unknowns
        assert curve is not None and u is not None
        around, values = self._round(curve, u), curve.values_at(u)
        start = self._start(values)
        if around is None or start is None:
            raise ModelError("the cycle is no saddle there")
        return self._height(values, start, around, at + self.time * rounds * around.period)

    def _cycle(self, value: float, near: Floats) -> PeriodicOrbit:
        found = [one for one in self.branch.at(value) if isinstance(one, PeriodicOrbit)]
        if not found:
            raise ModelError(f"no cycle is found at {value:.10g}")
        return min(found, key=lambda one: float(np.linalg.norm(self.flow.reduced(one.state) - near)))
