"""Light and codes: pictures are added up in linear light, and stored as sRGB codes (IEC 61966-2-1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd.video.srgb import code_of, light_of

Picture = NDArray[np.float32]

_LEVELS = 1 << 14


def to_light(code: ArrayLike) -> Picture:
    """Return the linear light, 0 to 1, of sRGB codes 0 to 255."""
    v = np.asarray(code, dtype=np.float64) / 255.0
    return light_of(v).astype(np.float32)


def _table() -> Picture:
    x = np.arange(_LEVELS) / (_LEVELS - 1)
    return (255.0 * code_of(x)).astype(np.float32)


_CODES = _table()


def to_code(light: Picture) -> Picture:
    """Return unrounded sRGB codes, 0 to 255, of light from 0 to 1; by table, within 0.4 of a code."""
    return np.take(_CODES, (light * np.float32(_LEVELS - 1) + np.float32(0.5)).astype(np.uint16), mode="clip")


class Noise:
    """Normal sensor noise of standard deviation `sd` codes, from a generator; no noise for sd = 0.

    A uniform 16-bit number picks a quantile from a table: the same normal law to 4.2 standard deviations
    as a normal generator gives, at a quarter of the time.
    """

    def __init__(self, sd: float, rng: np.random.Generator) -> None:
        from scipy.special import ndtri

        n = 1 << 16
        self.sd = sd
        self._rng = rng
        self._table = (sd * ndtri((np.arange(n) + 0.5) / n)).astype(np.float32)

    def on(self, codes: Picture) -> NDArray[np.uint8]:
        """Add noise to the picture and round it to codes."""
        import cv2

        if self.sd == 0:
            return np.rint(codes).astype(np.uint8)
        bits = self._rng.integers(0, 2**64 - 1, (codes.size + 3) // 4, np.uint64, endpoint=True)
        raw = bits.view(np.uint16)[: codes.size]
        noise = np.take(self._table, raw, mode="clip").reshape(codes.shape)
        return np.asarray(cv2.add(codes, noise, dtype=cv2.CV_8U), dtype=np.uint8)
