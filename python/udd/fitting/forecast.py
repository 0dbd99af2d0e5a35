"""Forecasts of a fitted model with a predictability horizon."""

from __future__ import annotations

import contextlib
import itertools
import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.angles import wrapped
from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.keywords import renamed
from udd._util.memory import require_memory
from udd._util.progress import thread_count
from udd._util.random_generator import Rng, generator
from udd._util.validation import array, number, whole
from udd.chaos.largest_exponent import lyapunov
from udd.errors import FitError, IntegrationError, ModelError
from udd.measurement import Measurement
from udd.models import Model, beyond_the_edge
from udd.models.formula_model import FormulaModel
from udd.models.profile import SensorProfile
from udd.simulation.batch import Batch
from udd.simulation.outcomes import FINISHED
from udd.simulation.trajectory import method_for

from .continuous import continuous
from .estimator_input import FilmParameters
from .fit import fit
from .fit_result import Fit
from .formula_models import driven
from .prediction import predicted
from .problem import Point
from .record import Record, record_of
from .time_scale import motion_time_scale

__all__ = ["Forecast", "forecast"]

Array = NDArray[np.float64]

# Times in s; for a user's own model in units of `motion_time_scale`.
_STEP = 0.01  # Interval between the times of a forecast.
_KICK = 0.1  # Interval between the random kicks that represent the assumed model error.
_FEWEST = 6  # Frames needed to determine a state.
_TRIES = 100  # Draws of a member's parameters that are invalid for the model.
_RTOL, _ATOL = 1e-9, 1e-12
_GROWTH_TIME = 4000.0  # Time of the average for the exponent, which has an error of 1 or 2 percent.


@dataclass(frozen=True, eq=False)
class Forecast(Drawable):
    """Forecast of the observed columns, with the spread of an ensemble.

    Attributes
    ----------
    t : ndarray (k,)
        Times on the measurement's clock [s]. The first is the start of the forecast.
    median, low, high : ndarray (k, m)
        Quantiles of the members, for every channel of the measurement, in its unit. Between `low` and `high`
        lies the share `level` of them. NaN if more than half of the disks have lost contact with the
        wheels.
    members : ndarray (n, k, m)
        The ensemble. NaN after a disk has lost contact with the wheels.
    names : tuple of str
        Names of the channels.
    level : float
        Share of the members between `low` and `high`.
    error : float
        Threshold for divergence: m of the disk's centre, or rad of a pendulum. For a user's own model it is
        the root mean square over the columns, in units of the motion's spread.
    valid_time : float
        Time after the start until half of the members have diverged from the median by `error`, s; inf if the
        forecast ends before.
    valid_low, valid_high : float
        The times until the shares ``(1 - level)/2`` and ``(1 + level)/2`` of the members have diverged, s.
    lyapunov_time : float
        Time in which errors grow e-fold on average, 1/lambda_1 of the fitted equations (without the disk's
        edge), s; inf if errors do not grow, NaN if there is no exponent.
    measured_valid_time : float
        Time until the measurement itself diverges from the median by `error`; NaN if it ends before.
    fit : Fit
        The fit behind the forecast.
    measurement : Measurement
            The measurement: the state was filtered from it, and its later frames are compared.

    See Also
    --------
    udd.plot.forecast : draw the fan with the measurement.
    """

    t: Array
    median: Array
    low: Array
    high: Array
    members: Array
    names: tuple[str, ...]
    level: float
    error: float
    valid_time: float
    valid_low: float
    valid_high: float
    lyapunov_time: float
    measured_valid_time: float
    fit: Fit
    measurement: Measurement

    @property
    def start(self) -> float:
        """Start time of the forecast, s."""
        return float(self.t[0])

    @property
    def lyapunov_times(self) -> float:
        """The valid time in Lyapunov times; NaN if there are none."""
        return self.valid_time / self.lyapunov_time if math.isfinite(self.lyapunov_time) else math.nan

    def to_dict(self) -> dict[str, Any]:
        """Return the forecast as JSON-ready values.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
        curves = {key: getattr(self, key) for key in ("median", "low", "high")}
        return {
            "start_s": self.start,
            "t": self.t,
            **{
                name: {key: curve[:, k] for key, curve in curves.items()} for k, name in enumerate(self.names)
            },
            "level": self.level,
            "members": len(self.members),
            "error": self.error,
            "valid_time_s": self.valid_time,
            "valid_time_low_s": self.valid_low,
            "valid_time_high_s": self.valid_high,
            "lyapunov_time_s": self.lyapunov_time,
            "valid_time_lyapunov_times": self.lyapunov_times,
            "measured_valid_time_s": self.measured_valid_time,
        }

    def __repr__(self) -> str:
        return (
            f"<Forecast from {self.start:.4g} to {self.t[-1]:.4g} s, {len(self.members)} members, "
            f"valid for {self.valid_time:.3g} s>"
        )


@renamed(seed="rng")
@checked_arguments(error=FitError)
def forecast(
    measurement: Measurement,
    model: Model | Fit,
    t: ArrayLike | None = None,
    *,
    start: float | None = None,
    window: float | None = None,
    members: int = 200,
    level: float = 0.95,
    error: float | None = None,
    film: int | None = None,
    process: bool = True,
    rng: Rng = 0,
) -> Forecast:
    """Forecast the motion from the last second of a measurement, with an ensemble.

    Every member draws the model's and the camera's parameters from the fit's covariance and filters its own
    state from the window with them. It then draws a start from that state's covariance and runs freely, with
    random kicks of the size of the fit's model error.

    Parameters
    ----------
    measurement : Measurement
        Its frames in the window before `start` are used; later frames are only compared.
    model : Disk, Pendulum, a user's own Model, or Fit
        A model is fitted first, to all frames up to `start` (:func:`udd.fit`); a fit is used as it is.
    t : float or array_like, shape (k,), optional
        Forecast length, s after the start; or the forecast times after it, increasing. Default: 10 s for a
        disk, 60 s for a pendulum, and for a user's own model ten units, each about four correlation times of
        its motion.
    start : float, optional
        Time on the measurement's clock at which the forecast starts, s; the last frame up to then is used.
        Default: the last frame of all.
    window : float, optional
        Time before the start from which the state is filtered, s. Default: 1 s, or 4 s for a pendulum; for a
        user's own model a tenth of the default for `t`.
    members : int
        Size of the ensemble.
    level : float
        Share of the members between `low` and `high`.
    error : float, optional
        The error up to which the forecast counts as valid. Default: 5 mm of the disk's centre, 0.05 rad of a
        pendulum, 0.2 of the spread of a user's own motion.
    film : int, optional
        For a fit of several measurements: number of the one with the camera and the drive of this one.
        Default: the one that is identical.
    process : bool
        True if random kicks act on the members. False treats the model's equations as exact.
    rng : int, Generator or None
        Seed of the ensemble. The same whole number gives the same ensemble; None takes fresh entropy.

    Returns
    -------
    Forecast
        `t`, `median`, `low`, `high` and `members` hold the ensemble; `valid_time` and `lyapunov_time` its
        horizon.

    Raises
    ------
    FitError
        The fit fails, or the window holds fewer than six frames without a gap.
    ModelError
            An option is out of range.

    See Also
    --------
    udd.fit : fit the model first.
    udd.plot.forecast : draw the result.

    Notes
    -----
    The fan is that of the motion as the camera would see it; the noise of single frames is not included. If
    the fit does not explain its data (chi2 per degree of freedom above 1), all spreads are multiplied by the
    square root of that ratio. The clock's error is fixed at its fitted value.

    Examples
    --------
    A pendulum, forecast to 5 mrad:

    >>> import numpy as np, udd
    >>> t = np.arange(0, 30, 0.05)
    >>> theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.5]).state[:, 1]
    >>> noise = 2e-3 * np.random.default_rng(1).standard_normal(len(t))
    >>> seen = udd.Measurement(t, {"theta": theta + noise})
    >>> ahead = udd.forecast(seen, udd.Pendulum(1.0, k0=0.03), start=20.0, t=[0.0, 1.0, 9.0])
    >>> bool(np.all(np.abs(ahead.median[:, 0] - theta[[400, 420, 580]]) < 5e-3))
    True
    >>> ahead.lyapunov_time  # errors of a damped pendulum do not grow
    inf
    """
    if not isinstance(measurement, Measurement):
        raise FitError(
            f"a measurement is needed (udd.track or udd.read_measurement), not {measurement!r:.80}"
        )
    measurement = continuous(measurement, model.model if isinstance(model, Fit) else model)
    members, tail = whole("members", members, 2), (1.0 - number("level", level, above=0.0)) / 2.0
    if tail <= 0.0:
        raise ModelError(f"level must be below 1, not {level:g}")
    require_memory(f"{members} members", members, itemsize=10_000)
    random = generator(rng)
    if t is not None:
        _times(t, _STEP)
    past = measurement
    if start is not None:
        past = measurement.rows(measurement.t <= number("start", start))
        if start > measurement.t[-1] + np.median(np.diff(measurement.t)):
            raise FitError(
                f"start is {start:g} s, but the record ends at {measurement.t[-1]:g} s; start earlier"
            )
    for name, option in (("window", window), ("error", error)):
        if option is not None:
            number(name, option, above=0.0)
    fitted = model if isinstance(model, Fit) else fit(past, model)
    if fitted.measurement.kind != measurement.kind:
        raise FitError(
            f"the fit is that of a {fitted.measurement.kind}, the measurement of a {measurement.kind}"
        )
    # The columns of a measurement do not say which unit of time a user's own model needs.
    profile, unit = fitted.model.profile, motion_time_scale(fitted)
    large = profile.fit.valid_error if error is None else float(error)
    times = _times(profile.fit.ahead * unit if t is None else t, _STEP * unit)
    length = float(profile.fit.window * unit if window is None else window)
    record = record_of(past, fitted.model)
    film = _film(fitted, measurement, film)
    if any(_same(fitted.measurements[film], each) for each in (measurement, past)):
        is_gross = (fitted.noise.weight == 0.0) & (fitted.record.film == film)
        record = replace(record, odd=record.odd | np.isin(record.row, fitted.record.row[is_gross]))
    part, origin = _window(fitted, film, record, length)

    scale = max(fitted.scatter, 1.0) ** 0.5
    film_model = fitted.models[film]
    if isinstance(film_model, FormulaModel) and film_model.inputs:
        (film_model,) = driven((film_model,), (measurement,), origin)
    models, sets, states = _starts(fitted, film_model, film, part, members, scale, random)
    kicks = scale * np.array(fitted.problem.diffusion) if process else np.zeros(states.shape[1])
    t_model = part.t[-1] + times
    runs = _runs(models, states, (1.0 + sets[0].clock) * t_model, kicks, _KICK * unit, random)
    shown = [fitted.channels.index(name) for name in measurement.names]
    seen = _observed(models, sets, t_model, runs)[..., shown]
    is_regular = ~np.isin(np.arange(len(past)), record.row[record.odd])
    spread = np.nanstd(past.values[is_regular], axis=0)

    shares = [tail, 0.5, 1.0 - tail]
    low, median, high = _quantiles(seen, shares)
    valid = [_parted(times, _size(member - median, profile.sensor, spread), large) for member in seen]
    # A member that never diverges counts as later than all that do.
    shortest, valid_time, longest = np.quantile(valid, shares, method="higher")
    clock = t_model + origin
    return Forecast(
        t=clock,
        median=median,
        low=low,
        high=high,
        members=seen,
        names=measurement.names,
        level=float(level),
        error=large,
        valid_time=float(valid_time),
        valid_low=float(shortest),
        valid_high=float(longest),
        lyapunov_time=_growth(film_model, states, _GROWTH_TIME * unit),
        measured_valid_time=_compared(measurement, profile.sensor, (clock, median), spread, large),
        fit=fitted,
        measurement=measurement,
    )


def _times(t: ArrayLike, step: float) -> Array:
    """Check the times after the start and return them, s; the first is 0."""
    wanted = array("t", t)
    if wanted.ndim == 0:
        end = number("t", float(wanted), above=0.0)
        require_memory("times of a forecast", end / step)
        return np.linspace(0.0, end, max(round(end / step), 1) + 1)
    if wanted.ndim != 1 or not wanted.size or wanted[0] < 0 or not (np.diff(wanted) > 0).all():
        raise ModelError("t must be a time ahead in s, or a list of such times, increasing from 0")
    return wanted if wanted[0] == 0 else np.concatenate([[0.0], wanted])


def _film(fitted: Fit, measurement: Measurement, film: int | None) -> int:
    """Return the number of the measurement with the right camera and drive."""
    several = len(fitted.measurements)
    if film is not None:
        if isinstance(film, bool) or not isinstance(film, (int, np.integer)) or not 0 <= film < several:
            raise ModelError(f"film must be a whole number from 0 to {several - 1}, not {film!r}")
        return int(film)
    matches = [k for k, each in enumerate(fitted.measurements) if _same(each, measurement)]
    if several > 1 and not matches:
        raise FitError(f"the fit is of {several} measurements: pass the number of this one as film=")
    return matches[0] if matches else 0


def _same(a: Measurement, b: Measurement) -> bool:
    """Return True if two measurements have the same rows, also after angles were made continuous."""
    return a is b or (
        a.names == b.names
        and np.array_equal(a.t, b.t)
        and np.array_equal(a.values, b.values, equal_nan=True)
        and np.array_equal(a.flag, b.flag)
    )


def _window(fitted: Fit, film: int, record: Record, length: float) -> tuple[Record, float]:
    """Return the last frames, for filtering the state, on the fit's clock, and that clock's zero."""
    t, last = record.t, len(record.t) - 1
    breaks = np.flatnonzero(~record.linked)
    run = int(breaks[-1]) + 1 if breaks.size else 0
    part = record.part(slice(max(run, int(np.searchsorted(t, t[last] - length - 1e-9))), last + 1))
    count = int(part.observed.any(axis=1).sum())
    if count < _FEWEST:
        raise FitError(
            f"the {length:g} s before the start hold {count} consecutive frames; a state needs at least "
            f"{_FEWEST}: use a longer window"
        )
    # The model's time counts from the first fitted row.
    origin = fitted.record.origins[film]
    return replace(part, t=part.t + (record.origin - origin)), origin


def _starts(
    fitted: Fit,
    film_model: Model,
    film: int,
    part: Record,
    members: int,
    scale: float,
    rng: np.random.Generator,
) -> tuple[list[Model], list[FilmParameters], Array]:
    """Draw every member's model, parameters (with the camera's) and state at the window's end."""
    _values, camera_of_fit, clock = fitted.point.sets[film]
    fixed = fitted.problem.of_states(part).at(Point(part.states, fitted.point.sets))
    models, sets, states = [], [], []
    free = [f for f in fitted.problem.free if f.film in (None, film)]
    names = {f.name: list(film_model.parameters)[f.index] for f in free if f.role == "model"}
    draws = _draws(fitted, scale, rng)
    for _ in range(members):
        model, draw = _valid(film_model, names, draws)
        camera = list(camera_of_fit)
        for parameter in free:
            if parameter.role == "camera":
                camera[parameter.index] = draw[parameter.name]
        drawn = FilmParameters(list(model.parameters.values()), camera, clock)
        try:
            member = replace(fixed, model=model, films=[drawn])
            _first, last, spread = _core.filter(member, [(0, len(part.t) - 1)])
        except ValueError as error:
            raise FitError(f"the state cannot be filtered from the window: {error}") from error
        models.append(model)
        sets.append(drawn)
        states.append(last[0] + scale * _normal(spread[0], rng))
    return models, sets, np.array(states)


def _valid(
    film_model: Model, names: Mapping[str, str], draws: Iterator[Mapping[str, float]]
) -> tuple[Model, Mapping[str, float]]:
    """Return a model from the next draw that is valid for it; `names` are those of its parameters."""
    for draw in itertools.islice(draws, _TRIES):
        with contextlib.suppress(ModelError):
            return film_model.with_parameters({names[name]: draw[name] for name in names}), draw
    raise FitError(
        "the fitted parameters are too uncertain for a forecast; use a longer record or fix some of them"
    )


def _draws(fitted: Fit, scale: float, rng: np.random.Generator) -> Iterator[Mapping[str, float]]:
    """Draw parameters from the fit's covariance; the clock's error is fixed."""
    mean = np.array(list(fitted.parameters.values()))
    covariance = fitted.covariance / fitted.widened**2  # the kicks represent the model error
    for k, free in enumerate(fitted.problem.free):
        if free.role == "clock":
            column = covariance[:, k]
            covariance = covariance - np.outer(column, column) / column[k]
            covariance[k, :] = covariance[:, k] = 0.0
    while True:
        yield dict(zip(fitted.parameters, (mean + scale * _normal(covariance, rng)).tolist(), strict=True))


def _normal(covariance: Array, rng: np.random.Generator) -> Array:
    """Draw from a normal distribution with this covariance; its rows may have different units."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where(sd > 0, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    result: Array = sd * (vectors @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(len(sd))))
    return result


def _runs(
    models: list[Model], states: Array, t: Array, kicks: Array, every: float, rng: np.random.Generator
) -> Array:
    """Run the members; return their states at the model's times `t`, (n, k, d), NaN after loss of contact."""
    n, d = states.shape
    rows = np.array([list(model.parameters.values()) for model in models])
    method = method_for(models[0], "auto", _RTOL)
    require_memory(f"{len(t)} states of each of {n} members", n, len(t), d, itemsize=16)
    result = np.full((n, len(t), d), np.nan)
    result[:, 0] = states
    alive = _between_wheels(models[0], states)
    kicked = np.any(kicks > 0)
    pieces = max(round((t[-1] - t[0]) / every), 1) if kicked else 1
    edges = np.linspace(t[0], t[-1], pieces + 1)
    current = states.copy()
    for a, b in itertools.pairwise(edges.tolist()):
        inside = np.flatnonzero((t > a) & (t <= b))
        # Half of a piece's kick before it and half after it.
        current += np.sqrt((b - a) / 2) * kicks * rng.standard_normal((n, d))
        alive &= _between_wheels(models[0], current)
        who = np.flatnonzero(alive)
        if not who.size:
            break
        times = np.unique(np.concatenate([[a], t[inside], [b]]))
        batch = Batch(models[0], rows[who], current[who], _RTOL, _ATOL, thread_count(None))
        batch_result = _core.ensemble(batch, times, method)
        result[np.ix_(who, inside)] = batch_result["states"][:, np.searchsorted(times, t[inside])]
        current[who] = batch_result["states"][:, -1]
        alive[who] = batch_result["outcome"] == FINISHED
        current += np.sqrt((b - a) / 2) * kicks * rng.standard_normal((n, d))
    return result


def _between_wheels(model: Model, states: Array) -> NDArray[np.bool_]:
    """Return True for each disk still in contact with the wheels, if loss of contact ends a run."""
    inside = model.profile.dynamics.inside
    if inside is None or getattr(model, "edge", "ignore") != "stop":
        return np.ones(len(states), dtype=bool)
    return inside(model.parameters, states)


def _observed(models: list[Model], sets: list[FilmParameters], t: Array, runs: Array) -> Array:
    """Compute the observations of each member's camera, (n, k, m)."""
    seen = []
    for model, drawn, run in zip(models, sets, runs, strict=True):
        there = np.isfinite(run).all(axis=1)
        film = np.zeros(int(there.sum()), dtype=np.int64)
        shown = predicted([model], [drawn], film, t[there], run[there], t[there, None])[:, 0]
        full = np.full((len(t), shown.shape[1]), np.nan)
        full[there] = shown
        seen.append(full)
    return np.array(seen)


def _quantiles(seen: Array, shares: list[float]) -> Array:
    """Return quantiles of the members, (3, k, m), while half of them still run."""
    there = np.isfinite(seen).all(axis=2).mean(axis=0) > 0.5
    result = np.full((3, *seen.shape[1:]), np.nan)
    if there.any():
        result[:, there] = np.nanquantile(seen[:, there], shares, axis=0)
    return result


def _size(difference: Array, sensor: SensorProfile, spread: Array) -> Array:
    """Return the distance of two motions: m of a disk's centre, a pendulum's rad, else per `spread`."""
    if not sensor.compared:
        result: Array = np.sqrt(np.mean((difference / spread) ** 2, axis=1))
        return result
    result = np.abs(reduce(np.hypot, difference[:, : sensor.compared].T))
    return result


def _parted(t: Array, size: Array, error: float) -> float:
    """Return the time at which a difference first exceeds the error, or the disk's run ends; inf if never."""
    beyond = np.flatnonzero(~(size <= error))
    if not beyond.size:
        return math.inf
    k = int(beyond[0])
    if k == 0 or not np.isfinite(size[k]):
        return float(t[k])
    share = (error - size[k - 1]) / (size[k] - size[k - 1])
    return float(t[k - 1] + share * (t[k] - t[k - 1]))


def _compared(
    measurement: Measurement,
    sensor: SensorProfile,
    expectation: tuple[Array, Array],
    spread: Array,
    error: float,
) -> float:
    """Return when the measurement first diverges from the median, s after the start; NaN if it does not."""
    clock, median = expectation
    after = measurement.slice(float(np.nextafter(clock[0], np.inf)), float(clock[-1]))
    t = after.t
    expected = np.column_stack([np.interp(t, clock, column) for column in median.T])
    difference = np.where(after.seen[:, None], after.values - expected, np.nan)
    if sensor.error_unit == "rad":
        difference = wrapped(difference)
    there = np.isfinite(difference).all(axis=1)
    when = _parted(t[there] - clock[0], _size(difference[there], sensor, spread), error)
    return when if np.isfinite(when) else math.nan


def _growth(model: Model, states: Array, long: float) -> float:
    """Compute the Lyapunov time of the fitted model's equations, s; its attractor may lie beyond the edge."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # one percent is enough for a unit of time
        try:
            equations = beyond_the_edge(model)
            value, spread = lyapunov(equations, with_error=True, t=long, state0=np.median(states, axis=0))
        except (IntegrationError, ModelError):
            return math.nan
    return 1.0 / value if value > 2 * spread else math.inf
