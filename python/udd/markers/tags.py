"""Printed tags (ArUco, AprilTag) on the disk: which, where, and what they look like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.video.reader import TrackError

from .layout import Layout, read_place

Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Tag:
    """A printed tag, upright at beta = 0."""

    dictionary: str  # "4x4_50", "apriltag_36h11", ...
    number: int
    at: complex  # centre [m from the disk's, u to the right, v down]
    side: float  # of the black square [m]

    @property
    def corners(self) -> Complexes:
        """Upper left, upper right, lower right, lower left [m]."""
        square = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
        return np.asarray(self.at + self.side / 2 * square, dtype=np.complex128)


def is_tags(said: Any) -> bool:
    """Return True if a layout consists of tags."""
    if isinstance(said, str | Mapping) or not isinstance(said, Sequence):
        return False
    return any(isinstance(m, Tag) or (isinstance(m, Mapping) and "tag" in m) for m in said)


def read_tags(said: Sequence[Any]) -> tuple[Tag, ...]:
    """Tags from ``{"tag": "4x4_50:7", "at": [y, z], "side": 0.03}`` (m, at beta = 0).

    Raises
    ------
    TrackError
        A mark that says something else, a dictionary or number that there is not, or one tag twice.
    """
    tags = tuple(m if isinstance(m, Tag) else _tag(m, k) for k, m in enumerate(said, start=1))
    if len({t.dictionary for t in tags}) > 1:
        raise TrackError("layout: all tags must be of one dictionary")
    if len({t.number for t in tags}) < len(tags):
        raise TrackError("layout: a tag occurs twice; each may occur once")
    return tags


def _tag(said: Any, number: int) -> Tag:
    if not isinstance(said, Mapping) or set(said) != {"tag", "at", "side"}:
        raise TrackError(f"layout: mark {number} must say tag, at = [y, z] and side, and nothing else")
    name, _, index = str(said["tag"]).rpartition(":")
    if not (index.isascii() and index.isdigit()):
        raise TrackError(f'layout: tag of mark {number} must be like "4x4_50:7", not {said["tag"]!r}')
    size = len(dictionary(name).bytesList)
    if int(index) >= size:
        raise TrackError(f"layout: the dictionary {name} has tags 0 to {size - 1}, not {index}")
    side = said["side"]
    if isinstance(side, bool) or not isinstance(side, int | float) or not 0 < side < 10:
        raise TrackError(f"layout: side of mark {number} must be a positive number of metres, not {side!r}")
    return Tag(name, int(index), read_place(said["at"], number), float(side))


def dictionary(name: str) -> Any:
    """OpenCV's dictionary of that name, without its DICT_."""
    import cv2

    names = {d.removeprefix("DICT_").lower(): d for d in dir(cv2.aruco) if d.startswith("DICT_")}
    if name.lower() not in names:
        raise TrackError(f"layout: there is no dictionary {name!r} of tags; there are {', '.join(names)}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, names[name.lower()]))


def cells_of(tag: Tag) -> NDArray[np.uint8]:
    """Return the black and white cells of a tag, 0 or 255, with its border."""
    import cv2

    words = dictionary(tag.dictionary)
    return np.asarray(cv2.aruco.generateImageMarker(words, tag.number, words.markerSize + 2), np.uint8)


def layout_of(tags: Sequence[Tag]) -> Layout:
    """Return the corners as the marks of a layout."""
    corners = tuple(complex(c) for tag in tags for c in tag.corners)
    return Layout(corners, ((0, 200, 220),) * len(corners))
