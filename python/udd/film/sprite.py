"""The disk itself, drawn once at twice the picture's resolution and at beta = 0."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .light import Picture, to_light

FINE = 2  # sprite pixels per picture pixel
DISK = (232, 230, 222)
INK = (24, 24, 26)  # of a printed tag
# Clockwise from the red mark, which sits at the angle beta.
MARKS = ((200, 38, 44), (240, 134, 36), (30, 78, 186), (34, 138, 62))
# In units of the disk's radius: 65 mm and 16 mm for R = 80 mm.
MARK_CENTRE, MARK_SIDE = 65 / 80, 16 / 80


def disk_sprite(
    radius: float,
    focus: float,
    offsets: NDArray[np.float64] | None = None,
    strength: Sequence[float] = (1.0,) * 4,
    patches: Sequence[Patch] | None = None,
) -> Picture:
    """Draw the disk of `radius` picture pixels, (n, n, 4): light times cover in red, green, blue, and cover.

    The marks are `offsets` (4, 2) picture pixels off their places, clockwise and outward, and their colours
    are mixed with the disk's by `strength`. `patches`, in units of the radius, take the place of all four.

    n is odd, so the disk's centre lies on the middle pixel. Edges are drawn from the exact distance to them,
    then blurred by `focus` (picture pixels), so that no place and no angle is favoured.
    """
    from .scene import blurred

    r = radius * FINE
    reach = math.ceil(r + 4 * max(focus, 0.5) * FINE) + 2
    v = np.arange(-reach, reach + 1, dtype=np.float64)
    x, y = v[None, :], v[:, None]
    disk = np.clip(r - np.hypot(x, y) + 0.5, 0.0, 1.0)
    light = np.broadcast_to(to_light(DISK), (v.size, v.size, 3)).astype(np.float64)
    for patch in patches or ():
        _stick(light, x / r, y / r, patch)
    for quarter, colour in enumerate(MARKS if patches is None else ()):
        angle = quarter * math.pi / 2
        aside, out = (0.0, 0.0) if offsets is None else (float(v) * FINE for v in offsets[quarter])
        sine, cosine = round(math.sin(angle)), round(math.cos(angle))
        away = MARK_CENTRE * r + out
        mark = _band(x, away * sine + aside * cosine, MARK_SIDE * r) * _band(
            y, -away * cosine + aside * sine, MARK_SIDE * r
        )
        light += float(strength[quarter]) * mark[..., None] * (to_light(colour) - light)
    sprite = np.concatenate([light * disk[..., None], disk[..., None]], axis=-1).astype(np.float32)
    return blurred(sprite, focus * FINE)


@dataclass(frozen=True)
class Patch:
    """A square stuck on the disk, its sides upright at beta = 0: of one colour, or a printed tag.

    `at` is its centre (right, up) and `side` its side in units of the disk's radius.
    """

    at: tuple[float, float]
    side: float
    colour: tuple[int, int, int] = (0, 0, 0)
    tag: NDArray[np.uint8] | None = None  # cells of a tag, 0 or 255


def _stick(light: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64], patch: Patch) -> None:
    """Draw a patch into the light of a sprite; x to the right and y down, in radii."""
    pixel = float(x[0, 1] - x[0, 0])
    cells = np.zeros((1, 1), np.uint8) if patch.tag is None else patch.tag
    step = patch.side / len(cells)
    left, top = patch.at[0] - patch.side / 2, -patch.at[1] - patch.side / 2
    for row, column in np.ndindex(cells.shape):
        across = _band(x / pixel, (left + (column + 0.5) * step) / pixel, step / pixel)
        cover = across * _band(y / pixel, (top + (row + 0.5) * step) / pixel, step / pixel)
        colour = to_light(patch.colour if patch.tag is None else INK if cells[row, column] == 0 else DISK)
        light += cover[..., None] * (colour - np.broadcast_to(to_light(DISK), 3))


def _band(v: NDArray[np.float64], centre: float, width: float) -> NDArray[np.float64]:
    """Compute the share of each pixel (1 wide, at v) that a band of that centre and width covers."""
    low, high = np.maximum(v - 0.5, centre - width / 2), np.minimum(v + 0.5, centre + width / 2)
    return np.asarray(np.clip(high - low, 0.0, 1.0), dtype=np.float64)
