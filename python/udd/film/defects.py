"""Defects of real scenes and cameras, to be put into a film on purpose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.validation import array, number
from udd.errors import UddError

from .camera import Camera
from .light import Picture

WALKING = 1.2  # m/s
SKIN, HAIR, SHIRT, STRIPE = (198, 150, 122), (62, 44, 30), (64, 82, 120), (182, 178, 170)
WOBBLE_PERIOD = 1.3  # s
FLICKER_PERIOD = 0.37  # s: the beat of lamps on alternating current against the frames


@dataclass(frozen=True)
class Defects:
    """Defects of the scene, the camera and the file; by default none.

    Attributes
    ----------
    clutter : int
        Number of patches in the marks' colours on the wall, at random places.
    bars : int
        Number of cross-bars of the support in front of the disk. They are 95 mm wide.
    off_axis : (float, float)
        Angles in rad between the disk's axis and the camera, to the side and downward. The camera is aimed at
        the pivot.
    distance : float
        Distance from the camera to the pivot, m. It sets the strength of the perspective of `off_axis`.
    lens : float
        Radial distortion: relative displacement at the picture's corner, above 0 for barrel.
    readout : float
        Share of a frame that a rolling shutter takes from the first row to the last. The time of a frame is
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
        Strength of each mark's colour: 1 for full colour. It is 0 for a mark that fell off.
    dropped : sequence of int
        Frames left out of the file. The time stamps of the others stay.
    repeated : sequence of int
        Frames that the file shows as copies of those before them.
    black : sequence of int
        Frames without a picture.
    after : float
        Time in s for which the film goes on after the run's end, with the disk falling freely.
    poster : float
        Size of a picture of the device on the wall next to it, relative to the device. 0 means none.
    mirrored : bool
        The film shows left as right, as selfie cameras do.
    turned : int
        Quarter turns clockwise by which the whole film is turned.
    shake : float
        Motion of a hand-held camera, pixels r.m.s. It also rolls a little.
    bumps : sequence of (float, float, float)
        Times in s of bumps of the camera, with the new displacement of the picture in pixels (right, down).
    zooms : sequence of (float, float)
        Times in s from which on the picture is enlarged, and by which factor.
    gains : sequence of (float, float)
        Times in s from which on the camera takes more light or less, and the factor.
    hands : sequence of (float, float)
        Times in s from which and until which a hand hides the disk.
    walkers : sequence of (float, float)
        Times in s at which a person who walks to the right passes the pivot, and the distance of the person
        from the camera relative to the device's. It is below 1 in front of the device.
    clock : sequence of (float, float)
        Times in s, by the film's own clock, from which on the motion is shown slower than the stamps say, and
        by which factor. It is below 1 where the motion is shown faster.
    flat : bool
        The time stamps of the file are even although frames were dropped.
    blended : float
        Frames per second of the camera, if a converter brought them to the film's rate and mixed neighbours
        in time. 0 means that no converter did.
    copied : float
        The same for a converter that repeats or drops frames.
    denoise : float
        Share of the previous picture in the present one where the two differ little: the camera's temporal
        noise reduction.

    See Also
    --------
    udd.render : takes them.

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
    poster: float = 0.0
    mirrored: bool = False
    turned: int = 0
    shake: float = 0.0
    bumps: Sequence[Sequence[float]] = ()
    zooms: Sequence[Sequence[float]] = ()
    gains: Sequence[Sequence[float]] = ()
    hands: Sequence[Sequence[float]] = ()
    walkers: Sequence[Sequence[float]] = ()
    clock: Sequence[Sequence[float]] = ()
    flat: bool = False
    blended: float = 0.0
    copied: float = 0.0
    denoise: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        ranges = {
            "clutter": (0, 1000), "bars": (0, 20), "distance": (0.3, 100), "lens": (-0.3, 0.3),
            "readout": (0, 1), "gradient": (-1, 1), "flicker": (0, 0.9), "wobble": (0, 0.5), "after": (0, 60),
            "poster": (0, 2), "turned": (-3, 3), "shake": (0, 50), "blended": (0, 1000), "copied": (0, 1000),
            "denoise": (0, 0.95),
        }  # fmt: skip
        for name, (low, high) in ranges.items():
            value = number(name, getattr(self, name))
            if not low <= value <= high:
                raise UddError(f"{name} must be from {low:g} to {high:g}, got {value!r}")
        shapes = {"off_axis": (2,), "mark_offsets": (4, 2), "mark_strength": (4,)}
        for name, shape in shapes.items():
            if array(name, getattr(self, name)).shape != shape:
                raise UddError(f"{name} must be finite numbers of shape {shape}, got {getattr(self, name)!r}")
        for name, width, least in (("bumps", 3, -1e3), ("zooms", 2, 0.2), ("gains", 2, 0.01),
                                   ("hands", 2, 0.0), ("walkers", 2, 0.3), ("clock", 2, 0.01)):  # fmt: skip
            given = array(name, getattr(self, name))
            rows = given.reshape(-1, width) if given.size % width == 0 else np.full((1, width), np.nan)
            times = rows[:, 0] if name != "hands" else rows.ravel()
            if not (np.isfinite(rows).all() and (np.diff(times) > 0).all() and (rows[:, 1:] >= least).all()):
                raise UddError(
                    f"{name} must be rows of {width} numbers at increasing times, got {getattr(self, name)!r}"
                )
        if max(abs(a) for a in self.off_axis) > 0.8:
            raise UddError(f"off_axis must be at most 0.8 rad, got {tuple(self.off_axis)!r}")
        if not all(0 <= s <= 1 for s in self.mark_strength):
            raise UddError(f"mark_strength must be from 0 to 1, got {tuple(self.mark_strength)!r}")

    @property
    def bends(self) -> bool:
        """True if the picture is not a true-to-scale one of the disk's plane."""
        return bool(self.lens) or any(self.off_axis)

    @property
    def lights(self) -> bool:
        """True if the light is uneven in space or in time."""
        return bool(self.gradient or self.flicker or len(self.gains))

    @property
    def moves(self) -> bool:
        """True if the camera moves or zooms."""
        return bool(self.shake or len(self.bumps) or len(self.zooms))

    def __repr__(self) -> str:
        """Only what is not as it should be."""
        entries = [
            f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if getattr(self, f.name) != f.default
        ]
        return f"Defects({', '.join(entries)})"


def source_of_pixels(camera: Camera, defects: Defects) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the place (x, y) of each pixel of the distorted picture in a true-to-scale one.

    A pinhole camera at `distance` looks at the pivot from the side and from below. The lens then moves points
    inward by the factor 1 - lens r^2, r being the distance from the picture's middle (corner: 1).
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
    # rays (u, v, f) in the camera, turned into the laboratory; the camera is at -distance along its axis
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
    now = _last(defects.gains, time, (1.0,))[0]
    now *= 1 + defects.flicker * math.sin(2 * math.pi * time / FLICKER_PERIOD)
    return np.asarray(np.minimum(light * (across * np.float32(now))[None, :, None], 1), dtype=np.float32)


def _last(rows: Sequence[Sequence[float]], time: float, before: tuple[float, ...]) -> tuple[float, ...]:
    """Return the values of the last row whose time has come."""
    values_now = before
    for begin, *values in rows:
        if time >= begin:
            values_now = tuple(float(v) for v in values)
    return values_now


def view_of(camera: Camera, time: float, defects: Defects) -> NDArray[np.float64]:
    """Return the affine map (2, 3) from pixels of a steady camera's picture to those of the moving one's."""
    random = np.random.Generator(np.random.PCG64(11))
    frequency, phase = random.uniform(0.4, 3.5, (3, 5)), random.uniform(0, 2 * math.pi, (3, 5))
    sway = np.sin(2 * math.pi * frequency * time + phase).sum(axis=1) * math.sqrt(2 / 5) * defects.shake
    du, dv = _last(defects.bumps, time, (0.0, 0.0))
    roll, zoom = 0.3 * sway[2] / max(camera.size), _last(defects.zooms, time, (1.0,))[0]
    c, s = zoom * math.cos(roll), zoom * math.sin(roll)
    u, v = (camera.size[0] - 1) / 2, (camera.size[1] - 1) / 2
    return np.array([[c, -s, u - c * u + s * v + sway[0] + du], [s, c, v - s * u - c * v + sway[1] + dv]])


def real_times(stamps: NDArray[np.float64], clock: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """Return when the frames with these stamps were exposed, where parts of the film are slowed down."""
    if not len(clock):
        return stamps
    begin, slower = np.array([0.0, *(row[0] for row in clock)]), np.array([1.0, *(row[1] for row in clock)])
    real = np.concatenate([[0.0], np.cumsum(np.diff(begin) / slower[:-1])])
    part = np.searchsorted(begin, stamps, side="right") - 1
    return np.asarray(real[part] + (stamps - begin[part]) / slower[part])


def hand(picture: Picture, camera: Camera, time: float, defects: Defects) -> Picture:
    """Lay a hand over the disk, as long as one is there; it comes from the right."""
    from .scene import dot, over, paint

    if not any(begin <= time < end for begin, end in defects.hands):
        return picture
    shapes = [dot(0.01 + 0.05 * k, 0.02 * k, 0.12, SKIN) for k in range(4)]
    return over(paint(shapes, camera, 1.5), picture)


def person(camera: Camera, time: float, defects: Defects, behind: bool) -> Picture | None:
    """Draw the person who passes at a time behind the device or in front of it, as a layer; None if none."""
    import cv2

    from .scene import blurred, box, dot, paint

    for passing, distance in defects.walkers:
        gone = WALKING * (time - passing)
        reach = distance * max(camera.size) / camera.scale + 0.4
        if (distance > 1) != behind or abs(gone) > reach:
            continue
        swing = 0.12 * math.sin(2 * math.pi * time)
        shapes = [box(-0.2, -1.2, 0.2, 0.3, SHIRT), dot(0.0, 0.45, 0.13, SKIN), dot(0.02, 0.51, 0.13, HAIR)]
        shapes += [box(-0.2, 0.14 * k, 0.2, 0.14 * k + 0.05, STRIPE) for k in range(-8, 3)]
        shapes += [box(swing - 0.06, -0.4, swing + 0.06, 0.2, STRIPE), dot(swing, -0.42, 0.06, SKIN)]
        moved = [((corners + np.array([gone, 0.0])) / distance, colour) for corners, colour in shapes]
        streak = max(1, round(WALKING * camera.exposure * camera.scale / distance))
        streaked = cv2.blur(paint(moved, camera, 0.0), (streak, 1), borderType=cv2.BORDER_REPLICATE)
        return blurred(np.asarray(streaked, dtype=np.float32), 1.2)
    return None


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


def with_poster(picture: Picture, camera: Camera, defects: Defects) -> Picture:
    """Hang a picture of the device on the wall, as large as `poster` says, in the upper left corner."""
    import cv2

    from .scene import front_shapes, over, paint
    from .sprite import FINE, disk_sprite

    size = defects.poster
    radius = 0.08 * camera.scale * size
    at = (1.15 * radius, 1.15 * radius)
    sprite = disk_sprite(radius, 0.6)
    middle, turn = (sprite.shape[0] - 1) / 2, 0.4
    c, s = FINE * math.cos(turn), FINE * math.sin(turn)
    inverse = np.array([[c, s, middle - c * at[0] - s * at[1]], [-s, c, middle + s * at[0] - c * at[1]]])
    shown = cv2.warpAffine(sprite, inverse, camera.size, flags=cv2.INTER_AREA | cv2.WARP_INVERSE_MAP)
    small = Camera(camera.size, camera.scale * size, at, 0.0, camera.rate, camera.exposure)
    support = [(0.5 * corners, colour) for corners, colour in front_shapes(1.0, 1.0)]
    return over(paint(support, small, 0.6), over(np.asarray(shown, dtype=np.float32), picture))
