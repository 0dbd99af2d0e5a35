"""How large the errors of a pose are, judged by how well the marks of one disk agree with each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .loop import Tracks

Array = NDArray[np.float64]
OUTLIER = 6.0  # times the usual disagreement; a frame beyond does not speak for the others
ALIKE = 1000.0  # coordinates that stand for a usual frame where frames differ by no more than chance
GROUP = 40  # frames with like streaks from which their usual disagreement is taken


def covariance(tracks: Tracks, centre_sigma: float = 0.0, shared: Sequence[Array] = ()) -> Array:
    """Covariance (n, 3, 3) of (u, v, beta) in pixels and rad, the centre known to so much.

    The fit's own covariance assumes independent pixels of known noise. Compression, lens and light
    are neither; the marks' disagreement shows by how much: a rigid disk leaves 2 m - 3 of the 2 m
    coordinates of m marks over. Where the centre is among them only the rim says; what it is off by turns
    with the disk. `shared` are standard errors (n, 3), signed alike, of causes that move all marks together.
    """
    chi2, info = np.array(tracks.chi2), np.array(tracks.information)
    marks = np.isfinite(chi2).sum(axis=1)
    spare = np.maximum(2 * marks - 3, 0)
    total = np.nansum(chi2, axis=1)
    usual, belief = _usual(total, spare, np.array(tracks.streak))
    # a frame's own disagreement counts too, beside that of frames like it as if they were so many coordinates
    inflation = (belief * usual + total) / (belief + spare)
    good = np.isfinite(info).all(axis=(1, 2))
    out = np.full(info.shape, np.nan)
    if good.any():
        out[good] = inflation[good, None, None] * np.linalg.inv(info[good])
        out[good] += np.diag([centre_sigma**2, centre_sigma**2, 0.0])
        for cause in shared:
            out[good] += cause[good, :, None] * cause[good, None, :]
    return out


def _usual(total: Array, spare: NDArray[np.int_], streak: Array) -> tuple[Array, Array]:
    """Misfit per spare coordinate that frames with like streaks have, and the coordinates that is worth.

    Of a variance that itself is drawn anew for each frame, 1 / variance being gamma distributed, the mean
    given a frame's misfit is that of both, and the less they scatter the more the usual one counts.
    """
    out, belief = np.ones(len(total)), np.full(len(total), ALIKE)
    known = np.flatnonzero(spare > 0)
    order = known[np.argsort(streak[known], kind="stable")]
    groups = np.array_split(order, max(1, min(6, len(order) // GROUP))) if len(order) else []
    for group in groups:
        each = total[group] / spare[group]
        most = OUTLIER * float(np.median(each))
        each = np.minimum(each, most)
        level = float(np.sum(each * spare[group]) / spare[group].sum())
        out[group], belief[group] = level, _belief(each / level, spare[group])
    if groups:  # where two marks leave nothing over, the film as a whole has to do
        rest = np.setdiff1d(np.arange(len(total)), known)
        ends = np.array([streak[g].max() for g in groups])
        first = np.array([g[0] for g in groups])
        like = first[np.minimum(np.searchsorted(ends, streak[rest]), len(groups) - 1)]
        out[rest], belief[rest] = out[like], belief[like]
    return out, belief


def _belief(each: Array, spare: NDArray[np.int_]) -> float:
    """By moments, from misfits per spare coordinate with the mean 1: chance alone scatters them by 2 / spare.

    A variance with relative scatter s has 1 / s more than 2 of its inverse's degrees of freedom in doubles.
    """
    chance = float(np.mean(2 / spare))
    scatter = (float(np.mean((each - 1) ** 2)) - chance) / (1 + chance)
    return min(2 + 2 / scatter, ALIKE) if scatter > 0 else ALIKE
