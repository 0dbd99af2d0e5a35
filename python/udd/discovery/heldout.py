"""Held-out errors: how far a model's free runs are from data that it was not fitted to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap

from udd import _core
from udd.fitting import Fit, Record, information_for
from udd.fitting.fit import levels

Array = NDArray[np.float64]

#: Horizons of the free runs, s; those longer than a third of the held-out part are left out.
HORIZONS = {"disk": (0.2, 0.4, 1.0, 2.0, 4.0), "pendulum": (0.5, 1.0, 4.0, 10.0, 20.0)}
_FILTER = 1.0  # s of data before each start, from which its state is filtered
_EVERY = 0.2  # s between starts
_DRAWS = 40  # of each start's state, for the noise floor
_BLOCK = 4.0  # s; starts within a block are resampled together


@dataclass(frozen=True)
class Errors:
    """Errors of free runs on held-out data.

    Attributes
    ----------
    unit : str
        ``"m"`` of the disk's centre, ``"rad"`` of a pendulum's angle.
    horizons : tuple of float
        Length of the free runs, s.
    median : ndarray (h,)
        Median error over the starts.
    low, high : ndarray (h,)
        95 % interval of the median, from a bootstrap over blocks.
    floor : ndarray (h,)
        What a model without fault would score: the noise of the data and of the filtered start alone.
    samples : ndarray (starts, h)
        The errors; NaN where the frame was not seen.
    blocks : ndarray of int (starts,)
        Starts with the same number are resampled together.
    """

    unit: str
    horizons: tuple[float, ...]
    median: Array
    low: Array
    high: Array
    floor: Array
    samples: Array
    blocks: NDArray[np.int64]

    def at(self, horizon: float) -> tuple[float, float, float, float]:
        """``(median, low, high, floor)`` at one of the horizons."""
        k = self.horizons.index(horizon)
        return float(self.median[k]), float(self.low[k]), float(self.high[k]), float(self.floor[k])

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        keys = ("median", "low", "high", "floor")
        rows = [
            {"horizon_s": h, **{key: float(getattr(self, key)[k]) for key in keys}}
            for k, h in enumerate(self.horizons)
        ]
        return {"unit": self.unit, "starts": len(self.samples), "errors": rows}


def held_out_errors(fit: Fit, record: Record, first: int, seed: int = 0) -> Errors:
    """Errors of a fitted model on the frames of `record` from `first` on.

    Each free run starts from a state that is filtered from the second of data before it; absolute time is kept.

    Parameters
    ----------
    fit : Fit
        Made without those frames.
    record : Record
        The whole measurement's frames.
    first : int
        Number of the first held-out frame.
    """
    kind = fit.measurement.kind
    windows, ends, horizons = _windows(record, first, HORIZONS[kind])
    states, covariances = _filtered(fit, record, windows)
    starts = windows[:, 1]
    times = record.t[ends]
    seen = record.seen[ends]
    there = record.observed[ends].all(axis=2)
    camera, clock = fit.point.camera, fit.point.clock
    predicted = _core.predict(fit.model, camera, clock, record.t[starts], states, times)
    samples = np.where(there, _distance(kind, predicted, seen), np.nan)

    rng = np.random.default_rng(seed)
    scale = np.linalg.cholesky(covariances + 1e-24 * np.eye(states.shape[1]))
    draws = rng.standard_normal((_DRAWS, *states.shape))
    drawn = states + np.einsum("kij,dkj->dki", scale, draws)
    runs = _core.predict(
        fit.model,
        camera,
        clock,
        np.tile(record.t[starts], _DRAWS),
        drawn.reshape(-1, states.shape[1]),
        np.tile(times, (_DRAWS, 1)),
    ).reshape(_DRAWS, *predicted.shape)
    noise = np.where(there[..., None], fit.noise.sd(record, record.states[:, 0])[ends], 0.0)
    faultless = runs + noise * rng.standard_normal(runs.shape)
    floor = np.median(np.where(there, _distance(kind, faultless, predicted), np.nan), axis=0)

    blocks = ((record.t[starts] - record.t[first]) // _BLOCK).astype(np.int64)
    low, high = np.array([_interval(blocks, samples[:, k : k + 1], rng) for k in range(len(horizons))]).T
    return Errors(
        unit="m" if kind == "disk" else "rad",
        horizons=horizons,
        median=np.nanmedian(samples, axis=0),
        low=low,
        high=high,
        floor=np.nanmedian(floor, axis=0),
        samples=samples,
        blocks=blocks,
    )


def improvement(before: Errors, after: Errors, horizon: float, seed: int = 0) -> tuple[float, float, float]:
    """The ratio of the median errors, after over before, with its 95 % interval from paired blocks."""
    k = before.horizons.index(horizon)
    both = np.column_stack([after.samples[:, k], before.samples[:, k]])
    low, high = _interval(before.blocks, both, np.random.default_rng(seed))
    return float(_statistic(both)), low, high


def _windows(
    record: Record, first: int, wanted: tuple[float, ...]
) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[float, ...]]:
    """Windows of frames to filter, the frames where their free runs are compared, and the horizons."""
    t = record.t
    step = float(np.median(np.diff(t)))
    horizons = tuple(h for h in wanted if h <= (t[-1] - t[first]) / 3 and h >= step)
    back, every = max(round(_FILTER / step), 6), max(round(_EVERY / step), 1)
    ahead = np.array([round(h / step) for h in horizons], dtype=np.int64)
    run = np.concatenate([[0], np.cumsum(~record.linked)])
    windows, ends = [], []
    for start in range(first + back, len(t) - int(ahead[-1]), every):
        if run[start - back] == run[start + ahead[-1]]:
            windows.append((start - back, start))
            ends.append(start + ahead)
    return np.array(windows, dtype=np.int64), np.array(ends, dtype=np.int64), horizons


def _filtered(fit: Fit, record: Record, windows: NDArray[np.int64]) -> tuple[Array, Array]:
    """States at the windows' ends."""
    kind = fit.measurement.kind
    data = (record.t, record.seen, information_for(fit, record), record.linked)
    start = (record.states, fit.point.camera, fit.point.clock)
    middle = list(levels(kind)[1])
    states, covariances = _core.filter(fit.model, data, start, middle, [(int(a), int(b)) for a, b in windows])
    return states, covariances


def _distance(kind: str, a: Array, b: Array) -> Array:
    """Distance of the disk's centres, or of a pendulum's angles."""
    difference = a - b
    result: Array
    if kind == "disk":
        result = np.hypot(difference[..., 0], difference[..., 1])
    else:
        result = np.abs((difference[..., 0] + np.pi) % (2 * np.pi) - np.pi)
    return result


def _statistic(columns: Array) -> float:
    """The median of one column, or the ratio of two columns' medians."""
    medians = np.nanmedian(columns, axis=0)
    return float(medians[0]) if len(medians) == 1 else float(medians[0] / medians[1])


def _interval(blocks: NDArray[np.int64], columns: Array, rng: np.random.Generator) -> tuple[float, float]:
    """95 % interval of the statistic over resampled blocks."""
    groups = [columns[blocks == b] for b in np.unique(blocks)]
    if len(groups) < 3:
        return float("nan"), float("nan")

    def statistic(chosen: NDArray[np.int64]) -> float:
        return _statistic(np.concatenate([groups[i] for i in chosen]))

    interval = bootstrap(
        (np.arange(len(groups)),),
        statistic,
        vectorized=False,
        n_resamples=999,
        method="percentile",
        rng=rng,
    ).confidence_interval
    return float(interval.low), float(interval.high)
