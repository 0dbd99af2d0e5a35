"""The camera: where a point of the laboratory lands in the picture, and when the shutter is open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

# The paper's camera: 550 x 700 pixels, the disk 140 pixels in radius, the pivot a little above the middle.
PAPER_SIZE = (550, 700)
PAPER_RADIUS = 140.0
PAPER_PIVOT = (275.0, 330.0)


@dataclass(frozen=True)
class Camera:
    """Camera that looks straight at the disk.

    Pixel coordinates (x, y) have x to the right and y down, and the centre of the top left pixel at (0, 0).

    Attributes
    ----------
    size : (int, int)
        Width and height of the picture in pixels. Both are even.
    scale : float
        Pixels per metre.
    pivot : (float, float)
        Pixel at which the wheels hold the disk.
    tilt : float
        Clockwise rotation of the whole picture, in rad.
    rate : Fraction
        Frames per second.
    exposure : float
        Time in s for which the shutter is open. It is at most the time of a frame.
    """

    size: tuple[int, int]
    scale: float
    pivot: tuple[float, float]
    tilt: float
    rate: Fraction
    exposure: float

    def to_pixel(self, y: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pixels (..., 2) of the points (y, z) in m, relative to the pivot, z upward."""
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        return np.stack(
            [self.pivot[0] + self.scale * (c * y + s * z), self.pivot[1] + self.scale * (s * y - c * z)],
            axis=-1,
        )


class CameraOptions(TypedDict, total=False):
    """The camera of a film, see :func:`udd.render`."""

    fps: float
    exposure: float
    size: Sequence[int]
    scale: float | None
    pivot: Sequence[float] | None
    tilt: float


CAMERA_OPTIONS: CameraOptions = {
    "fps": 25.0,
    "exposure": 0.010,
    "size": (550, 700),
    "scale": None,
    "pivot": None,
    "tilt": 0.0,
}


def make_camera(radius: float, options: CameraOptions) -> Camera:
    """Check what the user gave; the rest is the paper's camera, fitted to its `size` and the radius in m."""
    size, fps, exposure = options["size"], options["fps"], options["exposure"]
    scale, pivot, tilt = options["scale"], options["pivot"], options["tilt"]
    numbers = np.asarray(size)
    if numbers.shape != (2,) or not all(
        float(v) == int(v) and 64 <= v <= 8192 and v % 2 == 0 for v in numbers
    ):
        raise UddError(f"size must be an even width and height from 64 to 8192 pixels, got {tuple(size)!r}")
    width, height = int(numbers[0]), int(numbers[1])
    if not (math.isfinite(fps) and 1 <= fps <= 1000):
        raise UddError(f"fps must be from 1 to 1000 frames per second, got {fps!r}")
    rate = Fraction(fps).limit_denominator(1001)
    if not (math.isfinite(exposure) and 0 < exposure <= 1 / rate * (1 + 1e-9)):
        raise UddError(
            f"exposure must be above 0 and at most one frame ({float(1 / rate):.6g} s), got {exposure!r} s"
        )
    zoom = min(width / PAPER_SIZE[0], height / PAPER_SIZE[1])
    if scale is None:
        scale = PAPER_RADIUS * zoom / radius
    if not (math.isfinite(scale) and 8 <= scale * radius <= 4096):
        raise UddError(
            f"scale must make the disk's radius 8 to 4096 pixels, got {scale!r} for R = {radius:.6g} m"
        )
    if pivot is None:
        pivot = (PAPER_PIVOT[0] * width / PAPER_SIZE[0], PAPER_PIVOT[1] * height / PAPER_SIZE[1])
    if len(pivot) != 2 or not all(math.isfinite(v) and abs(v) <= 1e5 for v in pivot):
        raise UddError(f"pivot must be two finite pixel coordinates (x, y), got {tuple(pivot)!r}")
    if not math.isfinite(tilt):
        raise UddError(f"tilt must be a finite angle in rad, got {tilt!r}")
    return Camera(
        (width, height), float(scale), (float(pivot[0]), float(pivot[1])), float(tilt), rate, float(exposure)
    )
