"""Motion at a frame from the tracks around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.intervals import usual_interval
from udd.tracking.geometry.pose import Motion, Pose

from .tracks import Tracks

Array = NDArray[np.float64]
EACH_SIDE = 2  # neighbours on each side
NEAR = 3.5  # intervals: neighbours farther away are not used
LONG = 25.0  # pixels: longer streaks are fitted once more, from the refined poses of their neighbours
WEAK_MARKS = 3  # a long streak with fewer marks is not used for its neighbours
WEAK_OFF = 2.0  # pixels: the same for one whose marks disagree by more
# Friction makes the second derivative jump when a disk turns back. The error of its mean over an interval,
# times interval^2, is this factor of the leave-one-out residual (rms over the times of the jump).
JUMP = 1.10


@dataclass(frozen=True)
class Local:
    """Pose and its rates at one instant [pixels, rad, s]."""

    pose: Pose
    rate: complex
    spin: float
    bending: complex  # second derivative of the centre
    twisting: float
    tracked: bool  # by the first pass

    def motion(self, open_for: float) -> Motion:
        """Return the motion in an exposure."""
        return Motion.of_rates(self.rate, self.spin, self.bending, self.twisting, open_for)


def weak(tracks: Tracks) -> NDArray[np.bool_]:
    """Return True for frames with a long streak of too few marks, or of marks that disagree."""
    used = np.array([np.isfinite(c).sum() for c in tracks.chi2])
    off = np.array([np.nanmax(np.abs(x), initial=0.0) for x in tracks.residuals])
    long = tracks.streak > LONG
    return np.asarray(long & ((used < WEAK_MARKS) | (off > WEAK_OFF + 0.03 * tracks.streak)))


def interpolation_error(tracks: Tracks, variance: float) -> Array:
    """Estimate the errors (n, 3) of u, v, beta from the unknown paths between frames, with their signs.

    A streak shows the mean of its path. The distance from its middle is half the second derivative times the
    variance of the time [s^2] of the exposure. Polynomials through the neighbours give this derivative, but
    they do not follow the motion between frames. Their residual at the frame itself, left out, shows their
    error.
    """
    around = LocalMotion(tracks)
    factor = 0.5 * JUMP * variance / around.interval**2
    missed = [around.leave_one_out_residual(k) for k in range(len(tracks))]
    return factor * np.array([(centre.real, centre.imag, angle) for centre, angle in missed])


def to_mid_exposure(tracks: Tracks, covariance: Array, variance: float) -> Array:
    """Compute the covariances (n, 3, 3) of poses at mid-exposure from those of the means over the exposure.

    The distance of a path's mean from its middle, half the second derivative times `variance` [s^2], is
    subtracted. That derivative has the errors of the neighbours, and those of the frame itself with the
    opposite sign. With a shutter that is open all the time they increase the pose's error by a tenth.
    """
    around, out = LocalMotion(tracks), covariance.copy()
    good = np.asarray(np.isfinite(covariance).all(axis=(1, 2)))
    for k in np.flatnonzero(good):
        rows, weights = around.bending(int(k))
        if good[rows].all():
            share = (rows == k) - 0.5 * variance * weights
            out[k] = np.einsum("j,jab->ab", share**2, covariance[rows])
    return out


class LocalMotion:
    """The motion around each frame, from the poses of a first pass."""

    def __init__(self, tracks: Tracks, interval: float | None = None) -> None:
        self.t = tracks.t
        self.centre, self.angle = tracks.centre, tracks.angle
        self.good = np.flatnonzero(np.isfinite(self.angle) & ~weak(tracks))
        usual = usual_interval(self.t) if len(self.t) > 1 else 1.0
        self.interval = usual if interval is None else interval

    def _neighbours(self, k: int) -> tuple[NDArray[np.intp], Array, bool]:
        """Return the nearest frames on both sides, their distances in intervals, and True if k is tracked."""
        place = int(np.searchsorted(self.good, k))
        tracked = place < len(self.good) and bool(self.good[place] == k)
        low, high = max(0, place - EACH_SIDE), place + EACH_SIDE + tracked
        rows = self.good[low:high]
        x = (self.t[rows] - self.t[k]) / self.interval
        return rows[np.abs(x) < NEAR], x[np.abs(x) < NEAR], tracked

    def leave_one_out_residual(self, k: int) -> tuple[complex, float]:
        """Return the differences from the neighbours' prediction (centre, angle); 0 if they are too few."""
        rows, x, _ = self._neighbours(k)
        others = rows != k
        if others.all() or others.sum() < 2:
            return 0j, 0.0
        rows, x = rows[others], x[others]
        weights = np.linalg.inv(np.vander(x, len(x), increasing=True))[0]
        centre, angle = weights @ self.centre[rows], weights @ self.angle[rows]
        return complex(self.centre[k] - centre), float(self.angle[k] - angle)

    def bending(self, k: int) -> tuple[NDArray[np.intp], Array]:
        """Return the frames that give the second derivative at a frame, and their weights [1 / s^2]."""
        rows, x, tracked = self._neighbours(k)
        if len(rows) < 3 or not tracked:
            return np.array([k]), np.zeros(1)
        return rows, 2 * np.linalg.inv(np.vander(x, len(x), increasing=True))[2] / self.interval**2

    def at(self, k: int) -> Local | None:
        """Interpolate by polynomials through the nearest poses on both sides; None if too few are near."""
        rows, x, tracked = self._neighbours(k)
        if len(rows) < 3 or (not tracked and not (x.min() < 0 < x.max())):
            return None
        powers = np.linalg.inv(np.vander(x, len(x), increasing=True))[:3]
        c, a = powers @ self.centre[rows], powers @ self.angle[rows]
        place, angle = (self.centre[k], self.angle[k]) if tracked else (c[0], a[0])
        pose, h = Pose(complex(place), float(angle)), self.interval
        rate, bend = complex(c[1]) / h, 2 * complex(c[2]) / h**2
        return Local(pose, rate, float(a[1]) / h, bend, 2 * float(a[2]) / h**2, tracked)
