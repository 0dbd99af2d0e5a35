"""The pose of a rigid body from the offsets of its marks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import Mark

from .localization import Sighting

Array = NDArray[np.float64]
_NOTHING, _NOWHERE = np.zeros((2, 2)), np.zeros(2)


@dataclass(frozen=True)
class Step:
    """A correction of the pose: pixels, pixels, rad; its information for unit noise; misfit per mark."""

    change: Array
    information: Array
    residuals: Array  # (marks, 2): what remains of each offset [pixels], NaN where not seen
    chi2: Array  # (marks,): squared misfit in units of unit noise


def solve(
    marks: Sequence[Mark], sightings: Sequence[Sighting | None], angle: float, weights: Array
) -> Step | None:
    """Least-squares pose correction (du, dv, dbeta) from the marks seen, or None if it is not determined."""
    places = np.array([m.place for m in marks])
    arms = 1j * places * np.exp(1j * angle)
    maps = np.zeros((len(marks), 2, 3))
    maps[:, 0, 0] = maps[:, 1, 1] = 1.0
    maps[:, 0, 2], maps[:, 1, 2] = arms.real, arms.imag
    information = np.array([_NOTHING if s is None else s.information for s in sightings])
    offset = np.array([_NOWHERE if s is None else s.offset for s in sightings])
    trusted = np.where(np.asarray(weights) > 0, weights, 0.0)[:, None, None] * information
    weighted = (trusted @ maps).reshape(-1, 3)
    normal = maps.reshape(-1, 3).T @ weighted
    right = weighted.T @ offset.ravel()
    reach = max(abs(m.place) for m in marks)
    scale = np.diag([1.0, 1.0, 1 / reach])  # so that pixels compare with pixels
    eigen = np.linalg.eigvalsh(scale @ normal @ scale)
    if eigen[0] <= 1e-4 * max(eigen[-1], 1e-12):
        return None
    change = np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
    residuals = offset - maps @ change
    chi2 = (residuals[:, None, :] @ information @ residuals[:, :, None])[:, 0, 0]
    unseen = np.array([s is None for s in sightings])
    residuals[unseen], chi2[unseen] = np.nan, np.nan
    return Step(change, normal, residuals, chi2)
