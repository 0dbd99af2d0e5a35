"""Invariant manifolds of dimension one: the eigendirection of an equilibrium that is alone on its side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .equilibrium_curve import expansion
from .flow_map import Floats, FlowMap


@dataclass(frozen=True, eq=False)
class Eigendirection:
    """An eigenvalue and its vector, in typical sizes; the vector's largest component is positive."""

    number: float
    vector: Floats
    _turn: float
    _place: int
    _right: np.ndarray

    @property
    def left(self) -> Floats:
        """The left eigenvector, which vanishes on the other directions; 1 times the vector."""
        own: Floats = self._turn * np.linalg.inv(self._right)[self._place].real
        return own


def direction_alone(flow: FlowMap, values: Floats, rest: Floats, side: float) -> Eigendirection | None:
    """The only growing (`side` > 0) or the only other eigendirection of an equilibrium; None for several."""
    numbers, right = np.linalg.eig(flow.scaled(expansion(flow, values, rest).by_state))
    growing = numbers.real > 0.0
    alone = np.flatnonzero(growing if side > 0.0 else ~growing)
    if len(alone) != 1 or len(numbers) < 2:
        return None
    place = int(alone[0])
    vector = right[:, place].real
    turn = float(np.sign(vector[np.argmax(np.abs(vector))]))
    return Eigendirection(float(numbers[place].real), turn * vector, turn, place, right)
