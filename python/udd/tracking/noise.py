"""How large the errors of a pose are, judged by how well the marks of one disk agree with each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .loop import Tracks

Array = NDArray[np.float64]
OUTLIER = 6.0  # times the usual disagreement; a frame beyond does not speak for the others
BELIEF = 5.0  # a frame is trusted as if the film had told this many coordinates about it
GROUP = 40  # frames with like streaks from which their usual disagreement is taken


def covariance(tracks: Tracks, centre_sigma: float = 0.0) -> Array:
    """Covariance (n, 3, 3) of (u, v, beta) in pixels and rad, the centre known to so much.

    The fit's own covariance assumes independent pixels of known noise. Compression, lens and light
    are neither; the marks' disagreement shows by how much: a rigid disk leaves 2 m - 3 of the 2 m
    coordinates of m marks over. Where the centre is among them only the rim says; what it is off by turns
    with the disk.
    """
    chi2, info = np.array(tracks.chi2), np.array(tracks.information)
    marks = np.isfinite(chi2).sum(axis=1)
    spare = np.maximum(2 * marks - 3, 0)
    total = np.nansum(chi2, axis=1)
    usual = _usual(total, spare, np.array(tracks.streak))
    # a frame's own disagreement counts too, beside the whole film's as if that were `BELIEF` more coordinates
    inflation = (BELIEF * usual + total) / (BELIEF + spare)
    good = np.isfinite(info).all(axis=(1, 2))
    out = np.full(info.shape, np.nan)
    if good.any():
        out[good] = inflation[good, None, None] * np.linalg.inv(info[good])
        out[good] += np.diag([centre_sigma**2, centre_sigma**2, 0.0])
    return out


def _usual(total: Array, spare: NDArray[np.int_], streak: Array) -> Array:
    """Misfit per spare coordinate that frames with like streaks have, at least that of the assumed noise."""
    out = np.ones(len(total))
    known = np.flatnonzero(spare > 0)
    order = known[np.argsort(streak[known], kind="stable")]
    groups = np.array_split(order, max(1, min(6, len(order) // GROUP))) if len(order) else []
    for group in groups:
        each = total[group] / spare[group]
        most = OUTLIER * float(np.median(each))
        level = float(np.sum(np.minimum(each, most) * spare[group]) / spare[group].sum())
        out[group] = max(1.0, level)
    if groups:  # where two marks leave nothing over, the film as a whole has to do
        rest = np.setdiff1d(np.arange(len(total)), known)
        ends = np.array([streak[g].max() for g in groups])
        levels = np.array([out[g[0]] for g in groups])
        out[rest] = levels[np.minimum(np.searchsorted(ends, streak[rest]), len(groups) - 1)]
    return out
