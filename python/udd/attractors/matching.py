"""Matching of attractors at successive parameter values: which continues which, and hysteresis."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from udd.chaos.recurrence import Tightness
from udd.models.state_scaling import Coordinates, Floats

from .attractor import Attractor, alike, distance_between, mirrored


def groups(attractors: list[Attractor], tight: Tightness) -> list[int]:
    """Return the place of the first equal attractor for each attractor."""
    first: list[int] = []
    for k, attractor in enumerate(attractors):
        same = (j for j in sorted(set(first)) if alike(attractors[j], attractor, tight))
        first.append(next(same, k))
    return first


def mirror_images(
    attractors: list[Attractor], of: int, coordinates: Coordinates, tight: Tightness
) -> list[int]:
    """Return the places of an attractor's mirror images, its own included if it is symmetric."""
    images = [mirrored(attractors[of], sign, coordinates) for sign in coordinates.mirrors]
    return [k for k, other in enumerate(attractors) if any(alike(image, other, tight) for image in images)]


@dataclass
class AttractorMatcher:
    """Labels for attractors, from 1 on, carried from value to value.

    An attractor continues the one whose points were nearest at the value before (where it was last seen),
    unless the mean distance is above `reach`; each continues one at most.
    """

    reach: float
    last: dict[int, Attractor] = field(default_factory=dict)

    def label(self, attractors: list[Attractor]) -> list[int]:
        """Label the distinct attractors at the next value."""
        from scipy.optimize import linear_sum_assignment

        last_attractors = list(self.last)
        labels = [0] * len(attractors)
        if last_attractors and attractors:
            cost = np.array(
                [[distance_between(self.last[label], one) for label in last_attractors] for one in attractors]
            )
            for k, j in zip(*linear_sum_assignment(np.minimum(cost, 1e3 * self.reach)), strict=True):
                if cost[k, j] <= self.reach:
                    labels[k] = last_attractors[j]
        for k, label in enumerate(labels):
            labels[k] = label or len(self.last) + 1
            self.last[labels[k]] = attractors[k]
        return labels


def intervals(where: NDArray[np.bool_], unknown: NDArray[np.bool_], values: Floats) -> Floats:
    """Return the first and last value of every stretch, shape (stretches, 2); unknown values end none."""
    result: list[list[float]] = []
    open_ = False
    for value, here, gap in zip(values.tolist(), where.tolist(), unknown.tolist(), strict=True):
        if here and open_:
            result[-1][1] = value
        elif here:
            result.append([value, value])
        open_ = here or (open_ and gap)
    return np.array(result).reshape(-1, 2)
