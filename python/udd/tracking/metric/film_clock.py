"""Parts of a film that are slowed down: the drive, which is even, seems slower there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

Array = NDArray[np.float64]
WINDOW = 20  # frames that share a drive while the contact is found
SMOOTH = 7  # frames over which the drive's median is taken
SLOWER = 1.5  # factor from which on a part is slowed down; motors and their wheels vary by less
ODD = 3.0  # times the usual misfit: a window beyond has no even clock
SHORTEST = 8  # frames of such a part
MOST = 8  # parts
ABOUT = 6  # frames by which the end of a part may be off at first
WHOLE = 0.04  # relative difference within which a factor is a whole number


@dataclass(frozen=True)
class SlowPart:
    """A part of a film: its first frame, and how many times too long its intervals are, with an error."""

    first: int
    factor: float
    sigma: float


def slow_parts(t: Array, centre: NDArray[np.complex128], angle: Array) -> list[SlowPart]:
    """Find parts in which the drive seems slower than in others; the fastest parts are treated as real time.

    Parameters
    ----------
    t : ndarray (n,)
        Times by the film's clock, s.
    centre : ndarray of complex (n,)
        Pixels; NaN where the disk was not seen.
    angle : ndarray (n,)
        rad.

    Returns
    -------
    list of SlowPart
        All parts in order, the first at frame 0; empty if the whole film has one clock.
    """
    good = np.flatnonzero(np.isfinite(angle) & np.isfinite(centre))
    if len(good) < 4 * WINDOW:
        return []
    pivot = _pivot(t, centre, angle, good)
    speed = _speeds(t, centre - pivot, angle, good)
    smooth = median_filter(speed, SMOOTH, mode="nearest")
    fast = float(np.quantile(smooth, 0.9))
    if not fast > 0:
        return []
    level = np.round(np.log(np.clip(fast / np.maximum(smooth, 1e-9), 1 / 3, 100)) / np.log(SLOWER))
    edges = [0, *(np.flatnonzero(np.diff(level)) + 1).tolist(), len(speed)]
    edges = _joined(edges, smooth)
    if not 3 <= len(edges) <= MOST + 1:
        return []
    edges = _sharpened(edges, speed)
    means = [_mean(speed[a:b]) for a, b in pairwise(edges)]
    most = max(mean for mean, _ in means)
    if min(mean for mean, _ in means) <= 0:
        return []
    parts: list[SlowPart] = []
    for first, (mean, sigma) in zip(edges[:-1], means, strict=True):
        factor, error = most / mean, most / mean * sigma / mean
        if abs(factor / round(factor) - 1) < max(WHOLE, 2 * error / factor):
            factor = float(round(factor))
        parts.append(SlowPart(0 if not parts else int(good[first]), factor, error))
    return parts if max(p.factor for p in parts) > SLOWER else []


def _pivot(t: Array, centre: NDArray[np.complex128], angle: Array, good: NDArray[np.intp]) -> complex:
    """Estimate the contact, with a drive for each window, from windows with a constant clock."""
    rests = []
    for a in range(0, len(good) - WINDOW, WINDOW // 2):
        rows = good[a : a + WINDOW]
        turn = np.exp(-1j * angle[rows])
        swept = np.concatenate([[0], np.cumsum((turn[1:] + turn[:-1]) / 2 * np.diff(t[rows]))])
        even = np.column_stack([np.ones(WINDOW), swept])
        motion = np.column_stack([turn, centre[rows] * turn])
        rests.append(motion - even @ np.linalg.lstsq(even, motion, rcond=None)[0])
    turns, places = (np.array([rest[:, k] for rest in rests]) for k in (0, 1))
    pivot, keep = 0j, np.ones(len(rests), dtype=bool)
    for _ in range(4):
        pivot = complex(
            np.vdot(turns[keep], places[keep]) / max(np.vdot(turns[keep], turns[keep]).real, 1e-300)
        )
        off = np.sqrt(np.mean(np.abs(places - pivot * turns) ** 2, axis=1))
        keep = off <= ODD * np.median(off)
    return pivot


def _speeds(t: Array, away: NDArray[np.complex128], angle: Array, good: NDArray[np.intp]) -> Array:
    """Return the drive over each interval between frames with the disk, along its usual direction."""
    turn = np.diff(angle[good])
    spin = np.exp(1j * turn)
    share = np.where(np.abs(turn) > 1e-6, (spin - 1) / np.where(turn == 0, 1, 1j * turn), 1)
    drive = (away[good][1:] - away[good][:-1] * spin) / (share * np.diff(t[good]))
    usual = complex(np.median(drive.real), np.median(drive.imag))
    return np.asarray((drive * np.conj(usual) / max(abs(usual), 1e-300)).real)


def _joined(edges: list[int], smooth: Array) -> list[int]:
    """Edges of parts that are long enough and differ from those before them."""
    out = [0]
    for a, b in pairwise(edges):
        if b - a < SHORTEST:
            continue
        before, here = np.median(smooth[out[-1] : a]) if a > out[-1] else np.nan, np.median(smooth[a:b])
        if a > 0 and a > out[-1] and not 1 / SLOWER < here / max(before, 1e-9) < SLOWER:
            out.append(a)
    return [*out, len(smooth)]


def _sharpened(edges: list[int], speed: Array) -> list[int]:
    """Move the edges to their best places."""
    out = list(edges)
    for k in range(1, len(edges) - 1):
        low, high = out[k - 1] + 2, out[k + 1] - 2
        tries = range(max(low, edges[k] - ABOUT), min(high, edges[k] + ABOUT) + 1)
        part = speed[out[k - 1] : out[k + 1]]
        a, b = np.median(speed[out[k - 1] : edges[k]]), np.median(speed[edges[k] : out[k + 1]])
        costs = [
            np.abs(part[: n - out[k - 1]] - a).sum() + np.abs(part[n - out[k - 1] :] - b).sum() for n in tries
        ]
        out[k] = tries[int(np.argmin(costs))]
    return out


def _mean(speed: Array) -> tuple[float, float]:
    """Mean without outliers, and its standard error."""
    middle = float(np.median(speed))
    spread = 1.48 * float(np.median(np.abs(speed - middle)))
    fair = speed[np.abs(speed - middle) <= 3 * spread + 1e-12]
    return float(fair.mean()), spread / np.sqrt(len(fair))
