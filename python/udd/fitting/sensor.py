"""What a record shows of its sensor: the steps that it reads in, and its noise."""

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

_FEW = 8  # gaps between values that tell a lattice
_SAME = 1e-7  # of the range, below which two values are one
_OFF, _MOST = 0.02, 0.98  # how far gaps may be from multiples of the step, and how many are not farther
_ORDERS = (3, 4, 5, 6)  # of the differences that tell noise from motion
_MOVES = 3.0  # standard errors by which a frame differs from the one before where a film is not at rest
_STILL = 10  # frames of a film that shows no motion any more, at least
_ROUND = (1.0, 2.0, 5.0, 10.0)
_CLOSE = 1e-3  # relative, within which a number is a round one
_WHITE = -0.8  # of neighbours' correlation in differences of noise from which on they are taken for noise
_GROWS = 30.0  # nats that noise growing with what was read has to gain: differences go together
_ABOVE = 10.0  # times the noise's variance that the mean square of readings is, for their size to be known
_TURNS = 5
_NEAR = 5  # frames whose mean square is a frame's size


def lattice(values: Array) -> float:
    """The step in which a sensor reads, from the gaps between its values; 0 where they lie on no lattice.

    Parameters
    ----------
    values : ndarray (n,)
        In any order; NaN where nothing was read.

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
    """The noise of evenly spaced columns (n, c), from the least of what differences of several orders show.

    Those of a smooth motion are the smaller the higher their order, those of noise are as many times its
    variance as the middle binomial coefficient says.
    """
    shown = []
    for order in _ORDERS[: max(len(values) - _ORDERS[0], 1)]:
        scale = math.sqrt(math.comb(2 * order, order))
        shown.append(np.median(np.abs(np.diff(values, order, axis=0)), axis=0) / 0.6745 / scale)
    result: Array = np.min(shown, axis=0)
    return result


def reads(values: Array) -> tuple[float, float]:
    """``(noise, step)`` of one channel (n,): the step's own noise, step/sqrt(12), is contained.

    A sensor that reads in steps coarser than its noise mostly repeats itself: there the step's is all.
    """
    step = lattice(values)
    return max(float(roughness(values[:, None])[0]), step / math.sqrt(12.0)), step


def frame_noise(values: Array) -> Array:
    """The noise of each frame of one channel, (n,), of which the steps' errors repeat where readings do."""
    noise, step = reads(values)
    return _shared(values, np.full(len(values), noise), step)


def stated_noise(values: Array, sigma: Array) -> Array:
    """As :func:`frame_noise`, where the noise `sigma` of each frame, (n,), is stated."""
    return _shared(values, sigma, lattice(values))


def few_readings(values: Array) -> Array:
    """As :func:`frame_noise`, of an encoder that was seen in so few steps that they show no lattice."""
    step = float(np.diff(np.unique(values)).min())
    return _shared(values, np.full(len(values), step / math.sqrt(12.0)), step)


def repeats(values: Array, step: float) -> NDArray[np.int64]:
    """How often in a row each value was read, (n,)."""
    changes = np.flatnonzero(np.abs(np.diff(values)) > step / 2) + 1
    lengths = np.diff(np.concatenate([[0], changes, [len(values)]]))
    return np.repeat(lengths, lengths)


def _shared(values: Array, noise: Array, step: float) -> Array:
    """The noise of each frame, larger where readings repeat.

    As long as a motion stays within a step its frames share one error: together they tell what one would.
    """
    if not step:
        return noise
    own = np.minimum(step**2 / 12.0, noise**2)
    result: Array = np.sqrt(noise**2 + (repeats(values, step) - 1) * own)
    return result


def noise_by_size(values: Array) -> Array:
    """The noise of each frame of one channel (n,), which may grow with the size of what was read.

    Variance a + b x^2 of differences, of the lowest order that shows noise alone, fitted by their likelihood;
    one for all frames where that is not much likelier, or where every order shows motion.

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
    same = np.full(len(values), float(roughness(values[:, None])[0]))
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
    own = np.convolve(values**2, weights, "valid")
    size = uniform_filter1d(values**2, _NEAR, mode="nearest")
    variance = np.full(len(shown), mean)
    for _ in range(_TURNS):  # the scatter of a squared difference grows with its own expectation
        terms = np.column_stack([np.ones(len(own)), own]) / variance[:, None]
        scale = np.sqrt((terms**2).mean(axis=0)) + 1e-300
        (a, b), _residual = nnls(terms / scale, shown / variance)
        a, b = max(a / scale[0], 1e-6 * mean), b / scale[1]
        variance = a + b * own
    gain = 0.5 * float((np.log(mean / variance) + shown / mean - shown / variance).sum())
    return np.sqrt(a + b * size) if b > 0.0 and gain > _GROWS else same


def is_film(measurement: Measurement) -> bool:
    """Whether a measurement is one of the disk, tracked in a film."""
    return profile_of(measurement.kind).sensor.sees_marks and "px_per_m" in measurement.meta


def moving(measurement: Measurement) -> int:
    """The number of rows until a film's disk has come to rest for good, or all of them.

    From there on a compressed film repeats its picture, with its errors: the frames say nothing new, and
    their scatter says nothing of the noise.
    """
    n = len(measurement)
    if not is_film(measurement) or measurement.sigma is None:
        return n
    seen = np.flatnonzero(measurement.seen)
    steps = np.abs(np.diff(measurement.values[seen], axis=0)) > _MOVES * measurement.sigma[seen[1:]]
    last = np.flatnonzero(steps.any(axis=1))[-1:] + 2  # the frame it moved to, and one more
    return int(seen[last[0]]) if len(last) and last[0] + _STILL < len(seen) else n


def is_encoder(measurement: Measurement) -> bool:
    """Whether a pendulum's angle was read by an encoder.

    It says so, or it comes in steps that drown all other noise. Not where the steps are round numbers of rad
    or degrees: those come from writing the table.
    """
    if measurement.meta.get("sensor") == "encoder":
        return True
    if profile_of(measurement.kind).sensor.zero is None:
        return False
    noise, step = reads(measurement.values[measurement.seen, 0])
    return step > 0 and noise <= step and not (_is_round(step) or _is_round(math.degrees(step)))


def geometry_limits(sensor: SensorProfile, measurement: Measurement) -> bool:
    """Whether frames are counted on for no more than a film's geometry, as nothing else is known of them."""
    return sensor.faithful > 0 and measurement.sigma is None and not is_encoder(measurement)


def _is_round(value: float) -> bool:
    """Whether a number is 1, 2 or 5 times a power of ten."""
    mantissa = value / 10.0 ** math.floor(math.log10(value))
    return any(abs(mantissa / one - 1.0) < _CLOSE for one in _ROUND)
