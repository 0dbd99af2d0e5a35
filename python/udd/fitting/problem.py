"""Weighted least-squares problem of a fit, and points at which it is solved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.one_line import OneLine
from udd.effects.user_defined import UNLIMITED
from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import Model, profile_of
from udd.models.formula_model import FormulaModel

from .estimator_input import EstimatorInput, FilmParameters, Observations
from .formula_models import driven
from .noise import Noise
from .parameters import Free, known_camera, shapes
from .record import Record

Array = NDArray[np.float64]

_FRAME = 0.04  # s, the time over which the profiles state the assumed model error
#: Leverage above which a fit follows each frame.
FOLLOWS = 0.7


def levels(kind: str) -> tuple[tuple[float, ...], ...]:
    """Return the assumed model errors, large to small, per square root of a second."""
    return tuple(tuple(q / _FRAME**0.5 for q in level) for level in profile_of(kind).fit.model_error)


@dataclass(frozen=True, repr=False)
class Problem(OneLine):
    """Measurements prepared for a model: all inputs of a solve except its start.

    Attributes
    ----------
    models : tuple of Model
        One per film; they differ only in parameter values.
    schedule : tuple of tuple of float
        Assumed model errors, large to small, per square root of a second.
    diffusion : tuple of float
        The assumed model error now.
    likeliest : bool
        True if the model error is the most probable one; else it is as small as possible.
    measurements : tuple of Measurement
    """

    models: tuple[Model, ...]
    record: Record
    free: tuple[Free, ...]
    noise: Noise
    schedule: tuple[tuple[float, ...], ...]
    diffusion: tuple[float, ...]
    likeliest: bool = True
    measurements: tuple[Measurement, ...] = ()

    @property
    def has_smallest_model_error(self) -> bool:
        """True at the last level of the schedule, which a right model reaches."""
        return self.diffusion == self.schedule[-1]

    def with_model_error(self, diffusion: tuple[float, ...]) -> Problem:
        """Return the problem with another model error, per square root of a second."""
        return replace(self, diffusion=diffusion)

    def freeing(self, priors: Mapping[str, tuple[float, float]]) -> Problem:
        """Return the problem with more parameters of the model free: name, and mean and s.d. of the prior."""
        model = self.models[0]
        order, limits = list(model.parameters), shapes(model)
        more = (
            replace(Free(name, "model", order.index(name), *prior), range=limits.get(name, UNLIMITED))
            for name, prior in priors.items()
        )
        return replace(self, free=(*self.free, *more))

    def of_states(self, record: Record) -> Problem:
        """Return the problem of another record with its states as the only unknowns."""
        return replace(self, record=record, free=(), noise=self.noise.of(record))

    def at(self, point: Point) -> EstimatorInput:
        """Return the problem at a point, as input of the core's estimator."""
        record, noise = self.record, self.noise
        information = noise.information(record, point.states[:, 0])
        observations = Observations(
            record.t, record.seen, information, record.linked, record.film, noise.memory.tolist()
        )
        return EstimatorInput(
            self.models[0], observations, point.states, point.sets, self.free, self.diffusion, point.linear
        )


@dataclass(frozen=True, repr=False)
class Point(OneLine):
    """Values of all unknowns: the states, and for every film the model's, the camera's and the clock's.

    Attributes
    ----------
    linear : Linearised, optional
        The record linearised there, if a solve computed it: further results need not compute it again. It is
        left out of a pickle or a copy.
    """

    states: Array
    sets: tuple[FilmParameters, ...]
    linear: _core.Linearised | None = field(default=None, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "linear": None}

    def without_cache(self) -> Point:
        """Return the point without its linearisation."""
        return Point(self.states, self.sets)

    def with_values(self, change: Callable[[list[float]], list[float]]) -> Point:
        """Return the point with the values of every film's model changed."""
        return Point(self.states, tuple(film._replace(model=change(film.model)) for film in self.sets))

    def value(self, free: Free) -> float:
        """Return the value of a free parameter."""
        film = self.sets[free.film or 0]
        return {"model": film.model, "camera": film.camera, "clock": [film.clock]}[free.role][free.index]


def start_point(models: Sequence[Model], measurements: Sequence[Measurement], record: Record) -> Point:
    """Return the start of a fit: the states as read, all parameters at their given values."""
    sets = tuple(
        FilmParameters(list(model.parameters.values()), known_camera(model.kind, film.meta), 0.0)
        for model, film in zip(models, measurements, strict=True)
    )
    return Point(record.states, sets)


def one_model_each(model: Model | Sequence[Model], measurements: Sequence[Measurement]) -> tuple[Model, ...]:
    """Return one model per measurement; they may differ only in parameter values."""
    models = tuple(model) if isinstance(model, Sequence) else (model,) * len(measurements)
    for each, measurement in zip(models, measurements, strict=True):
        if not isinstance(each, Model):
            raise FitError(f"a model is needed (udd.Disk, udd.Pendulum, udd.Model), not {each!r}")
        if not each.profile.written and measurement.kind != each.kind:
            raise FitError(
                f"the measurement has columns {', '.join(measurement.names)}, "
                f"which {type(each).__name__} does not explain"
            )
        if list(each.parameters) != list(models[0].parameters):
            raise FitError(
                "the models of several measurements must be alike but for their parameters' values"
            )
    written = [each for each in models if isinstance(each, FormulaModel)]
    return driven(written, measurements) if written and written[0].inputs else models
