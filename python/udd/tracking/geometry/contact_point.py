"""The contact point, from the motion alone: the disk turns about it while it is driven past it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from .intervals import usual_interval

Array = NDArray[np.float64]
WINDOW = 1.5  # s; over longer stretches what the constraint leaves out (slip) adds up
SHORTEST = 0.3  # s
SLIPS = 6.0  # times the usual misfit; a window beyond shows something else
STARTS = 20  # single windows that are tried
# of the turning that the drive does not explain as well, root mean square; with less, as in steady rotation,
# an error of a thousandth of the disk moves the contact by 3 %
UNLIKE = 1 / 30
WORST = 0.03  # of the marks' reach: a contact known no better is not taken from the motion


@dataclass(frozen=True)
class Pivot:
    """Contact point [pixels, u + iv], its covariance (2, 2), and the drive that goes with it [pixels/s]."""

    place: complex
    covariance: Array
    drive: complex
    rms: float  # misfit [pixels]
    drive_sigma: float = np.nan


def pivot(
    t: Array, centre: NDArray[np.complex128], angle: Array, good: NDArray[np.bool_], reach: float
) -> Pivot | None:
    """Fit the rolling constraint in its integrated form; None where the motion does not determine it.

    In picture axes (u right, v down, angle clockwise) material of the disk at the contact p moves
    with the drive's velocity d:  dc/dt = d + i w (c - p), w = dangle/dt. Multiplying by exp(-i angle)
    makes both sides total derivatives,

        c exp(-i angle)  =  const + p exp(-i angle) + d * integral exp(-i angle) dt,

    linear in p and d, without any derivative of the data. Each window has its own constant. `reach`
    (the marks' distance from the centre [pixels]) is the size of the disk to compare with. The drive
    may have any direction here, so that a tilted camera does not move the contact.
    """
    rows: list[NDArray[np.complex128]] = []
    values: list[NDArray[np.complex128]] = []
    for a, b in windows(t, good):
        time, beta = t[a:b], angle[a:b]
        turn = np.exp(-1j * beta)
        dt = time - time[0]
        swept = CubicSpline(dt, turn).antiderivative()(dt) if b - a > 3 else np.zeros(b - a)
        block = np.column_stack([turn, swept])
        rows.append(block - block.mean(axis=0))
        left = centre[a:b] * turn
        values.append(left - left.mean())
    if not rows:
        return None
    rows, values = _rolling(rows, values)
    design, value = np.concatenate(rows), np.concatenate(values)
    weight = np.ones(len(value))
    x = np.zeros(2, dtype=complex)
    rest = value
    for _ in range(12):
        x = np.linalg.lstsq(design * weight[:, None], value * weight, rcond=None)[0]
        rest = np.abs(value - design @ x)
        weight = np.sqrt(1 / np.maximum(1.0, rest / (2 * np.median(rest) + 1e-12)))
    rms = float(np.sqrt(np.mean(rest**2) / 2))
    normal = (design.conj().T * weight**2) @ design
    free = float(np.real(normal[0, 0])) - abs(normal[0, 1]) ** 2 / max(float(np.real(normal[1, 1])), 1e-300)
    if free < UNLIKE**2 * float(np.sum(weight**2)):
        return None
    # misfits within a window go together: count windows, not frames
    inflation = len(value) / max(len(rows) - 1, 1)
    spread = rms**2 * inflation * np.real(np.diag(np.linalg.inv(normal + 1e-12 * np.eye(2))))
    variance = float(spread[0])
    if not np.isfinite(variance) or variance > (WORST * reach) ** 2:
        return None
    return Pivot(complex(x[0]), variance * np.eye(2), complex(x[1]), rms, float(np.sqrt(spread[1])))


def _rolling(
    rows: list[NDArray[np.complex128]], values: list[NDArray[np.complex128]]
) -> tuple[list[NDArray[np.complex128]], list[NDArray[np.complex128]]]:
    """Return the windows in which the disk rolls as in most, without release and fall.

    In a short film the window of the fall has a large share in a common fit, so single windows are tried too.
    """

    def misfits(part: Sequence[int]) -> Array:
        design, value = np.concatenate([rows[k] for k in part]), np.concatenate([values[k] for k in part])
        x = np.linalg.lstsq(design, value, rcond=None)[0]
        return np.array([np.sqrt(np.mean(np.abs(v - d @ x) ** 2)) for d, v in zip(rows, values, strict=True)])

    every = range(len(rows))
    starts = [every, *([k] for k in every[:: len(rows) // STARTS + 1])]
    off = min((misfits(part) for part in starts), key=lambda off: float(np.median(off)))
    for _ in range(3):
        keep = np.flatnonzero(off <= SLIPS * np.median(off))
        if len(keep) == len(rows):
            break
        off = misfits(keep.tolist())
    return [rows[k] for k in keep], [values[k] for k in keep]


@dataclass(frozen=True)
class Contact:
    """A rough contact point, good enough to foresee the next frame [pixels, pixels/s]."""

    place: complex
    drive: complex

    def carry(self, centre: complex, turn: float, dt: float) -> complex:
        """Return the disk's centre after a rotation by `turn` [rad] in `dt` [s] at a steady rate."""
        spin = np.exp(1j * turn)
        share = (spin - 1) / (1j * turn) if abs(turn) > 1e-6 else 1.0
        return complex(self.place + (centre - self.place) * spin + self.drive * dt * share)

    def velocity(self, centre: complex, rate: float) -> complex:
        """Velocity of the centre when the disk turns at `rate` [rad/s]."""
        return self.drive + 1j * rate * (centre - self.place)


def rough_contact(
    before: NDArray[np.complex128], after: NDArray[np.complex128], turn: Array, dt: Array, reach: float
) -> Contact | None:
    """Estimate the contact from pairs of neighbouring frames: exact finite motions at a steady rate."""
    if len(before) < 4:
        return None
    spin = np.exp(1j * turn)
    small = np.abs(turn) < 1e-6
    share = np.where(small, 1.0, (spin - 1) / (1j * np.where(small, 1.0, turn)))
    design, value = np.column_stack([1 - spin, dt * share]), after - before * spin
    if np.sqrt((np.abs(1 - spin) ** 2).sum()) < 0.3:  # hardly any turning: a pixel's error would move it far
        return None
    weight = np.ones(len(value))
    x = np.zeros(2, dtype=complex)
    for _ in range(15):
        x = np.linalg.lstsq(design * weight[:, None], value * weight, rcond=None)[0]
        rest = np.abs(value - design @ x)
        weight = 1 / (1 + (rest / (2 * np.median(rest) + 1e-3 * reach)) ** 2)
    return Contact(complex(x[0]), complex(x[1]))


def windows(t: Array, good: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Index ranges of unbroken good frames, cut to at most `WINDOW` seconds."""
    if len(t) < 2:
        return []
    out = []
    longest = 2.5 * usual_interval(t)
    start: int | None = None
    for i in range(len(t) + 1):
        stop = i == len(t) or not good[i] or (start is not None and i > start and t[i] - t[i - 1] > longest)
        full = start is not None and not stop and t[i] - t[start] >= WINDOW
        if start is not None and (stop or full):
            if t[i - 1] - t[start] >= SHORTEST and i - start >= 6:
                out.append((start, i))
            start = None
        if start is None and i < len(t) and good[i]:
            start = i
    return out


def support(view: NDArray[np.bool_]) -> complex | None:
    """Guess the contact from the support before the disk: the wheel's axle, widest near the top."""
    rows = np.flatnonzero((~view).any(axis=1))
    if len(rows) < 10:
        return None
    top = rows[: max(5, len(rows) // 3)]
    width = np.array([np.count_nonzero(~view[r]) for r in top])
    widest = top[width > 0.9 * width.max()]
    columns = np.flatnonzero((~view[widest]).all(axis=0))
    if not len(columns):
        return None
    return complex(float(columns.mean()), float(widest.mean()))
