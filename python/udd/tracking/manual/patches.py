"""Patch of one colour around a click: its middle, its colour, and their errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.markers.layout import PALEST
from udd.video.reader import Picture
from udd.video.rgb_frames import rgb

CLICK = 1.5  # Pixels by which a hand misses in each direction, if the screen shows each pixel.
REFINED = 0.3  # Error of a patch's middle in pixels: colours have half the resolution.
ALIKE = 0.94  # Cosine between the directions of a pixel's colour and the patch's: 20 degrees.
HALF = 0.5  # Share of the colour's strength in a pixel that is half patch, half disk.
SMALLEST = 6  # Least half-resolution pixels of a patch.
LARGEST = 0.05  # Share of the picture: a larger patch is a wall.
FULL = 0.74  # Share of its smallest rectangle that a mark fills at this coarse resolution.
DARK = 0.5  # Share of the usual brightness around a patch: darker pixels show another object.
HIDDEN = 0.1  # Share of dark pixels around a patch if the mark is partly hidden.


@dataclass(frozen=True)
class Patch:
    """A mark as it was clicked.

    Attributes
    ----------
    centre : complex
        u + iv [pixels].
    colour : (int, int, int)
        sRGB codes.
    sigma : float
        Standard error of each of the centre's coordinates [pixels].
    area : float
        [pixels]; 0 where no patch was found about the click.
    outline : ndarray, shape (n,), complex
        Corners of the smallest rectangle about it [pixels].
    """

    centre: complex
    colour: tuple[int, int, int]
    sigma: float
    area: float
    outline: NDArray[np.complex128]

    @property
    def refined(self) -> bool:
        """True if the patch gives the centre better than the click."""
        return self.sigma <= REFINED

    def holds(self, at: complex) -> bool:
        """Return True if a place lies within the patch, or near the click."""
        return bool(abs(at - self.centre) < max(0.5 * np.sqrt(self.area), 2 * self.sigma))


def patch(picture: Picture, at: complex, full_range: bool, miss: float = CLICK) -> Patch | None:
    """Find the patch of like colour around a place clicked to `miss` [pixels]; None without a colour.

    A pixel belongs to it by the direction of its colour and half its strength. A patch that is no whole
    rectangle (partly hidden, or grown into its surroundings) leaves the click in place.
    """
    import cv2

    u, v = picture.u.astype(np.float32) - 128, picture.v.astype(np.float32) - 128
    # a half-resolution sample i covers the full pixels 2i and 2i + 1, whose middle is 2i + 1/2
    row, column = round((at.imag - 0.5) / 2), round((at.real - 0.5) / 2)
    height, width = u.shape
    if not (0 <= row < height and 0 <= column < width):
        return None
    about = slice(max(0, row - 1), row + 2), slice(max(0, column - 1), column + 2)
    tint = np.array([np.median(u[about]), np.median(v[about])])
    strength = float(np.hypot(*tint))
    if strength < PALEST:
        return None
    unit = (tint / strength).astype(np.float32)
    along = unit[0] * u + unit[1] * v
    like = (along > ALIKE * np.hypot(u, v)) & (along > HALF * strength)
    _, number, stats, _ = cv2.connectedComponentsWithStats(like.astype(np.uint8), connectivity=4)
    codes = rgb(picture, full_range)
    full = slice(max(0, 2 * row - 2), 2 * row + 4), slice(max(0, 2 * column - 2), 2 * column + 4)
    clicked = Patch(at, _median(codes[full]), miss, 0.0, np.empty(0, np.complex128))
    here = int(number[row, column])
    if not here:
        return clicked
    size = int(stats[here, cv2.CC_STAT_AREA])
    if not SMALLEST <= size <= LARGEST * like.size:
        return clicked
    part = number == here
    inner = _of(part, cv2.erode(part.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool))
    colour = _median(codes[::2, ::2][inner])
    sides, outline = _rectangle(part)
    hidden = _beside(part, picture) > HIDDEN or (size < FULL * sides and size > 4 * SMALLEST)
    if hidden:
        return Patch(at, colour, miss, 4.0 * size, outline)
    return Patch(_middle(part, along / float(np.median(along[inner]))), colour, REFINED, 4.0 * size, outline)


def _middle(part: NDArray[np.bool_], share: NDArray[np.float32]) -> complex:
    """Mean place of a patch and of the samples about it, each weighted by its share of the mark's colour."""
    rows, columns = np.nonzero(_grown(part, 3))
    mass = np.clip(share[rows, columns], 0, 1)
    return complex(2 * (mass @ columns) / mass.sum() + 0.5, 2 * (mass @ rows) / mass.sum() + 0.5)


def _rectangle(part: NDArray[np.bool_]) -> tuple[float, NDArray[np.complex128]]:
    """Return the smallest rectangle around a patch: its area in samples, and its corners in the picture."""
    import cv2

    middle, sides, angle = cv2.minAreaRect(np.column_stack(np.nonzero(part)[::-1]).astype(np.float32))
    sides = (sides[0] + 1, sides[1] + 1)  # from the middles of the outermost samples to their edges
    corners = cv2.boxPoints((middle, sides, angle))
    return sides[0] * sides[1], 2 * (corners[:, 0] + 1j * corners[:, 1]) + (0.5 + 0.5j)


def _beside(part: NDArray[np.bool_], picture: Picture) -> float:
    """Share of what is about a patch that is darker than the disk: something stands before it."""
    about = picture.y[::2, ::2][_grown(part, 5) & ~_grown(part, 3)]
    return float(np.mean(about < DARK * np.median(about))) if len(about) else 0.0


def _grown(part: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    import cv2

    return np.asarray(cv2.dilate(part.astype(np.uint8), np.ones((by, by), np.uint8)), dtype=bool)


def _of(part: NDArray[np.bool_], inner: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the inside of a patch, or all of a patch without an inside."""
    return inner if inner.any() else part


def _median(codes: NDArray[np.uint8]) -> tuple[int, int, int]:
    red, green, blue = (round(float(c)) for c in np.median(codes.reshape(-1, 3), axis=0))
    return red, green, blue
