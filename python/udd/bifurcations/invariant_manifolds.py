"""Manifolds of dimension one of an equilibrium: the eigendirection alone on its side, and curves along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from udd._util.memory import require_memory
from udd.errors import IntegrationError

from .equilibrium_curve import expansion
from .equilibrium_search import refined
from .flow_map import Floats, FlowMap

__all__ = [
    "AWAY",
    "FAR",
    "FINE",
    "LEAVES",
    "NARROW",
    "Eigendirection",
    "ManifoldCurve",
    "ManifoldFamily",
    "direction_alone",
]

AWAY = 1e-6  # Distance from the equilibrium, in typical sizes, within which the manifold is straight.
FINE = 24  # Samples in a typical time along a manifold.
FAR = 30.0  # Typical sizes, beyond which nothing comes back.
LEAVES = 80  # Most typical times in which a manifold leaves the equilibrium.
NARROW = 1e-12  # Relative distance of the nearest values that are compared.
_ASIDE = 1e-3  # Distance of another guess of an equilibrium, in typical sizes.
_TRIES = 4  # Guesses of an equilibrium besides the first.
_LEFT = 0.1  # Distance at which the manifold has left the equilibrium.
_LOOSE = 10.0  # Tolerance of the runs, relative to 1e-13.
_ROWS = 2000  # Curves that are followed together.


@dataclass(frozen=True, eq=False)
class Eigendirection:
    """An eigenvalue and its right and left vectors, in typical sizes.

    The largest component of the right vector is positive; the left one times it is 1.
    """

    number: float
    vector: Floats
    left: Floats

    def start(self, flow: FlowMap, rest: Floats, sign: float, away: float = AWAY) -> Floats:
        """Return the state on one side of the manifold at a distance from the equilibrium."""
        return np.asarray(rest + flow.size * sign * away * self.vector)


def direction_alone(flow: FlowMap, values: Floats, rest: Floats, side: float) -> Eigendirection | None:
    """Return the only growing (`side` > 0) or the only other eigendirection; None if there are several."""
    numbers, right = np.linalg.eig(flow.scaled(expansion(flow, values, rest).by_state))
    growing = numbers.real > 0.0
    alone = np.flatnonzero(growing if side > 0.0 else ~growing)
    if len(alone) != 1 or len(numbers) < 2:
        return None
    place = int(alone[0])
    vector, left = right[:, place].real, np.linalg.pinv(right)[place].real
    turn = np.sign(vector[np.argmax(np.abs(vector))])
    return Eigendirection(float(numbers[place].real), turn * vector, turn * left)


@dataclass(frozen=True, eq=False)
class ManifoldCurve:
    """One side of an equilibrium's manifold of one dimension: states (k, r) at equal distances of time.

    With the left eigenvector that tells the side of the other manifold, and the first state that has left.
    """

    value: float
    rest: Floats
    left: Floats
    path: Floats
    left_at: float


@dataclass(frozen=True, eq=False)
class ManifoldFamily:
    """One side of an equilibrium's manifold at all values of the parameter `index`, for a longest time."""

    flow: FlowMap
    index: int
    sign: float
    longest: float

    def values_at(self, value: float) -> Floats:
        """Return all parameters."""
        values = self.flow.values.copy()
        values[self.index] = value
        return values

    def rest_near(self, value: float, guess: Floats) -> Floats | None:
        """Return the equilibrium near a guess; if Powell's method stalls, start next to the guess."""
        aside = np.random.default_rng(8).uniform(-_ASIDE, _ASIDE, (_TRIES, len(guess)))
        for shift in (np.zeros(len(guess)), *aside):
            curve = refined(self.flow, self.values_at(value), guess + shift * self.flow.size)
            if curve is not None:
                return curve
        return None

    def alone(self, value: float, rest: Floats) -> Eigendirection | None:
        """Return the only eigendirection on its side, a growing one first; none if there are several."""
        values = self.values_at(value)
        for side in (1.0, -1.0):
            one = direction_alone(self.flow, values, rest, side)
            if one is not None:
                return one
        return None

    def curves(self, values: Floats, rests: list[Floats]) -> list[ManifoldCurve]:
        """Return the curve at each value, from near the equilibrium until it has gone far or time is up."""
        curves: list[ManifoldCurve] = []
        for first in range(0, len(values), _ROWS):
            part = slice(first, first + _ROWS)
            curves += self._followed(values[part], rests[part])
        return curves

    def _followed(self, values: Floats, rests: list[Floats]) -> list[ManifoldCurve]:
        flow, step = self.flow, self.flow.clock / FINE
        size, count = flow.size, len(values)
        ways = [self.alone(value, rest) for value, rest in zip(values.tolist(), rests, strict=True)]
        center, left = np.array(rests), np.zeros((count, flow.dim))
        x, time = center.copy(), np.ones(count)
        for i, way in enumerate(ways):
            if way is not None:
                x[i] = way.start(flow, rests[i], self.sign)
                time[i], left[i] = np.sign(way.number), way.left
        rows = np.tile(flow.values, (count, 1))
        rows[:, self.index] = values
        going = np.array([way is not None for way in ways])
        states, away_at, end = [x.copy()], np.full(count, np.inf), np.zeros(count, dtype=np.intp)
        # Between values that are hardly apart it is seen late on which side an equilibrium is passed.
        rates = [abs(way.number) for way in ways if way is not None]
        lasts = self.longest - float(np.log(NARROW)) / min(rates, default=1.0)
        most = FINE * (LEAVES + lasts / flow.clock)
        require_memory("states of curves up to t_max", most, count, flow.dim, itemsize=16)
        for k in range(1, round(most)):
            rows_left = np.flatnonzero(going)
            if not len(rows_left):
                break
            x[rows_left] = self._on(rows[rows_left], x[rows_left], time[rows_left] * step)
            states.append(x.copy())
            end[rows_left] = k
            scaled = np.linalg.norm((x - center) / size, axis=1)
            away_at = np.where(going & (scaled > _LEFT), np.minimum(away_at, k), away_at)
            going &= (scaled < FAR) & ((k - away_at) * step < lasts)
        path = np.array(states)
        return [
            ManifoldCurve(value, rests[i], left[i], path[: end[i] + 1, i], away_at[i])
            for i, value in enumerate(values.tolist())
        ]

    def _on(self, rows: Floats, x: Floats, spans: Floats) -> Floats:
        """Return the states a step later; infinite where the run blows up."""
        try:
            return self.flow.fly_each(rows, x, spans, _LOOSE)
        except IntegrationError:
            if len(x) == 1:
                return np.full_like(x, np.inf)
        half = len(x) // 2
        parts = (slice(None, half), slice(half, None))
        return np.concatenate([self._on(rows[part], x[part], spans[part]) for part in parts])
