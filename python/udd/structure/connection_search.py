"""All connections of an interval of a parameter: where a manifold of one dimension passes an equilibrium."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from udd._validate import number, whole
from udd.errors import IntegrationError, ModelError
from udd.models import Model, beyond_the_edge
from udd.trajectory import simulate

from .branches import bounds_of
from .connecting import Connection, Problem, found_by
from .flow import Floats, Flow, flow_of
from .orbits import pieces_for
from .rest_curve import expansion
from .rests import equilibria, refined

__all__ = ["Connections", "connections"]

_FINE = 24  # states looked at in a typical time
_AWAY = 1e-3  # from the equilibrium, in typical sizes, the manifold begins as a straight line
_LEFT = 0.1  # further away it has left the equilibrium,
_LEAVES = 80.0  # which takes as many typical times at most
_SHOWN = 20.0  # typical times that show the extent of the motion
_FAR = 30.0  # typical sizes, beyond which nothing comes back
_NEAR = 3.0  # a passage at a larger distance is none
_LOOSE = 10.0  # times 1e-13: so accurate are the runs
_CLOSE = 3e-2  # from so near a passage Newton's method starts,
_NARROW = 1e-11  # or from an interval this narrow: towards a slow spiral passages come nearer slowly
_TRIES = 4  # to find an equilibrium
_FINER = 4  # so often values are added where the manifold stays longest
_PARTS = 8  # into which an interval is cut between values on whose sides it passes differ,
_ROUNDS = 14  # so often at most
_BEFORE = 1.5  # typical times by which passages at neighbouring values differ at most
_LATER = 15.0  # ... by which it passes later next to a connection
_TURN = 3.0  # ... that a turn about an equilibrium takes at most
_BESIDE = 4.0  # steps of the grid by which Newton's method may move a connection


@dataclass(frozen=True)
class _Passage:
    """Where a manifold passes an equilibrium: when, how near, on which side of its other manifold."""

    t: float
    distance: float
    side: float


_Nearest = tuple[float, _Passage, Floats, Floats]


@dataclass(frozen=True)
class _Bracket:
    """Two values between which the side changes on which an equilibrium (or its mirror image) is passed.

    And the nearest passage seen between: the value, the passage, the manifold, the equilibrium.
    """

    low: float
    high: float
    before: _Passage
    after: _Passage
    image: bool
    rest: Floats
    nearest: _Nearest | None = None


_Compared = tuple[float, Floats, dict[bool, list[_Passage]], int]


class Connections(list[Connection]):
    """Connections in the order of their values.

    Attributes
    ----------
    search : str
        What was searched, and how.
    """

    def __init__(self, found: list[Connection], search: str) -> None:
        super().__init__(found)
        self.search = search

    def __repr__(self) -> str:
        return f"<{super().__repr__()}; {self.search}>"


def connections(
    model: Model,
    parameter: str,
    bounds: Sequence[float],
    *,
    n: int = 1000,
    longest: float | None = None,
) -> Connections:
    """The homoclinic and heteroclinic orbits of an interval of a parameter.

    Parameters
    ----------
    model : Model
        Its other parameters stay.
    parameter : str
    bounds : (float, float)
        Of the parameter, both finite.
    n : int
        At so many values, equally far apart, the manifolds are compared.
    longest : float, optional
        For so long manifolds are followed after they have left their equilibrium, by default 10 typical
        times.

    Returns
    -------
    Connections
        A list of :class:`Connection` in the order of their values; its ``search`` says what was searched.

    Raises
    ------
    ModelError
        A parameter or option that cannot be used, or no equilibrium with one direction on its own.

    Notes
    -----
    Of each equilibrium that has one eigenvalue alone on its side of the imaginary axis, the manifold along it
    is a pair of curves, followed forward or backward in time. Where such a curve passes the equilibrium, or
    its mirror image, on another side than at the next value of the parameter, there is a connection between
    the two; it is found by narrowing the interval, and by Newton's method as :func:`udd.connection` does. Two
    connections between neighbouring values are missed, as are those that take longer. Where the manifold
    goes away for good, values are added where it stays longest, and where it passes more or fewer times.

    Examples
    --------
    >>> import udd
    >>> found = udd.connections(udd.DLE(4.0, B=0.2), "w", (4.0, 4.5), n=20, longest=10.0)
    >>> [(one.kind, round(one.value, 8)) for one in found]
    [('homoclinic', 4.25994905)]
    """
    low, high = bounds_of(bounds)
    if not np.isfinite([low, high]).all():
        raise ModelError(f"the bounds must be finite, not {low:g} and {high:g}")
    grid = np.linspace(low, high, whole("n", n, 2))
    start = beyond_the_edge(model).with_parameters({parameter: float(np.median(grid))})
    there = equilibria(start)
    flow = flow_of(start, _extent(start, [rest.state for rest in there]))
    index = flow.index(parameter)
    span = number("longest", 10.0 * flow.clock if longest is None else longest, above=0.0)
    rests = [flow.reduced(rest.state) for rest in there]
    found: list[Connection] = []
    followed = 0
    for k, rest in enumerate(rests):
        mirror = flow.mirror
        if mirror is not None and any(np.allclose(mirror * rest, other, atol=1e-9) for other in rests[:k]):
            continue  # the mirror image of one that was followed
        for sign in (1.0, -1.0):
            own = mirror is not None and np.allclose(mirror * rest, rest, atol=1e-9)
            if sign < 0.0 and own:
                continue  # so are the two sides of this one
            manifold = _Manifold(flow, index, grid, rest, sign, span)
            followed += manifold.exists
            for connection in manifold.connections(parameter):
                if all(abs(connection.value - one.value) > 1e-9 * abs(one.value) for one in found):
                    found.append(connection)
    if not followed:
        raise ModelError("no equilibrium there has one eigenvalue alone on its side of the imaginary axis")
    found.sort(key=lambda one: one.value)
    search = (
        f"{followed} manifolds compared at {len(grid)} values of {parameter} from {low:g} to {high:g}, "
        f"each followed for {span:.4g}: shorter pairs and longer ones may exist"
    )
    return Connections(found, search)


def _extent(model: Model, rests: list[Floats]) -> Floats:
    """States that show how large the motion is: of runs that leave the equilibria."""
    clock = flow_of(model, np.ones((1, len(model.state_names)))).clock
    times = np.linspace(0.0, _SHOWN * clock, 10 * _FINE)
    seen = [np.ones(len(model.state_names)) if not rests else rests[0]]
    for rest in rests:
        # What blows up does so later than half of the time, or than a quarter, ...
        for part in 0.5 ** np.arange(8):
            try:
                aside = rest + _AWAY * (1.0 + np.abs(rest))
                seen += [*simulate(model, part * times, aside, method="auto").state]
                break
            except IntegrationError:
                continue
    states = np.array(seen)
    return states[np.isfinite(states).all(axis=1)]


class _Manifold:
    """One side of an equilibrium's manifold of one dimension, at all values of the parameter."""

    def __init__(
        self, flow: Flow, index: int, grid: Floats, rest: Floats, sign: float, longest: float
    ) -> None:
        self.flow, self.index, self.grid, self.sign, self.longest = flow, index, grid, sign, longest
        self.rests: list[Floats | None] = [None] * len(grid)
        middle = len(grid) // 2
        for way in (range(middle, len(grid)), range(middle - 1, -1, -1)):
            guess: Floats | None = rest
            for i in way:
                guess = None if guess is None else self.rest_near(grid[i], guess)
                self.rests[i] = guess
        here = self.rests[middle]
        self.exists = here is not None and self.alone(grid[middle], here) is not None

    def values_at(self, value: float) -> Floats:
        values = self.flow.values.copy()
        values[self.index] = value
        return values

    def rest_near(self, value: float, guess: Floats) -> Floats | None:
        """The equilibrium near a guess; where Powell's method stalls, from a little beside it."""
        aside = np.random.default_rng(8).uniform(-_AWAY, _AWAY, (_TRIES, len(guess)))
        for shift in (np.zeros(len(guess)), *aside):
            found = refined(self.flow, self.values_at(value), guess + shift * self.flow.size)
            if found is not None:
                return found
        return None

    def alone(self, value: float, rest: Floats) -> tuple[float, Floats, Floats] | None:
        """The eigenvalue on its own, with its right and left vectors, scaled; none where there is no such."""
        size = self.flow.size
        matrix = expansion(self.flow, self.values_at(value), rest).by_state * size / size[:, None]
        numbers, right = np.linalg.eig(matrix)
        growing = numbers.real > 0.0
        for side in (growing, ~growing):
            if side.sum() == 1 and len(numbers) > 1:
                k = int(np.flatnonzero(side)[0])
                vector, left = right[:, k].real, np.linalg.inv(right)[k].real
                turn = float(np.sign(vector[np.argmax(np.abs(vector))]))
                return float(numbers[k].real), turn * vector, turn * left
        return None

    def passages(
        self, values: Floats, rests: list[Floats], longest: float
    ) -> tuple[list[dict[bool, list[_Passage]]], list[Floats]]:
        """Passages by the equilibrium, or its mirror image (True), at each value; the states on the way."""
        flow, step = self.flow, self.flow.clock / _FINE
        size, count = flow.size, len(values)
        ways = [self.alone(value, rest) for value, rest in zip(values.tolist(), rests, strict=True)]
        going = np.array([way is not None for way in ways])
        states = [
            rest + size * (self.sign * _AWAY * way[1] if way is not None else 0.0)
            for rest, way in zip(rests, ways, strict=True)
        ]
        x = np.array(states)
        time = np.array([np.sign(way[0]) if way is not None else 1.0 for way in ways])
        rows = np.tile(flow.values, (count, 1))
        rows[:, self.index] = values
        paths = [[state.copy()] for state in x]
        left_at = np.full(count, np.inf)
        center = np.array(rests)
        for k in range(1, round(_FINE * (_LEAVES + longest / flow.clock))):
            own = np.flatnonzero(going)
            if not len(own):
                break
            x[own] = self._on(rows[own], x[own], time[own] * step)
            scaled = np.linalg.norm((x - center) / size, axis=1)
            for i in own.tolist():
                paths[i].append(x[i].copy())
                if scaled[i] > _LEFT and not np.isfinite(left_at[i]):
                    left_at[i] = k * step
                if not scaled[i] < _FAR or k * step > left_at[i] + longest:
                    going[i] = False
        found = []
        for i, way in enumerate(ways):
            images = {False: rests[i]}
            if flow.mirror is not None and not np.allclose(flow.mirror * rests[i], rests[i], atol=1e-9):
                images[True] = flow.mirror * rests[i]
            table = {}
            for image, target in images.items():
                table[image] = (
                    [] if way is None else self._by(np.array(paths[i]), target, way[2], image, left_at[i])
                )
            found.append(table)
        return found, [np.array(path) for path in paths]

    def _on(self, rows: Floats, x: Floats, spans: Floats) -> Floats:
        """The states a step later; infinite where the run blows up."""
        try:
            return self.flow.fly_each(rows, x, spans, _LOOSE)
        except IntegrationError:
            if len(x) == 1:
                return np.full_like(x, np.inf)
        half = len(x) // 2
        parts = (slice(None, half), slice(half, None))
        return np.concatenate([self._on(rows[part], x[part], spans[part]) for part in parts])

    def _by(self, path: Floats, target: Floats, left: Floats, image: bool, after: float) -> list[_Passage]:
        """Minima of the distance from a target once the manifold has left its equilibrium."""
        flow, step = self.flow, self.flow.clock / _FINE
        away = (path - target) / flow.size
        distance = np.linalg.norm(away, axis=1)
        sides = away @ (left * flow.mirror if image and flow.mirror is not None else left)
        inner = (distance[1:-1] < distance[:-2]) & (distance[1:-1] <= distance[2:]) & (distance[1:-1] < _NEAR)
        where = (1 + np.flatnonzero(inner)).tolist()
        found: list[_Passage] = []
        for k in where:
            passage = _Passage(float(k * step), float(distance[k]), float(sides[k]))
            if passage.t <= after:
                continue
            # On a spiral towards the target it comes nearer with every turn.
            if (
                found
                and passage.distance < found[-1].distance
                and passage.t - found[-1].t < _TURN * flow.clock
            ):
                found.pop()
            found.append(passage)
        return found

    def _compared(self) -> list[_Compared]:
        """Values with what is passed there: those of the grid, and more where the manifold stays longest.

        Next to a connection it stays for long near the equilibrium that it passes, and may pass it once more.
        """
        values = [float(v) for v, rest in zip(self.grid, self.rests, strict=True) if rest is not None]
        rests = [rest for rest in self.rests if rest is not None]
        seen: list[_Compared] = []
        for _ in range(_FINER):
            if not values or not self.exists:
                break
            tables, paths = self.passages(np.array(values), rests, self.longest)
            seen += zip(values, rests, tables, map(len, paths), strict=True)
            seen.sort(key=lambda one: one[0])
            values, rests = [], []
            for before, here, after in zip(seen, seen[1:], seen[2:], strict=False):
                if before[3] < here[3] >= after[3] and here[3] > 1 + after[3]:
                    values += np.linspace(before[0], after[0], 2 * _PARTS + 1)[1:-1].tolist()
                    rests += [here[1]] * (2 * _PARTS - 1)
            for before, after in pairwise(seen):
                # One side of a connection may lead away at once.
                if any(len(before[2][image]) != len(after[2].get(image, [])) for image in before[2]):
                    values += np.linspace(before[0], after[0], _PARTS + 1)[1:-1].tolist()
                    rests += [before[1]] * (_PARTS - 1)
            values, rests = values[: len(self.grid)], rests[: len(self.grid)]
            own = {one[0] for one in seen}
            chosen = [k for k, value in enumerate(values) if value not in own and value not in values[:k]]
            near = [self.rest_near(values[k], rests[k]) for k in chosen]
            values = [values[k] for k, rest in zip(chosen, near, strict=True) if rest is not None]
            rests = [rest for rest in near if rest is not None]
        return seen

    def connections(self, parameter: str) -> list[Connection]:
        """Those between neighbouring values on whose sides it passes differ."""
        seen = self._compared()
        brackets = []
        for (value, rest, table, _), (after, _, later, _) in pairwise(seen):
            if after - value > 1.5 * float(self.grid[1] - self.grid[0]):
                continue  # the equilibrium was lost between
            for image, passages in table.items():
                for passage in passages:
                    other = _same(passage, later.get(image, []), self.flow.clock)
                    if other is not None and passage.side * other.side < 0.0:
                        brackets.append(_Bracket(value, after, passage, other, image, rest))
        spacing, found = float(self.grid[1] - self.grid[0]), []
        for _ in range(_ROUNDS):
            brackets = self._narrowed(brackets)
            left = []
            for bracket in brackets:
                if bracket.nearest is None:
                    continue
                wide = bracket.high - bracket.low > _NARROW * max(abs(bracket.low), abs(bracket.high))
                if wide and bracket.nearest[1].distance > _CLOSE:
                    left.append(bracket)
                    continue
                try:
                    one = self._solved(*bracket.nearest, bracket.image, parameter)
                except (ModelError, IntegrationError):
                    continue
                if abs(one.value - bracket.nearest[0]) < _BESIDE * spacing:
                    found.append(one)
            brackets = left
        return found

    def _narrowed(self, brackets: list[_Bracket]) -> list[_Bracket]:
        """The parts of brackets in which the side changes; all of them are compared at once."""
        values, rests = [], []
        for bracket in brackets:
            for value in np.linspace(bracket.low, bracket.high, _PARTS + 1)[1:-1].tolist():
                rest = self.rest_near(value, bracket.rest)
                values.append(value)
                rests.append(bracket.rest if rest is None else rest)
        if not values:
            return []
        # Nearer to the connection it passes later.
        longest = self.longest + _LATER * self.flow.clock
        tables, paths = self.passages(np.array(values), rests, longest)
        narrowed = []
        for b, bracket in enumerate(brackets):
            least = min(bracket.before.t, bracket.after.t) - _BEFORE * self.flow.clock
            low, before, after, high = bracket.low, bracket.before, bracket.after, bracket.high
            nearest: _Nearest | None = None
            for k in range(b * (_PARTS - 1), (b + 1) * (_PARTS - 1)):
                passage = next((one for one in tables[k].get(bracket.image, []) if one.t > least), None)
                if passage is None:
                    continue
                if nearest is None or passage.distance < nearest[1].distance:
                    nearest = values[k], passage, paths[k], rests[k]
                if passage.side * bracket.before.side > 0.0:
                    low, before = values[k], passage
                else:
                    high, after = values[k], passage
                    break
            narrowed.append(_Bracket(low, high, before, after, bracket.image, bracket.rest, nearest))
        return narrowed

    def _solved(
        self, value: float, passage: _Passage, path: Floats, rest: Floats, image: bool, parameter: str
    ) -> Connection:
        flow, step = self.flow, self.flow.clock / _FINE
        last = round(passage.t / step)
        pieces = pieces_for(flow, passage.t)
        every = max(1, last // pieces)
        where = np.arange(last % every, last + 1, every)
        nodes, span = path[where], float((len(where) - 1) * every * step)
        mirror = flow.mirror if image and flow.mirror is not None else np.ones(flow.dim)
        way = self.alone(value, rest)
        if way is not None and way[0] < 0.0:
            # Followed backward: the orbit comes from the target.
            nodes, rest = nodes[::-1].copy(), mirror * rest
        problem = Problem(flow, self.values_at(value), self.index, rest, mirror, nodes, span, value)
        return found_by(problem, parameter)


def _same(passage: _Passage, others: list[_Passage], clock: float) -> _Passage | None:
    """The passage at about the same time."""
    near = [other for other in others if abs(other.t - passage.t) < _BEFORE * clock]
    return min(near, key=lambda other: abs(other.t - passage.t)) if near else None
