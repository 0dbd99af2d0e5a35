"""The time scale of a fitted motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .problem import Fit

_UNITS = 24  # that the part which is fitted should at least be long


def correlation_time(fit: Fit) -> float:
    """The least over the states of standard deviation over root mean square rate; 0 where nothing moves."""
    linked, dt = fit.record.linked, np.diff(fit.record.t)
    rates = np.diff(fit.states, axis=0)[linked] / dt[linked, None]
    times = takes_to_change(fit.states, rates)
    return float(times[times > 0].min(initial=np.inf)) if times.any() else 0.0


def takes_to_change(values: NDArray[np.float64], rates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard deviation over root mean square rate of each column; 0 of one that does not move."""
    spread, rate = values.std(axis=0), np.sqrt((rates**2).mean(axis=0))
    result: NDArray[np.float64] = np.divide(spread, rate, out=np.zeros_like(spread), where=rate > 0)
    return result


def motion_time_scale(fit: Fit) -> float:
    """The unit of the times of this module: a second, or four times what a user's own motion takes to change.

    As on the disk, where that is a quarter of a second. It is the least over the states of the standard
    deviation over the root mean square rate. For a short record the unit is shorter, but not below that, so
    that the part held out has enough blocks to resample.
    """
    if not fit.model.profile.written:
        return 1.0
    change = correlation_time(fit) or float(np.median(np.diff(fit.record.t)))
    longest = max(float(np.ptp(fit.record.t[fit.record.film == k])) for k in np.unique(fit.record.film))
    return max(change, min(4.0 * change, longest / _UNITS))
