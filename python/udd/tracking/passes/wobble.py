"""A disk that turns out of its plane: the foreshortening of its marks, and what amplitude that means."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.calibration_items import Estimate
from udd.tracking.geometry.pose import DiskAppearance

from .tracks import Tracks

Array = NDArray[np.float64]
SHORT = 12.0  # pixels: longer streaks say too little about where a mark is
FEWEST = 40  # frames
BLOCK = 1.0  # s: stretches of the film that count as independent
DRAWS = 400  # of stretches, for the standard error
CERTAIN = 4.0  # standard errors above what has no direction
AXES = 36  # directions tried over half a turn
LINEAR = 0.03  # share by which marks a pixel off their places may seem nearer: they are placed to first order
SINE = 32.0  # amplitude^4 over the variance of 1 - cos(amplitude sin t), for small amplitudes


@dataclass(frozen=True)
class Wobble:
    """Amplitude of the turning about an axis in the disk's plane [rad]; 0 where none is seen.

    `least` is the amplitude that would just be seen; `axis` the angle of the axis from the vertical,
    clockwise [rad].
    """

    amplitude: float
    sigma: float
    axis: float
    least: float

    @property
    def estimate(self) -> Estimate:
        """A row of the table of calibrations."""
        if not math.isfinite(self.least):
            return Estimate(math.nan, math.nan, "too few marks to tell")
        how = "found" if self.amplitude else f"none seen (less than {math.degrees(self.least):.1f} degrees)"
        return Estimate(self.amplitude, self.sigma, how)


def strains(tracks: Tracks, look: DiskAppearance) -> tuple[Array, Array]:
    """Frames and how the marks of each are stretched, (n, 3): along u, across (shear / 2), along v.

    A rigid body leaves over what no shift and no turn explains; of that, a stretch in the picture's own
    directions is what is asked for.
    """
    places = look.places
    left, angle = tracks.residuals, tracks.angle
    short = np.array([s < SHORT and not flag for s, flag in zip(tracks.streak, tracks.flag, strict=True)])
    rows, out = [], []
    for k in np.flatnonzero(short & (np.isfinite(left[..., 0]).sum(axis=1) >= 4)):
        ok = np.isfinite(left[k, :, 0])
        arm = (places * np.exp(1j * angle[k]))[ok] / look.reach
        u, v, unit, none = arm.real, arm.imag, np.ones(int(ok.sum())), np.zeros(int(ok.sum()))
        design = np.concatenate(
            [np.column_stack([u, v, none, unit, none, -v]), np.column_stack([none, u, v, none, unit, u])]
        )
        if np.linalg.cond(design) > 50:
            continue
        solution = np.linalg.lstsq(design, np.concatenate([left[k, ok, 0], left[k, ok, 1]]), rcond=None)[0]
        rows.append(k)
        out.append(solution[:3] / look.reach)
    return np.array(rows, dtype=int), np.array(out).reshape(-1, 3)


def wobble(tracks: Tracks, look: DiskAppearance) -> Wobble:
    r"""Estimate the wobble of the disk, from the foreshortening of its marks.

    Turned by a out of the picture's plane about an axis in it, the disk is seen shorter across that axis by
    1 - cos a. Its mean hides in scale and layout; of a sine of amplitude A, what varies has the variance
    A^4 / 32. Errors of the tracking stretch the marks too, but in no one direction: what varies in the two
    other ways is taken off.
    """
    rows, strain = strains(tracks, look)
    t = tracks.t[rows]
    unseen = Wobble(0.0, math.inf, 0.0, math.inf)
    if len(rows) < FEWEST:
        return unseen
    strain = _tamed(strain)
    parts = np.unique(np.floor((t - t[0]) / BLOCK), return_inverse=True)[1]
    groups = [np.flatnonzero(parts == k) for k in range(int(parts.max()) + 1)]
    axis = _axis(strain)
    draw = np.random.default_rng(0)
    tries = []
    for _ in range(DRAWS):
        some = np.concatenate([groups[k] for k in draw.integers(0, len(groups), len(groups))])
        tries.append(_excess(strain[some], axis))
    value, sigma = _excess(strain, axis), float(np.std(tries))
    floor = _floor(strain, axis)
    least = (SINE * max(CERTAIN * sigma, floor)) ** 0.25
    if value < max(CERTAIN * sigma, floor):
        return Wobble(0.0, 0.5 * least, axis, least)
    amplitude = (SINE * value) ** 0.25
    spread = amplitude * math.hypot(math.hypot(sigma, floor) / (4 * value), LINEAR)
    return Wobble(amplitude, spread, axis, least)


def _tamed(strain: Array) -> Array:
    """About its middle, what is wild brought in: one mark hidden in part is no wobble."""
    away = strain - np.median(strain, axis=0)
    spread = 1.48 * np.median(np.abs(away), axis=0)
    return np.asarray(np.clip(away, -5 * spread, 5 * spread))


def _patterns(axis: float) -> tuple[Array, Array]:
    """Stretching across an axis, and the two ways that are none of it, as unit vectors (u, across, v)."""
    c, s = math.cos(axis), math.sin(axis)
    root = math.sqrt(2)
    across = np.array([c * c, root * c * s, s * s])
    along = np.array([s * s, -root * c * s, c * c])
    shear = np.array([-root * c * s, c * c - s * s, root * c * s])
    return across, np.stack([along, shear])


def _variances(strain: Array, axis: float) -> tuple[float, Array]:
    wanted, others = _patterns(axis)
    scaled = strain * np.array([1.0, math.sqrt(2), 1.0])
    return float(np.var(scaled @ wanted)), np.var(scaled @ others.T, axis=0)


def _axis(strain: Array) -> float:
    """Return the axis of the largest variation."""
    tried = np.pi * np.arange(AXES) / AXES
    return float(tried[np.argmax([_variances(strain, a)[0] for a in tried])])


def _excess(strain: Array, axis: float) -> float:
    wanted, others = _variances(strain, axis)
    return wanted - float(others.max())


def _floor(strain: Array, axis: float) -> float:
    """Return the variation that is no wobble."""
    return float(_variances(strain, axis)[1].max())
