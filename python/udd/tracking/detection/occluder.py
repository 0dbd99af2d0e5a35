"""Things in front of the disk that never move: the support, the wheels, anything fixed to them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from udd.video.reader import Picture

from .colour_blobs import Sight

DARKER = 0.12  # relative change of brightness that is no longer the bare disk
TINTED = 9.0  # colour difference (of 127) that is no longer the bare disk
MARGIN = 2


def visible(
    seen: Sequence[tuple[Picture, Sight]], body: NDArray[np.complex128]
) -> tuple[NDArray[np.bool_], float]:
    """Pixels where the disk is in full view, and the disk's brightness.

    A pixel which should show the bare disk (inside the square of the marks' reach, away from the
    marks) but mostly does not is behind something. A pixel the disk never reaches counts as in view.
    """
    import cv2

    height, width = seen[0][0].y.shape
    asked = np.zeros((height, width), dtype=np.int32)
    white = np.zeros((height, width), dtype=np.int32)
    brightest = np.zeros((height, width), dtype=np.uint8)
    levels = []
    for picture, sight in seen:
        np.maximum(brightest, picture.y, out=brightest)
        box, here = bare(sight, height, width, body)
        y = picture.y[box]
        level = _middle(y[here]) if here.any() else 255.0
        level = _middle(y[here & (y > 0.8 * level)]) if here.any() else level
        levels.append(level)
        good = here & (np.abs(y - np.float32(level)) < DARKER * level)
        for plane in (picture.u, picture.v):
            half = slice(box[0].start // 2, box[0].stop // 2), slice(box[1].start // 2, box[1].stop // 2)
            tint = cv2.resize(plane[half], y.shape[::-1], interpolation=cv2.INTER_LINEAR)
            usual = _middle(tint[good]) if good.any() else 128
            good &= np.abs(tint - np.float32(usual)) < TINTED
        asked[box] += here
        white[box] += good
    hidden = (asked > 0) & (white < 0.5 * asked)
    level = float(np.median(levels))
    # where the disk was never looked at, whatever is always dark and grown together with the mask
    dark = hidden | ((asked == 0) & (brightest < 0.4 * level))
    _, labels = cv2.connectedComponents(dark.astype(np.uint8), connectivity=4)
    hidden = dark & np.isin(labels, np.unique(labels[hidden]))
    kernel = np.ones((2 * MARGIN + 1, 2 * MARGIN + 1), dtype=np.uint8)
    solid = cv2.morphologyEx(hidden.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), dtype=np.uint8))
    return cv2.dilate(solid, kernel) == 0, level


def bare(
    sight: Sight, height: int, width: int, body: NDArray[np.complex128]
) -> tuple[tuple[slice, slice], NDArray[np.bool_]]:
    """Return a box of rows and columns, and its pixels that should show the bare disk."""
    box = _box(sight, height, width)
    return box, _should_be_bare(sight, box, body)


def _middle(codes: NDArray[np.uint8]) -> float:
    """Return the median of many codes, by counting them."""
    return float(np.searchsorted(np.bincount(codes).cumsum(), 0.5 * codes.size))


def _box(sight: Sight, height: int, width: int) -> tuple[slice, slice]:
    """Rows and columns about the square of the marks, from even numbers to even numbers."""
    reach = 1.1 * sight.reach

    def part(middle: float, size: int) -> slice:
        low, high = int(np.clip(middle - reach, 0, size)), int(np.clip(middle + reach + 2, 0, size))
        return slice(low & ~1, high & ~1)

    return part(sight.centre.imag, height), part(sight.centre.real, width)


def _should_be_bare(
    sight: Sight, box: tuple[slice, slice], body: NDArray[np.complex128]
) -> NDArray[np.bool_]:
    """Pixels of the box inside the marks' reach and away from the marks."""
    dv = (np.arange(box[0].start, box[0].stop) - sight.centre.imag).astype(np.float32)[:, None]
    du = (np.arange(box[1].start, box[1].stop) - sight.centre.real).astype(np.float32)[None, :]
    here = du * du + dv * dv < np.float32((1.08 * sight.reach) ** 2)
    clear = np.float32(1.1 * np.sqrt(sight.area))
    for direction in body * sight.reach * np.exp(1j * sight.angle):
        here &= (du - np.float32(direction.real)) ** 2 + (dv - np.float32(direction.imag)) ** 2 > clear**2
    return np.asarray(here)
