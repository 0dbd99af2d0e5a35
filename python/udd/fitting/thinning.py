"""Block averages (decimation) of a record sampled more often than motion and noise need."""

from __future__ import annotations

import itertools
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.measurement import Measurement
from udd.measurement.unwrapping import unwrapped
from udd.models import profile_of

from .input_noise import noise_by_differences
from .record import odd_frames
from .sensor import is_encoder, lattice

Array = NDArray[np.float64]

#: Frames above which a record is thinned: about half as many are left then.
MANY = 8000
#: The same where inputs were measured: a run over their samples takes a step for each.
MANY_DRIVEN = 2000
#: Blocks in the time in which the motion changes (its spread over its fast rates), at least.
_BLOCKS = 2
_SHORTER = 0.8  # times the block, tried next where the motion bends too much within it
_FAST = 0.9  # quantile of the rates: of frames one in fifty may be odd
_STRETCHES = 20  # of a record that is mostly at rest, each of which may show the motion
_WHOLE = 0.9  # of the frames seen, of which every column must be
_BIAS = 0.3  # of a mean's noise that the bends of the motion within a block may move it by
_FULL = 0.8  # of a block's frames, from which on its mean is corrected; below half of them there is none
_NEXT = 1.5  # steps within which a frame follows another
_PARTS = 4  # of a block, whose means show the noise


@dataclass(frozen=True)
class Thinned:
    """A measurement, block by block.

    Attributes
    ----------
    measurement : Measurement
    every : int
        How many frames each block holds; 1 where the record is as it was.
    frames : int
        How many there were.
    steps : dict of str to float
        The step that each column was read in, which its means no longer show; 0 where there is none.
    """

    measurement: Measurement
    every: int
    frames: int
    steps: dict[str, float]


def thinned(measurement: Measurement, angles: Collection[str] = ()) -> Thinned:
    """Block averages where a record of many frames loses nothing by it.

    Blocks are short beside the time in which the motion changes. What the motion bends within a block is
    taken out of its mean (to the fourth order in the block's length), and blocks are so short that what is
    left stays below the noise of a mean.

    Parameters
    ----------
    measurement : Measurement
    angles : collection of str
        Columns that are angles, in addition to those of a disk or a pendulum.
    """
    measurement = unwrapped(measurement, angles)
    n = int(measurement.seen.sum())
    many = MANY_DRIVEN if measurement.inputs else MANY
    # A frame with a lost column counts as lost; sensors with rates of their own have no blocks in common.
    whole = np.asarray(np.isfinite(measurement.values).all(axis=1))
    if n <= many or whole.sum() < _WHOLE * n:
        return Thinned(measurement, 1, n, {})
    t, values = measurement.t[whole], measurement.values[whole]
    step = float(np.median(np.diff(t)))
    every = int(min(_change(t, values, step) / _BLOCKS / step, -(-2 * n // many)))
    while every > 1:
        found = _averaged(measurement, whole, t, values, step, every)
        if found is not None:
            steps = {name: lattice(x) for name, x in zip(measurement.names, values.T, strict=True)}
            return Thinned(found, every, n, steps)
        every = int(_SHORTER * every)
    return Thinned(measurement, 1, n, {})


def _change(t: Array, values: Array, step: float) -> float:
    """How long the motion takes to change, s: the least over the columns of spread over rate.

    Rates are differences over the shortest time in which the motion goes far beyond its noise. A motion that
    dies down may do so within a stretch of the record alone; one that never does restricts no block.
    """
    noises = [_noise(x) for x in values.T]

    def least(rows: slice) -> float:
        columns = zip(values[rows].T, noises, strict=True)
        return min(_change_of(t[rows], x, step, noise) for x, noise in columns)

    whole = least(slice(None))
    if np.isfinite(whole):
        return whole
    ends = np.linspace(0, len(t), _STRETCHES + 1).astype(int)
    return min(least(slice(*pair)) for pair in itertools.pairwise(ends))


def _change_of(t: Array, x: Array, step: float, noise: float) -> float:
    """How long one column takes to change, s; infinite if it never goes far beyond its noise."""
    spread, lag = float(x.std()), 1
    while lag < len(x) // 4:
        moved = np.abs(x[lag:] - x[:-lag])[t[lag:] - t[:-lag] < 1.5 * lag * step]
        if len(moved) and np.quantile(moved, _FAST) > max(0.1 * spread, 10 * noise):
            return spread * lag * step / float(np.quantile(moved, _FAST))
        lag *= 2
    return float("inf")


def _noise(x: Array) -> float:
    """Standard deviation of a column's noise, from fifth differences: those of a motion are small."""
    return noise_by_differences(x, 5)


def _averaged(
    measurement: Measurement,
    whole: NDArray[np.bool_],
    t: Array,
    values: Array,
    step: float,
    every: int,
) -> Measurement | None:
    """Average blocks of so many of the whole frames; None if blocks are too long for how the motion bends."""
    length = every * step
    part = np.floor((t - t[0]) / length * _PARTS + 1e-9).astype(np.int64)
    block = part // _PARTS
    good = ~odd_frames(values, np.array([_noise(x) for x in values.T]), np.diff(t) < _NEXT * step)
    number = int(block[-1]) + 1
    count = np.bincount(block[good], minlength=number)
    kept, full = count >= every / 2, count >= _FULL * every
    least = np.maximum(count, 1)

    def means(column: Array) -> Array:
        result: Array = np.bincount(block[good], column[good], minlength=number) / least
        return result

    times = means(t)
    inside = np.flatnonzero(full[:-2] & full[1:-1] & full[2:]) + 1
    columns, sigmas = [], []
    for k, x in enumerate(values.T):
        noise = _part_noise(part[good], x[good]) / np.sqrt(_PARTS)
        noise = max(noise, 1e-6 * float(np.ptp(x)))
        mean = means(x)
        bend = np.zeros(number)
        bend[inside] = mean[inside - 1] - 2 * mean[inside] + mean[inside + 1]
        # A mean over a block is off by a 24th of the second difference, and then by little of the fourth.
        bends = inside[np.isin(inside - 1, inside) & np.isin(inside + 1, inside)]
        fourth = bend[bends - 1] - 2 * bend[bends] + bend[bends + 1]
        left = 0.0047 * np.sqrt(max(float(np.mean(fourth**2)) - 70 * noise**2, 0.0)) if len(bends) else 0.0
        if left > _BIAS * noise:
            return None
        # A block beside a gap has no second difference: it stands where its bend would not show.
        columns.append(mean - bend / 24)
        if measurement.sigma is None:
            sigmas.append(np.full(number, noise))
        else:
            stated = means(measurement.sigma[whole, k] ** 2)
            sigmas.append(np.maximum(np.sqrt(stated / least), noise))
    bent = np.zeros(number, dtype=bool)
    bent[inside] = True
    kept &= bent
    # The model's time counts from the first row, which stays where it was, with nothing seen in it.
    rest = np.flatnonzero(kept)
    if not len(rest):
        return None
    rows = np.concatenate([rest[:1], rest])
    rho = measurement.rho
    if rho is not None:
        rho = np.column_stack([means(own) for own in rho[whole].T])[rows]
    meta = dict(measurement.meta)
    if is_encoder(measurement):  # means lie on no lattice, by which it would be told
        meta["sensor"] = "encoder"
    if isinstance(meta.get("fps"), (int, float)):
        meta["fps"] = meta["fps"] / every
    times = np.concatenate([measurement.t[:1], times[rest]])
    mean = np.column_stack(columns)[rows]
    mean[0] = np.nan
    # What a disk's or a pendulum's record does not state is known of such records.
    sigma = np.column_stack(sigmas)[rows]
    return Measurement(
        times,
        mean,
        None if measurement.sigma is None and not profile_of(measurement.kind).written else sigma,
        rho,
        None,
        meta,
        measurement.names,
        inputs=measurement.inputs,
    )


def _part_noise(part: NDArray[np.int64], x: Array) -> float:
    """The noise of means over parts of a block: what is slower than frames is in it too."""
    number = int(part[-1]) + 1
    count = np.bincount(part, minlength=number)
    mean = np.bincount(part, x, minlength=number)[count > 0] / count[count > 0]
    return _noise(mean)
