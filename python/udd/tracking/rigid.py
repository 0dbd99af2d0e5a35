"""The pose of a rigid body from the offsets of its marks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .look import Mark
from .marks import Sighting

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Step:
    """A correction of the pose: pixels, pixels, rad; its information for unit noise; misfit per mark."""

    change: Array
    information: Array
    leftover: Array  # (marks, 2): what remains of each offset [pixels], NaN where not seen
    chi2: Array  # (marks,): squared misfit in units of unit noise


def solve(
    marks: Sequence[Mark], sightings: Sequence[Sighting | None], angle: float, weights: Array
) -> Step | None:
    """Least-squares pose correction (du, dv, dbeta) from the marks seen, or None if it is not determined."""
    normal, right = np.zeros((3, 3)), np.zeros(3)
    arms = [1j * m.place * np.exp(1j * angle) for m in marks]
    maps = [np.array([[1.0, 0.0, a.real], [0.0, 1.0, a.imag]]) for a in arms]
    for m, s, w in zip(maps, sightings, weights, strict=True):
        if s is not None and w > 0:
            normal += w * m.T @ s.information @ m
            right += w * m.T @ s.information @ s.offset
    reach = abs(marks[0].place)
    scale = np.diag([1.0, 1.0, 1 / reach])  # so that pixels compare with pixels
    eigen = np.linalg.eigvalsh(scale @ normal @ scale)
    if eigen[0] <= 1e-4 * max(eigen[-1], 1e-12):
        return None
    change = np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
    leftover, chi2 = np.full((len(marks), 2), np.nan), np.full(len(marks), np.nan)
    for k, (m, s) in enumerate(zip(maps, sightings, strict=True)):
        if s is not None:
            leftover[k] = s.offset - m @ change
            chi2[k] = leftover[k] @ s.information @ leftover[k]
    return Step(change, normal, leftover, chi2)
