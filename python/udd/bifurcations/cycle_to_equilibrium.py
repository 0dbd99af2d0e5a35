"""Heteroclinic orbits between an equilibrium and a saddle cycle."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd.errors import IntegrationError, ModelError

from .branch import Branch, cycles_of
from .equilibrium_curve import equilibrium_at
from .equilibrium_search import refined
from .flow_map import Floats, FlowMap
from .invariant_manifolds import AWAY, FAR, FINE, LEAVES, direction_alone
from .manifold_search import Accuracy, brackets, converge, distinct, secant
from .saddle_cycles import SaddleCycle, saddle_at, saddles_of
from .solutions import Equilibrium, PeriodicOrbit

__all__ = ["CycleConnection", "cycle_connections"]

_NEAR = 1.0  # Largest distance of a passage, in typical sizes.
_PARTS = 8  # Parts of a piece of the cycle, with which the manifold is compared.
_LEFT = 0.5  # Distance at which the manifold has left the equilibrium.
_ONTO = 1e-4  # Largest distance from the cycle in the end, in typical sizes.


@dataclass(frozen=True, eq=False)
class CycleConnection(Drawable):
    """Orbit between an equilibrium and a saddle cycle.

    Attributes
    ----------
    kind : {"equilibrium to cycle", "cycle to equilibrium"}
    parameter : str
    value : float
        The parameter's value: at others there is no such orbit.
    error : float
        A bound of the value's error: its change with the last round about the cycle, with runs a hundred
        times less accurate, and with an orbit that begins ten times further from the equilibrium.
    equilibrium : Equilibrium
    cycle : PeriodicOrbit
        Both at the value.

    See Also
    --------
    udd.cycle_connections : finds it.
    udd.plot.cycle : draw it.
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
    """Find the values at which an equilibrium and the cycles of a branch are connected.

    Parameters
    ----------
    branch : Branch
        A branch of saddle cycles with one multiplier outside the unit circle (or one inside).
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

    See Also
    --------
    udd.connections : between equilibria.
    udd.crises : tangencies of saddle cycles.
    udd.plot.cycle : draw the orbit.

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
    flow = cycles_of(branch)[0][0].flow
    if not isinstance(equilibrium, Equilibrium):
        raise ModelError(f"an equilibrium is needed, not {equilibrium!r}")
    growing = equilibrium.eigenvalues.real > 0.0
    if 1 not in (growing.sum(), (~growing).sum()):
        raise ModelError("the equilibrium has no eigenvalue alone on its side of the imaginary axis")
    guess, images = flow.reduced(equilibrium.state), flow.images
    time = 1.0 if growing.sum() == 1 else -1.0
    sides = [(1.0, images[0]), (-1.0, images[0])]
    sides += [(1.0, mirror) for mirror in images[1:] if not branch.symmetric]
    searches = (_Search(branch, flow, guess, time, *side) for side in sides)
    return distinct([connection for search in searches for connection in search.connections()])


@dataclass(frozen=True)
class _Passage:
    """The first passage of a manifold near a cycle: at which part of the period, when, and on which side."""

    saddle: SaddleCycle
    part: float
    t: float
    height: float


@dataclass(frozen=True)
class _Search:
    """One side of an equilibrium's manifold, and the cycles of a branch or their images by a mirror."""

    branch: Branch
    flow: FlowMap
    guess: Floats
    time: float
    sign: float
    mirror: Floats

    def connections(self) -> list[CycleConnection]:
        """Return those between neighbouring cycles of the branch that are passed on two sides."""
        passages: list[_Passage | None] = []
        for saddle in saddles_of(self.branch, self.time > 0.0):
            passages.append(None)
            if saddle is not None:
                with suppress(IntegrationError):  # it goes away for good
                    passages[-1] = self._passage(saddle)

        def passed(a: _Passage, b: _Passage) -> bool:
            return a.height * b.height < 0.0 and abs(a.t - b.t) <= 1.5 * self.flow.clock

        return brackets(passages, passed, self._located)

    def _passage(self, saddle: SaddleCycle) -> _Passage | None:
        """Return when the manifold first comes to the cycle, and on which side."""
        begin = self._start(saddle.values, AWAY)
        if begin is None:
            return None
        start = begin[0]
        around = self.mirror * self._around(saddle)
        step = self.time * self.flow.clock / FINE
        last, before, left, nearest = np.inf, np.inf, False, 0
        for k, x in enumerate(self._run(saddle.values, start, step)):
            gaps = np.linalg.norm((x - around) / self.flow.size, axis=1)
            away = float(gaps.min())
            if not away < FAR:
                return None
            left = left or bool(np.linalg.norm((x - start) / self.flow.size) > _LEFT)
            if left and before > last < away and last < _NEAR:
                part, t = nearest / len(around), float(k * step)
                return _Passage(saddle, part, t, self._arrival(saddle, part, t, 0, Accuracy(AWAY))[0])
            before, last, nearest = last, away, int(np.argmin(gaps))
        return None

    def _around(self, saddle: SaddleCycle) -> Floats:
        """Return states all around a cycle, in their order."""
        assert saddle.cycle._solved is not None
        curve, u = saddle.cycle._solved
        nodes = curve.around(u)
        spans = np.arange(_PARTS) * (curve.span(u) / curve.pieces / _PARTS)
        rows = np.repeat(nodes, _PARTS, axis=0)
        return self.flow.fly_each(saddle.values, rows, np.tile(spans, len(nodes)))

    def _run(self, values: Floats, x: Floats, step: float) -> Iterator[Floats]:
        """Yield the states after each step of time, a typical time of them in one call."""
        spans = np.arange(1.0, FINE + 1.0) * step
        for _ in range(LEAVES):
            states = self.flow.fly_each(values, np.tile(x, (FINE, 1)), spans)
            yield from states
            x = states[-1]

    def _start(self, values: Floats, away: float) -> tuple[Floats, float] | None:
        """Return a state on the manifold, and when an orbit from the usual distance comes to it."""
        rest = refined(self.flow, values, self.guess)
        if rest is None:
            return None
        way = direction_alone(self.flow, values, rest, self.time)
        if way is None or way.number == 0.0:
            return None
        x = way.start(self.flow, rest, self.sign, away)
        return x, float(np.log(away / AWAY)) / way.number

    def _arrival(
        self, saddle: SaddleCycle, part: float, t: float, rounds: int, accuracy: Accuracy
    ) -> tuple[float, float]:
        """Return the height and the distance from a part of a cycle, some rounds after a time."""
        image, begin = saddle.moved(part).mirrored(self.mirror), self._start(saddle.values, accuracy.away)
        if begin is None:
            raise ModelError("the equilibrium is no saddle there")
        x, span = begin[0][np.newaxis], t - begin[1] + self.time * rounds * saddle.period
        pieces = max(1, int(np.ceil(abs(span) / self.flow.clock)))
        for _ in range(pieces):
            x = self.flow.fly_each(saddle.values, x, np.array([span / pieces]), accuracy.loose)
        x = image.landed(x, accuracy.loose)[0]
        return float(image.height(x)), float(image.distance(x))

    def _located(self, a: _Passage, b: _Passage) -> CycleConnection:
        """Return the connection between two passages, by more and more rounds about the cycle."""
        first = Accuracy(AWAY)
        nearer = a if abs(a.height) < abs(b.height) else b
        like, part, t = nearer.saddle, nearer.part, nearer.t

        def saddle(value: float) -> SaddleCycle:
            return saddle_at(self.branch, value, like, self.time > 0.0)

        def height(value: float) -> float:
            return self._arrival(saddle(value), part, t, 0, first)[0]

        def solve(x: Floats, rounds: int, step: float, accuracy: Accuracy) -> Floats:
            return secant(lambda y: (self._arrival(saddle(y[0]), part, t, rounds, accuracy)[0], y), x, step)

        low, high = a.saddle.value, b.saddle.value
        if height(low) * height(high) >= 0.0:
            raise ModelError("the cycle is passed on one side")
        begin = brentq(height, low, high, xtol=1e-9 * abs(high))
        x, error, rounds = converge(solve, np.array([begin]), abs(high - low), first)
        value = float(x[0])
        there = saddle(value)
        if not self._arrival(there, part, t, rounds, first)[1] < _ONTO:
            raise ModelError("the orbit does not come to the cycle")
        rest = equilibrium_at(self.flow, there.values, self.guess)
        kind = "equilibrium to cycle" if self.time > 0.0 else "cycle to equilibrium"
        return CycleConnection(kind, self.branch.parameter, value, error, rest, there.cycle)
