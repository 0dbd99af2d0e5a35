"""Times of a constant rate that were rounded, as containers of films and tables round them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 10  # times. With fewer, a constant rate may be chance.

# In periods:
_FINEST = 1e-3  # Finer rounding does not matter.
_COARSEST = 0.75  # Coarser times do not determine the rate.
_GAPS = 0.25  # Up to this error the number of missing times is certain.

# In units of the rounding:
_SLACK = 1e-3  # accuracy of the search for the rate
_EXACT = 1e-6  # times with less deviation are not rounded

_DECIMALS = range(7)
_USUAL = (10, 12, 12.5, 15, 20, 24, 25, 30, 48, 50, 60, 90, 100, 120, 200, 240, 250, 480, 500, 960, 1000)
#: Rates that cameras and films have, Hz.
_RATES = tuple(factor * rate for rate in _USUAL for factor in (1.0, 1000 / 1001))


@dataclass(frozen=True)
class SteadyClock:
    """A constant rate that explains rounded times.

    Attributes
    ----------
    start, period : float
        First time and interval of the times before they were rounded, s.
    rounding : float
        The resolution of the times as they are, s.
    """

    start: float
    period: float
    rounding: float

    @property
    def text(self) -> str:
        """One sentence on the rate that was recognised."""
        return (
            f"times are rounded to {1e3 * self.rounding:.3g} ms: they are taken as those of "
            f"{1 / self.period:.6g} Hz"
        )

    def at(self, t: float, parts: int = 1) -> float:
        """Return the time before it was rounded, at whole periods or parts of one; other times stay."""
        return float(self.all_at(np.array([t]), parts)[0])

    def all_at(self, t: Array, parts: int = 1) -> Array:
        """Apply :meth:`at` to times (n,)."""
        number = np.round((t - self.start) / self.period * parts) / parts
        exact: Array = self.start + number * self.period
        return np.where(np.abs(exact - t) <= self.rounding, exact, t)


def steady_clock(t: Array, rounding: float | None = None) -> SteadyClock | None:
    """Recognise times of a constant rate, some of which may be missing, that were rounded.

    Every time must lie within the rounding of a straight line over its number, from first to last: a rate
    that truly varies does not.

    Parameters
    ----------
    t : ndarray (n,)
        Increasing times, s.
    rounding : float, optional
        Their resolution, s; by default the power of ten of which all are multiples.

    Returns
    -------
    SteadyClock or None
        None if the rate varies, if the times are exact, or if their resolution is not known.
    """
    if len(t) < FEWEST or not np.isfinite(t).all():
        return None
    steps = np.diff(t)
    rounding = _decimal(t) if rounding is None else rounding
    usual = float(np.median(steps))
    if not rounding or not steps.min() > 0 or not _FINEST * usual <= rounding <= _COARSEST * usual:
        return None
    missing = (steps > 1.5 * usual) & (rounding <= _GAPS * usual)
    period = float(steps[~missing].mean())
    number = np.concatenate([[0.0], np.cumsum(np.where(missing, np.round(steps / period), 1.0))])
    if np.ptp(steps[~missing]) > 2 * rounding * (1 + _SLACK):
        return None
    if np.abs(t[0] + period * number - t).max() < _EXACT * rounding:
        return None
    period, scatter = _line(number, t)
    # The narrowest band of a slope in which all times lie, by golden section: it is convex.
    reach = 2 * rounding / float(number[-1])
    low, high = period - reach, period + reach
    narrowest = _narrowest(number, t, low, high)
    if _width(number, t, narrowest) > rounding * (1 + _SLACK):
        return None
    for rate in sorted(_RATES, key=lambda rate: abs(1 / rate - period)):
        fits = _width(number, t, 1 / rate) <= rounding * (1 + _SLACK)
        if fits and abs(1 / rate - period) < 4 * scatter:
            period = 1 / rate
            break
    else:
        if _width(number, t, period) > rounding * (1 + _SLACK):
            period = narrowest
    rest = t - period * number
    start = 0.5 * float(rest.max() + rest.min())
    if abs(start - t[0]) <= 0.5 * rounding * (1 + _SLACK) and _within(rest, float(t[0]), rounding):
        start = float(t[0])  # a record begins when it says, unless that time was rounded too
    return SteadyClock(start, period, rounding)


def _decimal(t: Array) -> float:
    """Return the power of ten of which all times are multiples, s; 0 if none from 1 s to 1 us is."""
    for k in _DECIMALS:
        scaled = t * 10.0**k
        if np.abs(scaled - np.round(scaled)).max() < 1e-9 * max(1.0, float(np.abs(scaled).max())):
            return 10.0**-k
    return 0.0


def _line(number: Array, t: Array) -> tuple[float, float]:
    """Return the slope of least squares, and its standard deviation by the scatter about it."""
    away = number - number.mean()
    power = float(away @ away)
    slope = float(away @ t) / power
    rest = t - t.mean() - slope * away
    return slope, float(np.sqrt((rest @ rest) / (len(t) - 2) / power))


def _width(number: Array, t: Array, slope: float) -> float:
    return float(np.ptp(t - slope * number))


def _within(rest: Array, start: float, rounding: float) -> bool:
    return bool(np.abs(rest - start).max() <= 0.5 * rounding * (1 + _SLACK))


def _narrowest(number: Array, t: Array, low: float, high: float) -> float:
    share = 0.5 * (math.sqrt(5.0) - 1.0)
    inner = [high - share * (high - low), low + share * (high - low)]
    widths = [_width(number, t, slope) for slope in inner]
    for _ in range(60):
        if widths[0] < widths[1]:
            high, inner[1], widths[1] = inner[1], inner[0], widths[0]
            inner[0] = high - share * (high - low)
            widths[0] = _width(number, t, inner[0])
        else:
            low, inner[0], widths[0] = inner[0], inner[1], widths[1]
            inner[1] = low + share * (high - low)
            widths[1] = _width(number, t, inner[1])
    return inner[0] if widths[0] < widths[1] else inner[1]
