"""Processing of pictures in the camera and in converters: temporal noise reduction and other frame rates."""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import NDArray

from .defects import Defects
from .light import Picture

Codes = NDArray[np.uint8]
ALIKE = 8.0  # codes by which pictures differ where noise reduction mixes them to 1 / e of its share
SMOOTH = 1.5  # pixels over which noise reduction compares


class Denoiser:
    """Temporal noise reduction: mixes the previous result into the picture where the two differ little."""

    def __init__(self, share: float) -> None:
        self.share = share
        self._last: Picture | None = None

    def __call__(self, picture: Codes) -> Codes:
        """Return the picture with less noise."""
        import cv2

        if not self.share:
            return picture
        now = picture.astype(np.float32)
        if self._last is not None:
            off = cv2.GaussianBlur(np.abs(self._last - now).max(axis=2), (0, 0), SMOOTH)
            share = np.float32(self.share) * np.exp(-np.square(off / np.float32(ALIKE)))
            now += share[..., None] * (self._last - now)
        self._last = now
        return np.rint(now).astype(np.uint8)


class Converter:
    """Conversion of a camera's frames to another rate; it asks for each of them once, in order."""

    def __init__(self, take: Callable[[int], Codes], rate: float, blends: bool) -> None:
        self.rate, self.blends = rate, blends
        self._take = take
        self._taken: dict[int, Codes] = {}

    def at(self, time: float) -> Codes:
        """Return the picture at a time of the new clock, s."""
        position = time * self.rate
        if not self.blends:
            return self._frame(int(position + 0.5 - 1e-9))
        before = int(position + 1e-6)
        share = max(0.0, position - before)
        if share < 1e-6:
            return self._frame(before)
        mixed = (1 - share) * self._frame(before).astype(np.float32) + share * self._frame(before + 1)
        return cast(Codes, np.rint(mixed).astype(np.uint8))

    def _frame(self, number: int) -> Codes:
        if number not in self._taken:
            self._taken = {k: v for k, v in self._taken.items() if k == number - 1}
            self._taken[number] = self._take(number)
        return self._taken[number]


def converter(take: Callable[[int], Codes], defects: Defects) -> Converter | None:
    """Return the converter of a film; None if the camera's rate is the film's."""
    if not (defects.blended or defects.copied):
        return None
    return Converter(take, defects.blended or defects.copied, bool(defects.blended))
