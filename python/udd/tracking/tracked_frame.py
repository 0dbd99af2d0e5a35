"""A frame as it was tracked, for those who watch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import DiskAppearance, Pose
from udd.video.reader import Picture
from udd.video.rgb_frames import rgb


@dataclass(frozen=True)
class TrackedFrame:
    """Picture with the pose of the disk in it.

    Attributes
    ----------
    picture : Picture
        The frame of the film.
    pose : Pose
        NaN if the disk was not tracked.
    look : DiskAppearance
        Appearance of the marks.
    frames : int
        Number of frames in the film.
    full_range : bool
        True if the brightness codes go from 0 to 255.

    See Also
    --------
    udd.tracking.track_disk : calls `watch` with it.
    """

    picture: Picture
    pose: Pose
    look: DiskAppearance
    frames: int
    full_range: bool

    @property
    def held(self) -> bool:
        """True if the disk was tracked."""
        return bool(np.isfinite(self.pose.angle))

    @property
    def marks(self) -> NDArray[np.float64]:
        """The marks' places in the picture [pixels, v down], clockwise from red, shape (4, 2)."""
        places = np.array([mark.place for mark in self.look.marks])
        seen = self.look.lens.picture(self.pose.centre + places * np.exp(1j * self.pose.angle))
        return np.stack([seen.real, seen.imag], axis=-1)

    @property
    def centre(self) -> tuple[float, float]:
        """The disk's centre in the picture [pixels, v down]."""
        seen = complex(self.look.lens.picture(self.pose.centre))
        return seen.real, seen.imag

    @property
    def image(self) -> NDArray[np.uint8]:
        """The picture, (height, width, 3) of codes in red, green, blue."""
        return rgb(self.picture, self.full_range)
