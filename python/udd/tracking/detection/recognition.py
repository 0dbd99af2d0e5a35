"""Choice of the disk among similar objects: neither one at rest nor a mirror image."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import outside
from udd.tracking.correction import Correction, applied
from udd.tracking.options import TrackOptions
from udd.video.reader import Film, Picture, TrackError

from .colour_blobs import COLOURS, FEWEST, Sight, sightings
from .evidence import shown
from .layout_matching import sightings as matching
from .still_patches import split
from .survey import Survey, slowest

SAME_PLACE = 1.5  # Pixels: apparent motion of a thing at rest.
SAME_ANGLE = 0.03  # Apparent rotation of a thing at rest, in rad.
OFTEN = 0.3  # Share of the sights in one place above which the other sights are searched.
ALWAYS = 0.95  # Share of them above which the object never moves.
COARSE = 4  # Pixels of the pictures that are compared, along each side.
CHANGED = 14.0  # Codes by which light changes if something moves.
LARGE = 0.25  # Share of the disk's area: larger moving things are another object.
MARGIN = 1.0  # Part of a mark's side that is left out around a mark of another object.
WAY = 1.5  # Times the marks' reach: marks within it belong to the disk.


@dataclass(frozen=True)
class Recognition:
    """The survey's pictures, as they are corrected, and the disk in them."""

    look_over: Survey
    sights: list[Sight | None]
    seen: list[tuple[Picture, Sight]]  # the slowest first
    options: TrackOptions  # with places as they are in the corrected pictures
    clear: NDArray[np.bool_]  # (height, width): False at the marks of what only looks like the disk


def recognise(film: Film, look_over: Survey, options: TrackOptions) -> Recognition:
    """Find the disk in the survey's pictures; a mirrored film is turned around.

    Raises
    ------
    TrackError
        No disk with such marks is seen, or what shows them never moves while something else does.
    """
    sights, missing = _sights(look_over.pictures, options)
    if missing is not None or _count(sights) < FEWEST:
        mirror = Correction(mirrored=True)
        there = replace(look_over, bursts=[[mirror(p) for p in burst] for burst in look_over.bursts])
        others, lacking = _sights(there.pictures, placed(options, mirror, film.size))
        if lacking is None and _count(others) >= max(FEWEST, _count(sights) // 2):
            film.correct = applied(film).then_mirrored()
            warnings.warn(
                f"{film.path}: the marks go round the other way: the film is mirrored, as by a selfie "
                "camera; it is mirrored again",
                stacklevel=outside(),
            )
            look_over, sights, missing = there, others, None
            options = placed(options, mirror, film.size)
    sights, still = _moving(film, look_over.pictures, sights, options)
    seen = slowest(look_over.bursts, sights)
    if len(seen) < FEWEST:
        standard = options.layout.standard
        what = "red, orange, blue and green (clockwise)" if standard else "the layout's colours"
        pictures = look_over.pictures
        raise TrackError(
            f"{film.path}: no disk with marks in {what} was found: {len(seen)} of {len(pictures)} "
            f"frames looked at show all {len(options.layout.places)}; {shown(pictures, options)}"
        )
    if missing is not None:
        warnings.warn(
            f"{film.path}: no {COLOURS[missing]} mark is seen clearly; the other three are used",
            stacklevel=outside(),
        )
    clear = _without(still, options, seen[0][0].y.shape)
    return Recognition(look_over, sights, seen, options, clear)


def placed(options: TrackOptions, correction: Correction, size: tuple[int, int]) -> TrackOptions:
    """Return the options with their places after a turn or a mirror of the picture."""
    changed: dict[str, Any] = {}
    if options.pivot is not None:
        at = correction.place(complex(*options.pivot), size)
        changed["pivot"] = (at.real, at.imag)
    if options.region is not None:
        u0, v0, u1, v1 = options.region
        a, b = (correction.place(z, size) for z in (complex(u0, v0), complex(u1 - 1, v1 - 1)))
        changed["region"] = (
            min(a.real, b.real), min(a.imag, b.imag), max(a.real, b.real) + 1, max(a.imag, b.imag) + 1
        )  # fmt: skip
    return options.changed(changed) if changed else options


def _sights(
    pictures: Sequence[Picture], options: TrackOptions, still: bool | None = None
) -> tuple[list[Sight | None], int | None]:
    """Find the disk in each picture, and the missing mark; use patches at rest, or moving ones."""
    inside = [options.inside(p) for p in pictures]
    if options.layout.standard:
        return sightings(inside) if still is None else sightings(inside, lambda every: split(every, still))
    return matching(inside, options.layout, options.scale, still), None


def _count(sights: Sequence[Sight | None]) -> int:
    return sum(s is not None for s in sights)


def _moving(
    film: Film, pictures: Sequence[Picture], sights: list[Sight | None], options: TrackOptions
) -> tuple[list[Sight | None], Sight | None]:
    """Return the moving sights, or those of another disk, and the similar objects at rest."""
    seen = [s for s in sights if s is not None]
    if len(seen) < FEWEST:
        return sights, None
    usual = max(seen, key=lambda s: _like(seen, s))
    share = _like(seen, usual) / len(seen)
    if share < OFTEN:
        return sights, None
    fixed, moving = (_sights(pictures, options, still)[0] for still in (True, False))
    together = sum(a is not None and b is not None for a, b in zip(fixed, moving, strict=True))
    if together >= FEWEST and _count(moving) >= max(FEWEST, len(pictures) // 10):
        return moving, next(s for s in fixed if s is not None)
    place = None if share < ALWAYS else _elsewhere(pictures, usual)
    if place is None:
        return sights, None
    still, moved = (f"({z.real:.0f}, {z.imag:.0f})" for z in (usual.centre, place))
    raise TrackError(
        f"{film.path}: what shows the marks, at {still}, never moves, but something else does, at {moved}: "
        "say the disk's own marks (layout), or where it moves (region)"
    )


def _without(still: Sight | None, options: TrackOptions, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Pixels away from the marks of something that stands still, (height, width)."""
    import cv2

    clear = np.ones(shape, np.uint8)
    if still is not None:
        radius = round(MARGIN * np.sqrt(still.area))
        for arm in options.layout.unit * still.reach * np.exp(1j * still.angle):
            at = still.centre + arm
            cv2.circle(clear, (round(at.real), round(at.imag)), radius, 0, -1)
    return np.asarray(clear > 0)


def _like(sights: Sequence[Sight], usual: Sight) -> int:
    """Count the sights at the place of this one."""
    return sum(
        abs(s.centre - usual.centre) < SAME_PLACE
        and abs(np.angle(np.exp(1j * (s.angle - usual.angle)))) < SAME_ANGLE
        for s in sights
    )


def _elsewhere(pictures: Sequence[Picture], disk: Sight) -> complex | None:
    """Return the middle of the motion outside a disk, if it is as large as a part of the disk."""
    import cv2

    whole = [p for p in pictures if not p.damaged]
    height, width = (n // COARSE for n in whole[0].y.shape)
    size = (width, height)
    small = np.stack([cv2.resize(p.y, size, interpolation=cv2.INTER_AREA) for p in whole]).astype(np.float32)
    small *= np.median(small) / np.maximum(np.median(small, axis=(1, 2), keepdims=True), 1)
    change = np.quantile(small, 0.9, axis=0) - np.quantile(small, 0.1, axis=0)
    row, column = np.mgrid[:height, :width] * COARSE + (COARSE - 1) / 2
    outside_it = np.hypot(column - disk.centre.real, row - disk.centre.imag) > WAY * disk.reach
    moved: NDArray[np.uint8] = ((change > CHANGED) & outside_it).astype(np.uint8)
    moved = np.asarray(cv2.morphologyEx(moved, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)), np.uint8)
    if moved.sum() * COARSE**2 < LARGE * np.pi * (1.25 * disk.reach) ** 2:
        return None
    return complex(column[moved > 0].mean(), row[moved > 0].mean())
