"""Gravity as a film shows it: what clock, scale and the camera's roll make of the real one."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from udd.tracking.geometry.intervals import usual_interval

Array = NDArray[np.float64]
STANDARD = 9.81  # m/s^2
TURN = 1.5  # rad: the disk turns by as much in a stretch over which torques are averaged
FRAMES = 8  # that such a stretch has at least
FEWEST = 8  # stretches
FRICTION = (1.0, 3.0)  # rad/s about which friction may change
ROUNDS = 4  # of reweighting


@dataclass(frozen=True)
class ApparentGravity:
    """Gravity in the axes of the measurement and by its clock.

    Attributes
    ----------
    value : complex
        To the right + i upward, m/s^2; -9.81i for a film whose clock, scale and orientation are right.
    sigma : float
        Standard error of its size, m/s^2.
    """

    value: complex
    sigma: float

    @property
    def slower(self) -> float:
        """Factor by which the film's times are too long if nothing else is wrong."""
        return float(np.sqrt(STANDARD / abs(self.value)))

    @property
    def lean(self) -> float:
        """Angle of gravity from downward, rad."""
        return float(np.angle(1j * self.value))

    @property
    def is_known(self) -> bool:
        """True if the motion determines it to a fifth."""
        return bool(np.isfinite(self.sigma) and self.sigma < 0.2 * abs(self.value))


def apparent_gravity(t: Array, values: Array, radius: float) -> ApparentGravity | None:
    """Find gravity from the disk's angular momentum about the contact, which it and friction alone change.

    With J = R^2/2 Omega + Z dY/dT - Y dZ/dT, dJ/dT = g Y - k(|Omega|) Omega, whatever
    drives the disk. Multiplied by a bump and integrated over it, no derivative of J is needed.

    Parameters
    ----------
    t : ndarray (n,)
        Times, s.
    values : ndarray (n, 3)
        Y, Z, beta, m and rad; NaN where the disk was not seen.
    radius : float
        Radius of the disk, m.

    Returns
    -------
    ApparentGravity or None
        None if the film shows too little motion.
    """
    rows, rights = [], []
    for a, b in _unbroken(t, np.asarray(np.isfinite(values).all(axis=1))):
        time = t[a:b] - t[a]
        curve = CubicSpline(time, values[a:b])
        (y, z, _), (dy, dz, spin) = values[a:b].T, curve(time, 1).T
        momentum = radius**2 / 2 * spin + z * dy - y * dz
        terms = np.stack([y, z, spin, *(spin / (1 + (spin / fast) ** 2) for fast in FRICTION)])
        turned = float(np.abs(np.diff(values[a:b, 2])).sum())
        step = float(np.median(np.diff(time)))
        half = max(TURN / max(turned, 1e-9) * time[-1], FRAMES * step) / 2
        for middle in np.arange(half, time[-1] - half + 1e-9, half):
            s = (time - middle) / half
            inside = np.abs(s) < 1
            bump, slope = (1 - s[inside] ** 2) ** 3, -6 * s[inside] * (1 - s[inside] ** 2) ** 2 / half
            rights.append(-np.trapezoid(slope * momentum[inside], time[inside]) / half)
            rows.append(np.trapezoid(bump * terms[:, inside], time[inside], axis=1) / half)
    if len(rows) < FEWEST:
        return None
    design, right = np.array(rows), np.array(rights)
    weight = np.ones(len(right))
    size = np.maximum(np.abs(design).max(axis=0), 1e-12)
    design = design / size
    for _ in range(ROUNDS):
        solution = np.linalg.lstsq(design * weight[:, None], right * weight, rcond=1e-9)[0]
        rest = np.abs(right - design @ solution)
        weight = np.sqrt(1 / np.maximum(1.0, rest / (2 * np.median(rest) + 1e-15)))
    spread = float(np.sqrt(np.sum((rest * weight) ** 2) / max(len(right) / 2 - 5, 1)))  # stretches overlap
    inverse = np.linalg.pinv((design * weight[:, None]).T @ (design * weight[:, None]), rcond=1e-12)
    torque, sigma = solution[:2] / size[:2], spread * np.sqrt(np.diag(inverse)[:2]) / size[:2]
    value = complex(torque[1], -torque[0])
    return ApparentGravity(value, float(np.hypot(*sigma)))


def _unbroken(t: Array, good: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Ranges of frames without gaps, long enough for a stretch or two."""
    if len(t) < 2:
        return []
    usual = 2.5 * usual_interval(t)
    ends = np.flatnonzero(~good[1:] | ~good[:-1] | (np.diff(t) > usual)) + 1
    edges = [0, *ends.tolist(), len(t)]
    return [(a, b) for a, b in pairwise(edges) if b - a >= 2 * FRAMES and good[a:b].all()]
