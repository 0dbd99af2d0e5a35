"""What a drifting sensor, or a support that moves, would explain of a model's misfit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from udd.discovery.nonparametric.curve_scan import EVIDENCE_MARGIN
from udd.discovery.trial_fits import price_of
from udd.fitting import Fit, eased
from udd.fitting.time_scale import correlation_time, takes_to_change

Array = NDArray[np.float64]

_INTERVALS = 28  # of the drift's cubic spline over a record, as many as a curve over time has
_SLOW = 12.0  # times what the motion takes to change, that each of them lasts at least: two of its turns
_FEWEST = 3


def drift_gain(fit: Fit) -> float:
    """The fall of chi2, in units of the fit's scatter, by a slow drift of what each channel calls zero.

    A lower bound, for the motion is held; zero where it is not worth the drift's freedom, or where the record
    is too short to tell a drift from its motion.
    """
    sd = fit.noise.sd(fit.record, fit.blurring) / np.sqrt(np.maximum(fit.noise.weight, 1e-12))[:, None]
    change, total = correlation_time(fit), 0.0
    for film in np.unique(fit.record.film):
        own = fit.record.film == film
        t = fit.record.t[own]
        for misfit, read, size in zip(fit.misfit[own].T, fit.record.seen[own].T, sd[own].T, strict=True):
            seen = np.isfinite(misfit)
            # A drift is slow beside what this sensor sees of the motion: a tank's level is slow itself.
            slow = max(change, _about_its_trend(t[seen], (read - misfit)[seen]))
            number = min(_INTERVALS, int(float(np.ptp(t)) / (_SLOW * slow))) if slow > 0 else 0
            if number < _FEWEST or seen.sum() <= number + 3:
                continue
            weighted = _splines(t, number)[seen] / size[seen, None]
            scaled = misfit[seen] / size[seen]
            left = scaled - weighted @ np.linalg.lstsq(weighted, scaled, rcond=None)[0]
            fall = float(scaled @ scaled - left @ left) / max(fit.scatter, 1.0)
            total += fall if fall > price_of(fit) * weighted.shape[1] else 0.0
    return total


def _about_its_trend(t: Array, values: Array) -> float:
    """What a channel sees takes so long to change, about its trend."""
    if len(t) < _FEWEST:
        return 0.0
    level = values - np.polyval(np.polyfit(t - t[0], values, 1), t - t[0])
    (time,) = takes_to_change(level[:, None], (np.diff(level) / np.diff(t))[:, None])
    return float(time)


def _splines(t: Array, intervals: int) -> Array:
    """Cubic B-splines over a record, (n, intervals + 3)."""
    inner = np.linspace(t[0], t[-1], intervals + 1)
    knots = np.concatenate([[t[0]] * 3, inner, [t[-1]] * 3])
    result: Array = BSpline.design_matrix(t, knots, 3).toarray()
    return result


FORETELLS = 0.5
"""The ratio of free runs' errors, at worst, from which on no random forces come into question."""


def as_random(known: Fit, found: Fit) -> Fit | None:
    """Compare a found law with random forces alone, by the evidence (marginal likelihood).

    A moving support feeds random forces into a swing. If the swing hardly loses energy their trace lasts for
    many turns and resembles a law. A right law needs no random forces: its evidence is largest at the
    smallest model error. If a found law needs a larger one, its evidence must exceed that of the known model,
    each at its likeliest model error. A disk is not tested: its camera sees all marks move.

    Parameters
    ----------
    known, found : Fit
        Of all data, without and with what was found, in a search.

    Returns
    -------
    Fit or None
        None where they do not, or where no such forces are needed.
    """
    if found.model.profile.sensor.sees_marks:
        return None
    likeliest = eased(found)
    tight = likeliest.level == len(likeliest.problem.schedule) - 1
    if tight or likeliest.evidence - eased(known).evidence > EVIDENCE_MARGIN:
        return None
    return likeliest
