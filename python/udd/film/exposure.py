"""One exposure: the disk's light averaged while the shutter is open, between the wall and the support."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from udd.video.resampling import resampled

from .camera import Camera
from .defects import WOBBLE_PERIOD, Defects, hand, lit, person, source_of_pixels, view_of
from .light import Picture, to_code
from .motion import Array, Motion
from .scene import back_shapes, blurred, front_shapes, over, paint
from .sprite import FINE, Patch, disk_sprite

FOCUS = 0.6  # standard deviation of the lens's blur, pixels
COARSE = 0.25  # pixels of the shadow's picture per pixel
# The farthest a point of the disk goes in a sub-frame, pixels: within 1.3 codes of a continuous streak.
STEP = 1.5
STILL = 0.02  # pixels; a point that goes no farther is still
SHADOW_DEPTH, SHADOW_SOFT, SHADOW_SHIFT = 0.16, 0.09, (0.07, 0.10)  # in disk radii; shift right and down


class Scene:
    """Everything but the motion, drawn once; `expose` gives the picture of one frame."""

    def __init__(
        self,
        camera: Camera,
        radius: float,
        background: Picture,
        support: float,
        defects: Defects,
        patches: Sequence[Patch] | None = None,
    ) -> None:
        unit = radius / 0.08
        self.camera = camera
        self.radius = radius * camera.scale
        self.defects = defects
        offsets = np.asarray(defects.mark_offsets, dtype=np.float64) * camera.scale
        self.sprite = disk_sprite(self.radius, FOCUS, offsets, defects.mark_strength, patches)
        back = paint(back_shapes(unit) if support > 0 else [], camera, FOCUS)
        front = paint(front_shapes(unit, support, defects.bars), camera, FOCUS)
        self.background, self.back = background, back
        self.below = over(back, background)
        self.front, self.clear = _split(front)
        self.shade = _shadow(self.radius)
        self._still = over(front, self.below)
        self.source_pixels = source_of_pixels(camera, defects) if defects.bends else None
        self.plain = not (defects.bends or defects.lights or defects.moves)
        self.plain &= not (len(defects.hands) or len(defects.walkers))
        self._codes = to_code(self._still)
        self._picture = np.empty_like(self._codes)

    def expose(self, motion: Motion, time: float, stamp: float | None = None) -> Picture:
        """Return the unrounded codes (height, width, 3) of the frame whose exposure is centred on `time`.

        The next call writes into the same array. `stamp` is the film's own time, `time` if not given.
        """
        stamp = time if stamp is None else stamp
        times = sub_times(motion, time, self.camera, self.radius, self.defects.readout)
        states = motion(times)
        centres = self.camera.to_pixel(states[:, 1], states[:, 2])
        squeeze = np.cos(self.defects.wobble * np.sin(2 * np.pi * times / WOBBLE_PERIOD))
        centres[:, 0] += (squeeze - 1) * (centres[:, 0] - self.camera.pivot[0])
        low, high = self._window(centres)
        picture, below = self._picture, self.below
        passer = person(self.camera, stamp, self.defects, behind=True)
        if passer is None:
            np.copyto(picture, self._codes if self.plain else self._still)
        else:
            below = over(self.back, over(passer, self.background))
            np.copyto(picture, self.front + self.clear * below)
        if (high > low).all():
            part = (slice(low[1], high[1]), slice(low[0], high[0]))
            light = self._disk(below, times - time, states, centres - low, squeeze, part)
            picture[part] = to_code(light) if self.plain else light
        return picture if self.plain else self._developed(picture, stamp)

    def _disk(
        self,
        below: Picture,
        times: Array,
        states: Array,
        centres: Array,
        squeeze: Array,
        part: tuple[slice, slice],
    ) -> Picture:
        """Return the light of the part of the picture that the disk and its shadow may touch."""
        rows = np.arange(part[0].start, part[0].stop)
        shape = (len(rows), part[1].stop - part[1].start)
        weights = _open(times, rows, self.camera, self.defects.readout)
        turns = states[:, 3] + self.camera.tilt
        disk, clear = _split(_average(self.sprite, FINE, centres, turns, (*shape, 4), weights, squeeze))
        # the shadow is round, so it only shifts, and so soft that steps of half its softness do not show
        every = max(int(SHADOW_SOFT * self.radius / STEP / 2), 1)
        some = centres[::every]
        if weights is None:
            some = some + (centres.mean(axis=0) - some.mean(axis=0))
            shadow_weights = None
        else:
            shadow_weights = weights[::every] / np.maximum(weights[::every].sum(axis=0), 1e-6)
        some = some + np.multiply(SHADOW_SHIFT, self.radius)
        shadow = _average(self.shade, COARSE, some, np.zeros(len(some)), shape, shadow_weights)
        light = below[part] * _threefold(1 - shadow)
        light *= clear
        light += disk
        light *= self.clear[part]
        light += self.front[part]
        return light

    def _developed(self, light: Picture, time: float) -> Picture:
        """Codes of what the lens and the lamps make of a true-to-scale picture's light."""
        import cv2

        if len(self.defects.hands):
            light = hand(light, self.camera, time, self.defects)
        passer = person(self.camera, time, self.defects, behind=False)
        light = light if passer is None else over(passer, light)
        if self.source_pixels is not None:
            light = np.asarray(
                cv2.remap(light, *self.source_pixels, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE),
                dtype=np.float32,
            )
        if self.defects.moves:
            view = view_of(self.camera, time, self.defects)
            light = resampled(light, np.asarray(cv2.invertAffineTransform(view)))
        if self.defects.lights:
            light = lit(light, time, self.defects)
        return to_code(np.clip(light, 0, 1))

    def _window(self, centres: Array) -> tuple[np.ndarray, np.ndarray]:
        """Find the pixels the disk or its shadow may touch: corners (x, y), the upper one excluded."""
        margin = self.radius * (1 + max(SHADOW_SHIFT) + 3 * SHADOW_SOFT) + 8
        low = np.floor(centres.min(axis=0) - margin).astype(int)
        high = np.ceil(centres.max(axis=0) + margin).astype(int) + 1
        return np.maximum(low, 0), np.minimum(high, self.camera.size)


def sub_times(motion: Motion, time: float, camera: Camera, radius: float, readout: float = 0.0) -> Array:
    """Space sub-frames evenly through the exposure, as many as the fastest point of the rim needs.

    Their times have the mean and the variance of the whole exposure: where the disk turns back, a few of them
    represent a curved path.
    A rolling shutter's exposure lasts from the first row's opening to the last row's closing.
    """
    whole = camera.exposure + readout / float(camera.rate)
    opened, middle, closed = motion(time + whole * np.array([-0.5, 0.0, 0.5]))
    path = 0.0
    for a, b in ((opened, middle), (middle, closed)):
        path += math.hypot(b[1] - a[1], b[2] - a[2]) * camera.scale + abs(b[3] - a[3]) * radius
    fewest = 32 if readout else 2 if path > STILL else 1
    n = min(max(math.ceil(path / STEP), fewest), 1024)
    spread = 1.0 if readout or n == 1 else 1 / math.sqrt(1 - n**-2)
    return np.asarray(time + spread * whole * ((np.arange(n) + 0.5) / n - 0.5), dtype=np.float64)


def _open(times: Array, rows: np.ndarray, camera: Camera, readout: float) -> Array | None:
    """Return the share of each sub-frame (n, rows) in each row's exposure; None where all rows are alike."""
    if readout == 0:
        return None
    height = camera.size[1]
    middle = readout / float(camera.rate) * ((rows + 0.5) / height - 0.5)
    step = times[1] - times[0]
    low = np.maximum(times[:, None] - step / 2, middle[None, :] - camera.exposure / 2)
    high = np.minimum(times[:, None] + step / 2, middle[None, :] + camera.exposure / 2)
    share = np.maximum(high - low, 0)
    return np.asarray(share / share.sum(axis=0), dtype=np.float64)


def _average(
    sprite: Picture,
    fine: float,
    centres: Array,
    turns: Array,
    shape: tuple[int, ...],
    weights: Array | None = None,
    squeeze: Array | None = None,
) -> Picture:
    """Average the sprite with its middle at each of the centres (n, 2), turned clockwise by each angle.

    `fine` is the number of sprite pixels per pixel, `shape` that of the result, `weights` (n, rows) that of
    each copy in each row, `squeeze` (n,) its width.
    """
    import cv2

    total = np.zeros(shape, dtype=np.float32)
    piece = np.empty_like(total)
    middle = (sprite.shape[0] - 1) / 2
    for k, ((x, y), turn) in enumerate(zip(centres, turns, strict=True)):
        if weights is not None and not weights[k].any():
            continue
        c, s = fine * math.cos(turn), fine * math.sin(turn)
        thin = 1.0 if squeeze is None else 1 / float(squeeze[k])
        inverse = np.array(
            [[c * thin, s, middle - c * thin * x - s * y], [-s * thin, c, middle + s * thin * x - c * y]]
        )
        if weights is None:
            cv2.warpAffine(
                sprite, inverse, shape[1::-1], dst=piece, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
            )
            cv2.accumulate(piece, total)
            continue
        rows = np.flatnonzero(weights[k])
        first, last = int(rows[0]), int(rows[-1]) + 1
        inverse[:, 2] += inverse[:, 1] * first
        band = cv2.warpAffine(
            sprite, inverse, (shape[1], last - first), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        )
        weight = weights[k, first:last].astype(np.float32).reshape(-1, *[1] * (len(shape) - 1))
        total[first:last] += band * weight
    if weights is None:
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
