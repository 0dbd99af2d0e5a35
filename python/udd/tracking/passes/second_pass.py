"""The second pass: every frame again, its blur path known from the frames on both sides."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd.tracking.detection.frame_flags import is_lost, lost
from udd.tracking.geometry.intervals import usual_interval
from udd.tracking.geometry.pose import DiskAppearance, Motion, Pose
from udd.tracking.marks.localization import MISFIT
from udd.video.reader import Film, Picture

from .first_pass import TrackerState, fit_and_check
from .tracks import FrameTrack, Tracks, found_in, lost_in

Array = NDArray[np.float64]
EACH_SIDE = 2  # neighbours on each side
NEAR = 3.5  # intervals within which a neighbour tells anything
KNOWN = [MISFIT, MISFIT, MISFIT]  # rounds from the first pass's pose
FORESEEN = [1.5, 0.8, MISFIT, MISFIT]  # rounds from the neighbours alone
APART = 1.5  # pixels that the second pass may differ from the first at the marks ...
APART_BY_STREAK = 0.08  # ... and more for a streak, per pixel of its length
LONG = 25.0  # pixels; longer streaks are gone over once more, with what their neighbours turned out to be
WEAK_MARKS = 3  # a long streak with fewer marks does not speak for its neighbours
WEAK_OFF = 2.0  # pixels; nor does one whose marks disagree by more
# where the second derivative jumps, as friction makes it where a disk turns back: its error times interval^2
# against the miss, rms over the times at which it may jump, for the mean over a whole interval
JUMP = 1.10
FORESEEN_APART = 6.0  # pixels, the same from the neighbours' prediction


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


def refine(
    film: Film,
    state: TrackerState,
    first: Tracks,
    tick: Callable[[int], object] = lambda _: None,
    again: bool = False,
    look_at: Callable[[int], DiskAppearance] | None = None,
) -> Tracks:
    """Fit every frame again from what the first pass says about it and its neighbours.

    A frame that the second pass does not hold, or puts elsewhere, keeps the first pass's pose. One that
    the first pass lost between two that it tracked is tried from these. `again`: frames with long streaks,
    and lost ones, are fitted once more as soon as their neighbours are. `look_at` gives each frame's
    appearance if it is not always the same.
    """
    better: dict[int, FrameTrack] = {}
    best: dict[int, FrameTrack] = {}
    around = LocalMotion(first)
    reach = NEAR * around.interval
    waiting: deque[tuple[int, Picture]] = deque()

    def refined_again(k: int, picture: Picture) -> None:
        low, high = np.searchsorted(first.t, [first.t[k] - reach, first.t[k] + reach])
        rows = range(int(low), min(int(high) + 1, len(first)))
        part = first.part(rows.start, rows.stop)
        part = part.with_frames({j - rows.start: better[j] for j in rows if j in better})
        here = LocalMotion(part, around.interval)
        frame = _refine_frame(film, picture, k - rows.start, state, here, part)
        if frame is not None:
            best[k] = frame

    for k, picture in zip(range(len(first)), film.uncorrected(), strict=False):
        seen = state if look_at is None else replace(state, look=look_at(k))
        frame = _refine_frame(film, picture, k, seen, around, first)
        if frame is not None:
            better[k] = frame
        if again and (frame.streak > LONG if frame else first.flag[k] or first.streak[k] > LONG):
            waiting.append((k, picture))
        while waiting and first.t[k] - first.t[waiting[0][0]] > reach:
            refined_again(*waiting.popleft())
        tick(picture.index)
    while waiting:
        refined_again(*waiting.popleft())
    return first.with_frames(better | best)


def _refine_frame(
    film: Film, picture: Picture, k: int, state: TrackerState, around: LocalMotion, tracks: Tracks
) -> FrameTrack | None:
    if tracks.flag[k] and not is_lost(tracks.flag[k]):
        return None
    here = around.at(k)
    if here is None:
        return None
    motion = here.motion(state.exposure)
    pose = Pose(here.pose.centre, here.pose.angle)
    streak = state.look.streak(motion)
    part = film.corrected(picture, state.box([pose], streak, picture.y.shape))
    fit = fit_and_check(part, state, pose, motion, KNOWN if here.tracked else FORESEEN)
    if fit is None:
        return None
    away = abs(pose.centre - here.pose.centre) + abs(pose.angle - here.pose.angle) * state.look.reach
    if away > (APART if here.tracked else FORESEEN_APART) + APART_BY_STREAK * streak:
        return None
    if streak > LONG and fit.used.sum() < WEAK_MARKS and not here.tracked:
        return None  # two pale streaks agree with much
    return found_in(float(tracks.t[k]), fit, pose, streak, "refined")


def weak(tracks: Tracks) -> NDArray[np.bool_]:
    """Frames with long streaks of too few marks, or of marks that disagree."""
    used = np.array([np.isfinite(c).sum() for c in tracks.chi2])
    off = np.array([np.nanmax(np.abs(x), initial=0.0) for x in tracks.residuals])
    long = tracks.streak > LONG
    return np.asarray(long & ((used < WEAK_MARKS) | (off > WEAK_OFF + 0.03 * tracks.streak)))


def drop_weak(tracks: Tracks) -> Tracks:
    """Give up the frames in which a long streak of two marks is all there is: it fits in many places."""
    why, marks = lost("too few marks in a long streak"), tracks.chi2.shape[1]
    return tracks.with_frames(
        {
            k: replace(
                lost_in(float(tracks.t[k]), why, float(tracks.streak[k]), marks),
                marks=tracks.marks[k],
                complete=tracks.complete[k],
            )
            for k in map(int, np.flatnonzero(weak(tracks)))
            if not tracks.flag[k]
        }
    )


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
