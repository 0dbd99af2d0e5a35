"""How large the errors of a pose are, judged by how well the marks of one disk agree with each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .loop import Tracks

Array = NDArray[np.float64]
MOST = 10.0  # a frame worse than this many times the assumed noise does not speak for the film
BELIEF = 5.0


def covariance(tracks: Tracks) -> Array:
    """Covariance (n, 3, 3) of (u, v, beta) in pixels and rad.

    The fit's own covariance assumes independent pixels of known noise. Compression, lens and light
    are neither; the marks' disagreement shows by how much: a rigid disk leaves 2 m - 3 of the 2 m
    coordinates of m marks over.
    """
    chi2, info = np.array(tracks.chi2), np.array(tracks.information)
    marks = np.isfinite(chi2).sum(axis=1)
    spare = np.maximum(2 * marks - 3, 0)
    total = np.nansum(chi2, axis=1)
    known = spare > 0
    usual = max(1.0, float(np.sum(np.minimum(total, MOST * spare)[known]) / max(spare[known].sum(), 1)))
    # a frame's own disagreement counts too, beside the whole film's as if that were `BELIEF` more coordinates
    inflation = (BELIEF * usual + total) / (BELIEF + spare)
    good = np.isfinite(info).all(axis=(1, 2))
    out = np.full(info.shape, np.nan)
    if good.any():
        out[good] = inflation[good, None, None] * np.linalg.inv(info[good])
    return out
