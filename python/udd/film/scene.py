"""The parts of the picture at rest: the wall and the table, the device behind the disk and in front of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .light import Picture, to_light

Colour = tuple[int, int, int]
Shape = tuple[NDArray[np.float64], Colour]  # corners (n, 2) as (y, z) in m, and an sRGB colour

WALL, TABLE = (152, 155, 148), (122, 92, 64)
BLACK, EDGE, HOLE, RUBBER, TREAD, METAL = (
    (26, 28, 29),
    (52, 55, 57),
    (12, 13, 13),
    (33, 35, 36),
    (14, 15, 15),
    (84, 88, 92),
)
MOTOR = (150, 152, 155)
_FINE = 8  # sub-pixels per pixel along each axis when the edge of a shape is drawn


def box(y0: float, z0: float, y1: float, z1: float, colour: Colour) -> Shape:
    """Make a rectangle from (y0, z0) to (y1, z1) in m."""
    return np.array([(y0, z0), (y1, z0), (y1, z1), (y0, z1)]), colour


def dot(y: float, z: float, r: float, colour: Colour) -> Shape:
    """Make a round spot of radius r in m."""
    a = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    return np.stack([y + r * np.cos(a), z + r * np.sin(a)], axis=1), colour


def back_shapes(unit: float) -> list[Shape]:
    """Build what is behind the disk: pillar, motor, drive wheel (3 cm) seen edge-on; unit is R / (8 cm)."""
    shapes = [
        box(-0.011, -0.180, 0.011, 0.002, BLACK),
        box(-0.036, -0.014, -0.008, 0.012, MOTOR),
        box(-0.036, -0.0025, 0.024, 0.0025, METAL),
        box(-0.0045, -0.030, 0.0045, 0.030, RUBBER),
        box(-0.0015, -0.030, 0.0015, 0.030, EDGE),
    ]
    return [(corners * unit, colour) for corners, colour in shapes]


def front_shapes(unit: float, width: float, bars: int = 0) -> list[Shape]:
    """Build the support before the disk: base, pillar with its row of holes, axle and support wheel.

    `width` is relative to the real support's 26 mm; 0 leaves all of it away. `bars` cross it lower down.
    """
    if width == 0:
        return []
    half = 0.013 * width
    crossing = [box(-0.0475, z - 0.0045, 0.0475, z + 0.0045, BLACK) for z in -0.055 * (1 + np.arange(bars))]
    shapes = [box(-0.092, -0.191, 0.092, -0.177, BLACK), box(-half, -0.181, half, 0.007, BLACK)]
    shapes += [box(side * half - 0.0006, -0.178, side * half + 0.0006, 0.007, EDGE) for side in (-1, 1)]
    shapes += [dot(0.0, -0.024 - 0.008 * i, 0.0023, HOLE) for i in range(20)]
    shapes += [box(-0.013 - half, -0.0028, 0.013 + half, 0.0028, METAL)]
    shapes += [box(-0.0065, -0.020, 0.0065, 0.020, RUBBER)]
    shapes += [box(-0.0065, z, 0.0065, z + 0.0011, TREAD) for z in np.arange(-0.0185, 0.019, 0.0035)]
    return [(corners * unit, colour) for corners, colour in [*crossing, *shapes]]


def paint(shapes: Sequence[Shape], camera: Camera, focus: float) -> Picture:
    """Draw a layer (height, width, 4): light times cover in red, green, blue, then cover; smooth edges."""
    import cv2

    width, height = camera.size
    layer = np.zeros((height, width, 4), dtype=np.float32)
    for corners, colour in shapes:
        pixels = camera.to_pixel(corners[:, 0], corners[:, 1])
        low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 1, 0)
        high = np.minimum(np.ceil(pixels.max(axis=0)).astype(int) + 2, (width, height))
        if (high <= low).any():
            continue
        fine = np.zeros(((high[1] - low[1]) * _FINE, (high[0] - low[0]) * _FINE), dtype=np.uint8)
        # the centre of pixel 0 lies at (FINE - 1) / 2 sub-pixels; OpenCV takes 8 bits of fraction
        points = (pixels - low + 0.5) * _FINE - 0.5
        cv2.fillPoly(fine, [np.round(points * 256).astype(np.int32)], 255, shift=8)
        size = (int(high[0] - low[0]), int(high[1] - low[1]))
        cover = cv2.resize(fine, size, interpolation=cv2.INTER_AREA)[..., None] / np.float32(255)
        part = layer[low[1] : high[1], low[0] : high[0]]
        part *= 1 - cover
        part += cover * np.append(to_light(colour), np.float32(1))
    return blurred(layer, focus)


def blurred(picture: Picture, sd: float) -> Picture:
    """Put the picture out of focus by a Gaussian of `sd` pixels."""
    import cv2

    if sd <= 0:
        return picture
    return np.asarray(
        cv2.GaussianBlur(picture, (0, 0), sd, borderType=cv2.BORDER_REPLICATE), dtype=np.float32
    )


def over(layer: Picture, below: Picture) -> Picture:
    """Lay the layer over a picture (height, width, 3)."""
    return np.asarray(layer[..., :3] + below * (1 - layer[..., 3:]), dtype=np.float32)


def room(camera: Camera, unit: float) -> Picture:
    """Draw a grey, faintly mottled wall, lit from the upper left, and the table: the same in every film."""
    import cv2

    width, height = camera.size
    mottle = np.zeros((height, width), dtype=np.float32)
    random = np.random.Generator(np.random.PCG64(20))
    for cells, weight in ((5, 0.5), (13, 0.3), (40, 0.2)):
        coarse = random.random((cells + 2, cells), dtype=np.float32) - np.float32(0.5)
        mottle += np.float32(weight) * cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    x, y = np.linspace(-1, 1, width), np.linspace(-1, 1, height)
    fall = 1 - 0.05 * x[None, :] - 0.04 * y[:, None] - 0.06 * (x[None, :] ** 2 + y[:, None] ** 2)
    wall = to_light(WALL) * (fall.astype(np.float32) * (1 + np.float32(0.10) * mottle))[..., None]
    reach = 20 * unit  # far beyond the picture on either side
    table = paint([box(-reach, -reach, reach, -0.169 * unit, TABLE)], camera, 0.0)
    table[..., :3] *= (1 + np.float32(0.25) * mottle)[..., None]
    return over(table, wall)
