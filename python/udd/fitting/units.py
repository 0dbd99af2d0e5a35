"""Check whether a record's numbers are in the units assumed for them."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import FitError, outside
from udd.measurement import Measurement
from udd.models import Model, profile_of
from udd.models.profile import OtherUnit

from .fit_result import Fit
from .minimum import SolveError
from .noise import stated
from .noise_estimation import solve_with_noise
from .parameters import free_parameters
from .problem import Problem, levels, one_model_each, start_point
from .record import Record, record_of

Array = NDArray[np.float64]

_DECADE = 4.0  # factor by which a drive in the right unit may differ from the one that the frames show
_FRAMES = 250  # of each measurement: enough to distinguish units, at little cost
_FIRST = 0.6  # share of these frames; the rest is tested by itself, too
#: Gain in log likelihood per observed number (nats) that another unit needs. Right units win by 0.5 and more,
#: even if a strong effect is missing; a missing effect favours a wrong unit by at most a tenth of that.
_CLEARLY = 0.3
_RUNAWAY_SD = 10.0  # standard deviations from the given value: the fit describes another device
#: chi2 per degree of freedom above which a model does not explain its data, whatever it lacks.
UNEXPLAINED = 2.5
_MAX_DRIVE_RATIO = 3.0  # ratio to the given drive that no missing effect explains
_MAX_FREQUENCY_RATIO = 2.0  # ratio to a pendulum's given length over inertia


@dataclass(frozen=True)
class Scale:
    """Conversion of a record to another unit: factors and shifts by column name.

    The noise of the columns and the model's error are multiplied by the same factors: a unit with small
    numbers must not make them look noisy.
    """

    factors: Mapping[str, float]
    shifts: Mapping[str, float]

    def sizes(self, names: Sequence[str]) -> Array:
        """Return the factors of columns or states."""
        return np.array([self.factors.get(name, 1.0) for name in names])

    def values(self, values: Array, names: Sequence[str]) -> Array:
        """Convert values of columns or states to the other unit."""
        shift = np.array([self.shifts.get(name, 0.0) for name in names])
        result: Array = values * self.sizes(names) + shift
        return result

    def record(self, record: Record, columns: Sequence[str], states: Sequence[str]) -> Record:
        """Convert a record to the other unit."""
        return replace(
            record,
            seen=np.where(record.observed, self.values(record.seen, columns), 0.0),
            sigma=record.sigma * self.sizes(columns),
            states=self.values(record.states, states),
        )

    def density(self, record: Record, columns: Sequence[str]) -> float:
        """Return the gain in log density if the numbers are counted in the given unit, nats."""
        return float((record.observed * np.log(self.sizes(columns))).sum())


STATED = Scale({}, {})


def _mistaken(measurement: Measurement, model: Model, scale: Scale) -> str | None:
    """Return the message about numbers that cannot be in a unit, or None."""
    seen = measurement.seen
    if seen.sum() < 3 or model.kind != measurement.kind:  # which a fit rejects
        return None
    step = float(np.median(np.diff(measurement.t)))
    values = scale.values(measurement.values[seen], measurement.names)
    return model.profile.fit.mistaken_unit(model, step, values)


def drive_seen(measurement: Measurement) -> float:
    """Return the drive as the frames alone show it, m/s; NaN if they do not."""
    seen = profile_of(measurement.kind).fit.drive_seen
    return float("nan") if seen is None else seen(measurement.t, measurement.values, measurement.seen)


def other_unit(
    measurements: Sequence[Measurement],
    models: Sequence[Model],
    ends: Sequence[Sequence[Model]],
    free: Sequence[str],
) -> str | None:
    """Return a message about a unit that explains the record far better than the given one, or None.

    It must explain the record better, and also its last part by itself, so that chance has to favour it
    twice. If the unit of a parameter is in question, that parameter is fixed in both units; all other unknown
    parameters (`free`) are free. A unit that only compensates a slightly wrong parameter explains no more
    than the fit in which the parameter is free. `ends` are models of fits in the given unit: further starts.
    """
    short = [m.rows(np.arange(min(_FRAMES, len(m)))) for m in measurements]
    record = record_of(short, models)
    if record.states.shape[1] != len(models[0].state_names):
        return None  # Fits refuse friction with bristles, whose state no record has.
    last = record.part(~record.first(_FIRST))
    margin = _CLEARLY * np.array([record.observed.sum(), last.observed.sum()])

    def evidence(
        part: Record, converted: Sequence[Model], scale: Scale, fixed: frozenset[str], start: Sequence[Model]
    ) -> float:
        names = [name for name in free if name not in fixed]
        try:
            return _evidence(part, short, converted, start, scale, names)
        except FitError:
            return -np.inf

    def as_stated(converted: Sequence[Model], fixed: frozenset[str], start: Sequence[Model]) -> Array:
        """Return the evidence of the record, and of its last part by itself, in the given unit."""
        parts = [evidence(part, converted, STATED, fixed, start) for part in (record, last)]
        return np.array(parts if min(parts) > -np.inf else [-np.inf, -np.inf])

    @functools.cache
    def in_given_unit(fixed: frozenset[str]) -> Array:
        starts = [models] if fixed else [models, *ends]
        best: Array = np.max([as_stated(models, fixed, start) for start in starts], axis=0)
        return best

    best, text = -np.inf, None
    for tried in zip(*(_units(*pair) for pair in zip(short, models, strict=True)), strict=True):
        units = [unit for unit in tried if unit]
        if len(units) < len(tried):
            continue
        converted = [
            model.with_parameters({**model.parameters, **unit.parameters}) if unit.parameters else model
            for model, unit in zip(models, units, strict=True)
        ]
        doubted, scale = frozenset(units[0].parameters), Scale(units[0].factors, units[0].shifts)
        if any(_mistaken(*pair, scale) for pair in zip(short, converted, strict=True)):
            continue  # numbers in this unit would be rejected
        # The last part first: with a wrong unit a pendulum may turn so fast that the whole record takes
        # seconds.
        if not evidence(last, converted, scale, doubted, converted) > in_given_unit(doubted)[1] + margin[1]:
            continue
        value = evidence(record, converted, scale, doubted, converted)
        clearly = value > max(best, in_given_unit(doubted)[0] + margin[0], in_given_unit(frozenset())[0])
        if clearly and doubted:  # the less wrong of two lengths is not right
            clearly = as_stated(converted, frozenset(), converted)[0] < value + margin[0]
        if clearly:
            best, text = value, units[0].text
    return text


def _units(measurement: Measurement, model: Model) -> Iterator[OtherUnit | None]:
    """Return the units to try, the same for every measurement; None for one that its frames exclude."""
    profile = model.profile
    for other in profile.fit.other_units(model):
        drive = other.parameters.get(profile.dynamics.drive or "")
        yield None if drive is not None and _is_far(drive_seen(measurement) / drive, _DECADE) else other


def _is_far(ratio: float, factor: float) -> bool:
    """Return True if a ratio is not within a factor of 1."""
    return not 1 / factor < ratio < factor


def _evidence(
    part: Record,
    measurements: Sequence[Measurement],
    models: Sequence[Model],
    start: Sequence[Model],
    scale: Scale,
    free: Sequence[str],
) -> float:
    """Compute the evidence of a part of a record for models in a unit, with a large model error.

    Drive and camera are fixed at their given values: if they are free and an effect is missing, the fit
    converges to anything.
    """
    columns, states, profile = measurements[0].names, models[0].state_names, models[0].profile
    record = scale.record(part, columns, states)
    loose = np.array(levels(models[0].kind)[profile.fit.hardly :][:1]) * scale.sizes(states)
    schedule = tuple(tuple(level) for level in loose.tolist())
    problem = Problem(
        models=tuple(models),
        record=record,
        free=free_parameters(models, free, profile.sensor.pivot, each=()),
        noise=stated(record),
        schedule=schedule,
        diffusion=schedule[0],
        likeliest=False,
        measurements=tuple(measurements),
    )
    fitted = solve_with_noise(problem, start_point(start, measurements, record))
    return fitted.evidence + scale.density(part, columns)


def astray(fitted: Fit) -> bool:
    """Return True if a fit is so bad, or so far from the given values, that a unit may be wrong.

    A missing effect can do the same: :func:`udd.fitting.units.other_unit` distinguishes the two.
    """
    if fitted.scatter > UNEXPLAINED or ran_away(fitted):
        return True
    pairs, pace = zip(fitted.models, fitted.problem.models, strict=True), fitted.model.profile.fit.pace
    return pace is not None and any(
        _is_far(pace(end.parameters) / pace(given.parameters), _MAX_FREQUENCY_RATIO) for end, given in pairs
    )


def ran_away(fitted: Fit) -> bool:
    """Return True if the fitted drive or camera has impossible values.

    A strong missing effect causes that: the fit then compensates with a clock that is off by a third, or with
    a drive a fifth of the given one.
    """
    stated = fitted.model.profile.fit.stated
    parts = [f for f in fitted.problem.free if f.role != "model" or f.base in stated]
    return any(abs(fitted.point.value(f) - f.mean) > _RUNAWAY_SD * f.sd for f in parts)


def _is_drive_off(measurement: Measurement, model: Model) -> bool:
    """Return True if the frames alone show a drive far from the given one."""
    fit, name = model.profile.fit, model.profile.dynamics.drive
    if fit.drive_seen is None or name is None or measurement.kind != model.kind or not model.parameters[name]:
        return False
    return _is_far(drive_seen(measurement) / model.parameters[name], _MAX_DRIVE_RATIO)


def checked_units(
    measurement: Measurement | Sequence[Measurement],
    model: Model | Sequence[Model],
    options: Mapping[str, Any],
    fits: Callable[[], tuple[Fit, ...]],
) -> tuple[Fit, ...]:
    """Run fits and check whether the measurement's numbers may be in another unit than assumed.

    `options` are ``free``, ``camera``, ``priors`` and ``each`` of :func:`fit`. If another unit explains the
    measurement far better, :attr:`Fit.unit_doubt` says so, and a warning.

    Raises
    ------
    FitError
        The numbers cannot be in s, m and rad; or `fits` raises it.
    """
    measurements = (measurement,) if isinstance(measurement, Measurement) else tuple(measurement)
    models = one_model_each(model, measurements)
    free_parameters(models, **options)  # raises if an option is wrong
    for pair in zip(measurements, models, strict=True):
        if mistaken := _mistaken(*pair, STATED):
            raise FitError(mistaken)
    free, unknown = options["free"], models[0].profile.fit.unknown

    def doubt(ends: Sequence[Sequence[Model]] = ()) -> str | None:
        if not unknown:
            return None
        # Without effects: one that cannot be integrated in the given unit would favour all others.
        plain = [[model.with_effects(()) for model in some] for some in (models, *ends)]
        unknown_free = [name for name in unknown if free is None or name in free]
        text = other_unit(measurements, plain[0], plain[1:], unknown_free)
        if text:
            warnings.warn(f"{text}; the fit continues with the given units", stacklevel=outside())
        return text

    is_drive_off = any(_is_drive_off(*pair) for pair in zip(measurements, models, strict=True))
    text = doubt() if is_drive_off else None
    try:
        fitted = fits()
    except SolveError as error:
        if text := text if is_drive_off else doubt():  # most probably the reason
            raise FitError(f"{error}; {text}") from error
        raise
    if not is_drive_off and any(astray(each) for each in fitted):
        text = doubt([each.models for each in fitted])
    return tuple(replace(each, unit_doubt=text) for each in fitted) if text else fitted
