"""Held-out errors: the distance of a model's free runs from data that it was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.angles import wrapped
from udd.errors import FitError
from udd.fitting import UNEXPLAINED, Fit, Record, filtered, predicted
from udd.fitting.sensor import reads
from udd.models.formula_model import FormulaModel

Array = NDArray[np.float64]
#: A ratio and its 95 % interval.
Ratio = tuple[float, float, float]

_AT_ONCE = 4_000_000  # numbers in memory at a time for resampled blocks
_EVERY = 0.2  # s between starts
_BLOCK = 4.0  # s; starts within a block are resampled together
_FEWEST, _SHORT = 3, 6  # minimum of blocks for an interval, and blocks of a short record
_INTEGRATED = 1e-6  # numerical error of free runs, as a share of a state's spread
_FLOOR = 1.5  # ratio to the noise floor up to which an error counts as noise
_LOST = 0.7  # share of the motion's size beyond which a free run has lost the motion
_BLOWN_UP = 1e6  # error of a free run after its solution diverges
_COST_BLOCK = 2.0  # s; the same for the costs of frames, which do not overlap


@dataclass(frozen=True)
class Errors:
    """Errors of free runs on held-out data.

    Attributes
    ----------
    unit : str
        ``"m"`` for the disk's centre, ``"rad"`` for a pendulum's angle, ``"spread"`` for a user's own model:
        the root mean square over the observed states, each in units of its standard deviation.
    horizons : tuple of float
        Length of the free runs, s.
    median : ndarray (h,)
        Median error over the starts.
    low, high : ndarray (h,)
        95 % interval of the median, from a bootstrap over blocks.
    floor : ndarray (h,)
        Error of a perfect model: the noise of the data and of the filtered start alone.
    samples : ndarray (starts, h)
        The errors; NaN if the frame was not observed.
    blocks : ndarray of int (starts,)
        Starts with the same number are resampled together.
    run : ndarray (n,)
        Error of one free run over all held-out frames, from the fit's last frame before them; NaN if a frame
        was not observed.
    run_blocks : ndarray of int (n,)
        Frames with the same number are resampled together.
    """

    unit: str
    horizons: tuple[float, ...]
    median: Array
    low: Array
    high: Array
    floor: Array
    samples: Array
    blocks: NDArray[np.int64]
    run: Array
    run_blocks: NDArray[np.int64]

    def __repr__(self) -> str:
        """Describe the median errors at the horizons on one line."""
        unit = "spreads" if self.unit == "spread" else self.unit
        each = ", ".join(
            f"{e:.3g} {unit} at {h:.3g} s" for h, e in zip(self.horizons, self.median, strict=True)
        )
        return f"<Errors of {len(self.samples)} free runs: median {each or 'none'}>"

    @property
    def horizon(self) -> float | None:
        """Horizon at which models are compared, s: for the disk 1 s, or the longest below.

        For a user's own model it is the third horizon. For a pendulum it is None, the whole run.
        """
        if self.unit == "rad":
            return None
        if self.unit == "spread":
            return self.horizons[:3][-1]
        return max((h for h in self.horizons if h <= 1.0), default=self.horizons[0])

    @property
    def whole(self) -> float:
        """Root mean square error of the free run over all held-out frames."""
        return float(_rms(self.run))

    def at(self, horizon: float) -> tuple[float, float, float, float]:
        """Return ``(median, low, high, floor)`` at one of the horizons."""
        k = self.horizons.index(horizon)
        return float(self.median[k]), float(self.low[k]), float(self.high[k]), float(self.floor[k])

    def to_dict(self) -> dict[str, Any]:
        """Return the errors as JSON-ready values."""
        keys = ("median", "low", "high", "floor")
        rows = [
            {"horizon_s": h, **{key: float(getattr(self, key)[k]) for key in keys}}
            for k, h in enumerate(self.horizons)
        ]
        return {"unit": self.unit, "starts": len(self.samples), "errors": rows, "whole_run_rms": self.whole}


def held_out_errors(fit: Fit, record: Record, held_out: NDArray[np.bool_], unit: float = 1.0) -> Errors:
    """Compute the errors of a fitted model on the held-out frames of `record`.

    They are the last or the first ones of each measurement, or all of some. Each free run starts from a state
    that is filtered from the second of data before it; time stays absolute, in units of the motion's time
    scale.
    """
    profile = fit.model.profile
    wanted = tuple(h * unit for h in profile.discovery.horizons)
    window = profile.discovery.filter_window * unit
    windows, ends, horizons = _windows(record, held_out, wanted, window, _EVERY * unit)
    firsts, states = _filtered(fit, record, windows)
    starts = windows[:, 1]
    times = record.t[ends]
    predictions = predicted(fit.models, fit.point.sets, record.film[starts], record.t[starts], states, times)
    samples = _distance(fit, record, ends, predictions, _observed(record, ends))
    floor = _floor(fit, record, windows, ends, firsts)
    rng = np.random.default_rng(0)
    blocks = _blocks(record, starts, _BLOCK * unit)
    low, high = np.array([_interval(blocks, column[:, None], _median, rng) for column in samples.T]).T
    return Errors(
        unit=profile.sensor.error_unit,
        horizons=horizons,
        median=np.nanmedian(samples, axis=0),
        low=low,
        high=high,
        floor=floor,
        samples=samples,
        blocks=blocks,
        run=_run(fit, record, held_out, window),
        run_blocks=_blocks(record, np.flatnonzero(held_out), _BLOCK * unit),
    )


def block_numbers(record: Record, length: float) -> NDArray[np.int64]:
    """Return the number of the block of `length` s of each frame, separate for each measurement."""
    block = ((record.t - record.t.min()) // length).astype(np.int64)
    result: NDArray[np.int64] = block + record.film * (int(block.max()) + 1)
    return result


def _blocks(record: Record, frames: NDArray[np.int64], length: float) -> NDArray[np.int64]:
    """Return the blocks to resample for frames; shorter ones if there would be too few."""
    result = block_numbers(record, length)[frames]
    if len(np.unique(result)) >= _FEWEST:
        return result
    films = record.film[frames]
    span = max(float(np.ptp(record.t[frames[films == film]])) for film in np.unique(films))
    return block_numbers(record, span / _SHORT)[frames] if span > 0 else result


def _held_out_of(record: Record, held_out: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Return the held-out frames of each measurement that has some."""
    frames = (np.flatnonzero(held_out & (record.film == film)) for film in range(len(record.origins)))
    return [frames_of_film for frames_of_film in frames if len(frames_of_film)]


def improvement(before: Errors, after: Errors, horizon: float | None) -> Ratio:
    """Compute the ratio of the errors, after over before, with its 95 % interval.

    They are the median errors at a horizon; without one, those of the run over all held-out frames.
    """
    if horizon is None:
        return _ratio(before.run_blocks, np.column_stack([after.run, before.run]), _rms)
    k = before.horizons.index(horizon)
    return _ratio(before.blocks, np.column_stack([after.samples[:, k], before.samples[:, k]]), _median)


def cost_improvement(before: Array, after: Array, record: Record, unit: float) -> Ratio:
    """Compute the ratio of two fits' costs on a held-out record, with its 95 % interval from paired blocks.

    The costs are those of :attr:`udd.Fit.frame_costs`. They distinguish two models even if their
    forecasts are equally good.
    """
    costs = np.column_stack([after, before])
    return _ratio(block_numbers(record, _COST_BLOCK * unit), costs, _sum)


def confirmed(before: Errors, ratio: Ratio) -> bool:
    """Return True if free runs on held-out data confirm a claim: the interval of the error ratio is below 1.

    If the known model's runs are already at the noise floor, they cannot show a small effect, and only must
    not contradict it; for a pendulum the effect accumulates over the whole run. Without an interval nothing
    is confirmed.
    """
    _value, low, high = ratio
    if not np.isfinite(high) or low > 1.0:
        return False
    return high < 1.0 or (before.horizon is not None and reaches_noise_floor(before))


def reaches_noise_floor(errors: Errors) -> bool:
    """Return True if errors are within a factor 1.5 of the noise floor, or of the integration error."""
    horizon = errors.horizons[-1] if errors.horizon is None else errors.horizon
    median, low, _high, floor = errors.at(horizon)
    least = _INTEGRATED if errors.unit == "spread" else 0.0
    return bool((low if np.isfinite(low) else median) <= max(_FLOOR * floor, least))


def lacks_more(fit: Fit, errors: Errors) -> bool:
    """Return True if something is missing in addition to the added effects.

    The residuals exceed the noise. Or, for a user's own model, whose terms together may imitate a missing
    one, the innovations are not white and free runs are above the noise floor.
    """
    if fit.scatter > UNEXPLAINED:
        return True
    written = fit.model.profile.written
    return written and not reaches_noise_floor(errors) and fit.doubts.missing


def misses_the_motion(errors: Errors, record: Record, held_out: NDArray[np.bool_]) -> bool:
    """Return True if free runs miss by the size of the motion, and noise does not explain that.

    For a pendulum this refers to the whole held-out part, else to the horizon of comparison.
    """
    if errors.horizon is None:
        error, floor = errors.whole, float(errors.floor[-1])
    else:
        error, _low, _high, floor = errors.at(errors.horizon)
    size = 1.0
    if errors.unit != "spread":
        complete = held_out & record.observed.all(axis=1)
        places = record.seen[complete][:, : 2 if errors.unit == "m" else 1]
        size = float(np.sqrt(places.var(axis=0).sum()))
    # If all runs of a model diverge, it has no simulated data and no floor.
    return bool(error > _LOST * size and not floor >= 0.5 * _LOST * size)


def _ratio(blocks: NDArray[np.int64], columns: Array, measure: Callable[[Array], Array]) -> Ratio:
    def ratio(first: Array, second: Array) -> Array:
        return measure(first) / measure(second)

    return (float(ratio(*columns.T)), *_interval(blocks, columns, ratio, np.random.default_rng(0)))


def _windows(
    record: Record,
    held_out: NDArray[np.bool_],
    wanted: tuple[float, ...],
    window: float,
    often: float = _EVERY,
) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[float, ...]]:
    """Return windows of frames to filter, the frames at which their free runs are compared, and horizons."""
    spans = _held_out_of(record, held_out)
    longest = max(float(np.ptp(record.t[frames])) for frames in spans)
    step = float(np.median(np.diff(record.t)))
    horizons = tuple(h for h in wanted if h <= longest / 3 and h >= step)
    if not horizons:
        raise FitError(f"the held-out {longest:.2g} s are too short for a forecast; record for longer")
    windows, ends = [], []
    run = np.concatenate([[0], np.cumsum(~record.linked)])
    for frames in spans:
        # Every measurement has a different frame rate.
        step = float(np.median(np.diff(record.t[frames])))
        back, every = max(round(window / step), 6), max(round(often / step), 1)
        ahead = np.array([round(h / step) for h in horizons], dtype=np.int64)
        for start in range(int(frames[0]) + back, int(frames[-1]) + 1 - int(ahead[-1]), every):
            if run[start - back] == run[start + ahead[-1]]:
                windows.append((start - back, start))
                ends.append(start + ahead)
    if not windows:
        raise FitError(
            f"the held-out {longest:.2g} s have no {window + horizons[-1]:.2g} s without a gap, which a "
            "forecast needs; record for longer"
        )
    return np.array(windows, dtype=np.int64), np.array(ends, dtype=np.int64), horizons


def _filtered(fit: Fit, record: Record, windows: NDArray[np.int64]) -> tuple[Array, Array]:
    """Filter states at the windows' first and last frames; return the states as read if that fails."""
    diffusion = fit.problem.schedule[fit.model.profile.discovery.filter_level]
    try:
        first, last, _covariance = filtered(fit, record, windows, diffusion)
        return first, last
    except FitError:
        if len(windows) == 1:
            start, end = windows[0]
            return record.states[[start]], record.states[[end]]
    each = [_filtered(fit, record, window[np.newaxis]) for window in windows]
    return np.concatenate([first for first, _last in each]), np.concatenate([last for _first, last in each])


def _settled(record: Record, frames: NDArray[np.int64], window: float) -> int:
    """Return the frame of a measurement up to which its first state is filtered."""
    ahead = np.searchsorted(record.t[frames], record.t[frames[0]] + window)
    return int(frames[min(max(int(ahead), 6), len(frames) - 2)])


def _run(fit: Fit, record: Record, held_out: NDArray[np.bool_], window: float) -> Array:
    """Compute errors of free runs over the held-out frames of each measurement, frame by frame.

    A run starts at the last fitted frame before these. Without one it starts from the state that the first
    held-out frames show.
    """
    errors = np.full(len(record.t), np.nan)
    for frames in _held_out_of(record, held_out):
        film = record.film[frames[:1]]
        earlier = (fit.record.film == film) & (fit.record.t < record.t[frames[0]])
        start, at = fit.states[earlier][-1:], frames[0] - 1
        if not len(start):
            at = _settled(record, frames, window)
            _first, start = _filtered(fit, record, np.array([[frames[0], at]]))
            frames = frames[frames > at]
        times = record.t[frames][None, :]
        prediction = predicted(fit.models, fit.point.sets, film, record.t[[at]], start, times)[0]
        errors[frames] = _distance(fit, record, frames, prediction, _observed(record, frames))
    result: Array = errors[held_out]
    return result


def _floor(
    fit: Fit, record: Record, windows: NDArray[np.int64], ends: NDArray[np.int64], first: Array
) -> Array:
    """Compute median errors of the same free runs on simulated data with the estimated noise.

    ``first`` has the states at the windows' first frames, at which the simulated runs start.
    """
    rng = np.random.default_rng(0)
    # All windows have the length of the shortest, because frame rates may differ.
    length = int((windows[:, 1] - windows[:, 0]).min()) + 1
    begins = windows[:, 1] - length + 1
    first = np.where((begins == windows[:, 0])[:, None], first, record.states[begins])
    film = record.film[windows[:, 1]]
    frames = np.hstack([begins[:, None] + np.arange(length), ends])
    made = predicted(fit.models, fit.point.sets, film, record.t[begins], first, record.t[frames])
    whole = np.isfinite(made).all(axis=(1, 2))
    if not whole.any():
        return np.full(ends.shape[1], np.nan)
    n, windows, ends, film = int(whole.sum()), windows[whole], ends[whole], film[whole]
    frames, made = frames[whole], made[whole]
    # In a search the noise stays that of the first model's misfits; if less remains, it is smaller.
    sd = fit.noise.sd(record, record.states[:, 0]) * math.sqrt(min(fit.scatter, 1.0))
    sd = np.minimum(sd, _shown(fit, record))[frames]
    made = made + np.where(np.isfinite(sd), sd, 0.0) * rng.standard_normal(made.shape)

    # Windows overlap: each gets separate frames, not linked to the others.
    inside = frames[:, :length].ravel()
    simulated = replace(
        record.part(inside),
        seen=made[:, :length].reshape(n * length, -1),
        linked=np.tile(np.arange(length) < length - 1, n)[:-1],
    )
    starts = length * np.arange(n)
    _first, last = _filtered(fit, simulated, np.column_stack([starts, starts + length - 1]))
    runs = predicted(fit.models, fit.point.sets, film, record.t[windows[:, 1]], last, record.t[ends])
    result: Array = np.nanmedian(_distance(fit, record, ends, runs, made[:, length:]), axis=0)
    return result


def _shown(fit: Fit, record: Record) -> Array | float:
    """Estimate the noise of a record's frames, (n, m), because a search may assume more.

    For a film of marks a search uses the frames' own noise.
    """
    if fit.model.profile.sensor.sees_marks:
        return np.inf
    result = np.full(record.seen.shape, np.inf)
    for film in range(len(record.origins)):
        in_film = record.film == film
        for channel, there in enumerate(record.observed.T):
            if (in_film & there).any():
                result[in_film, channel] = reads(record.seen[in_film & there, channel])[0]
    return result


def _observed(record: Record, frames: NDArray[np.int64]) -> Array:
    """Return the observations of frames; NaN if not observed."""
    result: Array = np.where(record.observed[frames], record.seen[frames], np.nan)
    return result


def _distance(fit: Fit, record: Record, frames: NDArray[np.int64], run: Array, seen: Array) -> Array:
    """Compute the distance of disk centres, of pendulum angles, or of states in units of their spread.

    After a run diverged the distance is large. It is NaN in frames without all sensors; for a user's model
    one sensor is enough.
    """
    difference, sensor = run - seen, fit.model.profile.sensor
    used = np.flatnonzero(record.observed.any(axis=0))
    if sensor.compared:
        if sensor.error_unit == "rad":
            difference = wrapped(difference)
        distance = np.abs(reduce(np.hypot, np.moveaxis(difference[..., : sensor.compared], -1, 0)))
    else:
        squares = []
        for k in used:
            spread = float(record.seen[record.observed[:, k], k].std()) or 1.0
            angle = isinstance(fit.model, FormulaModel) and fit.channels[k] in fit.model.turning
            error = wrapped(difference[..., k]) if angle else difference[..., k]
            squares.append((error / (min(spread, 1.0) if angle else spread)) ** 2)
        count = np.count_nonzero(np.isfinite(squares), axis=0)
        distance = np.sqrt(np.nansum(squares, axis=0) / np.where(count, count, np.nan))
    observed = record.observed[frames][..., used]
    comparable = observed.any(axis=-1) if fit.model.profile.written else observed.all(axis=-1)
    result: Array = np.where(comparable, np.where(np.isnan(run).any(axis=-1), _BLOWN_UP, distance), np.nan)
    return result


def _median(rows: Array) -> Array:
    """Compute the median along the last axis without NaN; faster than `nanmedian` for thousands of rows."""
    ordered = np.sort(rows, axis=-1)  # NaN comes last
    count = np.count_nonzero(~np.isnan(rows), axis=-1)[..., None]
    lower, upper = (np.take_along_axis(ordered, at, axis=-1) for at in ((count - 1) // 2, count // 2))
    result: Array = (lower + upper)[..., 0] / 2
    return result


def _sum(rows: Array) -> Array:
    result: Array = np.nansum(rows, axis=-1)
    return result


def _rms(rows: Array) -> Array:
    result: Array = np.sqrt(np.nanmean(rows**2, axis=-1))
    return result


def _interval(
    blocks: NDArray[np.int64], columns: Array, measure: Callable[..., Array], rng: np.random.Generator
) -> tuple[float, float]:
    """Compute the 95 % interval of a statistic of columns (n, c), over resampled blocks."""
    observed = np.isfinite(columns).any(axis=1)
    blocks, columns = blocks[observed], columns[observed]
    numbers, counts = np.unique(blocks, return_counts=True)
    if len(numbers) < _FEWEST:
        return float("nan"), float("nan")

    from scipy.stats import bootstrap  # half a second to import

    # Blocks of one length, for many resamplings at once; missing frames count as not observed.
    groups = np.full((columns.shape[1], len(numbers), counts.max()), np.nan)
    for k, (number, count) in enumerate(zip(numbers, counts, strict=True)):
        groups[:, k, :count] = columns[blocks == number].T

    def statistic(chosen: NDArray[np.int64], axis: int) -> Array:  # of resamplings along the last axis
        return measure(*(group[chosen].reshape(*chosen.shape[:-1], -1) for group in groups))

    interval = bootstrap(
        (np.arange(len(numbers)),),
        statistic,
        vectorized=True,
        n_resamples=999,
        batch=max(_AT_ONCE // groups.size, 1),
        method="percentile",
        rng=rng,
    ).confidence_interval
    return float(interval.low), float(interval.high)
