"""The time scale of a fitted motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .fit_result import Fit

_UNITS = 24  # minimum length of the fitted part, in units of the time scale


def correlation_time(fit: Fit) -> float:
    """Return the smallest ratio, over the states, of s.d. to r.m.s. rate; 0 if all are constant."""
    linked, dt = fit.record.linked, np.diff(fit.record.t)
    rates = np.diff(fit.states, axis=0)[linked] / dt[linked, None]
    times = takes_to_change(fit.states, rates)
    return float(times[times > 0].min(initial=np.inf)) if times.any() else 0.0


def takes_to_change(values: NDArray[np.float64], rates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ratio of standard deviation to r.m.s. rate for each column; 0 for a constant column."""
    spread, rate = values.std(axis=0), np.sqrt((rates**2).mean(axis=0))
    result: NDArray[np.float64] = np.divide(spread, rate, out=np.zeros_like(spread), where=rate > 0)
    return result


def motion_time_scale(fit: Fit) -> float:
    """Return the unit of time for this package: 1 s, or four correlation times of a user's own model.

    On the disk four correlation times are 1 s as well. The correlation time is the minimum over the states of
    standard deviation over r.m.s. rate. For a short record the unit is shorter (but not below one correlation
    time), so that the held-out part has enough blocks to resample.
    """
    if not fit.model.profile.written:
        return 1.0
    change = correlation_time(fit) or float(np.median(np.diff(fit.record.t)))
    longest = max(float(np.ptp(fit.record.t[fit.record.film == k])) for k in np.unique(fit.record.film))
    return max(change, min(4.0 * change, longest / _UNITS))
