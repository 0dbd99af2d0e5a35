"""How large the errors of a pose are, judged by how well the marks of one disk agree with each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .loop import Tracks

Array = NDArray[np.float64]


def covariance(tracks: Tracks, reach: float) -> Array:
    """Covariance (n, 3, 3) of (u, v, beta) in pixels and rad.

    The fit's own covariance assumes independent pixels of known noise. Compression, lens and light
    are neither; the marks' disagreement shows by how much: a rigid disk leaves 2 m - 3 of the 2 m
    coordinates of m marks over.
    """
    chi2, info = np.array(tracks.chi2), np.array(tracks.information)
    marks = np.isfinite(chi2).sum(axis=1)
    spare = 2 * marks - 3
    total = np.nansum(chi2, axis=1)
    ok = spare > 0
    inflation = max(1.0, float(np.sum(np.minimum(total, 50 * spare)[ok]) / max(spare[ok].sum(), 1)))
    good = np.isfinite(info).all(axis=(1, 2))
    out = np.full(info.shape, np.nan)
    if good.any():
        out[good] = inflation * np.linalg.inv(info[good])
    return out
