"""The second pass: every frame again, its blur path known from the frames on both sides."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd.tracking.detection.frame_flags import is_lost, lost
from udd.tracking.geometry.pose import DiskAppearance, Pose
from udd.tracking.marks.localization import MISFIT
from udd.video.reader import Film, Picture

from .copied_pixels import CopiedPixels
from .first_pass import TrackerState, fit_and_check
from .frame_loop import NOWHERE, Corrected, Observer, observe
from .local_motion import LONG, NEAR, WEAK_MARKS, LocalMotion, weak
from .tracks import FrameTrack, Tracks, found_in, lost_in

Array = NDArray[np.float64]
KNOWN = [MISFIT, MISFIT, MISFIT]  # rounds from the first pass's pose
FORESEEN = [1.5, 0.8, MISFIT, MISFIT]  # rounds from the neighbours alone
MOST_MOVED = 1.5  # pixels that the second pass may differ from the first at the marks ...
MOVED_BY_STREAK = 0.08  # ... and more for a streak, per pixel of its length
MOST_MOVED_FORESEEN = 6.0  # pixels, the same from the neighbours' prediction


def refine(
    film: Film,
    state: TrackerState,
    first: Tracks,
    tick: Callable[[Picture, Pose], object] = lambda picture, pose: None,
    again: bool = False,
    look_at: Callable[[int], DiskAppearance] | None = None,
) -> Tracks:
    """Fit every frame again from what the first pass says about it and its neighbours.

    If the second pass cannot fit a frame, or puts it elsewhere, the frame keeps its first pose. A frame that
    the first pass lost between two tracked ones is predicted from these. With `again`, frames with long
    streaks and lost frames are fitted once more, after their neighbours. `look_at` gives the appearance in
    each frame if it changes.
    """
    refiner = Refiner(state, first, again, look_at)
    codec = CopiedPixels(state, first)
    observe(film, [refiner, codec], tick)
    return replace(first.with_frames(refiner.better | refiner.best), copied=codec.share)


class Refiner(Observer):
    """Tracks of a first pass, refined frame by frame."""

    def __init__(
        self,
        state: TrackerState,
        first: Tracks,
        again: bool,
        look_at: Callable[[int], DiskAppearance] | None,
    ) -> None:
        self.state, self.first, self.again, self.look_at = state, first, again, look_at
        self.around = LocalMotion(first)
        self.reach = NEAR * self.around.interval
        self.better: dict[int, FrameTrack] = {}
        self.best: dict[int, FrameTrack] = {}  # of those that are fitted once more
        self.waiting: deque[tuple[int, Corrected, tuple[int, ...]]] = deque()
        self.next = 0  # number of the next frame

    def look(self, corrected: Corrected, t: float, shape: tuple[int, ...]) -> Pose:
        """Refine the next frame, and those whose neighbours are all refined by now."""
        k, first = self.next, self.first
        self.next += 1
        if k >= len(first):
            return NOWHERE
        state = self.state if self.look_at is None else replace(self.state, look=self.look_at(k))
        frame = _refined(corrected, shape, k, state, self.around, first)
        if frame is not None:
            self.better[k] = frame
        if self.again and (frame.streak > LONG if frame else first.flag[k] or first.streak[k] > LONG):
            self.waiting.append((k, corrected, shape))
        while self.waiting and first.t[k] - first.t[self.waiting[0][0]] > self.reach:
            self._once_more()
        return NOWHERE if frame is None else Pose(frame.centre, frame.angle)

    def end(self) -> None:
        """Refine the frames that still wait."""
        while self.waiting:
            self._once_more()

    def _once_more(self) -> None:
        """Refine the first frame that waits from its refined neighbours."""
        (k, corrected, shape), t = self.waiting.popleft(), self.first.t
        low, high = np.searchsorted(t, [t[k] - self.reach, t[k] + self.reach])
        rows = range(int(low), min(int(high) + 1, len(t)))
        part = self.first.part(rows.start, rows.stop)
        part = part.with_frames({j - rows.start: self.better[j] for j in rows if j in self.better})
        here = LocalMotion(part, self.around.interval)
        frame = _refined(corrected, shape, k - rows.start, self.state, here, part)
        if frame is not None:
            self.best[k] = frame


def _refined(
    corrected: Corrected,
    shape: tuple[int, ...],
    k: int,
    state: TrackerState,
    around: LocalMotion,
    tracks: Tracks,
) -> FrameTrack | None:
    """Return a frame fitted from its neighbours' motion; None if the fit fails a check."""
    if tracks.flag[k] and not is_lost(tracks.flag[k]):
        return None
    here = around.at(k)
    if here is None:
        return None
    motion = here.motion(state.exposure)
    pose = Pose(here.pose.centre, here.pose.angle)
    streak = state.look.streak(motion)
    part = corrected(state.box([pose], streak, shape))
    fit = fit_and_check(part, state, pose, motion, KNOWN if here.tracked else FORESEEN)
    if fit is None:
        return None
    away = abs(pose.centre - here.pose.centre) + abs(pose.angle - here.pose.angle) * state.look.reach
    if away > (MOST_MOVED if here.tracked else MOST_MOVED_FORESEEN) + MOVED_BY_STREAK * streak:
        return None
    if streak > LONG and fit.used.sum() < WEAK_MARKS and not here.tracked:
        return None  # two pale streaks fit in many places
    return found_in(float(tracks.t[k]), fit, pose, streak, "refined")


def drop_weak(tracks: Tracks) -> Tracks:
    """Mark frames as lost if they have only a long streak of too few marks, which fits in many places."""
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
