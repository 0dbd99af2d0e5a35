"""Free runs of the fitted models, for the pictures."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from udd.errors import IntegrationError
from udd.fitting import predicted
from udd.simulation.trajectory import Trajectory, integrated

if TYPE_CHECKING:
    from udd.discovery.results import Discovery
    from udd.fitting import Fit

Array = NDArray[np.float64]

_STEP = 0.01  # s
_BEFORE = 1.0  # s of data shown before the start


@dataclass(frozen=True)
class Forecast:
    """Measured motion around a moment, and what the models make of it from there, as the camera would see it.

    Attributes
    ----------
    start : float
        Time at which the free runs start, s.
    t_seen, seen : ndarray (n,), (n, m)
    t : ndarray (k,)
    before, after : ndarray (k, m)
    """

    start: float
    t_seen: Array
    seen: Array
    t: Array
    before: Array
    after: Array


def free_run(fit: Fit) -> Trajectory | None:
    """Run the fitted model from the first fitted state over the record; None if it diverges."""
    t = fit.record.t
    times = np.arange(t[0], t[-1], _STEP)
    try:
        return integrated(fit.model, times, fit.states[0])
    except IntegrationError:
        return None


def smooth(fit: Fit) -> SimpleNamespace:
    """Return a curve through the fitted states, with the slopes of the model."""
    t = fit.record.t
    curve = CubicHermiteSpline(t, fit.states, fit.model.rates(t, fit.states))
    fine = np.unique(np.concatenate([t, np.arange(t[0], t[-1], _STEP)]))
    state = curve(fine)
    # No curve across a gap in the record.
    state[~np.append(fit.record.linked, True)[np.searchsorted(t, fine, side="right") - 1]] = np.nan
    return SimpleNamespace(t=fine, state=state, model=fit.model)


def forecast(discovery: Discovery) -> Forecast:
    """Predict from the first held-out frame: a disk's first seconds, a pendulum's last ones."""
    fit, m = discovery.fit, discovery.measurement
    t = fit.record.t
    origin = fit.record.origin
    first = min(int(np.searchsorted(t, discovery.split - origin)), len(t) - 2)
    shown = fit.model.profile.shown
    if shown.forecast_end:
        shown_from, end = max(t[-1] - shown.forecast, t[first]), t[-1]
    else:
        shown_from, end = t[first] - _BEFORE, min(t[first] + shown.forecast, t[-1])
    times = np.arange(t[first] + _STEP, end, _STEP)
    before, after = (_predicted(f, first, times) for f in (discovery.baseline, fit))
    rows = m.slice(shown_from + origin, end + origin)
    seen = np.where(rows.seen[:, None], rows.values, np.nan)
    late = times >= shown_from
    times_seen, start = times[late] + origin, float(t[first]) + origin
    return Forecast(start, rows.t, seen, times_seen, before[late], after[late])


def side_by_side(discovery: Discovery, seconds: float) -> tuple[Array, Array, list[Array]]:
    """Times of frames from the first held-out one on, what was measured, and what the models make of it.

    The known model comes first, then the one with the added effects if there are any.
    """
    fit = discovery.fit
    t = fit.record.t
    first = min(int(np.searchsorted(t, discovery.split - fit.record.origin)), len(t) - 3)
    last = int(np.searchsorted(t, min(t[first] + seconds, t[-1]), side="right"))
    frames = slice(first, last)
    seen = np.where(fit.record.observed[frames], fit.record.seen[frames], np.nan)
    fits = [discovery.baseline, *([fit] if discovery.effects else [])]
    times = t[frames]
    return times + fit.record.origin, seen, [_predicted(each, first, times) for each in fits]


def _predicted(fit: Fit, first: int, times: Array) -> Array:
    start = fit.record.t[first : first + 1]
    states = fit.states[first : first + 1]
    result: Array = predicted(
        fit.models, fit.point.sets, fit.record.film[first : first + 1], start, states, times[None, :]
    )[0]
    return result
