"""Clock of a film by the drive, which is even: where it seems slower or faster, the time stamps are wrong.

A drive may vary, too. The disk's rate of turning distinguishes the two, as it cannot jump in real time, and
so does gravity, which agrees with itself by the right clock only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from .apparent_gravity import apparent_gravity

Array = NDArray[np.float64]
WINDOW = 20  # frames that share a drive while the contact is estimated
SLOWER = 1.5  # factor from which on the drive alone shows a part; motors and their wheels vary by less
ODD = 3.0  # times the usual misfit: a window beyond has no even clock
SHORTEST = 8  # steps of a part that may show real time
PENALTY = 40.0  # decrease of chi2 that a change of the clock must bring
CHUNK = 3000  # steps that are cut into parts at once
SMOOTH = 7  # steps over which a fall is recognised
UNSEEN = 2  # frames between two that show the disk, beyond which these show no speed
STOPPED = 0.02  # of the drive: with less, the disk is not driven
NOISE = 0.1  # of the drive: speeds with more scatter show no clock
ABOUT = 3  # frames on each side of a change, through which the angle is smooth in real time
DEGREE = 4  # of this smooth curve
BETTER = 0.4  # of the misfit by the stamps that may remain by the drive's clock
CLEARLY = 12.0  # times the usual misfit that a change must explain
WHOLE = 0.04  # relative difference within which a factor is a whole number or the inverse of one
PARTS = 6  # largest denominator of other factors, as 4/5 for 24 and 30 frames per second
SURE = 2.5  # standard errors within which a factor is such a fraction
LISTED = 6  # parts
MOSTLY = 0.9  # share of the speed's variance between parts that must be the clock's; a true map has 0.999
AGREES = 0.6  # of gravity's relative error that remains if all changes are the clock's
UNKNOWN = 0.2  # relative error of a factor by gravity from which on it does not decide
ALIKE = 0.05  # of two clocks' logarithms between which gravity does not decide


@dataclass(frozen=True)
class SlowPart:
    """A part of a film: its first frame, and how many times too long its intervals are, with an error."""

    first: int
    factor: float
    sigma: float


def slow_parts(
    t: Array, centre: NDArray[np.complex128], angle: Array, radius: float, scale: float
) -> list[SlowPart]:
    """Find parts of a film in which the clock differs from that of the others.

    Gravity decides which part shows real time. If it does not, the fastest one does.

    Parameters
    ----------
    t : ndarray (n,)
        Times by the film's clock, s.
    centre : ndarray of complex (n,)
        Pixels; NaN where the disk was not seen.
    angle : ndarray (n,)
        rad.
    radius : float
        Radius of the disk, m.
    scale : float
        Pixels per metre.

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
    hidden = np.diff(good) > UNSEEN  # nobody knows how the disk turned meanwhile
    speed[hidden] = median_filter(speed, SMOOTH, mode="nearest")[hidden]
    driven = np.flatnonzero(median_filter(speed, SMOOTH, mode="nearest") > STOPPED * np.median(np.abs(speed)))
    if len(driven) < 2 * WINDOW:
        return []
    end = driven[-1] + 1
    if end < len(speed):
        end -= SMOOTH // 2  # the filter does not show in which step the wheels lost the disk that falls then
    speed, good = speed[:end], good[: end + 1]
    usual, noise = float(np.median(np.abs(speed))), _noise(speed)
    if not usual > 0 or noise > NOISE * float(np.quantile(speed, 0.9)):
        return []
    stamps, turned = t[good], angle[good]
    away = np.conj(centre[good] - pivot) / scale
    values = np.column_stack([away.real, away.imag, turned])

    def too_long(time: Array) -> tuple[float, float]:
        """Return the factor by which times (n,) are too long by gravity, and its error."""
        gravity = apparent_gravity(time, values, radius)
        if gravity is None or not np.isfinite(gravity.sigma):
            return 1.0, np.inf
        return gravity.slower, 0.5 * gravity.slower * gravity.sigma / abs(gravity.value)

    def precision(edges: Sequence[int]) -> float:
        factor, sigma = too_long(_clock(edges, speed, stamps))
        return sigma / factor

    every = _cut(speed, max(noise, 1e-3 * usual))
    if len(every) < 3:
        return []
    edges = _confirmed(every, speed, stamps, turned)
    if len(edges) < len(every) and precision(every) < AGREES * precision(edges):
        edges = every
    if len(edges) < 3 or _between(edges, speed) < MOSTLY * _between(every, speed):
        return []  # the drive varies
    level, sigma = _shared(*_levels(edges, speed))
    if level.min() <= 0:
        return []
    time = _retimed(stamps, edges, level)
    real = _real(edges, level, float(time[-1] / np.ptp(stamps)), lambda real: too_long(time / real))
    parts: list[SlowPart] = []
    for first, mean, error in zip(edges[:-1], level, sigma, strict=True):
        factor, off = real / mean, real / mean * error / mean
        factor = _rational(factor, off)
        parts.append(SlowPart(0 if not parts else int(good[first]), factor, off))
    return parts if len({part.factor for part in parts}) > 1 else []


def text_of(parts: Sequence[SlowPart]) -> str:
    """Return the factors of the parts and where they begin, the first ones if there are many."""
    texts = [f"{p.factor:.3g} ± {p.sigma:.2g} from frame {p.first} on" for p in parts]
    rest = len(parts) - LISTED
    return ", ".join(texts[:LISTED]) + (f", and {rest} more parts" if rest > 0 else "")


def _rational(factor: float, sigma: float) -> float:
    """Return the whole number, its inverse or the simple fraction that a factor is within its error."""
    whole = float(round(factor)) if factor >= 1 else 1 / round(1 / factor)
    if abs(factor - whole) < max(WHOLE * factor, SURE * sigma):
        return whole
    fraction = float(Fraction(factor).limit_denominator(PARTS))
    return fraction if abs(factor - fraction) < SURE * sigma else factor


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


def _noise(speed: Array) -> float:
    """Estimate the scatter of speeds from differences; every second or third may have another clock."""
    differences = [np.median(np.abs(speed[lag:] - speed[:-lag])) for lag in (1, 2, 3, 5)]
    return 1.48 * float(min(differences)) / 2**0.5


def _cut(speed: Array, noise: float) -> list[int]:
    """Cut speeds into parts with a constant mean: least squares with a penalty for each part, exactly."""
    edges = [0]
    for begin in range(0, len(speed), CHUNK):
        part = speed[begin : begin + CHUNK] / noise
        n = len(part)
        sums, squares = (np.concatenate([[0.0], np.cumsum(part**power)]) for power in (1, 2))
        cost, last = np.zeros(n + 1), np.zeros(n + 1, dtype=int)
        for end in range(1, n + 1):
            size = end - np.arange(end)
            misfit = squares[end] - squares[:end] - (sums[end] - sums[:end]) ** 2 / size
            total = cost[:end] + misfit + PENALTY
            last[end] = int(np.argmin(total))
            cost[end] = total[last[end]]
        ends, at = [], n
        while at > 0:
            ends.append(begin + at)
            at = int(last[at])
        edges += ends[::-1]
    return edges


def _between(edges: Sequence[int], speed: Array) -> float:
    """Return the sum of squares of the speeds that a constant mean in each part explains."""
    parts = [speed[a:b] for a, b in pairwise(edges)]
    return float(sum(len(part) * (part.mean() - speed.mean()) ** 2 for part in parts))


def _levels(edges: Sequence[int], speed: Array) -> tuple[Array, Array]:
    """Return the mean speed of each part without outliers, and its standard error."""
    usual, out = _noise(speed), []
    for a, b in pairwise(edges):
        middle = float(np.median(speed[a:b]))
        fair = speed[a:b][np.abs(speed[a:b] - middle) <= 3 * usual + 1e-12]
        out.append((float(fair.mean()) if len(fair) else middle, usual / max(len(fair), 1) ** 0.5))
    level, sigma = np.array(out).T
    return level, sigma


def _shared(level: Array, sigma: Array) -> tuple[Array, Array]:
    """Return levels of which those that agree have a common mean, and its error: a film has few clocks."""
    order = np.argsort(level)
    wide = np.diff(level[order]) > SURE * np.hypot(sigma[order][1:], sigma[order][:-1])
    for group in np.split(order, np.flatnonzero(wide) + 1):
        weight = sigma[group] ** -2.0
        level[group], sigma[group] = (weight @ level[group]) / weight.sum(), weight.sum() ** -0.5
    return level, sigma


def _clock(edges: Sequence[int], speed: Array, t: Array) -> Array:
    """Return times (n,) by the drive, the level of the longest part being real time."""
    level = np.maximum(_levels(edges, speed)[0], 1e-9)
    return _retimed(t, edges, level / level[np.argmax(np.diff(edges))])


def _retimed(t: Array, edges: Sequence[int], factors: Array) -> Array:
    """Return times (n,) from 0 on, whose intervals are multiplied by a factor in each part."""
    return np.concatenate([[0.0], np.cumsum(np.diff(t) * np.repeat(factors, np.diff(edges)))])


def _confirmed(edges: list[int], speed: Array, t: Array, angle: Array) -> list[int]:
    """Return the edges at which the clock changes, not the drive: the angle is smooth by the new clock only.

    If the disk hardly turns at an edge, a large factor decides, or a like one elsewhere.
    """
    level, time = _levels(edges, speed)[0], _clock(edges, speed, t)
    plain = np.sort([_roughness(k, t, angle) for k in range(ABOUT, len(t) - ABOUT, ABOUT)])
    noise = float(plain[len(plain) // 4]) if len(plain) else 0.0  # most windows have no edge, or few
    ratios, sure, unsure = [], [], []
    for number, k in enumerate(edges[1:-1]):
        ratio = abs(float(np.log(max(level[number + 1], 1e-12) / max(level[number], 1e-12))))
        stamped, driven = _roughness(k, t, angle), _roughness(k, time, angle)
        if driven < BETTER * stamped and stamped > CLEARLY * noise:
            sure.append(k)
            ratios.append(ratio)
        elif stamped <= CLEARLY * noise or driven < stamped:
            unsure.append((k, ratio))
    sure += [k for k, r in unsure if r > np.log(SLOWER) or any(abs(r - other) < ALIKE for other in ratios)]
    return [0, *sorted(sure), edges[-1]]


def _roughness(k: int, t: Array, angle: Array) -> float:
    """Return the mean square misfit of a smooth curve through the angles about a frame."""
    rows = slice(max(0, k - ABOUT), k + ABOUT + 1)
    x = t[rows] - t[k]
    powers = np.vander(x / np.abs(x).max(), DEGREE + 1)
    rest = angle[rows] - powers @ np.linalg.lstsq(powers, angle[rows], rcond=None)[0]
    return float(rest @ rest) / max(len(x) - DEGREE - 1, 1)


def _real(
    edges: Sequence[int], level: Array, mean: float, too_long: Callable[[float], tuple[float, float]]
) -> float:
    """Return the level of real time, by gravity; without it, the fastest one.

    If most of the film has no long part, its mean may be real time as well: converters keep that.
    """
    size = np.diff(edges)
    long = level[size >= SHORTEST]
    uneven = size[size >= SHORTEST].sum() < 0.5 * size.sum()
    levels = np.append(level, mean) if uneven else long
    usual = mean if uneven else float(long.max())
    factor, sigma = too_long(usual)
    if not sigma < UNKNOWN * factor:
        return usual
    off = np.abs(np.log(levels / (usual * factor)))
    alike = levels[off < off.min() + ALIKE]
    return usual if usual in alike else float(alike.max())
