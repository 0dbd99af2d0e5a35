"""Whether numbers are in the units that they are taken to be in."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import Disk, Model, Pendulum

Array = NDArray[np.float64]

#: Decades by which a stated speed or length may be off: cm, mm and their inverses.
_DECADES = (-3, -2, -1, 1, 2, 3)
_DECADE = 4.0  # times that what the frames show may be off a drive in the right unit
_FRAMES = 250  # of each measurement: enough to tell units apart, and soon done
#: Nats per number seen by which another unit must be likelier. Right units win by 0.5 and more even where a
#: strong effect is missing; what a missing effect lends to a wrong one is a tenth of that.
_CLEARLY = 0.3
_BEYOND = 5.0  # radii: no disk is as far from its contact, but one whose place is in cm is
_SLOWEST = 0.5  # s between frames of a disk, which changes its motion in a quarter of that
_DEGREE = np.pi / 180
_NEAR = 0.25  # by how much a ratio may be off its unit
_SURE = 0.7  # correlation from which on a slope counts
_BENDS = 3.0  # times what gravity can bend a pendulum's motion


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
        if isinstance(model, Disk) and measurement.kind == "disk":
            _ask_disk(model, measurement, step)
        elif isinstance(model, Pendulum) and measurement.kind == "pendulum":
            _ask_pendulum(model, measurement, step)


def _ask_disk(model: Disk, measurement: Measurement, step: float) -> None:
    y, z, beta = measurement.values[measurement.seen].T
    if step > _SLOWEST:
        raise FitError(
            f"the times step by {step:.3g}, too far apart for a disk if they are in s: are they in ms?"
        )
    away = float(np.median(np.hypot(y, z)))
    if away > _BEYOND * model.R:
        raise FitError(
            f"the disk's centre is typically {away:.3g} from the contact, but its radius is {model.R:g} m: "
            f"are Y and Z in {'mm' if away > 100 * model.R else 'cm'}?"
        )
    # A disk that rolls goes dY = Z dbeta, whatever drives and brakes it.
    along, turned = np.diff(y), 0.5 * (z[1:] + z[:-1]) * np.diff(beta)
    power = float(turned @ turned)
    if not power or not along.any():
        return
    slope = float(along @ turned) / power
    sure = slope * np.sqrt(power / float(along @ along)) > _SURE
    if sure and abs(slope / _DEGREE - 1) < _NEAR:
        raise FitError(
            f"the disk rolls {1 / slope:.3g} times less far than beta turns if that is in rad: is beta in "
            "degrees?"
        )


def _ask_pendulum(model: Pendulum, measurement: Measurement, step: float) -> None:
    theta = measurement.values[measurement.seen, 0]
    pace = np.sqrt(model.inertia / (model.g * model.length))
    period = 2 * np.pi * pace
    if step > period / 2:
        raise FitError(
            f"the times step by {step:.3g}, but the pendulum swings once in {period:.3g} s: are they in ms, "
            "or the length in another unit than m?"
        )
    if np.ptp(theta) <= 2 * np.pi:  # within one turn it may never have been unwrapped
        return
    lag = max(round(period / 8 / step), 1)
    bend = np.abs(theta[2 * lag :] - 2 * theta[lag:-lag] + theta[: -2 * lag])
    if len(bend) and float(np.quantile(bend, 0.9)) > _BENDS * max((lag * step / pace) ** 2, 0.3):
        raise FitError(
            f"the angle has a range of {np.ptp(theta):.3g}, with steps of up to "
            f"{float(np.abs(np.diff(theta)).max()):.3g} between frames, which gravity cannot do if it is in "
            "rad: is it in degrees?"
        )


def drive_seen(measurement: Measurement) -> float:
    """The drive W as the frames alone show it, m/s: the mean of dZ/dT + Y dbeta/dT.

    No fit is needed, and hardly an effect moves it.
    """
    near = measurement.seen[1:] & measurement.seen[:-1]
    if not near.any():
        return float("nan")
    y, z, beta = measurement.values.T
    lifted = np.diff(z) + 0.5 * (y[1:] + y[:-1]) * np.diff(beta)
    return float(lifted[near].sum() / np.diff(measurement.t)[near].sum())


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
    """The units that are tried, the same for every measurement; None for one that its frames exclude.

    Of a disk the drive's alone: that its places or its angle are in another unit :func:`ask` sees at once.
    """
    if isinstance(model, Disk):
        for k in _DECADES if model.W else ():
            drive = model.W * 10.0**k
            if not 1 / _DECADE < drive_seen(measurement) / drive < _DECADE:
                yield None
                continue
            yield Unit(
                f"the motion is that of a drive of {drive:.3g} m/s, where {model.W:g} m/s was stated: check "
                "the drive and its unit",
                model.with_parameters({**model.parameters, "W": drive}),
                measurement,
            )
    elif isinstance(model, Pendulum):
        yield Unit(
            "the motion is that of a pendulum whose angle is in degrees, not in rad",
            model,
            *_scaled(measurement, {"theta": _DEGREE}),
        )
        for k in _DECADES:
            length = model.length * 10.0**k
            inertia = model.inertia * 10.0 ** (2 * k)
            yield Unit(
                f"the motion is that of a pendulum of {length:.3g} m, where {model.length:g} m was stated: "
                "check the length and its unit",
                model.with_parameters({**model.parameters, "length": length, "inertia": inertia}),
                measurement,
            )


def _scaled(measurement: Measurement, factors: Mapping[str, float]) -> tuple[Measurement, float]:
    """The measurement with some of its columns multiplied, and what that does to a density's logarithm."""
    sizes = np.array([factors.get(name, 1.0) for name in measurement.names])
    sigma = measurement.sigma
    scaled = Measurement(
        measurement.t,
        measurement.values * sizes,
        None if sigma is None else sigma * sizes,
        measurement.rho,
        measurement.flag,
        measurement.meta,
        measurement.names,
    )
    return scaled, int(measurement.seen.sum()) * float(np.log(sizes).sum())
