"""Poses of all frames as a pass found them, in pixels and radians."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import Pose
from udd.tracking.marks.pose_fit import Fit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrameTrack:
    """One frame: its pose, or why there is none."""

    t: float
    centre: complex
    angle: float  # unwrapped
    information: Array  # (3, 3) of (u, v, beta) for the assumed pixel noise
    residuals: Array  # (marks, 2) of each mark [pixels], NaN where not used
    chi2: Array  # (marks,)
    marks: NDArray[np.float32]  # (marks, 2, 2) information of (u, v) of each, of the pose's, 0 where not used
    complete: Array  # (marks,) share of each mark's edges in view
    streak: float  # blur length at the marks [pixels]
    flag: str
    method: str  # "fast" or "refined", empty where the disk was not held
    copied: float = 0.0  # share of the marks' edges that a codec copied from the frame before


@dataclass(frozen=True)
class Tracks:
    """The same of all frames; nothing in it is changed, a stage makes another."""

    t: Array
    centre: NDArray[np.complex128]
    angle: Array
    information: Array
    residuals: Array
    chi2: Array
    marks: NDArray[np.float32]
    complete: Array
    streak: Array
    flag: tuple[str, ...]
    method: tuple[str, ...]
    copied: Array

    @classmethod
    def of(cls, frames: Sequence[FrameTrack]) -> Tracks:
        """Make tracks from their frames."""
        columns: dict[str, Any] = {f.name: [getattr(frame, f.name) for frame in frames] for f in fields(cls)}
        texts = ("flag", "method")
        done: dict[str, Any] = {k: tuple(v) if k in texts else np.array(v) for k, v in columns.items()}
        return cls(**done)

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.t)

    @property
    def tracked(self) -> NDArray[np.bool_]:
        """Frames with a pose."""
        return np.asarray(np.isfinite(self.information).all(axis=(1, 2)))

    def part(self, first: int, end: int) -> Tracks:
        """Return the tracks of consecutive frames."""
        return Tracks(**{f.name: getattr(self, f.name)[first:end] for f in fields(self)})

    def without(self, those: NDArray[np.bool_], flag: str) -> Tracks:
        """Return tracks without the poses of some frames (n,), which get a flag if they have none."""
        changed = {
            k: lost_in(float(self.t[k]), flag, float(self.streak[k]), self.chi2.shape[1])
            for k in map(int, np.flatnonzero(those))
            if not self.flag[k]
        }
        return self.with_frames(changed) if changed else self

    def with_frames(self, changed: Mapping[int, FrameTrack]) -> Tracks:
        """Return tracks with other frames at those numbers."""
        columns = {f.name: list(getattr(self, f.name)) for f in fields(self)}
        frames = [FrameTrack(*row) for row in zip(*columns.values(), strict=True)]
        return Tracks.of([changed.get(k, frame) for k, frame in enumerate(frames)])


def found_in(t: float, fit: Fit, pose: Pose, streak: float, method: str) -> FrameTrack:
    """Return a frame in which a fit locates the disk."""
    return FrameTrack(
        t,
        pose.centre,
        pose.angle,
        fit.step.information,
        np.where(fit.used[:, None], fit.step.residuals, np.nan),
        np.where(fit.used, fit.step.chi2, np.nan),
        fit.information.astype(np.float32),
        np.array([s.complete if s and u else 0.0 for s, u in zip(fit.sightings, fit.used, strict=True)]),
        streak,
        "",
        method,
    )


def lost_in(t: float, flag: str, streak: float, marks: int) -> FrameTrack:
    """Return a frame without a pose."""
    return FrameTrack(
        t,
        complex(np.nan, np.nan),
        np.nan,
        np.full((3, 3), np.nan),
        np.full((marks, 2), np.nan),
        np.full(marks, np.nan),
        np.zeros((marks, 2, 2), dtype=np.float32),
        np.zeros(marks),
        streak,
        flag,
        "",
    )
