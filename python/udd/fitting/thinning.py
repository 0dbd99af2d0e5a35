"""Block averages (decimation) of a record sampled faster than motion and noise require."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.measurement import Measurement
from udd.models import profile_of

from .outliers import odd_frames
from .sensor import is_encoder, lattice, noise_by_differences

Array = NDArray[np.float64]

#: Frames above which a record is thinned, to about half of them.
MANY = 8000
#: The same if inputs were measured: a run needs a step for each of their samples.
MANY_DRIVEN = 2000
#: Minimum of blocks in the time in which the motion changes (its spread over its fast rates).
_BLOCKS = 2
_SHORTER = 0.8  # factor to the next shorter block if the motion has too much curvature within one
_FAST = 0.9  # quantile of the rates: one in fifty frames may be an outlier
_STRETCHES = 20  # parts of a record that is mostly at rest, of which any may show the motion
_WHOLE = 0.9  # share of the observed frames in which all columns must be present
_BIAS = 0.3  # share of a mean's noise that the curvature of the motion within a block may contribute
_KEPT = 0.5  # share of a block's frames below which there is no mean
_NEXT = 1.5  # steps within which a frame follows another
_ORDER = 5  # of the differences that show a column's noise, in which motion is small
_PARTS = 4  # parts of a block; their means show the noise


@dataclass(frozen=True)
class Thinned:
    """Result of :func:`thinned`: block means of a measurement.

    Attributes
    ----------
    measurement : Measurement
    every : int
        Frames in each block; 1 if the record is unchanged.
    frames : int
        Frames before thinning.
    steps : dict of str to float
        Step in which each column was read, which its means no longer show; 0 if it has none.
    """

    measurement: Measurement
    every: int
    frames: int
    steps: dict[str, float]


def thinned(measurement: Measurement) -> Thinned:
    """Average blocks of frames if a long record, whose angles are continuous, loses no information by it.

    Blocks are short compared with the time in which the motion changes. The effect of the motion's curvature
    is subtracted from each mean (to the fourth order in the block's length), and blocks are short enough that
    the rest is below the noise of a mean.
    """
    n = int(measurement.seen.sum())
    many = MANY_DRIVEN if measurement.inputs else MANY
    # A frame without one of the columns counts as lost; sensors with different rates have no common blocks.
    whole = np.asarray(np.isfinite(measurement.values).all(axis=1))
    if n <= many or whole.sum() < _WHOLE * n:
        return Thinned(measurement, 1, n, {})
    t, values = measurement.t[whole], measurement.values[whole]
    step = float(np.median(np.diff(t)))
    every = int(min(_change(t, values, step) / _BLOCKS / step, -(-2 * n // many)))
    while every > 1:
        averaged = _averaged(measurement, whole, t, values, step, every)
        if averaged is not None:
            steps = {name: lattice(x) for name, x in zip(measurement.names, values.T, strict=True)}
            return Thinned(averaged, every, n, steps)
        every = int(_SHORTER * every)
    return Thinned(measurement, 1, n, {})


def _change(t: Array, values: Array, step: float) -> float:
    """Return the time in which the motion changes, s: the minimum over the columns of spread over rate.

    Rates are differences over the shortest time in which the motion far exceeds its noise. A motion that
    decays may do so in a part of the record only; one that never does restricts no block.
    """
    noises = noise_by_differences(values, _ORDER).tolist()

    def least(rows: slice) -> float:
        columns = zip(values[rows].T, noises, strict=True)
        return min(_change_of(t[rows], x, step, noise) for x, noise in columns)

    whole = least(slice(None))
    if np.isfinite(whole):
        return whole
    ends = np.linspace(0, len(t), _STRETCHES + 1).astype(int)
    return min(least(slice(*pair)) for pair in itertools.pairwise(ends))


def _change_of(t: Array, x: Array, step: float, noise: float) -> float:
    """Return the time in which one column changes, s; infinite if it never far exceeds its noise."""
    spread, lag = float(x.std()), 1
    while lag < len(x) // 4:
        moved = np.abs(x[lag:] - x[:-lag])[t[lag:] - t[:-lag] < 1.5 * lag * step]
        if len(moved) and np.quantile(moved, _FAST) > max(0.1 * spread, 10 * noise):
            return spread * lag * step / float(np.quantile(moved, _FAST))
        lag *= 2
    return float("inf")


def _averaged(
    measurement: Measurement,
    whole: NDArray[np.bool_],
    t: Array,
    values: Array,
    step: float,
    every: int,
) -> Measurement | None:
    """Average blocks of `every` complete frames; None if the motion has too much curvature in a block."""
    length = every * step
    part = np.floor((t - t[0]) / length * _PARTS + 1e-9).astype(np.int64)
    block = part // _PARTS
    good = ~odd_frames(t, values, noise_by_differences(values, _ORDER), np.diff(t) < _NEXT * step)
    number = int(block[-1]) + 1
    count = np.bincount(block[good], minlength=number)
    kept = count >= _KEPT * every
    least = np.maximum(count, 1)

    def means(column: Array) -> Array:
        result: Array = np.bincount(block[good], column[good], minlength=number) / least
        return result

    since = t - t[0] - (block + 0.5) * length  # the block's middle
    spread = means(since**2) - means(since) ** 2
    times = means(t)
    inside = np.flatnonzero(kept[:-2] & kept[1:-1] & kept[2:]) + 1
    before, after = times[inside] - times[inside - 1], times[inside + 1] - times[inside]
    columns, sigmas = [], []
    for k, x in enumerate(values.T):
        noise = _part_noise(part[good], x[good]) / np.sqrt(_PARTS)
        noise = max(noise, 1e-6 * float(np.ptp(x)))
        mean = means(x)
        curvature = np.zeros(number)
        slopes = (mean[inside + 1] - mean[inside]) / after, (mean[inside] - mean[inside - 1]) / before
        curvature[inside] = 2 * (slopes[0] - slopes[1]) / (before + after)
        # A block mean is off by half the curvature times the spread of its times, plus a small share of the
        # fourth difference.
        bends = inside[np.isin(inside - 1, inside) & np.isin(inside + 1, inside)]
        fourth = length**2 * (curvature[bends - 1] - 2 * curvature[bends] + curvature[bends + 1])
        excess = float(np.mean(fourth**2)) - 70 * noise**2 if len(bends) else 0.0
        if 0.0047 * np.sqrt(max(excess, 0.0)) > _BIAS * noise:
            return None
        # A block next to a gap has no second difference, so its mean is not corrected, and it is dropped.
        columns.append(mean - curvature * spread / 2)
        if measurement.sigma is None:
            sigmas.append(noise * np.sqrt(every / least))
        else:
            stated = means(measurement.sigma[whole, k] ** 2)
            sigmas.append(np.maximum(np.sqrt(stated / least), noise))
    rest = inside[kept[inside]]
    if not len(rest):
        return None
    # The model's time counts from the first row, which stays in place, without observations.
    rows = np.concatenate([rest[:1], rest])
    rho = measurement.rho
    if rho is not None:
        rho = np.column_stack([means(correlations) for correlations in rho[whole].T])[rows]
    meta = dict(measurement.meta)
    if is_encoder(measurement):  # means lie on no lattice, by which an encoder is recognised
        meta["sensor"] = "encoder"
    if isinstance(meta.get("fps"), (int, float)):
        meta["fps"] = meta["fps"] / every
    times = np.concatenate([measurement.t[:1], times[rest]])
    mean = np.column_stack(columns)[rows]
    mean[0] = np.nan
    # Records of a disk or a pendulum that do not state their noise have a known one.
    is_known = measurement.sigma is None and not profile_of(measurement.kind).written
    sigma = None if is_known else np.column_stack(sigmas)[rows]
    return Measurement(times, mean, sigma, rho, None, meta, measurement.names, inputs=measurement.inputs)


def _part_noise(part: NDArray[np.int64], x: Array) -> float:
    """Estimate the noise of means over parts of a block, which includes noise slower than frames."""
    count = np.bincount(part)
    mean = np.bincount(part, x)[count > 0] / count[count > 0]
    return float(noise_by_differences(mean, _ORDER))
