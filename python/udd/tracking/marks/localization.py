"""Appearance of a mark and its place in the picture: sub-pixel, blurred, or half hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.tracking.geometry.lens import UNBENT
from udd.tracking.geometry.pose import DiskAppearance, Mark, Motion, Pose

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Stepped = tuple[list[float], list[list[float]], list[list[float]], list[float]]  # as `rigid.Step`
Triple = tuple[float, float, float]
Box = tuple[int, int, int, int]  # rows from, to, columns from, to

FAINT = 0.04  # of full light: a mark that differs by less from the disk is none
MISFIT = 0.12  # pixels by which edges of real marks, lenses and codecs differ from the ideal shape


class Picture(NamedTuple):
    """A picture as the core reads it: codes (h, w), which pixels are in view, factors of their light."""

    codes: NDArray[np.uint8]
    view: Bools
    even: NDArray[np.float32] | None


class Appearing(NamedTuple):
    """Appearance of the disk as the core reads it: see `align_marks` there."""

    lights: Array
    look: tuple[float, ...]
    marks: Array
    lens: Sequence[float]


@dataclass(frozen=True)
class Sighting:
    """Observation of a mark, relative to its expected place.

    `offset` (du, dv) [pixels] and its information matrix (2, 2) [1 / pixel^2]: a mark of which only
    one edge is seen informs across that edge alone.
    """

    offset: Array
    information: Array
    complete: float  # share of the mark's edges that is seen as expected, 0 ... 1
    in_view: float  # share of them before which nothing is known to stand
    rms: float  # residual brightness over the window
    gain: float  # contrast against that expected
    box: Box
    weight: Array | None = None  # of each pixel of the window, flat, where asked for
    residual: Array | None = None  # brightness left over, flat


def coverage(
    mark: Mark,
    centre: complex,
    angle: float,
    motion: Motion,
    psf: float,
    box: Box,
    local: Array | None = None,
) -> Array:
    """Share of each pixel of a window that the mark covers, averaged over the exposure.

    Parameters
    ----------
    centre, angle : the disk's pose at mid-exposure: pixels (u + iv), beta [rad].
    motion : movement over the exposure.
    psf : standard deviation of the blur of lens and pixel [pixels].
    box : rows from, to, columns from, to.
    local : row of `Lens.locals`, the map from the picture to the plane of the disk here; none if not given.
    """
    pose = np.array([centre.real, centre.imag, angle])
    here = UNBENT if local is None else local
    flat = _core.mark_coverage(mark.row, pose, motion.row, float(psf), box, here)
    return flat.reshape(box[1] - box[0], box[3] - box[2])


def locate(
    y: NDArray[np.uint8],
    view: Bools,
    look: DiskAppearance,
    pose: Pose,
    motion: Motion,
    rounds: Sequence[float] = (MISFIT,),
    *,
    gain_slack: float = 0.1,
    without: int | None = None,
    keep: bool = False,
) -> tuple[Triple, list[Sighting | None], list[bool], Stepped | None, float]:
    """Offsets of the marks from their expected places by least squares on the visible pixels.

    The light about a mark is modelled as  white + level (gain c - du dc/du - dv dc/dv), with white,
    gain, du, dv free, the gain within `gain_slack` of 1. `view` is False behind things in front; unexplained
    pixels (a hand, a cable) lose their weight. Each of `rounds`
    takes edges as known to so many pixels and ends with a Gauss-Newton step of the pose.

    Returns the last pose (u, v, beta); the sightings of the last round; which of them it used; its step, None
    if fewer than two marks were seen; and the step's size in pixels.
    """
    numbers = [look.psf, look.noise, gain_slack, look.rim, FAINT * float(look.light[-1])]
    at, sightings, used, step, moved = _core.align_marks(
        Picture(y, view, look.even),
        Appearing(look.lights, (*numbers, look.readout / y.shape[0]), look.table, look.lens.row),
        (pose.centre.real, pose.centre.imag, pose.angle),
        (*motion.row, *motion.rolling),
        rounds,
        without,
        keep,
    )
    return at, [None if s is None else _sighting(*s) for s in sightings], used, step, moved


def _sighting(
    offset: tuple[float, float],
    information: tuple[float, float, float, float],
    shares: tuple[float, float, float, float],
    box: Box,
    pixels: tuple[Array, Array] | None,
) -> Sighting:
    weight, residual = (None, None) if pixels is None else pixels
    matrix = np.array(information).reshape(2, 2)
    return Sighting(np.array(offset), matrix, *shares, box, weight, residual)


def beyond_place(shape: Array, base: Array, s: Sighting) -> Array:
    """Changes (k, pixels) of a mark of the coverage `base`, less what white, gain and place can do."""
    r0, r1, c0, c1 = s.box
    grad_v, grad_u = np.gradient(base.reshape(r1 - r0, c1 - c0))
    free = np.stack([np.ones_like(base), base, grad_u.ravel(), grad_v.ravel()])
    weighted = free * s.weight
    share = np.linalg.solve(weighted @ free.T, weighted @ shape.T)
    return np.asarray(shape - share.T @ free)


def seen_at(look: DiskAppearance, pose: Pose, motion: Motion, height: int) -> tuple[Array, Array]:
    """Return the pose (n, 3) during the rows of each mark, and its map (n, 8).

    A rolling shutter sees each row at a time of its own; within a mark that is a shear.
    """
    places = look.places
    centre, angle = np.full(len(places), pose.centre), np.full(len(places), pose.angle)
    turn = np.exp(1j * pose.angle)
    if not look.readout:
        at = pose.centre + places * turn
        return np.column_stack([centre.real, centre.imag, angle]), look.lens.locals(at)
    per_row = look.readout / height
    at = pose.centre + places * turn
    for _ in range(3):
        late = per_row * (look.lens.picture(at).imag + 0.5 - height / 2)
        centre = pose.centre + (motion.rate + 0.5 * motion.bending * late) * late
        angle = pose.angle + (motion.spin + 0.5 * motion.twisting * late) * late
        at = centre + places * np.exp(1j * angle)
    locals_ = look.lens.locals(at)
    speed = motion.rate + motion.bending * late + 1j * (motion.spin + motion.twisting * late) * (at - centre)
    if look.lens.plain:
        locals_[:, 0], locals_[:, 1] = at.real, at.imag
        locals_[:, 2], locals_[:, 3] = at.real, at.imag
    locals_[:, 5] -= speed.real * per_row
    locals_[:, 7] -= speed.imag * per_row
    return np.column_stack([centre.real, centre.imag, angle]), locals_
