"""Measurements prepared for the estimator: consecutive frames, their links, and a guess of the states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.one_line import OneLine
from udd.errors import FitError
from udd.measurement import Measurement
from udd.measurement.unwrapping import unwrapped
from udd.models import Model, profile_of
from udd.models.formula_model import FormulaModel

from .continuous import angles_of
from .formula_models import checked_start, driven, guessed, slope
from .outliers import akima, interpolated, odd_frames
from .sensor import (
    NO_NOISE,
    few_readings,
    frame_noise,
    is_encoder,
    lattice,
    moving,
    noise_by_size,
    stated_noise,
)

Array = NDArray[np.float64]

_FEWEST = 10  # Frames of a fit.
_FEWEST_OF_SEVERAL = 4  # The same of each of several records. Start states use up fewer.
_SHORT = 30  # A record with fewer frames hardly shows its noise.
_OF_FRAMES = ("t", "seen", "sigma", "rho", "states", "odd", "row", "film")  # arrays with a row for each frame


@dataclass(frozen=True, repr=False)
class Record(OneLine):
    """Frames for the estimator, of one measurement or of several in sequence.

    Attributes
    ----------
    t : ndarray (n,)
        Time of each frame since its measurement's first row, s. Frames missing in short gaps are inserted, so
        that no flow runs for long.
    seen : ndarray (n, m)
        Observations. They are 0 if not observed.
    sigma : ndarray (n, m)
        Standard deviation that the measurement states. It is infinite if a channel was not observed.
    rho : ndarray (n, m, m)
        Correlation of the channels' errors.
    linked : ndarray of bool (n - 1,)
        True if frame i + 1 continues the motion of frame i.
    states : ndarray (n, d)
        A first guess of the states.
    odd : ndarray of bool (n,)
        True for outliers, see :func:`.outliers.odd_frames`. A fit starts without them.
    row : ndarray of int (n,)
        Row of the frame in the measurement. It is -1 if the frame was inserted.
    film : ndarray of int (n,)
        The number of the measurement that a frame belongs to.
    origins : tuple of float
        Time of each measurement's first row, s, which is the zero of the model's time: a drift's drive and a
        ripple's phase refer to the record's start.
    """

    t: Array
    seen: Array
    sigma: Array
    rho: Array
    linked: NDArray[np.bool_]
    states: Array
    odd: NDArray[np.bool_]
    row: NDArray[np.int64]
    film: NDArray[np.int64]
    origins: tuple[float, ...]

    def part(self, frames: slice | NDArray[Any]) -> Record:
        """Select frames by a slice, a mask or increasing numbers; only consecutive ones stay linked."""
        chosen = np.arange(len(self.t))[frames]
        of_frames = {name: getattr(self, name)[chosen] for name in _OF_FRAMES}
        return replace(self, linked=self.linked[chosen[:-1]] & (np.diff(chosen) == 1), **of_frames)

    @property
    def origin(self) -> float:
        """Time of the first measurement's first row, s."""
        return self.origins[0]

    @property
    def clock(self) -> Array:
        """Every frame's time on its measurement's clock, s."""
        result: Array = self.t + np.array(self.origins)[self.film]
        return result

    def first(self, share: float) -> NDArray[np.bool_]:
        """Mark the frames in the first part of their measurement, by count."""
        result = np.zeros(len(self.t), dtype=bool)
        for film in range(len(self.origins)):
            frames = np.flatnonzero(self.film == film)
            result[frames[: int(share * len(frames))]] = True
        return result

    @cached_property
    def observed(self) -> NDArray[np.bool_]:
        """True for each channel that was observed in a frame, (n, m)."""
        return np.isfinite(self.sigma)

    @cached_property
    def unmixing(self) -> Array:
        """Inverses of the channels' correlations, (n, m, m)."""
        inverse: Array = np.asarray(np.linalg.inv(self.rho), dtype=np.float64)
        return inverse


def record_of(
    measurement: Measurement | Sequence[Measurement],
    model: Model | Sequence[Model] | None = None,
    state0: Mapping[str, float] | Sequence[Mapping[str, float]] | None = None,
) -> Record:
    """Prepare a measurement for the estimator, or several in sequence.

    The channels are the measurement's columns. For a user's own model they are the model's sensors or states,
    of which the measurement may have only some; `state0` holds start values of the others, for all
    measurements or in one table each.

    Raises
    ------
    FitError
        It is not a measurement, or has too few observed frames.
    """
    several = not isinstance(measurement, Measurement)
    measurements: Sequence[Any] = measurement if isinstance(measurement, (list, tuple)) else [measurement]
    for part in measurements or [measurement]:
        if not isinstance(part, Measurement):
            raise FitError(f"a measurement is needed (udd.track or udd.read_measurement), not {part!r:.80}")
    count = len(measurements)
    models = model if isinstance(model, Sequence) else [model] * count
    starts = state0 if several and isinstance(state0, Sequence) else [state0] * count
    for given, what, expected in ((starts, "starts", "one each"), (models, "models", "one, or one each")):
        if len(given) != count:
            number = "one measurement" if count == 1 else f"{count} measurements"
            raise FitError(f"got {number} but {len(given)} {what}; expected {expected}")
    alone = count == 1
    records = [_record_of(*arguments, alone) for arguments in zip(measurements, models, starts, strict=True)]
    result = _joined(_together(measurements, records))
    if (result.sigma <= NO_NOISE).any():
        frame, channel = np.argwhere(result.sigma <= NO_NOISE)[0]
        name = (models[0].channels if isinstance(models[0], FormulaModel) else measurements[0].names)[channel]
        where = "" if alone else f" of measurement {result.film[frame]}"
        raise FitError(
            f"{name} has a single value in all rows{where}, which does not show its noise: "
            f"leave it out, or state the noise"
        )
    return result


def _together(measurements: Sequence[Measurement], records: Sequence[Record]) -> list[Record]:
    """Check records that are fitted together, and let short ones share their noise.

    Only together must they have enough frames and show motion. Noise that is not stated is assumed to be the
    same in all short records, because a few frames show it only roughly.
    """
    count = sum(int(record.observed.any(axis=1).sum()) for record in records)
    if count < _FEWEST:
        raise FitError(f"the measurements hold {count} usable frames; a fit needs at least {_FEWEST}")
    if not any(_changes(record) for record in records):
        names = ", ".join(measurements[0].names)
        raise FitError(f"{names}: all values are constant, so nothing can be fitted")
    short = [
        k
        for k, (measurement, record) in enumerate(zip(measurements, records, strict=True))
        if measurement.sigma is None and len(record.t) < _SHORT
    ]
    if len(short) < 2 or len({record.seen.shape[1] for record in records}) > 1:
        return list(records)
    shown = np.array([[_median(records[k], c) for c in range(records[0].seen.shape[1])] for k in short])
    typical = np.sqrt((shown**2).sum(axis=0) / np.maximum((shown > NO_NOISE).sum(axis=0), 1))
    return [
        replace(record, sigma=np.where(record.observed & (typical > 0.0), typical, record.sigma))
        if k in short
        else record
        for k, record in enumerate(records)
    ]


def _median(record: Record, channel: int) -> float:
    """Return the typical noise of a channel; 0 if it was not observed."""
    noise = record.sigma[record.observed[:, channel], channel]
    return float(np.median(noise)) if len(noise) else 0.0


def _changes(record: Record) -> bool:
    """Return True if any channel changes."""
    high = np.where(record.observed, record.seen, -np.inf).max(axis=0)
    low = np.where(record.observed, record.seen, np.inf).min(axis=0)
    return bool((high > low).any())


def _record_of(measurement: Measurement, model: Any, state0: Any, alone: bool) -> Record:
    """Prepare one measurement as :func:`record_of` does, to be fitted alone or together with others."""
    fewest = _FEWEST if alone else _FEWEST_OF_SEVERAL
    measurement = unwrapped(measurement, angles_of(model))
    formula_model = model if isinstance(model, FormulaModel) else None
    start = None if state0 is None else checked_start(formula_model, state0)
    if formula_model and not set(measurement.names) <= set(formula_model.channels):
        given, wanted = ", ".join(measurement.names), ", ".join(formula_model.channels)
        what = "sensors" if formula_model.observe else "states"
        raise FitError(f"the measurement has columns {given}, but the model's {what} are {wanted}")
    if not formula_model and profile_of(measurement.kind).written:
        given = ", ".join(measurement.names)
        hint = ": a pendulum with a gyroscope is udd.Pendulum(...).with_gyroscope()"
        raise FitError(
            f"the measurement has columns {given}, which are neither a disk's (Y, Z, beta) nor a pendulum's "
            f"(theta){hint if 'Omega' in measurement.names else ''}"
        )
    if formula_model and formula_model.inputs:
        (formula_model,) = driven((formula_model,), (measurement,))
    counts = np.isfinite(measurement.values).sum(axis=0)
    if formula_model and len(measurement.names) > 1 and counts.min() < fewest:
        name, count = measurement.names[int(np.argmin(counts))], int(counts.min())
        raise FitError(f"{name} was observed in {count} rows; a column needs at least {fewest}: leave it out")
    values, seen = measurement.values, measurement.seen & (np.arange(len(measurement)) < moving(measurement))
    if seen.sum() < fewest:
        what = "a fit needs" if alone else "in a joint fit each measurement needs"
        raise FitError(f"the measurement holds {int(seen.sum())} usable frames; {what} at least {fewest}")
    origin = float(measurement.t[0])
    times = measurement.t[seen] - origin
    step = float(np.median(np.diff(times)))
    longest = 3.5 * step if formula_model else max(0.5, 3.5 * step)
    t, row, linked = _fill(times, np.flatnonzero(seen), step, longest)

    columns = measurement.names
    names = formula_model.channels if formula_model else columns
    places = np.array([names.index(name) for name in columns])
    there = np.flatnonzero(row >= 0)
    full = np.zeros((len(t), len(names)))
    read = values[row[there]]
    present = np.isfinite(read)
    full[np.ix_(there, places)] = np.nan_to_num(read)
    sigma = np.full((len(t), len(names)), np.inf)
    rho = np.tile(np.eye(len(names)), (len(t), 1, 1))
    stated = None if measurement.sigma is None else measurement.sigma[row[there]]
    noise = np.where(present, _noise_of(measurement, read) if stated is None else stated, np.inf)
    if stated is not None:
        for column, sd, read_there in zip(read.T, noise.T, present.T, strict=True):
            sd[read_there] = stated_noise(column[read_there], sd[read_there])
    sigma[np.ix_(there, places)] = noise
    if stated is not None and measurement.rho is not None:
        observed_pairs = present[:, :, None] & present[:, None, :]
        correlation = measurement.covariance()[row[there]] / (stated[:, :, None] * stated[:, None, :])
        rho[np.ix_(there, places, places)] = np.where(observed_pairs, correlation, np.eye(len(columns)))
    guess = np.column_stack([_joined_up(t, t[there], column) for column in read.T])
    typical = np.array([np.median(column[np.isfinite(column)]) for column in sigma[:, places].T])
    odd = odd_frames(t, guess, typical, linked)
    guess = interpolated(guess, odd)
    if odd[there].any() and stated is None:  # outliers do not show the noise, nor the range, of a column
        clean = np.where(present & odd[there, None], guess[there], read)
        sigma[np.ix_(there, places)] = np.where(present, _noise_of(measurement, clean), np.inf)
    film = np.zeros(len(t), dtype=np.int64)
    if formula_model:
        typical_noises = dict(zip(columns, typical.tolist(), strict=True))
        seen_guess = dict(zip(columns, guess.T, strict=True))
        states = guessed(formula_model, t, seen_guess, linked, start, typical_noises)
    else:  # the rate of the angle from neighbouring frames: only a start, data are never differentiated
        states = np.column_stack([slope(t, guess[:, -1], linked), guess])
    return Record(t, full, sigma, rho, linked, states, odd, row, film, (origin,))


def _joined_up(t: Array, there: Array, column: Array) -> Array:
    """Interpolate a column: linearly over rows that lack all columns, else by Akima interpolation."""
    present = np.isfinite(column)
    if present.all():
        result: Array = np.interp(t, there, column)
        return result
    return akima(t, there[present], column[present])


def _noise_of(measurement: Measurement, values: Array) -> Array:
    """Return the assumed noise if a measurement does not state it, of each column or of each frame.

    With a user's own model columns may have gaps, because sensors have different rates. Their noise may grow
    with the reading, unless they come in steps.
    """
    sensor = profile_of(measurement.kind).sensor
    if profile_of(measurement.kind).written:
        columns = [column[np.isfinite(column)] for column in values.T]
        estimate = frame_noise if any(lattice(column) for column in columns) else noise_by_size
        result = np.full(values.shape, np.inf)
        for noise, column, present in zip(result.T, columns, np.isfinite(values).T, strict=True):
            noise[present] = np.maximum(estimate(column), 1e-6 * np.ptp(column) + NO_NOISE)
        return result
    if sensor.zero is not None and is_encoder(measurement):
        noise = frame_noise(values[:, 0])
        return (noise if noise.all() else few_readings(values[:, 0]))[:, None]
    return np.array(sensor.sigma)


def _joined(records: Sequence[Record]) -> Record:
    """Concatenate records; the last frame of one is not linked with the first of the next."""
    if len({record.seen.shape[1] for record in records}) > 1:
        raise FitError("measurements in a joint fit must be of the same kind of body; fit them separately")
    links = [np.append(record.linked, False) for record in records]
    arrays = {name: np.concatenate([getattr(r, name) for r in records]) for name in _OF_FRAMES}
    arrays["film"] = np.concatenate([np.full(len(r.t), k, dtype=np.int64) for k, r in enumerate(records)])
    origins = tuple(origin for r in records for origin in r.origins)
    return Record(linked=np.concatenate(links)[:-1], origins=origins, **arrays)


def _fill(
    t: Array, rows: NDArray[np.int64], step: float, longest: float
) -> tuple[Array, NDArray[np.int64], NDArray[np.bool_]]:
    """Insert frames into short gaps; cut at long ones."""
    gap = np.diff(t)
    steps = np.maximum(np.where(gap > longest, 1.0, np.rint(gap / step)), 1.0).astype(np.int64)
    before = np.repeat(np.arange(len(gap)), steps)
    # Index of the step over its gap that a frame ends; the last step ends at the next existing frame.
    number = np.arange(len(before)) - np.repeat(np.cumsum(steps) - steps, steps) + 1
    last = number == steps[before]
    times = np.where(last, t[before + 1], number * (gap / steps)[before] + t[before])
    origin = np.where(last, rows[before + 1], -1)
    return np.append(t[:1], times), np.append(rows[:1], origin), gap[before] <= longest
