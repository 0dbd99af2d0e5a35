"""Whether numbers are in the units that they are taken to be in."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import Model, profile_of

_DECADE = 4.0  # times that what the frames show may be off a drive in the right unit
_FRAMES = 250  # of each measurement: enough to tell units apart, and soon done
#: Nats per number seen by which another unit must be likelier. Right units win by 0.5 and more even where a
#: strong effect is missing; what a missing effect lends to a wrong one is a tenth of that.
_CLEARLY = 0.3


@dataclass(frozen=True)
class Unit:
    """Another unit that something may be in: what it is, and the model and the measurement then.

    `nats` is what the densities of the numbers seen gain when they are counted in the unit stated.
    """

    text: str
    model: Model
    measurement: Measurement
    nats: float = 0.0


def ask(measurements: Sequence[Measurement], models: Sequence[Model]) -> None:
    """Refuse numbers that cannot be in s, m and rad, before a fit tries to follow them.

    Raises
    ------
    FitError
        Which numbers, and what they may be instead.
    """
    for measurement, model in zip(measurements, models, strict=True):
        seen = measurement.seen
        if seen.sum() < 3:
            continue  # which a fit refuses
        step = float(np.median(np.diff(measurement.t)))
        if model.kind != measurement.kind:
            continue
        mistaken = model.profile.fit.mistaken_unit(model, step, measurement.values[seen])
        if mistaken:
            raise FitError(mistaken)


def drive_seen(measurement: Measurement) -> float:
    """The drive as the frames alone show it, m/s; NaN where none is seen."""
    seen = profile_of(measurement.kind).fit.drive_seen
    return float("nan") if seen is None else seen(measurement.t, measurement.values, measurement.seen)


def other_unit(
    measurements: Sequence[Measurement],
    models: Sequence[Model],
    evidence: Callable[[Sequence[Measurement], Sequence[Model]], float],
) -> str | None:
    """The unit in which the numbers are far likelier than as stated, in a sentence; None where none is.

    Drive and camera are held as they are stated: a fit in which they are free goes anywhere where an effect
    is missing.

    Parameters
    ----------
    measurements, models : sequences
    evidence : callable
        Of measurements and models held as they are, the model's error as large as is tried; raises FitError.
    """
    short = [m.rows(np.arange(min(_FRAMES, len(m)))) for m in measurements]
    try:
        stated = evidence(short, models)
    except FitError:
        stated = -np.inf
    best, told = stated + _CLEARLY * sum(int(m.seen.sum()) * len(m.names) for m in short), None
    for tried in zip(*(_units(*pair) for pair in zip(short, models, strict=True)), strict=True):
        units = [unit for unit in tried if unit]
        if len(units) < len(tried):
            continue
        try:
            found = evidence([u.measurement for u in units], [u.model for u in units])
            found += sum(u.nats for u in units)
        except FitError:
            continue
        if found > best:
            best, told = found, units[0].text
    return told


def _units(measurement: Measurement, model: Model) -> Iterator[Unit | None]:
    """The units that are tried, the same for every measurement; None for one that its frames exclude."""
    profile = model.profile
    for other in profile.fit.other_units(model):
        drive = other.parameters.get(profile.dynamics.drive or "")
        if drive is not None and not 1 / _DECADE < drive_seen(measurement) / drive < _DECADE:
            yield None
            continue
        changed = model.with_parameters(model.parameters | other.parameters) if other.parameters else model
        moved = other.factors or other.shifts
        scaled, nats = _scaled(measurement, other.factors, other.shifts) if moved else (measurement, 0.0)
        yield Unit(other.text, changed, scaled, nats)


def _scaled(
    measurement: Measurement, factors: Mapping[str, float], shifts: Mapping[str, float]
) -> tuple[Measurement, float]:
    """The measurement with some of its columns multiplied and shifted, and what its log density gains."""
    sizes = np.array([factors.get(name, 1.0) for name in measurement.names])
    offsets = np.array([shifts.get(name, 0.0) for name in measurement.names])
    sigma = measurement.sigma
    scaled = Measurement(
        measurement.t,
        measurement.values * sizes + offsets,
        None if sigma is None else sigma * sizes,
        measurement.rho,
        measurement.flag,
        measurement.meta,
        measurement.names,
        inputs=measurement.inputs,
    )
    return scaled, int(measurement.seen.sum()) * float(np.log(sizes).sum())
