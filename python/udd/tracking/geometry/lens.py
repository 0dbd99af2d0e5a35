"""Tilt of the camera and curvature of its lens, from the rigidity of the disk alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

Array = NDArray[np.float64]
Complexes = NDArray[np.complex128]
PRIOR = np.array([0.1, 0.15, 0.15, 0.1, 0.05])  # what cameras on a tripod have
BETTER = 0.8  # the misfit must fall to this share, or the picture is taken as it is
FEWEST = 12  # frames to judge by
DETERMINED = 0.5  # of `PRIOR`: what the film determines worse is left at 0


@dataclass(frozen=True)
class Lens:
    """Map from the picture to the plane of the disk, both in pixels (u + iv).

    p is the picture point from the picture's middle in units of `size`. Then q = p (1 + curve |p|^2) and w =
    q / (1 + tilt_u q_u + tilt_v q_v); u is stretched by 1 + aspect and v sheared by `shear`. A vertical in
    the middle of the picture is vertical in the plane, as for any camera that is not rolled.
    """

    middle: complex = 0j
    size: float = 1.0
    curve: float = 0.0
    tilt_u: float = 0.0
    tilt_v: float = 0.0
    aspect: float = 0.0
    shear: float = 0.0

    @property
    def plain(self) -> bool:
        """Return True if the map changes nothing."""
        return not (self.curve or self.tilt_u or self.tilt_v or self.aspect or self.shear)

    @property
    def row(self) -> tuple[float, ...]:
        """Return the eight numbers: middle u, v, size, curve, tilts, aspect, shear."""
        terms = (self.size, self.curve, self.tilt_u, self.tilt_v, self.aspect, self.shear)
        return (self.middle.real, self.middle.imag, *terms)

    @np.errstate(invalid="ignore")  # NaN: where the disk was not seen
    def plane(self, picture: Complexes | complex) -> Complexes:
        """Points of the disk's plane for points of the picture."""
        z = np.asarray(picture, dtype=np.complex128)
        if self.plain:
            return z
        p = (z - self.middle) / self.size
        q = p * (1 + self.curve * (p.real**2 + p.imag**2))
        w: Complexes = q / (1 + self.tilt_u * q.real + self.tilt_v * q.imag)
        at = self.middle + self.size * (w.real * (1 + self.aspect) + 1j * (w.imag + self.shear * w.real))
        return np.asarray(at, dtype=np.complex128)

    @np.errstate(invalid="ignore")
    def picture(self, plane: Complexes | complex) -> Complexes:
        """Points of the picture for points of the disk's plane."""
        z = np.asarray(plane, dtype=np.complex128)
        if self.plain:
            return z
        w = (z - self.middle) / self.size
        across = w.real / (1 + self.aspect)
        w = across + 1j * (w.imag - self.shear * across)
        q = w / (1 - self.tilt_u * w.real - self.tilt_v * w.imag)
        p = q
        for _ in range(8):  # contracts by 3 curve |p|^2 a time
            p = q / (1 + self.curve * (p.real**2 + p.imag**2))
        return np.asarray(self.middle + self.size * p)

    def locals(self, plane: Complexes) -> Array:
        """Linearise the map near points (n,) of the plane.

        Rows of eight: the point in the picture (u, v), in the plane (u, v), d plane / d picture (2, 2).
        """
        if self.plain:
            return np.broadcast_to(UNBENT, (len(plane), 8)).copy()
        at, h = self.picture(plane), 0.5
        du = (self.plane(at + h) - self.plane(at - h)) / (2 * h)
        dv = (self.plane(at + 1j * h) - self.plane(at - 1j * h)) / (2 * h)
        here = self.plane(at)
        columns = (at, here)
        slopes = [du.real, dv.real, du.imag, dv.imag]
        return np.column_stack([*(x for z in columns for x in (z.real, z.imag)), *slopes])


@dataclass(frozen=True)
class LensFit:
    """A lens and how well it is known: standard errors of curve, tilt u, tilt v, aspect and shear."""

    lens: Lens
    sigma: Array
    is_significant: bool  # else no lens is clearly better than none


UNBENT = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0])
PLAIN = Lens()
SQUARE = np.array([-1j, 1, 1j, -1])


def middle_of(shape: tuple[int, int]) -> complex:
    """Return the middle of a picture (height, width), the centre of its lens distortion [pixels]."""
    return complex(shape[1] / 2, shape[0] / 2)


def calibrate(
    points: Complexes,
    shape: tuple[int, int],
    body: Complexes = SQUARE,
    curve: float | None = None,
    tilt: float | None = None,
) -> LensFit:
    """Find the map under which the marks keep their distances, if one is clearly better than none.

    Parameters
    ----------
    points : complex, shape (frames, marks)
        Picture positions of the marks [pixels], NaN where not seen.
    shape : (height, width) of the picture.
    body : complex, shape (marks,)
        Approximate places of the marks, in any unit.
    curve, tilt : float, optional
        Given, not found: the lens's curvature; whatever is not None leaves the tilt away.
    """
    from scipy.optimize import least_squares

    points = points[np.isfinite(points).sum(axis=1) >= 3]
    middle, size = middle_of(shape), float(np.hypot(*shape) / 2)
    fixed = np.array([0.0 if curve is None else curve, 0, 0, 0, 0])
    as_given = Lens(middle, size, *(float(v) for v in fixed)) if fixed.any() else PLAIN
    free = np.array([curve is None, *[tilt is None] * 4])
    if len(points) < FEWEST or len(body) < 3 or not free.any():
        return LensFit(as_given, np.where(free, np.inf, 0.0), False)
    first, seen = _layout(points, body), np.isfinite(points)
    n = len(body)

    def rest(x: Array, with_lens: bool) -> Array:
        lens = Lens(middle, size, *np.where(free, x[:5], fixed)) if with_lens else as_given
        off = _misfit(lens.plane(np.where(seen, points, middle)), seen, x[5 : 5 + n] + 1j * x[5 + n :])
        return np.concatenate([off, 0.02 * x[:5] / PRIOR, 1e-6 * (x[5:] - start[5:])])

    start = np.concatenate([np.zeros(5), first.real, first.imag])
    flat = least_squares(lambda x: rest(x, False), start, loss="soft_l1", f_scale=0.1)
    fit = least_squares(lambda x: rest(x, True), flat.x, loss="soft_l1", f_scale=0.1)
    spare = max(int(2 * seen.sum() - 3 * len(points)) - 2 * n - 5, 1)
    spread = _spread(fit, spare)
    sigma = np.where(free, np.sqrt(np.diag(spread)), 0.0)
    # a disk that hardly moves does not show the lens; what it shows, as a wobble, would become one
    undetermined = sigma > DETERMINED * PRIOR
    if undetermined.any():
        free = free & ~undetermined
        fit = least_squares(lambda x: rest(x, True), flat.x, loss="soft_l1", f_scale=0.1)
        # the terms at 0 have the errors of their prior, and displace the others
        carried = spread[:, undetermined] @ np.linalg.pinv(spread[np.ix_(undetermined, undetermined)])
        variance = np.diag(_spread(fit, spare)) + carried**2 @ PRIOR[undetermined] ** 2
        sigma = np.where(free, np.sqrt(variance), sigma)
    if fit.cost > BETTER**2 * flat.cost:
        return LensFit(as_given, sigma, False)
    return LensFit(Lens(middle, size, *(float(v) for v in np.where(free, fit.x[:5], fixed))), sigma, True)


def _spread(fit: OptimizeResult, spare: int) -> Array:
    """Return the covariance (5, 5) of the terms of a lens at a minimum."""
    # the loss is about rms^2 / 2 per spare coordinate; the weak priors are in the Jacobian
    inverse = np.linalg.pinv(fit.jac.T @ fit.jac, hermitian=True)
    return np.asarray(inverse[:5, :5] * (2 * fit.cost / spare))


def _layout(points: Complexes, body: Complexes) -> Complexes:
    """Return the marks' places on the disk, from the frame that shows them best."""
    best = points[np.argmax(np.isfinite(points).sum(axis=1))]
    seen = np.isfinite(best)
    part, at = body[seen] - body[seen].mean(), best[seen] - best[seen].mean()
    return np.asarray(body * abs(np.vdot(part, at)) / np.vdot(part, part).real)


def _misfit(points: Complexes, seen: NDArray[np.bool_], places: Complexes) -> Array:
    """Return the residuals of each frame after the best rigid motion of `places` onto it."""
    count = seen.sum(axis=1, keepdims=True)
    p = np.where(seen, points, 0)
    q = np.where(seen, places[None, :], 0)
    p0, q0 = p.sum(axis=1, keepdims=True) / count, q.sum(axis=1, keepdims=True) / count
    p, q = np.where(seen, p - p0, 0), np.where(seen, q - q0, 0)
    turn = (q.conj() * p).sum(axis=1, keepdims=True)
    left = (p - q * turn / np.abs(turn))[seen]
    return np.concatenate([left.real, left.imag])
