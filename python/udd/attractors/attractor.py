"""Attractors as point sets on a section, and when two of them are one and the same."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd.chaos.recurrence import APERIODIC, Tightness
from udd.models.state_scaling import Coordinates, Floats

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

KINDS = ("equilibrium", "periodic", "aperiodic")
"""Aperiodic is chaos, a quasi-periodic motion, or a period above a third of the points."""

_QUANTILE = 0.9
_SHARE = 0.5  # of the points that must lie within a set: 0.9 are expected, of a disjoint one none
_SPREAD = 0.25  # of the set's points that are nearest to one: about 0.55 are expected


@dataclass(frozen=True, eq=False)
class Attractor:
    """Points of a section (for an equilibrium, the one state) that a motion comes back to.

    Attributes
    ----------
    kind : str
        A member of `KINDS`.
    states : ndarray (k, dim)
        The distinct points of a period. An aperiodic attractor has all its points.
    points : ndarray (k, m)
        The same in the coordinates of comparison.
    duration : float
        Time of a period. NaN if the attractor is aperiodic.
    """

    kind: str
    states: Floats
    points: Floats
    duration: float = float("nan")

    @property
    def period(self) -> int:
        """The number of section points, 0 where it is aperiodic."""
        return APERIODIC if self.kind == "aperiodic" else len(self.states)

    @cached_property
    def tree(self) -> cKDTree:
        """Return a tree of the points, for the nearest ones."""
        from scipy.spatial import cKDTree

        return cKDTree(self.points)

    @cached_property
    def spacing(self) -> float:
        """Within this distance of a point of the set, nine times in ten there is another."""
        distance, _ = self.tree.query(self.points, k=2)
        return float(np.quantile(distance[:, 1], _QUANTILE))

    def holds(self, points: Floats, tight: Tightness) -> NDArray[np.bool_]:
        """Return True for the records (..., k, m) of the same kind that lie on this attractor.

        Points of a periodic orbit must be near those of the attractor. Most points of an aperiodic motion
        must lie as near to the set as its points do to each other, and must be spread over all of it.
        Different attractors have no point in common, but a transient may pass over an attractor.
        """
        distance, nearest = self.tree.query(points)
        if self.kind != "aperiodic":
            return np.asarray(distance.max(axis=-1) < tight.same)
        within = (distance <= self.spacing).mean(axis=-1) > _SHARE
        ordered = np.sort(nearest, axis=-1)
        met = 1 + (np.diff(ordered, axis=-1) > 0).sum(axis=-1)
        most = min(len(self.points), points.shape[-2])
        return np.asarray(within & (met > _SPREAD * most))


def alike(first: Attractor, other: Attractor, tight: Tightness) -> bool:
    """Return True if two records lie on the same attractor."""
    if first.kind != other.kind and "aperiodic" in (first.kind, other.kind):
        # Chaos in bands so narrow that they look like points.
        periodic, bands = (other, first) if first.kind == "aperiodic" else (first, other)
        return bool(periodic.holds(bands.points, tight))
    return bool(first.holds(other.points, tight) and other.holds(first.points, tight))


def distance_between(one: Attractor, other: Attractor) -> float:
    """Compute the distance of two sets of points: the mean distance to the nearest point of the other set."""
    there, _ = one.tree.query(other.points)
    back, _ = other.tree.query(one.points)
    return max(float(there.mean()), float(back.mean()))


def mirrored(attractor: Attractor, sign: Floats, coordinates: Coordinates) -> Attractor:
    """Return the mirror image."""
    states = sign * attractor.states
    return Attractor(attractor.kind, states, coordinates(states), attractor.duration)
