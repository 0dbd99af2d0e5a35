"""What a mark looks like, and where in the picture it is: sub-pixel, blurred, or half hidden."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Mark:
    """A rectangular mark in the body frame of the disk (pixels; u + iv at beta = 0)."""

    place: complex  # centre
    half: tuple[float, float]  # half side lengths
    turn: float  # orientation of its first side against the body frame [rad]
    level: float  # brightness minus that of the disk


@dataclass(frozen=True)
class Motion:
    """How the disk moves during the exposure: displacement [pixels] and turn [rad] over the whole of it."""

    shift: complex = 0j
    turn: float = 0.0


@dataclass(frozen=True)
class Sighting:
    """Where one mark is against where it was expected.

    `offset` (du, dv) [pixels] and its information matrix (2, 2) [1 / pixel^2]: a mark of which only
    one edge is seen informs across that edge alone.
    """

    offset: Array
    information: Array
    complete: float  # visible share of the mark's edges, 0 ... 1
    rms: float  # residual brightness over the window
    gain: float  # contrast against that expected
    box: tuple[int, int, int, int]  # rows from, to, columns from, to
    weight: Array  # of each pixel of the window, flat
    residual: Array  # brightness left over, flat


def coverage(mark: Mark, centre: complex, angle: float, motion: Motion, psf: float, box: tuple[int, int, int, int]) -> Array:
    """Share of each pixel of a window that the mark covers, averaged over the exposure.

    Parameters
    ----------
    centre, angle : the disk's pose at mid-exposure: pixels (u + iv), beta [rad].
    motion : movement over the exposure.
    psf : standard deviation of the blur of lens and pixel [pixels].
    box : rows from, to, columns from, to.
    """
    r0, r1, c0, c1 = box
    u = np.arange(c0, c1, dtype=np.float64)
    v = np.arange(r0, r1, dtype=np.float64)
    path = abs(motion.shift + 1j * motion.turn * mark.place * np.exp(1j * angle))
    count = 1 if path < 0.7 else min(24, int(np.ceil(path / 1.2)) + 1)
    total = np.zeros((len(v), len(u)))
    for k in range(count):
        s = (k + 0.5) / count - 0.5
        a = angle + s * motion.turn
        m = centre + s * motion.shift + mark.place * np.exp(1j * a)
        c, d = np.cos(a + mark.turn), np.sin(a + mark.turn)
        du, dv = u - m.real, (v - m.imag)[:, None]
        along, across = c * du + d * dv, c * dv - d * du
        total += _slab(along, mark.half[0], psf) * _slab(across, mark.half[1], psf)
    return total / count


def _slab(x: Array, half: float, psf: float) -> Array:
    """Blurred indicator of |x| < half; the quintic smooth step of equal variance stands for the error function."""
    width = 2.83 * psf  # standard deviation of the step's derivative is width / 2.83
    s = np.clip((half - np.abs(x)) / width, -1.0, 1.0)
    s2 = s * s
    return np.asarray(0.5 + s * (0.9375 - s2 * (0.625 - 0.1875 * s2)))


def window(mark: Mark, centre: complex, angle: float, motion: Motion, shape: tuple[int, int], margin: float = 5.0) -> tuple[int, int, int, int]:
    """Rows and columns that hold the mark over the exposure, clipped to the picture."""
    ends = [centre + s * motion.shift + mark.place * np.exp(1j * (angle + s * motion.turn)) for s in (-0.5, 0.5)]
    reach = np.hypot(*mark.half) + margin
    us, vs = [e.real for e in ends], [e.imag for e in ends]
    return (
        max(0, int(min(vs) - reach)),
        min(shape[0], int(max(vs) + reach) + 2),
        max(0, int(min(us) - reach)),
        min(shape[1], int(max(us) + reach) + 2),
    )


MISFIT = 0.12  # pixels by which edges of real marks, lenses and codecs differ from the ideal shape


def locate(
    y: NDArray[np.uint8],
    view: Bools,
    mark: Mark,
    centre: complex,
    angle: float,
    motion: Motion,
    psf: float,
    noise: float,
    gain_slack: float = 0.1,
    misfit: float = MISFIT,
) -> Sighting | None:
    """Offset of a mark from its expected place by least squares on the visible pixels.

    The picture in the window is modelled as  white + level (gain c - du dc/du - dv dc/dv), with white,
    gain, du, dv free, the gain within `gain_slack` of 1. `view` is False where something stands in
    front. Pixels that nothing of this explains (a hand, a cable) lose their weight.
    """
    box = window(mark, centre, angle, motion, y.shape)
    r0, r1, c0, c1 = box
    if r1 - r0 < 6 or c1 - c0 < 6:
        return None
    cover = coverage(mark, centre, angle, motion, psf, box)
    grad_v, grad_u = np.gradient(cover)
    edge2 = grad_u * grad_u + grad_v * grad_v
    total = float(edge2.sum())
    seen = view[r0:r1, c0:c1].ravel()
    if total <= 0 or seen.sum() < 25:
        return None
    patch = y[r0:r1, c0:c1].ravel().astype(np.float64)
    level = mark.level
    columns = np.stack([np.ones(cover.size), level * cover.ravel(), -level * grad_u.ravel(), -level * grad_v.ravel()])
    precise = seen / (noise**2 + (misfit * level) ** 2 * edge2.ravel())
    weight = precise
    prior = np.diag([1e-12, gain_slack**-2, 1e-12, 1e-12])
    x = np.zeros(4)
    for _ in range(3):
        weighted = columns * weight
        normal = weighted @ columns.T + prior
        x = np.linalg.solve(normal, weighted @ patch + prior[:, 1])
        residual = patch - x @ columns
        z2 = residual * residual * precise / 36.0  # beyond 6 standard deviations a pixel shows something else
        weight = precise * np.clip(1 - z2, 0, None) ** 2
        if np.count_nonzero(weight) < 25:
            return None
    covariance = np.linalg.inv(normal)[2:, 2:]
    complete = float(edge2.ravel()[weight > 0.1 * precise].sum()) / total
    rms = float(np.sqrt((weight * residual**2).sum() / weight.sum()))
    return Sighting(x[2:], np.linalg.inv(covariance), complete, rms, float(x[1]), box, weight, residual)
