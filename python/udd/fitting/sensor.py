"""Sensor properties that a record shows: steps of the readings, and noise."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import nnls

from udd.measurement import Measurement
from udd.models import profile_of
from udd.models.profile import SensorProfile

Array = NDArray[np.float64]

#: Noise of a column with a single value, which does not show it.
NO_NOISE = 1e-300
_FEW = 8  # Gaps between values that are needed to detect a lattice.
_SAME = 1e-7  # Share of the range below which two values are equal.
# Tolerance of gaps relative to the step, and the share of gaps that must be within it.
_OFF, _MOST = 0.02, 0.98
_ORDERS = (3, 4, 5, 6)  # Orders of the differences that distinguish noise from motion.
_MOVES = 3.0  # Standard errors: a frame differs by this from the last, unless the film is at rest.
_STILL = 10  # Minimum of frames at rest at the end of a film.
_ROUND = (1.0, 2.0, 5.0, 10.0)
_CLOSE = 1e-3  # relative tolerance of a round number
# correlation of neighbours in differences of noise, relative to white noise, above which they count as noise
_WHITE = -0.8
_GROWS = 30.0  # nats that noise growing with the reading has to gain: differences are correlated
# minimum ratio of the readings' mean square to the noise's variance, for their size to be reliable
_ABOVE = 10.0
_TURNS = 5
_NEAR = 5  # frames over which a frame's size is averaged


def lattice(values: Array) -> float:
    """Return the step of a sensor's readings, from the gaps between its values; 0 if they lie on no lattice.

    Parameters
    ----------
    values : ndarray (n,)
        In any order; NaN if nothing was read.

    Examples
    --------
    >>> import numpy as np
    >>> from udd.fitting.sensor import lattice
    >>> angle = np.random.default_rng(0).normal(0, 0.1, 500)
    >>> round(lattice(0.25 * np.round(angle / 0.02)), 6), lattice(angle)
    (0.25, 0.0)
    """
    ordered = np.sort(values[np.isfinite(values)])
    gaps = np.diff(ordered)
    gaps = gaps[gaps > _SAME * max(float(np.ptp(ordered)), 1e-300)] if len(ordered) else gaps
    if len(gaps) < _FEW:
        return 0.0
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    times = np.rint(gaps / step)
    step = float(gaps @ times / (times @ times))
    off = np.abs(gaps / step - np.rint(gaps / step))
    return step if float((off < _OFF).mean()) > _MOST else 0.0


def roughness(values: Array) -> Array:
    """Estimate the noise of evenly spaced columns, (n,) or (n, c), from differences of several orders.

    The least of the estimates counts. Differences of a smooth motion decrease with their order; those of
    noise have its variance times the central binomial coefficient.
    """
    orders = _ORDERS[: max(len(values) - _ORDERS[0], 1)]
    result: Array = np.min([noise_by_differences(values, order) for order in orders], axis=0)
    return result


def noise_by_differences(values: Array, order: int) -> Array:
    """Compute the s.d. of white noise with differences of this order as large as those of columns."""
    size = np.median(np.abs(np.diff(values, order, axis=0)), axis=0) / 0.6745
    result: Array = size / math.sqrt(math.comb(2 * order, order))
    return result


def reads(values: Array) -> tuple[float, float]:
    """Estimate ``(noise, step)`` of one channel (n,); the noise contains the step's, step/sqrt(12).

    A sensor with steps larger than its noise mostly repeats its readings: the noise is then that of the step.
    """
    step = lattice(values)
    return max(float(roughness(values)), step / math.sqrt(12.0)), step


def frame_noise(values: Array) -> Array:
    """Estimate the noise of each frame of one channel, (n,); the steps' errors repeat as the readings do."""
    noise, step = reads(values)
    return _shared(values, np.full(len(values), noise), step)


def stated_noise(values: Array, sigma: Array) -> Array:
    """Compute :func:`frame_noise` from the stated noise `sigma` of each frame, (n,)."""
    return _shared(values, sigma, lattice(values))


def few_readings(values: Array) -> Array:
    """Compute :func:`frame_noise` of an encoder with too few distinct readings to show a lattice."""
    step = float(np.diff(np.unique(values)).min(initial=np.ptp(values)))
    return np.maximum(_shared(values, np.full(len(values), step / math.sqrt(12.0)), step), NO_NOISE)


def repeats(values: Array, step: float) -> NDArray[np.int64]:
    """Return the length of the run of equal readings that each frame belongs to, (n,)."""
    changes = np.flatnonzero(np.abs(np.diff(values)) > step / 2) + 1
    lengths = np.diff(np.concatenate([[0], changes, [len(values)]]))
    return np.repeat(lengths, lengths)


def _shared(values: Array, noise: Array, step: float) -> Array:
    """Increase the noise of frames with repeated readings.

    While a motion stays within a step its frames share one error: together they have the information of one.
    """
    if not step:
        return noise
    step_variance = np.minimum(step**2 / 12.0, noise**2)
    result: Array = np.sqrt(noise**2 + (repeats(values, step) - 1) * step_variance)
    return result


def noise_by_size(values: Array) -> Array:
    """Estimate the noise of each frame of one channel (n,), which may grow with the size of the reading.

    The variance a + b x^2 is fitted to differences, of the lowest order that shows noise alone, by maximum
    likelihood. All frames get the same noise if that gains little likelihood, or if every order shows motion.

    Examples
    --------
    >>> import numpy as np
    >>> from udd.fitting.sensor import noise_by_size
    >>> x, white = np.cos(np.arange(0, 20, 0.05)), np.random.default_rng(0).standard_normal(400)
    >>> noise_by_size(x * (1 + 0.1 * white))[[0, 31]].round(2)
    array([0.1 , 0.01])
    >>> float(np.ptp(noise_by_size(x + 0.1 * white)))
    0.0
    """
    same = np.full(len(values), float(roughness(values)))
    if len(values) < 10 * _NEAR:
        return same
    for order in _ORDERS:
        weights = np.array([math.comb(order, k) ** 2 for k in range(order + 1)]) / math.comb(2 * order, order)
        rough = np.diff(values, order)
        shown = rough**2 / math.comb(2 * order, order)
        mean = float(shown.mean())
        if mean > 0.0 and rough[1:] @ rough[:-1] < _WHITE * order / (order + 1) * (rough @ rough):
            break
    else:
        return same
    if float((values**2).mean()) < _ABOVE * mean:
        return same
    local_power = np.convolve(values**2, weights, "valid")
    size = uniform_filter1d(values**2, _NEAR, mode="nearest")
    variance = np.full(len(shown), mean)
    for _ in range(_TURNS):  # the scatter of a squared difference grows with its own expectation
        terms = np.column_stack([np.ones(len(local_power)), local_power]) / variance[:, None]
        scale = np.sqrt((terms**2).mean(axis=0)) + 1e-300
        (a, b), _residual = nnls(terms / scale, shown / variance)
        a, b = max(a / scale[0], 1e-6 * mean), b / scale[1]
        variance = a + b * local_power
    gain = 0.5 * float((np.log(mean / variance) + shown / mean - shown / variance).sum())
    return np.sqrt(a + b * size) if b > 0.0 and gain > _GROWS else same


def is_film(measurement: Measurement) -> bool:
    """Return True if a measurement is one of the disk, tracked in a film."""
    return profile_of(measurement.kind).sensor.sees_marks and "px_per_m" in measurement.meta


def moving(measurement: Measurement) -> int:
    """Return the number of rows until a film's disk stops for good, or all of them.

    A compressed film then repeats its picture, with its errors: the frames have no new information, and their
    scatter does not show the noise.
    """
    n = len(measurement)
    if not is_film(measurement) or measurement.sigma is None:
        return n
    seen = np.flatnonzero(measurement.seen)
    steps = np.abs(np.diff(measurement.values[seen], axis=0)) > _MOVES * measurement.sigma[seen[1:]]
    last = np.flatnonzero(steps.any(axis=1))[-1:] + 2  # the frame it moved to, and one more
    return int(seen[last[0]]) if len(last) and last[0] + _STILL < len(seen) else n


def is_encoder(measurement: Measurement) -> bool:
    """Return True if an encoder read a pendulum's angle.

    The measurement says so, or the angle comes in steps larger than all other noise. Steps that are round
    numbers of rad or degrees come from writing the table, and do not count.
    """
    if measurement.meta.get("sensor") == "encoder":
        return True
    if profile_of(measurement.kind).sensor.zero is None:
        return False
    noise, step = reads(measurement.values[measurement.seen, 0])
    return step > 0 and noise <= step and not (_is_round(step) or _is_round(math.degrees(step)))


def geometry_limits(sensor: SensorProfile, measurement: Measurement) -> bool:
    """Return True if the frames are trusted only to a film's geometric error, because no noise is stated."""
    return sensor.faithful > 0 and measurement.sigma is None and not is_encoder(measurement)


def _is_round(value: float) -> bool:
    """Return True if a number is 1, 2 or 5 times a power of ten."""
    mantissa = value / 10.0 ** math.floor(math.log10(value))
    return any(abs(mantissa / round_number - 1.0) < _CLOSE for round_number in _ROUND)
