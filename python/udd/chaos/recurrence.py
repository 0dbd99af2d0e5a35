"""Recurrence of points on a section: periods, and motions that still settle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.models.state_scaling import Floats

APERIODIC, SETTLING = 0, -1
"""Values instead of a period: the points do not come back; the motion still settles."""

_NEAR = 0.01
_LEAST = 12


@dataclass(frozen=True)
class Tightness:
    """Tolerances of recurrence, in the coordinates of :mod:`udd.models.state_scaling`.

    Attributes
    ----------
    noise : float
        Distance by which integration errors move a point that comes back exactly.
    settled : float
        Largest distance of a periodic orbit's points from their limits. A larger one means a transient.
    same : float
        Largest distance between the points of two records of the same periodic orbit.
    """

    noise: float
    settled: float
    same: float


def tightness(rtol: float) -> Tightness:
    """Return the tolerances for runs with this `rtol`."""
    noise = 30.0 * rtol + 1e-11
    settled = max(1e-4, 100.0 * noise)
    return Tightness(noise, settled, 10.0 * settled)


def periods(points: Floats, tight: Tightness) -> NDArray[np.int32]:
    """Count the section points after which each motion comes back.

    Parameters
    ----------
    points : ndarray (jobs, n, m)
        Successive points of each motion, finite.
    tight : Tightness

    Returns
    -------
    ndarray (jobs,)
        The period, at most a third of n. It is 0 if the points do not come back. It is -1 if they nearly do
        but still move: a transient that dies out, or an unstable orbit that is being left.

    Notes
    -----
    With d the change from one period to the next, which falls by r each time, what is still to come is
    d r/(1 - r). So a slow transient, as near a bifurcation, is not mistaken for its end. Periods above a
    quarter of n must have settled to the last digits.
    """
    jobs, n, _ = points.shape
    result = np.zeros(jobs, dtype=np.int32)
    if jobs == 0:
        return result
    if n < _LEAST:
        raise ValueError(f"{n} points are too few to tell a period")
    longest = n // 3
    back = points[:, n - 1 - longest : n - 1][:, ::-1]
    is_near = np.abs(back - points[:, -1:]).max(axis=2) < _NEAR
    for p in range(1, longest + 1):
        rows = np.flatnonzero((result <= 0) & is_near[:, p - 1])
        if not len(rows):
            continue
        late, to_come = _changes(points[rows], p)
        settled = (late < tight.noise) | (to_come < tight.settled)
        result[rows[settled]] = p
        result[rows[~settled & (late < _NEAR)]] = SETTLING
    for p in np.unique(result[result > 1]).tolist():
        rows = np.flatnonzero(result == p)
        result[rows] = _shortest(points[rows], p, 4.0 * tight.settled)
    return result


def _changes(points: Floats, p: int) -> tuple[Floats, Floats]:
    """Return the last change from period to period, and the expected remaining change."""
    n = points.shape[1]
    change = np.abs(points[:, p:] - points[:, :-p]).max(axis=2)
    late = change[:, -p:].max(axis=1)
    if 4 * p > n:
        return late, np.full(len(points), np.inf)
    # Over the last half of the points, in two spans: in chaos both seldom shrink, and the slower counts.
    lag = max(1, n // (4 * p) - 1)
    middle, early = (change[:, -(k * lag + 1) * p : -k * lag * p].max(axis=1) for k in (1, 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.fmax(late / middle, middle / early) ** (1.0 / lag)
        to_come = np.where(ratio < 1.0, late * ratio / (1.0 - ratio), np.inf)
    return late, to_come


def _shortest(points: Floats, period: int, close: float) -> NDArray[np.int32]:
    """Return the smallest divisor of the period after which the points agree within their errors.

    Near a period doubling the shorter period settles last, with its points now on this side, now on that.
    """
    result = np.full(len(points), period, dtype=np.int32)
    for p in (p for p in range(period - 1, 0, -1) if period % p == 0):
        change = np.abs(points[:, -period:] - points[:, -period - p : -p]).max(axis=(1, 2))
        result[change < close] = p
    return result
