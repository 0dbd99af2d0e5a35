"""What stands before the disk and never moves: the support, the wheels, anything fixed to them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .decode import Picture
from .find import BODY, Sight

DARKER = 0.12  # relative change of brightness that is no longer the bare disk
TINTED = 9.0  # colour difference (of 127) that is no longer the bare disk
MARGIN = 2


def visible(seen: Sequence[tuple[Picture, Sight]]) -> tuple[NDArray[np.bool_], float]:
    """Pixels where the disk is in full view, and the disk's brightness.

    A pixel which should show the bare disk (inside the square of the marks' reach, away from the
    marks) but mostly does not is behind something. A pixel the disk never reaches counts as in view.
    """
    import cv2

    height, width = seen[0][0].y.shape
    rows, cols = np.mgrid[0:height, 0:width].astype(np.float32)
    bare = np.zeros((height, width), dtype=np.int32)
    white = np.zeros((height, width), dtype=np.int32)
    brightest = np.zeros((height, width), dtype=np.uint8)
    levels = []
    for picture, sight in seen:
        du, dv = cols - np.float32(sight.centre.real), rows - np.float32(sight.centre.imag)
        clear = np.float32(1.1 * np.sqrt(sight.area))
        here = du * du + dv * dv < np.float32((1.08 * sight.reach) ** 2)
        for direction in BODY * sight.reach * np.exp(1j * sight.angle):
            here &= (du - np.float32(direction.real)) ** 2 + (dv - np.float32(direction.imag)) ** 2 > clear**2
        y = picture.y
        level = float(np.median(y[here])) if here.any() else 255.0
        level = float(np.median(y[here & (y > 0.8 * level)])) if here.any() else level
        levels.append(level)
        u = cv2.resize(picture.u, (width, height), interpolation=cv2.INTER_LINEAR)
        v = cv2.resize(picture.v, (width, height), interpolation=cv2.INTER_LINEAR)
        good = here & (np.abs(y - np.float32(level)) < DARKER * level)
        tint_u, tint_v = np.median(u[good]) if good.any() else 128, np.median(v[good]) if good.any() else 128
        good &= (np.abs(u - np.float32(tint_u)) < TINTED) & (np.abs(v - np.float32(tint_v)) < TINTED)
        np.maximum(brightest, y, out=brightest)
        bare += here
        white += good
    hidden = (bare > 0) & (white < 0.5 * bare)
    level = float(np.median(levels))
    # where the disk was never looked at, whatever is always dark and grown together with the mask
    dark = hidden | ((bare == 0) & (brightest < 0.4 * level))
    _, labels = cv2.connectedComponents(dark.astype(np.uint8), connectivity=4)
    hidden = dark & np.isin(labels, np.unique(labels[hidden]))
    kernel = np.ones((2 * MARGIN + 1, 2 * MARGIN + 1), dtype=np.uint8)
    solid = cv2.morphologyEx(hidden.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), dtype=np.uint8))
    return cv2.dilate(solid, kernel) == 0, level
