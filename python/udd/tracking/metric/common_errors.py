"""Errors that all marks of a frame share: their agreement hides these, jumps of the rolling disk do not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from udd.tracking.geometry.intervals import usual_interval
from udd.tracking.geometry.pose import moved_by_pose
from udd.tracking.passes.tracks import Tracks

from .pixels_to_metres import Camera

Array = NDArray[np.float64]
GROUP = 80  # frames with like streaks that share as much
CLOSE = 2.5  # usual intervals that three frames in a row may span
OUTLIER = 6.0  # times the median; a jump beyond is cut down to that: the disk may have slipped or been let go
CUT = 1 - 2**-OUTLIER  # of their mean that squares of two normal coordinates keep so
SECOND = np.array([1.0, -2.0, 1.0])  # difference
# standard error of such a mean, times the root of their number: fourth differences that overlap go together,
# so that there are 2.6 times fewer
SCATTER = 2.6**0.5


def common_mode_errors(tracks: Tracks, covariance: Array, camera: Camera) -> Array:
    """Standard error (n,) of u and of v that `covariance` lacks; 0 where it is less than its own error.

    Codecs move all that goes the same way alike, by a vector or by leaving out what changes little. A disk
    that rolls keeps (see `pivot`)  (c - p) exp(-i angle) - d * integral exp(-i angle) dt . Slip changes that
    evenly over three frames in a row, so its second difference shows the errors of the frames. If the law of
    rolling fails, by a slip that depends on the place of the disk or by a wrong contact, that difference is
    not noise. Seen from the wheels it then changes little between frames, so the second difference of the
    second differences is used.
    """
    out = np.zeros(len(tracks))
    if not np.isfinite(camera.drive):
        return out
    seen, expected = _jumps(tracks, covariance, camera)
    streak = tracks.streak
    rows = np.flatnonzero(np.isfinite(seen))
    order = rows[np.argsort(streak[rows], kind="stable")]
    if len(order) < GROUP:
        return out
    groups = np.array_split(order, len(order) // GROUP if np.isfinite(streak[order]).all() else 1)
    excess = np.array([_excess(seen[g], expected[g]) for g in groups])
    ends = np.array([streak[g].max() for g in groups])
    return np.asarray(np.sqrt(excess[np.minimum(np.searchsorted(ends, streak), len(groups) - 1)]))


def _jumps(tracks: Tracks, covariance: Array, camera: Camera) -> tuple[Array, Array]:
    """Squares of differences and what is expected, for unit weights [pixels^2], per frame; NaN for none."""
    t, angle = tracks.t, tracks.angle
    away = tracks.centre - camera.pivot
    drive = complex(np.conj(camera.drive)) * camera.scale
    good = np.asarray(np.isfinite(covariance).all(axis=(1, 2)))
    maps = moved_by_pose(-away)  # of a pose's error to that of c - p where the angle is taken out
    variance = np.einsum("nij,njk,nik->n", maps, covariance, maps)
    usual = usual_interval(t) if len(t) > 1 else 1.0
    second, weights = np.full(len(t), np.nan + 0j), np.zeros((len(t), 3), dtype=complex)
    for k in range(1, len(t) - 1):
        three = slice(k - 1, k + 2)
        if not good[three].all() or t[k + 1] - t[k - 1] > CLOSE * usual:
            continue
        about = np.flatnonzero(good[max(0, k - 2) : k + 3]) + max(0, k - 2)
        swept = CubicSpline(t[about], np.exp(-1j * (angle[about] - angle[k]))).antiderivative()(t[three])
        weights[k] = SECOND * np.exp(-1j * (angle[three] - angle[k]))
        second[k] = weights[k] @ away[three] - drive * (SECOND @ swept)
    seen, expected = np.full(len(t), np.nan), np.full(len(t), np.nan)
    for k in range(2, len(t) - 2):
        each = np.zeros(5, dtype=complex)
        for start, (times, row) in enumerate(zip(SECOND, weights[k - 1 : k + 2], strict=True)):
            each[start : start + 3] += times * row
        size = np.abs(each) ** 2
        difference = SECOND @ second[k - 1 : k + 2]
        if np.isfinite(difference):
            seen[k] = abs(difference) ** 2 / size.sum()
            expected[k] = size @ variance[k - 2 : k + 3] / size.sum()
    return seen, expected


def _excess(seen: Array, expected: Array) -> float:
    """Variance of u and of v with which the mean is what it is expected to be."""

    def ratio(excess: float) -> float:
        each = seen / (expected + 2 * excess)
        return float(np.minimum(each, OUTLIER * np.median(each)).mean()) / CUT

    if ratio(0.0) < 1 + SCATTER / np.sqrt(len(seen)):
        return 0.0
    return float(brentq(lambda surplus: ratio(surplus) - 1, 0.0, float(seen.max()), rtol=1e-6))
