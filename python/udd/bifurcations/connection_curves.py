"""Homoclinic and heteroclinic orbits over two parameters."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from udd.errors import IntegrationError, ModelError

from .branch_continuation import unit_of
from .connecting_orbits import Connection, Problem, found_by
from .flow_map import Floats

__all__ = ["ConnectionWay"]

_NEAR = 2e-2  # typical sizes from the equilibrium, where the orbit is cut before it is prolonged anew
_TURN = 0.9  # least cosine between one direction and the next
_SHORTEST = 1e-4  # step


@dataclass(frozen=True)
class ConnectionWay:
    """How a curve of connections is followed in the plane of two parameters.

    Attributes
    ----------
    parameters : (str, str)
    box : ndarray, shape (2, 2)
        Bounds of both.
    step, longest : float
    most : int
    """

    parameters: tuple[str, str]
    box: Floats
    step: float
    longest: float
    most: int

    def follow(self, start: Connection, sense: float) -> tuple[list[tuple[Floats, Connection]], str]:
        """Both parameters and the connections, and why the curve ends."""
        problem = start._problem
        if problem is None:
            raise ModelError("this connection was not made by udd.connection or udd.connections")
        indices = [problem.flow.index(name) for name in self.parameters]
        p = problem.values_at(start.value)[indices]
        pairs = zip(p.tolist(), self.box.tolist(), strict=True)
        # In the plane of the parameters alone the curve is nearly straight: long steps.
        unit = 5.0 * np.array([unit_of(value, *bounds) for value, bounds in pairs])
        found, direction, step = [(p, start)], np.array([0.0, sense]), self.step
        while len(found) <= self.most:
            trial, reason = None, "the curve turns too sharply"
            while trial is None and step >= _SHORTEST:
                guess = p + step * direction * unit
                k = int(np.argmax(np.abs(direction)))
                bound = self._bound(guess, k)
                if bound is not None:
                    guess = p + (bound - p[k]) / (direction[k] * unit[k]) * direction * unit
                    guess[k] = bound
                if bound is not None and abs(guess[k] - p[k]) < 1e-9 * unit[k]:
                    return found, f"the bound {bound:.6g}"
                try:
                    trial = self._solved(found[-1][1], indices, guess, k)
                    there = guess.copy()
                    there[1 - k] = trial.value
                    way = (there - p) / unit
                    if way @ direction < _TURN * np.linalg.norm(way) and len(found) > 1:
                        trial = None
                except (ModelError, IntegrationError, np.linalg.LinAlgError) as error:
                    reason = str(error)
                step = step if trial is not None else 0.5 * step
            if trial is None:
                return found, f"lost: {reason}"
            outside = self._bound(there, 1 - k)
            if outside is not None:
                found += self._at_bound(found[-1][1], indices, p, there, 1 - k, outside)
                return found, f"the bound {outside:.6g}"
            p, direction = there, way / np.linalg.norm(way)
            found.append((p, self._named(trial, p)))
            if bound is not None:
                return found, f"the bound {bound:.6g}"
            step = min(self.longest, 1.4 * step)
        return found, "as many points as were wanted"

    def _named(self, found: Connection, p: Floats) -> Connection:
        """The connection over the first parameter, whichever of them was solved for."""
        if found.parameter == self.parameters[0]:
            return found
        problem = copy.copy(found._problem)
        assert problem is not None
        problem.values = problem.values_at(problem.value)
        problem.parameter, problem.value = problem.flow.index(self.parameters[0]), float(p[0])
        problem._rests = {}
        try:
            return found_by(problem, self.parameters[0])
        except (ModelError, IntegrationError):
            return found

    def _bound(self, p: Floats, k: int) -> float | None:
        low, high = self.box[k].tolist()
        return None if low <= p[k] <= high else low if p[k] < low else high

    def _at_bound(
        self, near: Connection, indices: list[int], p: Floats, there: Floats, k: int, bound: float
    ) -> list[tuple[Floats, Connection]]:
        guess = p + (there - p) * ((bound - p[k]) / (there[k] - p[k]))
        guess[k] = bound
        try:
            found = self._solved(near, indices, guess, k)
        except (ModelError, IntegrationError, np.linalg.LinAlgError):
            return []
        guess[1 - k] = found.value
        return [(guess, self._named(found, guess))]

    def _solved(self, near: Connection, indices: list[int], guess: Floats, fixed: int) -> Connection:
        """The connection near another one at a value of the `fixed` parameter, by the other parameter."""
        assert near._problem is not None
        problem = trimmed(near._problem)
        values = problem.values.copy()
        values[indices] = guess
        problem.values, problem.parameter = values, indices[1 - fixed]
        problem.value, problem._rests = float(guess[1 - fixed]), {}
        return found_by(problem, self.parameters[1 - fixed])


def trimmed(problem: Problem) -> Problem:
    """The orbit without what lies near the equilibrium at its ends, which is prolonged for other values."""
    rest = problem.rest(problem.value)
    short, size = copy.copy(problem), problem.flow.size
    first = np.linalg.norm((problem.nodes - rest) / size, axis=1) > _NEAR
    last = np.linalg.norm((problem.mirror * problem.nodes - rest) / size, axis=1) > _NEAR
    begin, end = max(int(np.argmax(first)) - 1, 0), len(last) - max(int(np.argmax(last[::-1])) - 1, 0)
    short.nodes = problem.nodes[begin:end].copy()
    short.span = problem.span * (len(short.nodes) - 1) / (len(problem.nodes) - 1)
    return short
