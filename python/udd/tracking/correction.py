"""The correction of a film's pictures before they are measured: steady, as bright, upright, unmirrored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.measurement import CAMERA_COLUMNS
from udd.video.reader import Box, Film, Picture, Plane
from udd.video.resampling import resampled
from udd.video.srgb import code_of, light_of


@dataclass(frozen=True)
class Correction:
    """A map of a film's pictures to what a steady camera, held upright, would have taken.

    Attributes
    ----------
    turns : int
        Quarter turns counter-clockwise, once the picture is steady.
    mirrored : bool
        True if left and right are exchanged at the end.
    factor, shift : ndarray of complex (n,)
        A point z of the steady picture lies at ``factor[k] z + shift[k]`` in frame k; empty if the camera was
        at rest.
    gain : ndarray (n,)
        Light of frame k against that of the steady picture; empty if it is always the same.
    full_range : bool
        True if the brightness codes go from 0 to 255.
    """

    turns: int = 0
    mirrored: bool = False
    factor: NDArray[np.complex128] = field(default_factory=lambda: np.empty(0, np.complex128))
    shift: NDArray[np.complex128] = field(default_factory=lambda: np.empty(0, np.complex128))
    gain: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    full_range: bool = False

    def __call__(self, picture: Picture, box: Box | None = None) -> Picture:
        """Return the corrected picture; if a box is given, it may be unsteady outside the box."""
        planes = [picture.y, picture.u, picture.v]
        if len(self.factor):
            k = min(picture.index, len(self.factor) - 1)
            part = None if self.turns % 4 or self.mirrored else box
            planes = _steadied(planes, complex(self.factor[k]), complex(self.shift[k]), part)
        if len(self.gain):
            k = min(picture.index, len(self.gain) - 1)
            planes = _as_bright(planes, float(self.gain[k]), self.full_range)
        if self.turns % 4:
            planes = [np.rot90(p, self.turns) for p in planes]
        if self.mirrored:
            planes = [p[:, ::-1] for p in planes]
        y, u, v = (np.ascontiguousarray(p) for p in planes)
        return replace(picture, y=y, u=u, v=v)

    def then_mirrored(self) -> Correction:
        """Return the correction with left and right exchanged at the end."""
        return replace(self, mirrored=not self.mirrored)

    def then_turned(self, turns: int) -> Correction:
        """Return the correction with quarter turns counter-clockwise at the end."""
        return replace(self, turns=(self.turns + (-turns if self.mirrored else turns)) % 4)

    def place(self, at: complex, size: tuple[int, int]) -> complex:
        """Return where a point (u + iv) of a picture of this size lies after the turn and the mirror."""
        width, height = size
        for _ in range(self.turns % 4):
            at = complex(at.imag, width - 1 - at.real)
            width, height = height, width
        return complex(width - 1 - at.real, at.imag) if self.mirrored else at

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The camera's motion as columns of `Measurement.quality`; none if it was at rest."""
        n = max(len(self.factor), len(self.gain))
        if not n:
            return {}
        factor = self.factor if len(self.factor) else np.ones(n, np.complex128)
        shift = self.shift if len(self.shift) else np.zeros(n, np.complex128)
        gain = self.gain if len(self.gain) else np.ones(n)
        motion = (shift.real, shift.imag, np.angle(factor), np.abs(factor), gain)
        return {name: np.round(x, 6) for name, x in zip(CAMERA_COLUMNS, motion, strict=True)}

    @property
    def meta(self) -> dict[str, Any]:
        """Entries of a measurement's header."""
        out: dict[str, Any] = {"mirrored": True} if self.mirrored else {}
        return out | ({"turned": self.turns % 4} if self.turns % 4 else {})


def applied(film: Film) -> Correction:
    """Return the correction that a film's pictures get now."""
    if isinstance(film.correct, Correction):
        return film.correct
    return Correction(full_range=film.full_range)


def correction_of(
    meta: Mapping[str, Any], quality: Mapping[str, NDArray[Any]], full_range: bool
) -> Correction | None:
    """Return the correction with which a film was measured, from what the measurement says; None for none."""
    turns, mirrored = int(meta.get("turned", 0)), bool(meta.get("mirrored", False))
    if all(name in quality for name in CAMERA_COLUMNS):
        u, v, turn, zoom, gain = (np.asarray(quality[name], dtype=float) for name in CAMERA_COLUMNS)
        return Correction(turns, mirrored, zoom * np.exp(1j * turn), u + 1j * v, gain, full_range)
    return Correction(turns, mirrored, full_range=full_range) if turns or mirrored else None


def _steadied(planes: list[Plane], factor: complex, shift: complex, box: Box | None) -> list[Plane]:
    """Resample the planes, or a box of them; a sample of a colour lies between two pixels of the picture."""
    half = 0.5 + 0.5j
    shifts = (shift, *[(factor * half + shift - half) / 2] * 2)
    out = []
    for plane, at, size in zip(planes, shifts, (1, 2, 2), strict=True):
        r0, r1, c0, c1 = (0, plane.shape[0], 0, plane.shape[1]) if box is None else (x // size for x in box)
        at += factor * complex(c0, r0)
        view = np.array([[factor.real, -factor.imag, at.real], [factor.imag, factor.real, at.imag]])
        moved = np.empty_like(plane) if box is None else plane.copy()
        moved[r0:r1, c0:c1] = resampled(plane, view, (c1 - c0, r1 - r0))
        out.append(moved)
    return out


def _as_bright(planes: list[Plane], gain: float, full_range: bool) -> list[Plane]:
    """Divide the light by the gain; colours become paler or stronger with it."""
    import cv2

    if abs(gain - 1) < 1e-6:
        return planes
    low, high = (0.0, 255.0) if full_range else (16.0, 219.0)
    codes = (np.arange(256) - low) / high
    lit = code_of(np.clip(light_of(np.clip(codes, 0, 1.08)) / gain, 0, 1.2))
    table = np.clip(np.round(lit * high + low), 0, 255).astype(np.uint8)
    strength = gain ** (-1 / 2.2)
    tint = np.clip(np.round((np.arange(256) - 128.0) * strength) + 128, 0, 255).astype(np.uint8)
    tables = (table, tint, tint)
    return [np.asarray(cv2.LUT(p, t), dtype=np.uint8) for p, t in zip(planes, tables, strict=True)]
