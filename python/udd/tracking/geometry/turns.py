"""Whole turns across gaps: the one that rolling and usual torques explain, or a doubt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from udd.tracking.geometry.intervals import usual_interval

Array = NDArray[np.float64]
SHORT = 3.5  # Usual intervals: in a shorter gap no turn is lost.
SIDE, NEAR = 4, 0.12  # Frames, and seconds, on each side that show the rate of rotation.
STEP = 0.08  # Time in s over which accelerations are compared. Shorter ones are noise.
MEMORY = 0.15  # Typical duration of an acceleration in s.
SURE = 16.0  # Decrease of chi2 against the next best number of turns.
ODD = 12.0  # Value of chi2 per acceleration above which no number explains the gap.
PLACE, SLIP = 0.01, 0.04  # Error of the disk's place, in the marks' reach and in the way driven.
SHAPES = 4  # Shapes by which the angle may differ from a cubic.
SAMPLES = 25
LONG = 1.0  # Seconds: across a longer gap too many paths fit equally well.
MOST = 12  # Turns more or less that are tried.
LEAST = 3.0  # Acceleration in rad/s^2: no disk rotates more evenly.


@dataclass(frozen=True)
class Turns:
    """Angles with their whole turns, and the frames from which on their number is in doubt."""

    angle: Array
    doubtful: NDArray[np.intp]


def count_turns(
    t: Array, centre: NDArray[np.complex128], angle: Array, pivot: complex, drive: complex, reach: float
) -> Turns:
    """Find the whole turns in each gap.

    A frame shows the angle but for whole turns. For each number of turns, a smooth path of the angle is
    fitted that also brings the centre to its next place. A disk that rolls about `pivot` keeps (c - p)
    exp(-i angle) - d integral exp(-i angle) dt. The accelerations of the path are compared with those in
    the other frames.

    Parameters
    ----------
    t : ndarray (n,)
        Times, s.
    centre : ndarray of complex (n,)
        Pixels.
    angle : ndarray (n,)
        rad; NaN where the disk was not seen.
    pivot, drive : complex
        Contact [pixels] and velocity of the drive [pixels/s]; NaN if they are not known.
    reach : float
        Distance of the marks from the centre [pixels].
    """
    angle, doubtful = angle.copy(), []
    seen = np.flatnonzero(np.isfinite(angle))
    if len(seen) < 2 * SIDE:
        return Turns(angle, np.empty(0, np.intp))
    usual, fastest = _usual_acceleration(t, angle), _fastest(t, angle)
    gaps = np.flatnonzero(np.diff(t[seen]) > SHORT * usual_interval(t))
    for k in gaps:
        i, j = seen[k], seen[k + 1]
        before, after = _rate(t, angle, seen[: k + 1], i), _rate(t, angle, seen[k + 1 :], j)
        if not np.isfinite(before + after):
            doubtful.append(j)
            continue
        gap, expected = t[j] - t[i], 0.5 * (before + after) * (t[j] - t[i])
        first = (angle[i] - angle[j] + expected) / (2 * np.pi)
        tries = [n for n in range(round(first) - MOST, round(first) + MOST + 1)
                 if abs(angle[j] - angle[i] + 2 * np.pi * n) <= 1.3 * fastest * gap + np.pi]  # fmt: skip
        way = _Way(
            gap, before, after, usual, (centre[i] - pivot) / reach, (centre[j] - pivot) / reach, drive / reach
        )
        costs = np.array([way.cost(angle[i], angle[j] + 2 * np.pi * n) for n in tries])
        best = int(np.argmin(costs))
        others = np.delete(costs, best)
        odd = costs[best] > ODD * way.pieces
        if odd or gap > LONG or (len(others) and others.min() - costs[best] < SURE):
            doubtful.append(j)
        angle[j:] += 2 * np.pi * tries[best]
    return Turns(angle, np.array(doubtful, dtype=np.intp))


def count_turns_over_the_top(t: Array, angle: Array) -> Turns:
    """Find the whole turns of a pendulum from its angles (n,) in -pi to pi; none if it only swings."""
    whole, seen = angle.copy(), np.isfinite(angle)
    whole[seen] = np.unwrap(angle[seen])
    if not (np.abs(whole - angle) > 1).any():
        return Turns(angle, np.empty(0, np.intp))
    nowhere = complex(np.nan, np.nan)
    return count_turns(t, np.full(len(t), nowhere), whole, nowhere, nowhere, 1.0)


def in_doubt(turns: Turns) -> list[tuple[int, str]]:
    """Return the frame from which on the number of turns is in doubt, with the reason; none if it is not."""
    return [(int(k), "a whole turn may be missing") for k in turns.doubtful[:1]]


@dataclass(frozen=True)
class _Way:
    """A gap: its length, the rates on both sides, the centre before and after."""

    gap: float
    before: float
    after: float
    usual: float  # acceleration [rad/s^2]
    start: complex  # of the centre from the contact, in units of the marks' reach
    end: complex
    drive: complex

    @property
    def pieces(self) -> float:
        """Return the number of successive accelerations in the gap."""
        return 1 + self.gap / MEMORY

    def cost(self, start: float, end: float) -> float:
        """Chi2 of the smoothest way from one angle to the other."""
        s = np.linspace(0, 1, SAMPLES)
        rise, a, b = end - start, self.before * self.gap, self.after * self.gap
        cubic = np.polynomial.Polynomial([start, a, 3 * rise - 2 * a - b, a + b - 2 * rise])
        flat = np.polynomial.Polynomial([0, 0, 1, -2, 1])  # s^2 (1 - s)^2
        shapes = [flat * np.polynomial.Chebyshev.basis(k, [0, 1]).convert(kind=np.polynomial.Polynomial)
                  for k in range(SHAPES)]  # fmt: skip
        places, bends = np.array([f(s) for f in shapes]), np.array([f.deriv(2)(s) for f in shapes])
        base, bend = cubic(s), cubic.deriv(2)(s)
        factor = np.sqrt(self.pieces / SAMPLES) / (self.usual * self.gap**2)
        rolls = np.isfinite(self.start) and np.isfinite(self.drive)
        spread = np.hypot(PLACE, SLIP * abs(self.drive) * self.gap) if rolls else 1.0

        def rest(x: Array) -> Array:
            out: Array = np.asarray(factor * (bend + x @ bends))
            if not rolls:
                return out
            turn = np.exp(-1j * (base + x @ places - start))
            swept = np.trapezoid(turn, s) * self.gap
            off = (self.end * turn[-1] - self.start - self.drive * swept) / spread
            return np.append(out, [off.real, off.imag])

        return float(2 * least_squares(rest, np.zeros(SHAPES), max_nfev=40).cost)


def _rate(t: Array, angle: Array, seen: NDArray[np.intp], edge: int) -> float:
    """Rate of turning at a frame at the edge of a gap, by a parabola through those about it."""
    usual = usual_interval(t)
    rows = seen[np.abs(t[seen] - t[edge]) < max((SIDE - 0.5) * usual, NEAR)]
    if len(rows) < 2:
        return float("nan")
    x = t[rows] - t[edge]
    return float(np.polyfit(x, angle[rows], min(2, len(rows) - 1))[-2])


def _usual_acceleration(t: Array, angle: Array) -> float:
    """Root mean square of the angular acceleration where the disk is seen, over steps of `STEP`."""
    step = max(1, round(STEP / usual_interval(t)))
    h = step * usual_interval(t)
    second = angle[2 * step :] - 2 * angle[step:-step] + angle[: -2 * step]
    even = np.abs(t[2 * step :] - t[: -2 * step] - 2 * h) < 0.3 * h
    good = second[np.isfinite(second) & even]
    return max(float(np.sqrt(np.mean(good**2))) / h**2, LEAST) if len(good) else 30.0


def _fastest(t: Array, angle: Array) -> float:
    """Nearly the fastest rate at which the disk is seen to turn."""
    rate = np.abs(np.diff(angle) / np.diff(t))
    close = np.isfinite(rate) & (np.diff(t) < SHORT * usual_interval(t))
    return float(np.quantile(rate[close], 0.99)) if close.any() else 20.0
