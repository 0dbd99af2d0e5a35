"""Free parameters of a fit and their priors."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from udd import _core
from udd.effects.user_defined import UNLIMITED
from udd.errors import FitError
from udd.models import Model


@dataclass(frozen=True)
class Free:
    """Free parameter: its name, its owner, and its Gaussian prior.

    Attributes
    ----------
    name : str
        Name. The number of the film follows in brackets if the parameter belongs to one of several.
    role : str
        ``"model"``, ``"camera"`` or ``"clock"``.
    index : int
        Its place among the parameters of that role. It is counted from 0.
    mean, sd : float
        Mean and standard deviation of the prior. Infinite means no prior.
    film : int or None
        The film that it belongs to. None if all share it.
    range : tuple of float
        Least and largest value for which the model is defined.
    """

    name: str
    role: str
    index: int
    mean: float
    sd: float
    film: int | None = None
    range: tuple[float, float] = UNLIMITED

    @property
    def base(self) -> str:
        """Name without the number of the film."""
        return self.name.partition("[")[0]


def free_parameters(
    models: Sequence[Model],
    free: Iterable[str] | None = None,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
    each: Iterable[str] | None = None,
) -> tuple[Free, ...]:
    """Return the free parameters of a fit of one model per film; the options are those of :func:`udd.fit`.

    Raises
    ------
    FitError
        A name is not one of the model's or the camera's, or a prior is invalid.
    """
    model = models[0]
    values = model.parameters
    names = list(_spread(model)) + _amplitudes(model) if free is None else names_of("free", free)
    sensor = model.profile.sensor
    camera_priors = {**sensor.camera, **({} if sensor.clock is None else {"clock": sensor.clock})}
    wanted = list(camera_priors) if camera is True else [] if camera is False else names_of("camera", camera)
    if twice := sorted(name for name, count in Counter([*names, *wanted]).items() if count > 1):
        raise FitError(f"{', '.join(twice)} is named twice; name it once")
    film_specific = set(model.profile.fit.each if each is None else names_of("each", each))
    for name in [*names, *(film_specific if each is not None else ())]:
        if name not in values:
            raise FitError(f"the model has no parameter {name!r}; it has {', '.join(values)}")
    for name in wanted:
        if name not in camera_priors:
            raise FitError(f"the camera has no parameter {name!r}; it has {', '.join(camera_priors)}")

    several = len(models) > 1
    order, cameras = list(values), [name for name, _unit in _core.camera_parameters(model.kind)]
    result = []
    for name in names:
        films = range(len(models)) if several and name in film_specific else [None]
        for film in films:
            of = models[film or 0]
            spread = _spread(of)
            if free is None and name not in spread and name not in _amplitudes(of):
                continue  # a drive of zero stays fixed
            label = name if film is None else f"{name}[{film}]"
            mean, sd = of.parameters[name], spread.get(name, np.inf)
            limits = shapes(of).get(name, UNLIMITED)
            result.append(Free(label, "model", order.index(name), mean, sd, film, limits))
    for film in range(len(models)):
        for name in wanted:
            role, index = ("clock", 0) if name == "clock" else ("camera", cameras.index(name))
            label = f"{name}[{film}]" if several else name
            result.append(Free(label, role, index, 0.0, camera_priors[name], film if several else None))
    return _with_priors(result, dict(priors or {}))


def names_of(option: str, given: Iterable[str]) -> list[str]:
    """Check and return the names that an option lists.

    Raises
    ------
    FitError
        The option is not a list, or it is a single name.
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
    """Return the camera's parameters before a fit: no errors, and the picture's middle as stated.

    Raises
    ------
    FitError
        ``middle`` is stated, but is not two finite numbers.
    """
    camera = dict.fromkeys((name for name, _unit in _core.camera_parameters(kind)), 0.0)
    if "middle_y" in camera and meta.get("middle") is not None:
        try:
            y, z = (float(x) for x in meta["middle"])
        except (TypeError, ValueError):
            y = z = np.nan
        if not np.isfinite([y, z]).all():
            raise FitError(
                f"the picture's middle must be two numbers [m], both finite, not {meta['middle']!r}"
            )
        camera |= {"middle_y": y, "middle_z": z}
    return list(camera.values())


def shapes(model: Model) -> dict[str, tuple[float, float]]:
    """Return the range of each parameter that gives an effect of a model its shape."""
    return {
        f"{effect.name}.{p.name}": p.range
        for effect in model.effects
        for p in effect.spec.parameters
        if p.role != "amplitude"
    }


def _amplitudes(model: Model) -> list[str]:
    """Return the names of the amplitudes of a model's effects."""
    return [f"{e.name}.{p}" for e in model.effects for p in e.amplitudes]


def _spread(model: Model) -> dict[str, float]:
    """Return the standard deviations of the priors of parameters that are free by default."""
    values = model.parameters
    priors = model.profile.fit.priors
    if priors is None:
        return {name: np.inf for name in values if name not in _amplitudes(model)}
    # A drive of zero stays fixed.
    free = [name for name in priors if name != model.profile.dynamics.drive or values[name]]
    spread = {
        name: priors[name] * abs(values[name]) if np.isfinite(priors[name]) else np.inf for name in free
    }
    return {name: sd if sd > 0 else np.inf for name, sd in spread.items()}


def _with_priors(free: list[Free], given: dict[str, tuple[float, float]]) -> tuple[Free, ...]:
    """Replace the priors that are given by a parameter's name, or by its part before the brackets."""
    for name, prior in given.items():
        if not (isinstance(prior, (tuple, list)) and len(prior) == 2):
            raise FitError(f"the prior of {name} must be a mean and a standard deviation, not {prior!r:.80}")
        mean, sd = prior
        if not (np.isfinite(mean) and sd > 0):
            raise FitError(
                f"the prior of {name} needs a finite mean and a positive standard deviation, not {mean}, {sd}"
            )
    unknown = set(given) - {f.name for f in free} - {f.base for f in free}
    if unknown:
        raise FitError(
            f"priors has {', '.join(sorted(unknown))}, which is not free; add it to free or drop it"
        )
    chosen = (given.get(f.name, given.get(f.base, (f.mean, f.sd))) for f in free)
    return tuple(replace(f, mean=mean, sd=sd) for f, (mean, sd) in zip(free, chosen, strict=True))
