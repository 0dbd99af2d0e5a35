"""Misfit that a drifting sensor, or a moving support, would explain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from udd.discovery.nonparametric.bsplines import Spline
from udd.discovery.thresholds import EVIDENCE_MARGIN
from udd.discovery.trial_fits import cost_of_parameter
from udd.fitting import Fit, eased
from udd.fitting.time_scale import correlation_time, takes_to_change

Array = NDArray[np.float64]

_INTERVALS = 28  # intervals of the drift's cubic spline over a record, as many as for a curve over time
_SLOW = 12.0  # minimum length of an interval, in times in which the motion changes: two periods
_FEWEST = 3


def drift_gain(fit: Fit) -> float:
    """Compute the decrease in chi2, in units of the fit's scatter, by a slow drift of each channel's zero.

    It is a lower bound, because the motion is fixed. It is zero if it is below the cost of the drift's
    freedom, or if the record is too short to distinguish a drift from its motion.
    """
    sd = fit.noise.sd(fit.record, fit.blurring) / np.sqrt(np.maximum(fit.noise.weight, 1e-12))[:, None]
    change, total = correlation_time(fit), 0.0
    for film in np.unique(fit.record.film):
        in_film = fit.record.film == film
        t = fit.record.t[in_film]
        for misfit, read, size in zip(
            fit.misfit[in_film].T, fit.record.seen[in_film].T, sd[in_film].T, strict=True
        ):
            seen = np.isfinite(misfit)
            # A drift must be slow compared with the motion that this sensor shows: a tank's level is slow
            # itself.
            slow = max(change, _about_its_trend(t[seen], (read - misfit)[seen]))
            number = min(_INTERVALS, int(float(np.ptp(t)) / (_SLOW * slow))) if slow > 0 else 0
            if number < _FEWEST or seen.sum() <= number + 3:
                continue
            spline = Spline(float(t[0]), float(t[-1]), number, False)
            weighted = spline.design(t[seen]) / size[seen, None]
            scaled = misfit[seen] / size[seen]
            remainder = scaled - weighted @ np.linalg.lstsq(weighted, scaled, rcond=None)[0]
            fall = float(scaled @ scaled - remainder @ remainder) / max(fit.scatter, 1.0)
            total += fall if fall > 2 * cost_of_parameter(fit) * weighted.shape[1] else 0.0
    return total


def _about_its_trend(t: Array, values: Array) -> float:
    """Return the time in which a channel's signal changes, about its trend."""
    if len(t) < _FEWEST:
        return 0.0
    level = values - np.polyval(np.polyfit(t - t[0], values, 1), t - t[0])
    (time,) = takes_to_change(level[:, None], (np.diff(level) / np.diff(t))[:, None])
    return float(time)


FORETELLS = 0.5
"""The ratio of free runs' errors, at worst, from which on no random forces come into question."""


def as_random(before: Fit, after: Fit) -> Fit | None:
    """Compare a found law with random forces alone, by the evidence (marginal likelihood).

    A moving support feeds random forces into a swing. If the swing loses little energy, their trace lasts for
    many periods and resembles a law. A right law needs no random forces: its evidence is largest at the
    smallest model error. If a law needs a larger one, its evidence must exceed that of the known model, each
    at its most probable model error. A disk is not tested: its camera sees all marks move.

    Return the fit with random forces; None if they do not explain the record as well, or are not needed.
    """
    if after.model.profile.sensor.sees_marks:
        return None
    most_probable = eased(after)
    tight = most_probable.problem.has_smallest_model_error
    if tight or most_probable.evidence - eased(before).evidence > EVIDENCE_MARGIN:
        return None
    return most_probable
