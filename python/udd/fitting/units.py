"""Whether numbers are in the units that they are taken to be in."""

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

_DECADE = 4.0  # times that what the frames show may be off a drive in the right unit
_FRAMES = 250  # of each measurement: enough to tell units apart, and soon done
_FIRST = 0.6  # of these frames; the rest is asked by itself, too
#: Nats per number seen by which another unit must be likelier. Right units win by 0.5 and more even where a
#: strong effect is missing; what a missing effect lends to a wrong one is a tenth of that.
_CLEARLY = 0.3


@dataclass(frozen=True)
class Scale:
    """What becomes of the numbers of a record in another unit: factors and shifts by the columns' names.

    The noise of the columns and the model's error are multiplied by the same factors: a unit that makes the
    numbers small must not make them look noisy.
    """

    factors: Mapping[str, float]
    shifts: Mapping[str, float]

    def sizes(self, names: Sequence[str]) -> Array:
        """The factors of columns or states."""
        return np.array([self.factors.get(name, 1.0) for name in names])

    def values(self, values: Array, names: Sequence[str]) -> Array:
        """The numbers of columns or states in the other unit."""
        shift = np.array([self.shifts.get(name, 0.0) for name in names])
        result: Array = values * self.sizes(names) + shift
        return result

    def record(self, record: Record, columns: Sequence[str], states: Sequence[str]) -> Record:
        """The record in the other unit."""
        return replace(
            record,
            seen=np.where(record.observed, self.values(record.seen, columns), 0.0),
            sigma=record.sigma * self.sizes(columns),
            states=self.values(record.states, states),
        )

    def density(self, record: Record, columns: Sequence[str]) -> float:
        """What the log density of the numbers gains when they are counted in the unit stated, nats."""
        return float((record.observed * np.log(self.sizes(columns))).sum())


STATED = Scale({}, {})

#: Fits models to a record's frames, with these parameters fixed, from where others ended.
Fitter = Callable[
    [Record, Sequence[Measurement], Sequence[Model], Sequence[Model], Scale, frozenset[str]], Fit
]


def ask(measurements: Sequence[Measurement], models: Sequence[Model]) -> None:
    """Refuse numbers that cannot be in s, m and rad, before a fit tries to follow them.

    Raises
    ------
    FitError
        Which numbers, and what they may be instead.
    """
    for measurement, model in zip(measurements, models, strict=True):
        if mistaken := _mistaken(measurement, model, STATED):
            raise FitError(mistaken)


def _mistaken(measurement: Measurement, model: Model, scale: Scale) -> str | None:
    """Return the sentence about numbers that cannot be in a unit, or None."""
    seen = measurement.seen
    if seen.sum() < 3 or model.kind != measurement.kind:  # which a fit refuses
        return None
    step = float(np.median(np.diff(measurement.t)))
    values = scale.values(measurement.values[seen], measurement.names)
    return model.profile.fit.mistaken_unit(model, step, values)


def drive_seen(measurement: Measurement) -> float:
    """The drive as the frames alone show it, m/s; NaN where none is seen."""
    seen = profile_of(measurement.kind).fit.drive_seen
    return float("nan") if seen is None else seen(measurement.t, measurement.values, measurement.seen)


def other_unit(
    measurements: Sequence[Measurement], models: Sequence[Model], ends: Sequence[Sequence[Model]], fit: Fitter
) -> str | None:
    """Return the sentence about a unit that explains the record far better than the stated one, or None.

    It must explain the record better, and also its last part by itself: chance does not favour it twice. If
    the unit of a parameter is in question, that parameter is fixed in both units; all other unknown ones are
    free. A unit that only makes up for a parameter that is somewhat off explains no more than the fit in
    which the parameter is free.

    Parameters
    ----------
    measurements, models : sequences
    ends : sequence of sequence of Model
        Where fits in the stated unit ended, from which they are tried too.
    fit : callable
        Makes a fit that is hardly held to its model. Drive and camera are fixed as they are stated: a fit in
        which they are free goes anywhere if an effect is missing.
    """
    short = [m.rows(np.arange(min(_FRAMES, len(m)))) for m in measurements]
    record = record_of(short, models)
    if record.states.shape[1] != len(models[0].state_names):
        return None  # Fits refuse friction with bristles, whose state no record has.
    last = record.part(~record.first(_FIRST))
    margin = _CLEARLY * np.array([record.observed.sum(), last.observed.sum()])

    def evidence(
        part: Record,
        own: Sequence[Model],
        scale: Scale,
        fixed: frozenset[str],
        start: Sequence[Model] | None = None,
    ) -> float:
        """The evidence of a part of the record; -inf if it cannot be fitted."""
        columns, states = short[0].names, own[0].state_names
        try:
            fitted = fit(scale.record(part, columns, states), short, own, start or own, scale, fixed)
        except FitError:
            return -np.inf
        return fitted.evidence + scale.density(part, columns)

    def as_stated(own: Sequence[Model], fixed: frozenset[str], start: Sequence[Model]) -> Array:
        """The evidence of the record, and of its last part by itself, in the stated unit."""
        both = [evidence(part, own, STATED, fixed, start) for part in (record, last)]
        return np.array(both if min(both) > -np.inf else [-np.inf, -np.inf])

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
        own = [model.with_parameters({**model.parameters, **u.parameters}) if u.parameters else model
               for model, u in zip(models, units, strict=True)]  # fmt: skip
        doubted, scale = frozenset(units[0].parameters), Scale(units[0].factors, units[0].shifts)
        if any(_mistaken(*pair, scale) for pair in zip(short, own, strict=True)):
            continue  # who stated this unit would be refused
        # The last part first: a wrong unit may spin a pendulum so fast that the whole takes seconds.
        if not evidence(last, own, scale, doubted) > stated(doubted)[1] + margin[1]:
            continue
        found = evidence(record, own, scale, doubted)
        clearly = found > max(best, stated(doubted)[0] + margin[0], stated(frozenset())[0])
        if clearly and doubted:  # of two wrong lengths the nearer is no right one
            clearly = as_stated(own, frozenset(), own)[0] < found + margin[0]
        if clearly:
            best, text = found, units[0].text
    return text


def _units(measurement: Measurement, model: Model) -> Iterator[OtherUnit | None]:
    """The units that are tried, the same for every measurement; None for one that its frames exclude."""
    profile = model.profile
    for other in profile.fit.other_units(model):
        drive = other.parameters.get(profile.dynamics.drive or "")
        excluded = drive is not None and not 1 / _DECADE < drive_seen(measurement) / drive < _DECADE
        yield None if excluded else other
