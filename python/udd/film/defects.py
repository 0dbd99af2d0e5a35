"""What goes wrong in front of a real camera and inside it, to be put into a film on purpose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

from .camera import Camera
from .light import Picture

WOBBLE_PERIOD = 1.3  # s
FLICKER_PERIOD = 0.37  # s: the beat of lamps on alternating current against the frames


@dataclass(frozen=True)
class Defects:
    """Defects of the scene, the camera and the file; by default none.

    Attributes
    ----------
    clutter : int
        Patches in the marks' colours that hang on the wall, at random places.
    bars : int
        Cross-bars of the support before the disk, 95 mm wide.
    off_axis : (float, float)
        Angles in rad by which the camera stands beside and below the disk's axis, aimed at the pivot.
    distance : float
        From the camera to the pivot, m; how strong the perspective of `off_axis` is.
    lens : float
        Radial distortion: relative displacement at the picture's corner, above 0 for barrel.
    readout : float
        Share of a frame that a rolling shutter takes from the first row to the last; the time of a frame is
        that of its middle row.
    gradient : float
        Relative change of the light from the picture's left edge to its right.
    flicker : float
        Relative amplitude of the light's change in time.
    wobble : float
        Amplitude in rad of the disk's turning about the vertical through the pivot: it foreshortens.
    mark_offsets : sequence of four (float, float)
        How far each mark (red, orange, blue, green) is glued off its place, m: (clockwise, outward).
    mark_strength : sequence of four float
        1 for a mark in full colour, 0 for one that fell off.
    dropped : sequence of int
        Frames left out of the file; the time stamps of the others stay.
    repeated : sequence of int
        Frames that the file shows as copies of those before them.
    black : sequence of int
        Frames without a picture.
    after : float
        Time in s for which the film goes on after the run's end, with the disk falling freely.

    Examples
    --------
    >>> import math, udd
    >>> aside = udd.film.Defects(off_axis=(math.radians(15), 0.0))
    >>> aside.bends
    True
    """

    clutter: int = 0
    bars: int = 0
    off_axis: Sequence[float] = (0.0, 0.0)
    distance: float = 1.2
    lens: float = 0.0
    readout: float = 0.0
    gradient: float = 0.0
    flicker: float = 0.0
    wobble: float = 0.0
    mark_offsets: Sequence[Sequence[float]] = ((0.0, 0.0),) * 4
    mark_strength: Sequence[float] = (1.0,) * 4
    dropped: Sequence[int] = ()
    repeated: Sequence[int] = ()
    black: Sequence[int] = ()
    after: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        ranges = {
            "clutter": (0, 1000), "bars": (0, 20), "distance": (0.3, 100), "lens": (-0.3, 0.3),
            "readout": (0, 1), "gradient": (-1, 1), "flicker": (0, 0.9), "wobble": (0, 0.5), "after": (0, 60),
        }  # fmt: skip
        for name, (low, high) in ranges.items():
            value = getattr(self, name)
            if not (math.isfinite(value) and low <= value <= high):
                raise UddError(f"{name} must be from {low:g} to {high:g}, got {value!r}")
        shapes = {"off_axis": (2,), "mark_offsets": (4, 2), "mark_strength": (4,)}
        for name, shape in shapes.items():
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if value.shape != shape or not np.isfinite(value).all():
                raise UddError(f"{name} must be finite numbers of shape {shape}, got {getattr(self, name)!r}")
        if max(abs(a) for a in self.off_axis) > 0.8:
            raise UddError(f"off_axis must be at most 0.8 rad, got {tuple(self.off_axis)!r}")
        if not all(0 <= s <= 1 for s in self.mark_strength):
            raise UddError(f"mark_strength must be from 0 to 1, got {tuple(self.mark_strength)!r}")

    @property
    def bends(self) -> bool:
        """Whether the picture is not a true-to-scale one of the disk's plane."""
        return bool(self.lens) or any(self.off_axis)

    @property
    def lights(self) -> bool:
        """Whether the light is uneven in space or in time."""
        return bool(self.gradient or self.flicker)

    def __repr__(self) -> str:
        """Only what is not as it should be."""
        said = [
            f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if getattr(self, f.name) != f.default
        ]
        return f"Defects({', '.join(said)})"


def source_of_pixels(camera: Camera, defects: Defects) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return, for each pixel of the bent picture, the place (x, y) of a true-to-scale one that it shows.

    A pinhole camera at `distance` looks at the pivot from beside and below; the lens then moves a point at
    distance r (corner: 1) from the picture's middle inward by the factor 1 - lens r^2.
    """
    width, height = camera.size
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    corner = float(np.hypot(*middle))
    x, y = np.meshgrid(np.arange(width) - middle[0], np.arange(height) - middle[1])
    # inverse of q -> q (1 - lens |q|^2), by iteration
    px, py = x / corner, y / corner
    qx, qy = px, py
    for _ in range(30):
        shrink = 1 - defects.lens * (qx**2 + qy**2)
        qx, qy = px / shrink, py / shrink
    u, v = qx * corner + middle[0] - camera.pivot[0], qy * corner + middle[1] - camera.pivot[1]
    a, b = defects.off_axis
    # rays (u, v, f) in the camera, turned into the laboratory; the camera stands at -distance along its axis
    focal = camera.scale * defects.distance
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    right, down = np.array([ca, 0, -sa]), np.array([sa * sb, cb, ca * sb])
    ahead = np.array([sa * cb, -sb, ca * cb])
    ray = [u * right[k] + v * down[k] + focal * ahead[k] for k in range(3)]
    start = -defects.distance * ahead
    along = -start[2] / ray[2]
    on_x, on_y = start[0] + along * ray[0], start[1] + along * ray[1]
    return (
        (camera.pivot[0] + camera.scale * on_x).astype(np.float32),
        (camera.pivot[1] + camera.scale * on_y).astype(np.float32),
    )


def lit(light: Picture, time: float, defects: Defects) -> Picture:
    """Return the picture under uneven light."""
    width = light.shape[1]
    across = 1 + defects.gradient * (np.arange(width, dtype=np.float32) / np.float32(width - 1) - 0.5)
    now = 1 + defects.flicker * math.sin(2 * math.pi * time / FLICKER_PERIOD)
    return np.asarray(np.minimum(light * (across * np.float32(now))[None, :, None], 1), dtype=np.float32)


def hung(picture: Picture, camera: Camera, count: int, unit: float) -> Picture:
    """Hang patches in the marks' colours on the wall, of about the marks' size, never under the table."""
    from .scene import box, over, paint
    from .sprite import MARKS

    random = np.random.Generator(np.random.PCG64(7))
    half = 0.5 * np.array(camera.size) / camera.scale / unit
    shapes: list[Any] = []
    for k in range(count):
        y = random.uniform(-half[0], half[0])
        z = random.uniform(-0.15, half[1])
        side = random.uniform(0.012, 0.022)
        colour = np.clip(np.array(MARKS[k % 4]) + random.integers(-14, 15, 3), 0, 255)
        red, green, blue = (int(c) for c in colour)
        corners, paint_of = box(y, z, y + side, z + side, (red, green, blue))
        shapes.append((corners * unit, paint_of))
    return over(paint(shapes, camera, 0.6), picture)
