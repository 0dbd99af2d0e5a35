"""Noise of a record: scale, growth with speed, outlier weights (Huber), autocorrelation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import nnls

from udd._util import chi_squared
from udd._util.one_line import OneLine

from .record import Record

if TYPE_CHECKING:
    from .fit_result import Fit

Array = NDArray[np.float64]

#: Share of frames with normal noise below the Huber threshold; a frame beyond it counts less.
_HONEST = 0.99
#: Distance, in units of that threshold, beyond which a frame does not count: about 100 standard deviations.
_GROSS = 30.0
#: Standard errors above which an autocorrelation is significant, and the value above which it is motion.
_SURE, _MOTION = 4.0, 0.8
#: Frequencies over which the misfits' power is averaged.
_BAND = 17
#: Relative precision of computed motion, as a share of a channel's largest number: no noise is smaller.
_EXACT = 1e-12


@dataclass(frozen=True, repr=False)
class Noise(OneLine):
    """Noise of a measurement.

    The variance of a channel is ``(factor sigma)^2 + (blur Omega)^2``, where ``sigma`` is what the
    measurement states; noise often grows with the speed.

    Attributes
    ----------
    factor : ndarray (m,)
        Factors on the stated standard deviations. They are 1 if these were right.
    blur : ndarray (m,)
        Growth with the angular speed, in the channel's unit per rad/s.
    weight : ndarray (n,)
        Weight of each frame. It is 1, less for an outlier (Huber), and 0 for a gross one.
    memory : ndarray (m,)
        Lag-1 autocorrelation of the noise.
    """

    factor: Array
    blur: Array
    weight: Array
    memory: Array

    def of(self, record: Record) -> Noise:
        """Return the same noise for another record, the outliers of which get weight 0."""
        return replace(self, weight=np.where(record.odd, 0.0, 1.0))

    def sd(self, record: Record, omega: Array) -> Array:
        """Return the standard deviation of every frame and channel, (n, m)."""
        variance: Array = (self.factor * record.sigma) ** 2 + (self.blur * omega[:, None]) ** 2
        return np.sqrt(variance)

    def information(self, record: Record, omega: Array) -> Array:
        """Return the inverse covariance of every frame, (n, m, m), weighted; zero if not observed."""
        scale = 1.0 / self.sd(record, omega)
        result: Array = self.weight[:, None, None] * record.unmixing * scale[:, :, None] * scale[:, None, :]
        return result

    def beyond(self, record: Record, omega: Array, factor: float) -> bool:
        """Return True if the median noise of any channel exceeds the stated one by more than a factor."""
        sd, seen = self.sd(record, omega), record.observed
        ratios = [sd[use, m] / record.sigma[use, m] for m, use in enumerate(seen.T)]
        return any(float(np.median(ratio)) > factor for ratio in ratios if len(ratio))

    def like(self, other: Noise, record: Record, omega: Array) -> bool:
        """Return True if two noises agree to 3 % in the median."""
        seen = record.observed
        ratio = self.sd(record, omega)[seen] / other.sd(record, omega)[seen]
        return bool(abs(np.median(ratio) - 1.0) < 0.03)


def stated(record: Record) -> Noise:
    """Return the noise that the measurement states; outliers get weight 0."""
    channels = record.seen.shape[1]
    return Noise(np.ones(channels), np.zeros(channels), np.ones(0), np.zeros(channels)).of(record)


def estimated(fit: Fit) -> Noise:
    """Estimate the noise from a fit's misfits, corrected for the scatter of the fitted values."""
    record, omega, misfit, before = fit.record, fit.blurring, fit.misfit, fit.noise
    seen, assumed = record.observed, fit.noise_sd
    distance = _distance(record, misfit, assumed)
    channels = seen.sum(axis=1).clip(1)
    # Outliers are judged by the typical frame, because the stated noise may be wrong.
    numbers = np.arange(1, seen.shape[1] + 1)  # of channels that a frame may show
    typical = np.median(distance[seen.any(axis=1)]) / np.sqrt(chi_squared.ppf(0.5, numbers))
    limit = (np.sqrt(chi_squared.ppf(_HONEST, numbers)) * np.maximum(typical, 1.0))[channels - 1]
    # A gross outlier has no weight: its chi2 would hide that of all other frames.
    is_gross = record.odd | (distance > _GROSS * limit)
    less = np.where(is_gross, 0.0, limit / np.maximum(distance, limit))
    weight = np.where(distance > limit, less, 1.0)
    # The variance comes from the frames within the limit, in which normal noise has this share of its
    # variance.
    shown = (chi_squared.cdf(chi_squared.ppf(_HONEST, numbers), numbers + 2) / _HONEST)[channels - 1]
    factor, blur = np.ones(misfit.shape[1]), np.zeros(misfit.shape[1])
    for m in range(misfit.shape[1]):
        use = seen[:, m] & (weight == 1.0)
        if not use.any():
            continue  # an unobserved state
        # A fit follows its data: each squared misfit is smaller than that of the noise by the fit's leverage.
        variance = assumed[use, m] ** 2
        leverage = fit.misfit_variance[use, m] / variance
        power = misfit[use, m] ** 2 / shown[use] / np.maximum(1.0 - leverage, 0.05)
        least = _EXACT * np.abs(record.seen[use, m]).max()
        terms = np.column_stack([record.sigma[use, m] ** 2, omega[use] ** 2])
        for _ in range(3):  # the scatter of a squared misfit grows with its own expectation
            scale = np.sqrt((terms**2).mean(axis=0)) + 1e-300
            share, _residual = nnls(terms / scale / variance[:, None], power / variance)
            variance = np.maximum(terms / scale @ share, 1e-6 * power.mean() + least**2 + 1e-300)
        factor[m], blur[m] = np.sqrt(share / scale)
        smallest = np.sqrt((1e-6 * power.mean() + least**2) / (record.sigma[use, m] ** 2).mean())
        factor[m] = max(factor[m], smallest)
    return Noise(factor, blur, weight, before.memory)


def noise_autocorrelation(fit: Fit) -> Array:
    """Estimate the lag-1 autocorrelation of the noise, per channel, from a fit with a small model error.

    It is 0 if it is not significant, and 0 if it would last for many frames: that is motion that the model
    lacks. Outliers are left out.
    """
    record, misfit, sd, weight = fit.record, fit.misfit, fit.noise_sd, fit.noise.weight
    there = record.observed & (weight == 1.0)[:, None]
    scaled = np.divide(misfit, sd, out=np.zeros(misfit.shape), where=there)
    pairs = there[1:] & there[:-1] & record.linked[:, None]
    power = (scaled**2).sum(axis=0) / np.maximum(there.sum(axis=0), 1)
    count = np.maximum(pairs.sum(axis=0), 1)
    rho = (scaled[1:] * scaled[:-1] * pairs).sum(axis=0) / count / np.maximum(power, 1e-300)
    result: Array = np.where((rho > _SURE / np.sqrt(count)) & (rho < _MOTION), rho, 0.0)
    return result


def _distance(record: Record, misfit: Array, sd: Array) -> Array:
    """Return the distance of each frame in standard deviations."""
    normal = np.nan_to_num(misfit / sd)
    squared = np.einsum("ni,nij,nj->n", normal, record.unmixing, normal)
    result: Array = np.sqrt(np.maximum(squared, 0.0))
    return result


def colour(misfit: Array, signature: Array) -> float:
    """Compare the misfits' power at an effect's frequencies with their mean power; at least 1.

    Misfits that are correlated over many frames, such as those of a lens, resemble an effect more than white
    noise does.

    Parameters
    ----------
    misfit, signature : ndarray (n, m)
        Misfits of a fit with the effect, and their difference from those without it, both in units of the
        noise; NaN if nothing was observed. The worst channel counts.
    """
    worst = 1.0
    for e, s in zip(np.nan_to_num(misfit).T, np.nan_to_num(signature).T, strict=True):
        power = uniform_filter1d(np.abs(np.fft.rfft(e)) ** 2, _BAND, mode="nearest")
        weight = np.abs(np.fft.rfft(s)) ** 2
        if weight.sum() > 0 and power.sum() > 0:
            worst = max(worst, float((weight @ power) / weight.sum() / power.mean()))
    return worst
