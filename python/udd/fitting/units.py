"""Check whether a record's numbers are in the units assumed for them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import Model, profile_of
from udd.models.profile import OtherUnit

from .problem import Fit
from .record import Record, record_of

Array = NDArray[np.float64]

_DECADE = 4.0  # factor by which a drive in the right unit may differ from the one that the frames show
_FRAMES = 250  # of each measurement: enough to distinguish units, at little cost
_FIRST = 0.6  # share of these frames; the rest is tested by itself, too
#: Gain in log likelihood per observed number (nats) that another unit needs. Right units win by 0.5 and more,
#: even if a strong effect is missing; a missing effect favours a wrong unit by at most a tenth of that.
_CLEARLY = 0.3


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

#: Callable that fits models to a record's frames from given start models, with some parameters fixed.
Fitter = Callable[
    [Record, Sequence[Measurement], Sequence[Model], Sequence[Model], Scale, frozenset[str]], Fit
]


def ask(measurements: Sequence[Measurement], models: Sequence[Model]) -> None:
    """Reject numbers that cannot be in s, m and rad, before a fit tries to follow them.

    Raises
    ------
    FitError
        With the numbers, and the units that they may be in.
    """
    for measurement, model in zip(measurements, models, strict=True):
        if mistaken := _mistaken(measurement, model, STATED):
            raise FitError(mistaken)


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
    measurements: Sequence[Measurement], models: Sequence[Model], ends: Sequence[Sequence[Model]], fit: Fitter
) -> str | None:
    """Return a message about a unit that explains the record far better than the given one, or None.

    It must explain the record better, and also its last part by itself, so that chance has to favour it
    twice. If the unit of a parameter is in question, that parameter is fixed in both units; all other unknown
    parameters are free. A unit that only compensates a slightly wrong parameter explains no more than the fit
    in which the parameter is free.

    Parameters
    ----------
    measurements, models : sequences
    ends : sequence of sequence of Model
        End points of fits in the given unit, used as further starts.
    fit : callable
        Fits with a large model error. Drive and camera are fixed at their given values: if they are free and
        an effect is missing, the fit converges to anything.
    """
    short = [m.rows(np.arange(min(_FRAMES, len(m)))) for m in measurements]
    record = record_of(short, models)
    if record.states.shape[1] != len(models[0].state_names):
        return None  # Fits refuse friction with bristles, whose state no record has.
    last = record.part(~record.first(_FIRST))
    margin = _CLEARLY * np.array([record.observed.sum(), last.observed.sum()])

    def evidence(
        part: Record,
        converted: Sequence[Model],
        scale: Scale,
        fixed: frozenset[str],
        start: Sequence[Model] | None = None,
    ) -> float:
        """Return the evidence of a part of the record; -inf if it cannot be fitted."""
        columns, states = short[0].names, converted[0].state_names
        try:
            fitted = fit(
                scale.record(part, columns, states),
                short,
                converted,
                start or converted,
                scale,
                fixed,
            )
        except FitError:
            return -np.inf
        return fitted.evidence + scale.density(part, columns)

    def as_stated(converted: Sequence[Model], fixed: frozenset[str], start: Sequence[Model]) -> Array:
        """Return the evidence of the record, and of its last part by itself, in the given unit."""
        parts = [evidence(part, converted, STATED, fixed, start) for part in (record, last)]
        return np.array(parts if min(parts) > -np.inf else [-np.inf, -np.inf])

    @functools.cache
    def stated(fixed: frozenset[str]) -> Array:
        starts = [models] if fixed else [models, *ends]
        best: Array = np.max([as_stated(models, fixed, start) for start in starts], axis=0)
        return best

    best, text = -np.inf, None
    for tried in zip(*(_units(*pair) for pair in zip(short, models, strict=True)), strict=True):
        units = [unit for unit in tried if unit]
        if len(units) < len(tried):
            continue
        converted = [model.with_parameters({**model.parameters, **u.parameters}) if u.parameters else model
               for model, u in zip(models, units, strict=True)]  # fmt: skip
        doubted, scale = frozenset(units[0].parameters), Scale(units[0].factors, units[0].shifts)
        if any(_mistaken(*pair, scale) for pair in zip(short, converted, strict=True)):
            continue  # numbers in this unit would be rejected
        # The last part first: with a wrong unit a pendulum may turn so fast that the whole record takes
        # seconds.
        if not evidence(last, converted, scale, doubted) > stated(doubted)[1] + margin[1]:
            continue
        value = evidence(record, converted, scale, doubted)
        clearly = value > max(best, stated(doubted)[0] + margin[0], stated(frozenset())[0])
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
        excluded = drive is not None and not 1 / _DECADE < drive_seen(measurement) / drive < _DECADE
        yield None if excluded else other
