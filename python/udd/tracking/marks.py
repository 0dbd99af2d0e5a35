"""What a mark looks like, and where in the picture it is: sub-pixel, blurred, or half hidden."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .lens import SAME, Local
from .look import Look, Mark, Motion, Pose

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
UNBENT = Local(0j, 0j, SAME)


@dataclass(frozen=True)
class Sighting:
    """Where one mark is against where it was expected.

    `offset` (du, dv) [pixels] and its information matrix (2, 2) [1 / pixel^2]: a mark of which only
    one edge is seen informs across that edge alone.
    """

    offset: Array
    information: Array
    complete: float  # share of the mark's edges that is seen as expected, 0 ... 1
    in_view: float  # share of them before which nothing is known to stand
    rms: float  # residual brightness over the window
    gain: float  # contrast against that expected
    box: tuple[int, int, int, int]  # rows from, to, columns from, to
    weight: Array  # of each pixel of the window, flat
    residual: Array  # brightness left over, flat


def coverage(
    mark: Mark,
    centre: complex,
    angle: float,
    motion: Motion,
    psf: float,
    box: tuple[int, int, int, int],
    local: Local | None = None,
) -> Array:
    """Share of each pixel of a window that the mark covers, averaged over the exposure.

    Parameters
    ----------
    centre, angle : the disk's pose at mid-exposure: pixels (u + iv), beta [rad].
    motion : movement over the exposure.
    psf : standard deviation of the blur of lens and pixel [pixels].
    box : rows from, to, columns from, to.
    local : the map from the picture to the plane of the disk here; the identity if not given.
    """
    r0, r1, c0, c1 = box
    local = local or UNBENT
    u = np.arange(c0, c1, dtype=np.float32) - np.float32(local.picture.real)
    v = np.arange(r0, r1, dtype=np.float32) - np.float32(local.picture.imag)
    (uu, uv), (vu, vv) = local.slope
    path = abs(motion.shift + 1j * motion.turn * mark.place * np.exp(1j * angle))
    count = min(32, int(np.ceil(path / (2.0 * psf + 0.3))) + 1) if path > 0.5 else 1
    total = np.zeros((len(v), len(u)), dtype=np.float32)
    for k in range(count):
        s = (k + 0.5) / count - 0.5
        a = angle + s * motion.turn
        m = centre + s * motion.shift + mark.place * np.exp(1j * a) - local.plane
        c, d = np.cos(a + mark.turn), np.sin(a + mark.turn)
        across = np.add.outer(
            np.float32(c * vv - d * uv) * v - np.float32(c * m.imag - d * m.real),
            np.float32(c * vu - d * uu) * u,
        )
        along = np.add.outer(
            np.float32(c * uv + d * vv) * v - np.float32(c * m.real + d * m.imag),
            np.float32(c * uu + d * vu) * u,
        )
        across = _slab(across, mark.half[1], psf)
        across *= _slab(along, mark.half[0], psf)
        total += across
    return np.asarray(total, dtype=np.float64) / count


def _slab(x: NDArray[np.float32], half: float, psf: float) -> NDArray[np.float32]:
    """Blurred indicator of |x| < half, in place of `x`.

    The quintic smooth step of equal variance stands for the error function.
    """
    width = 2.646 * psf  # x / width has variance 1/7 under the step's derivative 15/16 (1 - x^2)^2
    np.abs(x, out=x)
    np.subtract(np.float32(half), x, out=x)
    x *= np.float32(1 / width)
    np.minimum(x, np.float32(1), out=x)
    np.maximum(x, np.float32(-1), out=x)
    square = x * x
    square *= np.float32(0.1875) * square - np.float32(0.625)
    square += np.float32(0.9375)
    x *= square
    x += np.float32(0.5)
    return x


def window(
    mark: Mark,
    centre: complex,
    angle: float,
    motion: Motion,
    shape: tuple[int, int],
    local: Local,
    margin: float = 5.0,
) -> tuple[int, int, int, int]:
    """Rows and columns that hold the mark over the exposure, clipped to the picture."""
    ends = [
        local.back(centre + s * motion.shift + mark.place * np.exp(1j * (angle + s * motion.turn)))
        for s in (-0.5, 0.5)
    ]
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
    look: Look,
    mark: Mark,
    pose: Pose,
    motion: Motion,
    *,
    psf: float | None = None,
    gain_slack: float = 0.1,
    misfit: float = MISFIT,
) -> Sighting | None:
    """Offset of a mark from its expected place by least squares on the visible pixels.

    The light in the window is modelled as  white + level (gain c - du dc/du - dv dc/dv), with white,
    gain, du, dv free, the gain within `gain_slack` of 1. `view` is False where something stands in
    front; pixels that nothing of this explains (a hand, a cable) lose their weight. `psf` overrides
    the film's own sharpness; edges count as known to `misfit` pixels.
    """
    centre, angle, rim, lens = pose.centre, pose.angle, look.rim, look.lens
    psf = look.psf if psf is None else psf
    local = lens.local(centre + mark.place * np.exp(1j * angle))
    box = window(mark, centre, angle, motion, y.shape, local)
    r0, r1, c0, c1 = box
    if r1 - r0 < 6 or c1 - c0 < 6:
        return None
    cover = coverage(mark, centre, angle, motion, psf, box, local)
    grad_v, grad_u = np.gradient(cover)
    edge2 = grad_u * grad_u + grad_v * grad_v
    total = float(edge2.sum())
    middle = local.back(centre)
    away_u, away_v = np.arange(c0, c1) - middle.real, np.arange(r0, r1) - middle.imag
    inside = np.add.outer(away_v**2, away_u**2) < (rim - 0.5 * abs(motion.shift)) ** 2
    seen = (view[r0:r1, c0:c1] & inside).ravel()
    if total <= 0 or seen.sum() < 25:
        return None
    patch = look.light[y[r0:r1, c0:c1]].ravel()
    level = mark.level
    columns = np.stack(
        [np.ones(cover.size), level * cover.ravel(), -level * grad_u.ravel(), -level * grad_v.ravel()]
    )
    precise = seen / (look.noise**2 + (misfit * level) ** 2 * edge2.ravel())
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
    covariance: Array = local.slope @ np.linalg.inv(normal)[2:, 2:] @ local.slope.T
    complete = float(edge2.ravel()[weight > 0.1 * precise].sum()) / total
    in_view = float(edge2.ravel()[seen].sum()) / total
    rms = float(np.sqrt((weight * residual**2).sum() / weight.sum()))
    return Sighting(
        local.slope @ x[2:],
        np.asarray(np.linalg.inv(covariance), dtype=np.float64),
        complete,
        in_view,
        rms,
        float(x[1]),
        box,
        weight,
        residual,
    )
