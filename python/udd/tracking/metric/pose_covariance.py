"""Errors of a pose, from the agreement of the marks of one disk."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import DiskAppearance
from udd.tracking.passes.tracks import Tracks

from .streak_errors import mark_residuals, new_poses, unit_covariance

Array = NDArray[np.float64]
OUTLIER = 6.0  # Times the usual disagreement. A frame beyond does not count for the others.
ALIKE = 1000.0  # Weight of a usual frame, in coordinates, if frames differ by no more than chance.
GROUP = 40  # Frames with similar streaks that give the usual disagreement.


def covariance(tracks: Tracks, look: DiskAppearance) -> Array:
    """Covariance (n, 3, 3) of (u, v, beta) in pixels and rad, of what moves each mark for itself.

    The fit's own covariance assumes independent pixels of known noise. Errors by compression, lens and light
    are neither. The marks' disagreement along and across their streaks shows them: a rigid disk leaves 2 m -
    3 of the 2 m coordinates of m marks over.
    """
    new, used = new_poses(tracks, look.reach), np.isfinite(tracks.chi2)
    off = mark_residuals(tracks, new)
    spare = np.maximum(2 * used.sum(axis=1) - 3, 0)
    chi2 = np.einsum("nmi,nmij,nmj->nm", off, tracks.marks.astype(float), off)
    total = np.where(used, chi2, 0.0).sum(axis=1)
    usual, belief, group = _usual(total, spare, tracks.streak, new)
    # a frame's disagreement counts with that of similar frames, whose weight is a number of coordinates
    inflation = (belief * usual + total) / (belief + spare)
    return np.asarray(inflation[:, None, None] * unit_covariance(tracks, look, off, group, new))


def add_shared_errors(covariance: Array, centre_sigma: float, shared: Sequence[Array]) -> Array:
    """Add errors that move all marks together, and the error of the centre, to the covariance.

    Only the rim gives the place of the centre among the marks. Its error rotates with the disk. `shared`
    are standard errors (n, 3) of u, v and beta, signed alike.
    """
    out = covariance + np.diag([centre_sigma**2, centre_sigma**2, 0.0])
    for cause in shared:
        out = out + cause[:, :, None] * cause[:, None, :]
    return np.asarray(out)


def _usual(
    total: Array, spare: NDArray[np.int_], streak: Array, new: NDArray[np.bool_]
) -> tuple[Array, Array, NDArray[np.int_]]:
    """Return the misfit per spare coordinate of frames with like streaks, its weight and their group.

    The weight is a number of coordinates. Only frames with a new pose show it. The frames' variances differ,
    1 / variance being gamma distributed. The mean of a variance, given the frame's misfit, is a weighted mean
    of that and the usual one. The less the frames scatter, the more the usual misfit counts.
    """
    out, belief = np.ones(len(total)), np.full(len(total), ALIKE)
    which = np.full(len(total), -1)
    rows = np.flatnonzero(spare > 0)
    order = rows[np.argsort(streak[rows], kind="stable")]
    showing = order[new[order]]
    if not len(showing):
        return out, belief, which
    groups = np.array_split(showing, max(1, min(6, len(showing) // GROUP)))
    ends = np.array([streak[group].max() for group in groups[:-1]])
    number_of = np.searchsorted(ends, streak[order])
    for number, group in enumerate(groups):
        each = total[group] / spare[group]
        most = OUTLIER * float(np.median(each))
        each = np.minimum(each, most)
        level = float(np.sum(each * spare[group]) / spare[group].sum())
        members = order[number_of == number]
        out[members], belief[members] = level, _belief(each / level, spare[group])
        which[members] = number
    return out, belief, which


def _belief(each: Array, spare: NDArray[np.int_]) -> float:
    """Estimate by moments, from misfits per spare coordinate with mean 1: chance scatters them by 2 / spare.

    A variance with relative scatter s has 1 / s more than 2 of its inverse's degrees of freedom in doubles.
    """
    chance = float(np.mean(2 / spare))
    scatter = (float(np.mean((each - 1) ** 2)) - chance) / (1 + chance)
    return min(2 + 2 / scatter, ALIKE) if scatter > 0 else ALIKE
