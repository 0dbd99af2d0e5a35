"""Which parameters a fit leaves free, and what is known of them beforehand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from udd import _core
from udd.errors import FitError
from udd.models import Model


@dataclass(frozen=True)
class Free:
    """A free parameter: its name, what it belongs to, and its Gaussian prior.

    Attributes
    ----------
    name : str
        Followed by the number of the film in brackets where it belongs to one of several.
    role : str
        ``"model"``, ``"camera"`` or ``"clock"``.
    index : int
        Its place among the parameters of that role.
    mean, sd : float
        The prior; an infinite standard deviation for none.
    film : int or None
        The film that it belongs to; None where all share it.
    """

    name: str
    role: str
    index: int
    mean: float
    sd: float
    film: int | None = None


def free_parameters(
    models: Sequence[Model],
    free: Iterable[str] | None = None,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
    each: Iterable[str] | None = None,
) -> tuple[Free, ...]:
    """The free parameters of a fit.

    Parameters
    ----------
    models : sequence of Disk or Pendulum
        One per film; their values are the priors' means.
    free : iterable of str, optional
        Names of the model's free parameters. By default ``k0, k1, k2, W`` of a disk, ``k0, length, inertia``
        of a pendulum, and the amplitudes of all effects.
    camera : bool or iterable of str
        Whether the camera's parameters are free, or which.
    priors : mapping of str to (mean, standard deviation), optional
        Replaces the default priors.
    each : iterable of str, optional
        The model's parameters that every film has a value of its own of; by default the drive ``W``. Those of
        the camera always are.

    Raises
    ------
    FitError
        A name that the model or the camera does not have, or a prior that is none.
    """
    model = models[0]
    values = model.parameters
    names = list(_spread(model)) + _amplitudes(model) if free is None else names_of("free", free)
    sensor = model.profile.sensor
    known = {**sensor.camera, **({} if sensor.clock is None else {"clock": sensor.clock})}
    wanted = list(known) if camera is True else [] if camera is False else names_of("camera", camera)
    twice = {name for name in [*names, *wanted] if [*names, *wanted].count(name) > 1}
    if twice:
        raise FitError(f"{', '.join(sorted(twice))} is named twice")
    own = set(model.profile.fit.each if each is None else names_of("each", each))
    for name in [*names, *(own if each is not None else ())]:
        if name not in values:
            raise FitError(f"the model has no parameter {name!r}; it has {', '.join(values)}")
    for name in wanted:
        if name not in known:
            raise FitError(f"the camera has no parameter {name!r}; it has {', '.join(known)}")

    several = len(models) > 1
    order, cameras = list(values), [name for name, _unit in _core.camera_parameters(model.kind)]
    result = []
    for name in names:
        films = range(len(models)) if several and name in own else [None]
        for film in films:
            of = models[film or 0]
            spread = _spread(of)
            if free is None and name not in spread and name not in _amplitudes(of):
                continue  # a drive at rest
            label = name if film is None else f"{name}[{film}]"
            sd = np.inf if name in _amplitudes(of) else spread.get(name, np.inf)
            result.append(Free(label, "model", order.index(name), of.parameters[name], sd, film))
    for film in range(len(models)):
        for name in wanted:
            role, index = ("clock", 0) if name == "clock" else ("camera", cameras.index(name))
            label = f"{name}[{film}]" if several else name
            result.append(Free(label, role, index, 0.0, known[name], film if several else None))
    return _with_priors(result, dict(priors or {}))


def names_of(option: str, given: Iterable[str]) -> list[str]:
    """The names that an option lists.

    Raises
    ------
    FitError
        It is no list, or a name alone.
    """
    if isinstance(given, str):
        raise FitError(f'{option} must be a list of names, not a name: {option}=["{given:.80}"]')
    if not isinstance(given, Iterable):
        raise FitError(f"{option} must be a list of names, not {given!r}")
    names = list(given)
    if not all(isinstance(name, str) for name in names):
        raise FitError(f"{option} must be a list of names, not {names!r:.80}")
    return names


def known_camera(kind: str, meta: Mapping[str, Any]) -> list[float]:
    """The camera's parameters before a fit: it gets nothing wrong, and its picture's middle is as said.

    Raises
    ------
    FitError
        ``middle`` is said, but is not two finite numbers.
    """
    known = dict.fromkeys((name for name, _unit in _core.camera_parameters(kind)), 0.0)
    if "middle_y" in known and meta.get("middle") is not None:
        try:
            y, z = (float(x) for x in meta["middle"])
        except (TypeError, ValueError):
            y = z = np.nan
        if not np.isfinite([y, z]).all():
            raise FitError(
                f"the picture's middle must be two numbers [m], both finite, not {meta['middle']!r}"
            )
        known |= {"middle_y": y, "middle_z": z}
    return list(known.values())


def _amplitudes(model: Model) -> list[str]:
    """The amplitudes of a model's effects."""
    return [f"{e.name}.{p}" for e in model.effects for p in e.amplitudes]


def _spread(model: Model) -> dict[str, float]:
    """The standard deviations of the priors of what is free by default."""
    values = model.parameters
    priors = model.profile.fit.priors
    if priors is None:
        return {name: np.inf for name in values if name not in _amplitudes(model)}
    # A drive at rest is at rest.
    free = [name for name in priors if name != model.profile.dynamics.drive or values[name]]
    known = {name: priors[name] * abs(values[name]) if np.isfinite(priors[name]) else np.inf for name in free}
    return {name: sd if sd > 0 else np.inf for name, sd in known.items()}


def _with_priors(free: list[Free], given: dict[str, tuple[float, float]]) -> tuple[Free, ...]:
    """The parameters with the priors given, by their names or by what stands before the brackets."""
    for name, prior in given.items():
        if not (isinstance(prior, (tuple, list)) and len(prior) == 2):
            raise FitError(f"the prior of {name} must be a mean and a standard deviation, not {prior!r}")
        mean, sd = prior
        if not (np.isfinite(mean) and sd > 0):
            raise FitError(
                f"the prior of {name} needs a finite mean and a standard deviation that must be positive"
            )
    unknown = set(given) - {f.name for f in free} - {f.name.split("[")[0] for f in free}
    if unknown:
        raise FitError(f"a prior is given for {', '.join(sorted(unknown))}, which is not free")
    result = []
    for f in free:
        mean, sd = given.get(f.name, given.get(f.name.split("[")[0], (f.mean, f.sd)))
        result.append(replace(f, mean=mean, sd=sd))
    return tuple(result)
