"""Places of background points in a picture of full resolution, from an approximate view."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from udd.video.reader import Plane
from udd.video.resampling import enlarged

Complexes = NDArray[np.complex128]
WINDOW = 15  # pixels about a point that are compared
MARGIN = 4  # pixels around that, for slopes and for the error of the view
FAR = 2.0  # pixels by which a point may miss the view
HALF = WINDOW // 2 + MARGIN
CENTRE = HALF * (1 + 1j)


class FinePlaces:
    """Small parts of a first picture, resampled to the pixels of a later one and compared there.

    The part and not the later picture is resampled: the first picture is enlarged once, and a point that
    lies upon a pixel of the later picture needs no interpolation there.
    """

    def __init__(self, first: Plane) -> None:
        self.large = enlarged(np.asarray(first, np.float32))

    def compare(
        self, y: Plane, points: Complexes, factor: complex, shift: complex, brighter: float
    ) -> tuple[NDArray[np.intp], Complexes, Complexes]:
        """Locate points of the first picture in a picture `y` that has approximately this view.

        `brighter` multiplies the codes of `y`. Returns the numbers of the located points, a place in the
        first picture near each, and the same place in `y`.
        """
        import cv2

        there = factor * points + shift
        at = np.round(there.real) + 1j * np.round(there.imag)
        height, width = y.shape
        inside = (at.real >= HALF) & (at.real < width - HALF) & (at.imag >= HALF) & (at.imag < height - HALF)
        rows = np.flatnonzero(inside)
        if not len(rows):
            return rows, points[rows], there[rows]
        at, side, how = at[rows], 2 * HALF + 1, cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        first, then = (np.empty((len(at) * side, side), np.uint8) for _ in range(2))
        back = 2 / factor  # from the picture to the enlarged first one
        view = np.array([[back.real, -back.imag, 0.0], [back.imag, back.real, 0.0]])
        for k, corner in enumerate(at - CENTRE):
            part, begin = slice(k * side, (k + 1) * side), back * (corner - shift)
            view[:, 2] = begin.real, begin.imag
            seen = cv2.warpAffine(self.large, view, (side, side), flags=how, borderMode=cv2.BORDER_REPLICATE)
            first[part] = np.clip(np.rint(seen), 0, 255)  # an enlarged edge overshoots
            u, v = int(corner.real), int(corner.imag)
            then[part] = y[v : v + side, u : u + side]
        if brighter != 1:
            then = np.asarray(cv2.convertScaleAbs(then, alpha=brighter), np.uint8)
        middles = np.column_stack([np.full(len(at), HALF), HALF + side * np.arange(len(at))])
        middles = np.ascontiguousarray(middles, np.float32)
        size = (WINDOW, WINDOW)
        place, ok, _ = cv2.calcOpticalFlowPyrLK(
            first, then, middles, middles.copy(), winSize=size, maxLevel=0
        )
        off = (np.asarray(place, float) - middles) @ [1, 1j]
        good = (np.ravel(np.asarray(ok)) > 0) & (np.abs(off) < FAR)
        return rows[good], ((at - shift) / factor)[good], (at + off)[good]
