"""Innovations: each frame minus its prediction from the frames before; white if the model is right."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util import chi_squared

if TYPE_CHECKING:
    from .fit_result import Fit

Array = NDArray[np.float64]


_FEWEST = 2  # innovations of a channel, from which on they are tested


@dataclass(frozen=True, eq=False)
class Innovations:
    """Innovations of a fitted model in units of their own standard deviation.

    Attributes
    ----------
    names : tuple of str
        The channels.
    dt : float
        Time between frames, s.
    values : ndarray (n, m)
        NaN if nothing was observed or the filter's state was still undetermined.
    """

    names: tuple[str, ...]
    dt: float
    values: Array

    @property
    def chi2(self) -> Array:
        """Mean square of every channel; 1 if model and noise are right."""
        result: Array = np.nanmean(self.values**2, axis=0)
        return result

    def autocorrelation(self, lags: int) -> tuple[Array, Array]:
        """Compute the autocorrelation at lags 1 to `lags`, (lags, m), and its s.d. for white noise."""
        seen = np.isfinite(self.values)
        x = np.where(seen, self.values - np.nanmean(self.values, axis=0), 0.0)
        power = (x**2).sum(axis=0) / seen.sum(axis=0)
        pairs = np.array([(seen[k:] & seen[:-k]).sum(axis=0) for k in range(1, lags + 1)])
        products = np.array([(x[k:] * x[:-k]).sum(axis=0) for k in range(1, lags + 1)])
        return products / np.maximum(pairs, 1) / power, 1.0 / np.sqrt(np.maximum(pairs, 1))

    def ljung_box(self, lags: int) -> tuple[Array, Array]:
        """Compute the Ljung-Box statistic of every channel, and its probability for white noise."""
        rho, sd = self.autocorrelation(lags)
        q = ((rho / sd) ** 2).sum(axis=0)  # because of gaps, the number of pairs replaces n (n + 2)/(n - k)
        return q, chi_squared.sf(q, lags)


def innovations(fit: Fit) -> Innovations:
    """Compute the innovations of a fit: observations minus the predictions of a Kalman filter.

    The parameters are fixed. The filter runs along the fitted motion, around which everything is linear, with
    the noise and the model error that the fit assumed.
    """
    problem = replace(fit.problem, noise=fit.noise)
    vague = np.ptp(fit.states, axis=0).tolist()
    values = _core.innovations(replace(problem.at(fit.point), free=()), vague)
    is_tested = np.isfinite(values).sum(axis=0) >= _FEWEST
    seen = [k for k in range(len(fit.channels)) if fit.record.observed[:, k].any() and is_tested[k]]
    names = tuple(fit.channels[k] for k in seen)
    return Innovations(names, float(np.median(np.diff(fit.record.t))), values[:, seen])
