"""Pixels that a codec copies from the frame before: they show the disk where it was when they were coded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import Pose

from .first_pass import MarkedDisk, TrackerState
from .frame_loop import NOWHERE, Corrected, Observer
from .tracks import Tracks

Array = NDArray[np.float64]
SLOW = 1.0  # pixels: over a longer way every edge of a mark changes, so that equal pixels are chance
BLOCK = np.ones((3, 3), np.uint8)  # a pixel next to a changed one may be equal by chance
# Codecs code a block again when its error is large, so its age is uniform between 0 and the longest age.
MEAN, SCATTER = 0.5, 12**-0.5


class CopiedPixels(Observer):
    """Share of the marks' edges in each frame, by their squared slopes, that repeats the frame before."""

    def __init__(self, state: TrackerState, tracks: Tracks) -> None:
        self.state, self.tracks, self.disk = state, tracks, MarkedDisk(state)
        self.share = np.zeros(len(tracks))
        self.last: NDArray[np.uint8] | None = None
        self.next = 0  # number of the next frame

    def look(self, corrected: Corrected, t: float, shape: tuple[int, ...]) -> Pose:
        """Compare the next frame with the last one, about the marks."""
        k, before = self.next, self.last
        self.next, self.last = k + 1, None
        if k >= len(self.tracks) or not np.isfinite(self.tracks.angle[k]):
            return NOWHERE
        pose = Pose(complex(self.tracks.centre[k]), float(self.tracks.angle[k]))
        picture = self.last = corrected(self.state.box([pose], 0.0, shape)).y
        if before is None:
            return NOWHERE
        import cv2

        places, about, _ = self.disk.surroundings(pose)
        total = copied = 0.0
        for u, v in zip(places.real.astype(int), places.imag.astype(int), strict=True):
            part = slice(max(v - about, 0), v + about), slice(max(u - about, 0), u + about)
            seen = picture[part]
            if min(seen.shape) < 2:  # a mark at the picture's edge
                continue
            down, right = np.gradient(seen.astype(np.float32))
            slope = (down**2 + right**2) * self.state.view[part]
            total += float(slope.sum())
            changed = cv2.dilate((seen != before[part]).astype(np.uint8), BLOCK)
            copied += float(slope[changed == 0].sum())
        self.share[k] = copied / max(total, 1.0)
        return NOWHERE


def without_lag(tracks: Tracks, reach: float) -> tuple[Tracks, Array]:
    """Return the tracks without the lag of copied pixels, and the standard errors (n, 3) of the correction.

    A frame of which a share s is copied lags by s times the lag of the last frame and the way since then.
    """
    rows = np.flatnonzero(np.isfinite(tracks.angle))
    lag = np.zeros((len(tracks), 3))
    if len(rows) < 2:
        return tracks, lag
    path = np.column_stack([tracks.centre.real, tracks.centre.imag, tracks.angle])[rows]
    for last, k, step in zip(rows[:-1], rows[1:], np.gradient(path, axis=0)[1:], strict=True):
        way = lag[last] + step
        if np.hypot(way[0], way[1]) + abs(way[2]) * reach < SLOW:
            lag[k] = tracks.copied[k] * way
    moved = MEAN * (lag[:, 0] + 1j * lag[:, 1])
    tracks = replace(tracks, centre=tracks.centre + moved, angle=tracks.angle + MEAN * lag[:, 2])
    return tracks, SCATTER * lag
