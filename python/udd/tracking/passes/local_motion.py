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
NEAR = 3.5  # intervals within which a neighbour tells anything
LONG = 25.0  # pixels; longer streaks are gone over once more, with what their neighbours turned out to be
WEAK_MARKS = 3  # a long streak with fewer marks does not speak for its neighbours
WEAK_OFF = 2.0  # pixels; nor does one whose marks disagree by more
# where the second derivative jumps, as friction makes it where a disk turns back: its error times interval^2
# against the miss, rms over the times at which it may jump, for the mean over a whole interval
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
    """Frames with long streaks of too few marks, or of marks that disagree."""
    used = np.array([np.isfinite(c).sum() for c in tracks.chi2])
    off = np.array([np.nanmax(np.abs(x), initial=0.0) for x in tracks.residuals])
    long = tracks.streak > LONG
    return np.asarray(long & ((used < WEAK_MARKS) | (off > WEAK_OFF + 0.03 * tracks.streak)))


def interpolation_error(tracks: Tracks, variance: float) -> Array:
    """Standard errors (n, 3) of u, v, beta, signed alike, from paths between frames that are not quite known.

    A streak shows the mean of its path. The distance from its middle is half the second derivative times the
    variance of the time [s^2] of the exposure. The polynomials that tell this derivative do not know
    what happens between frames; how far they miss the frame itself when it is left out shows how much.
    """
    around = LocalMotion(tracks)
    factor = 0.5 * JUMP * variance / around.interval**2
    missed = [around.leave_one_out_residual(k) for k in range(len(tracks))]
    return factor * np.array([(centre.real, centre.imag, angle) for centre, angle in missed])


def to_mid_exposure(tracks: Tracks, covariance: Array, variance: float) -> Array:
    """Covariances (n, 3, 3) of poses in the middle of paths whose bending poses with those errors told.

    The distance of a path's mean from its middle, half the second derivative times `variance` [s^2], is
    subtracted. That derivative has the errors of the frame itself, against the sign, and of its neighbours:
    of a
    shutter that is open all the time they make the pose worse by a tenth.
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
    """A first pass, to be looked at around each of its frames."""

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
        """Return how centre and angle differ from the neighbours' prediction; 0 if these are too few."""
        rows, x, _ = self._neighbours(k)
        others = rows != k
        if others.all() or others.sum() < 2:
            return 0j, 0.0
        rows, x = rows[others], x[others]
        weights = np.linalg.inv(np.vander(x, len(x), increasing=True))[0]
        centre, angle = weights @ self.centre[rows], weights @ self.angle[rows]
        return complex(self.centre[k] - centre), float(self.angle[k] - angle)

    def bending(self, k: int) -> tuple[NDArray[np.intp], Array]:
        """Frames that tell the second derivative at a frame that is tracked, and their weights [1 / s^2]."""
        rows, x, tracked = self._neighbours(k)
        if len(rows) < 3 or not tracked:
            return np.array([k]), np.zeros(1)
        return rows, 2 * np.linalg.inv(np.vander(x, len(x), increasing=True))[2] / self.interval**2

    def at(self, k: int) -> Local | None:
        """Polynomials through the nearest poses on both sides; None where too few are near."""
        rows, x, tracked = self._neighbours(k)
        if len(rows) < 3 or (not tracked and not (x.min() < 0 < x.max())):
            return None
        powers = np.linalg.inv(np.vander(x, len(x), increasing=True))[:3]
        c, a = powers @ self.centre[rows], powers @ self.angle[rows]
        place, angle = (self.centre[k], self.angle[k]) if tracked else (c[0], a[0])
        pose, h = Pose(complex(place), float(angle)), self.interval
        rate, bend = complex(c[1]) / h, 2 * complex(c[2]) / h**2
        return Local(pose, rate, float(a[1]) / h, bend, 2 * float(a[2]) / h**2, tracked)
