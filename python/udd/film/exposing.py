"""One exposure: the disk's light averaged while the shutter is open, between the wall and the support."""

from __future__ import annotations

import math

import numpy as np

from udd.film.camera import Camera
from udd.film.light import Picture, to_code
from udd.film.motion import Array, Motion
from udd.film.scene import back_shapes, blurred, front_shapes, over, paint
from udd.film.sprite import FINE, disk_sprite

FOCUS = 0.6  # standard deviation of the lens's blur, pixels
COARSE = 0.25  # pixels of the shadow's picture per pixel
# The farthest a point of the disk goes in a sub-frame, pixels: within 1.3 codes of a continuous streak.
STEP = 1.5
SHADOW_DEPTH, SHADOW_SOFT, SHADOW_SHIFT = 0.16, 0.09, (0.07, 0.10)  # in disk radii; shift right and down


class Scene:
    """Everything but the motion, drawn once; `expose` gives the picture of one frame."""

    def __init__(self, camera: Camera, radius: float, background: Picture, support: float) -> None:
        unit = radius / 0.08
        self.camera = camera
        self.radius = radius * camera.scale
        self.sprite = disk_sprite(self.radius, FOCUS)
        back = paint(back_shapes(unit) if support > 0 else [], camera, FOCUS)
        front = paint(front_shapes(unit, support), camera, FOCUS)
        self.below = over(back, background)
        self.front, self.clear = _split(front)
        self.shade = _shadow(self.radius)
        self.still = to_code(over(front, self.below))
        self._picture = np.empty_like(self.still)

    def expose(self, motion: Motion, time: float) -> Picture:
        """Return the unrounded codes (height, width, 3) of the frame whose exposure is centred on `time`.

        The next call writes into the same array.
        """
        states = motion(sub_times(motion, time, self.camera, self.radius))
        centres = self.camera.to_pixel(states[:, 1], states[:, 2])
        low, high = self._window(centres)
        picture = self._picture
        np.copyto(picture, self.still)
        if (high > low).all():
            part = (slice(low[1], high[1]), slice(low[0], high[0]))
            shape = (int(high[1] - low[1]), int(high[0] - low[0]))
            turns = states[:, 3] + self.camera.tilt
            disk, clear = _split(_average(self.sprite, FINE, centres - low, turns, (*shape, 4)))
            # the shadow is round, so it only shifts, and so soft that steps of half its softness do not show
            some = centres[:: max(int(SHADOW_SOFT * self.radius / STEP / 2), 1)]
            some = (
                some
                + (centres.mean(axis=0) - some.mean(axis=0))
                + np.multiply(SHADOW_SHIFT, self.radius)
                - low
            )
            shadow = _average(self.shade, COARSE, some, np.zeros(len(some)), shape)
            light = self.below[part] * _threefold(1 - shadow)
            light *= clear
            light += disk
            light *= self.clear[part]
            light += self.front[part]
            picture[part] = to_code(light)
        return picture

    def _window(self, centres: Array) -> tuple[np.ndarray, np.ndarray]:
        """Find the pixels the disk or its shadow may touch: corners (x, y), the upper one excluded."""
        margin = self.radius * (1 + max(SHADOW_SHIFT) + 3 * SHADOW_SOFT) + 8
        low = np.floor(centres.min(axis=0) - margin).astype(int)
        high = np.ceil(centres.max(axis=0) + margin).astype(int) + 1
        return np.maximum(low, 0), np.minimum(high, self.camera.size)


def sub_times(motion: Motion, time: float, camera: Camera, radius: float) -> Array:
    """Space sub-frames evenly through the exposure, as many as the fastest point of the rim needs."""
    opened, middle, closed = motion(time + camera.exposure * np.array([-0.5, 0.0, 0.5]))
    path = 0.0
    for a, b in ((opened, middle), (middle, closed)):
        path += math.hypot(b[1] - a[1], b[2] - a[2]) * camera.scale + abs(b[3] - a[3]) * radius
    n = min(max(math.ceil(path / STEP), 1), 1024)
    return np.asarray(time + camera.exposure * ((np.arange(n) + 0.5) / n - 0.5), dtype=np.float64)


def _average(sprite: Picture, fine: float, centres: Array, turns: Array, shape: tuple[int, ...]) -> Picture:
    """Average the sprite with its middle at each of the centres (n, 2), turned clockwise by each angle.

    `fine` is the number of sprite pixels per pixel, `shape` that of the result.
    """
    import cv2

    total = np.zeros(shape, dtype=np.float32)
    piece = np.empty_like(total)
    middle = (sprite.shape[0] - 1) / 2
    for (x, y), turn in zip(centres, turns, strict=True):
        c, s = fine * math.cos(turn), fine * math.sin(turn)
        inverse = np.array([[c, s, middle - c * x - s * y], [-s, c, middle + s * x - c * y]])
        cv2.warpAffine(
            sprite, inverse, shape[1::-1], dst=piece, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        )
        cv2.accumulate(piece, total)
    total /= len(centres)
    return total


def _split(layer: Picture) -> tuple[Picture, Picture]:
    """Split a layer into its light and the share of light it lets through, (height, width, 3) each."""
    import cv2

    light = np.asarray(cv2.cvtColor(layer, cv2.COLOR_BGRA2BGR), dtype=np.float32)
    return light, _threefold(1 - layer[..., 3])


def _threefold(plane: Picture) -> Picture:
    """Repeat a plane (height, width) for three colours: faster to multiply by than a broadcast plane."""
    import cv2

    return np.asarray(cv2.merge([plane, plane, plane]), dtype=np.float32)


def _shadow(radius: float) -> Picture:
    """Draw the disk's soft shadow: the share of light it takes."""
    r, soft = radius * COARSE, SHADOW_SOFT * radius * COARSE
    reach = math.ceil(r + 3 * soft) + 2
    v = np.arange(-reach, reach + 1)
    full = np.clip(r - np.hypot(v[None, :], v[:, None]) + 0.5, 0, 1).astype(np.float32)
    return np.float32(SHADOW_DEPTH) * blurred(full, soft)
