"""Invariant manifolds of dimension one: the eigendirection of an equilibrium that is alone on its side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .equilibrium_curve import expansion
from .flow_map import Floats, FlowMap

__all__ = ["AWAY", "FAR", "FINE", "LEAVES", "Eigendirection", "direction_alone"]

AWAY = 1e-6  # Distance from the equilibrium, in typical sizes, within which the manifold is straight.
FINE = 24  # Samples in a typical time along a manifold.
FAR = 30.0  # Typical sizes, beyond which nothing comes back.
LEAVES = 80  # Most typical times in which a manifold leaves the equilibrium.


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
