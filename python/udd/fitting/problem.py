"""The weighted least-squares problem of a fit, and its result."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.keywords import renamed, renamed_attribute
from udd._util.one_line import OneLine
from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import Model, profile_of
from udd.models.formula_model import FormulaModel

from .estimator_input import EstimatorInput, FilmParameters, Observations
from .noise import Noise, colour
from .parameters import Free
from .record import Record
from .sensor import geometry_limits

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .diagnostics import Diagnostics
    from .uncertainty_budget import Budget

Array = NDArray[np.float64]

_FRAME = 0.04  # s, over which the profiles state the model's assumed error
#: A fit whose leverage is larger follows each frame.
FOLLOWS = 0.7


def levels(kind: str) -> tuple[tuple[float, ...], ...]:
    """The model's assumed error, loose to tight, per square root of a second."""
    return tuple(tuple(q / _FRAME**0.5 for q in level) for level in profile_of(kind).fit.model_error)


@dataclass(frozen=True, repr=False)
class Problem(OneLine):
    """Measurements laid out for a model, with everything that a solve needs but its start.

    Attributes
    ----------
    models : tuple of Model
        One per film, alike but for their parameters' values.
    likeliest : bool
        Whether the model is held as tightly as is likeliest; else as tightly as it can be.
    """

    models: tuple[Model, ...]
    record: Record
    free: tuple[Free, ...]
    noise: Noise
    schedule: tuple[tuple[float, ...], ...]
    diffusion: tuple[float, ...]
    likeliest: bool = True

    def with_model_error(self, diffusion: tuple[float, ...]) -> Problem:
        """The same with the model held this tightly: its assumed error, per square root of a second."""
        return replace(self, diffusion=diffusion)

    def at(self, point: Point) -> EstimatorInput:
        """The problem at a point, as the core's estimator reads it."""
        observations = Observations.of(self.record, self.noise, point.states[:, 0])
        return EstimatorInput(
            self.models[0], observations, point.states, point.sets, self.free, self.diffusion, point.linear
        )


@dataclass(frozen=True, repr=False)
class Point(OneLine):
    """Values of all unknowns: the states, and for every film the model's, the camera's and the clock's.

    Attributes
    ----------
    linear : Linearised, optional
        The record linearised there, where a solve came to it: who asks for more there need not do it again.
        It does not go with a pickle or a copy.
    """

    states: Array
    sets: tuple[FilmParameters, ...]
    linear: _core.Linearised | None = field(default=None, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "linear": None}

    def bare(self) -> Point:
        """The same without what a solve left there."""
        return Point(self.states, self.sets)

    def value(self, free: Free) -> float:
        """The value of a free parameter."""
        model, camera, clock = self.sets[free.film or 0]
        return {"model": model, "camera": camera}[free.role][free.index] if free.role != "clock" else clock


@dataclass(frozen=True, eq=False)
class Fit(Drawable):
    """A model fitted to a measurement, or to several.

    Attributes
    ----------
    models : tuple of Model
        With the fitted parameters, one per measurement.
    parameters : dict of str to float
        The free parameters, the camera's included; those that only one of several measurements has are
        followed by its number in brackets.
    errors : dict of str to float
        Their standard errors.
    covariance : ndarray (p, p)
        In the order of `parameters`.
    chi2, dof : float
        Sum of squares in units of the assumed noise and model error, and what it should be.
    evidence : float
        Logarithm of the record's likelihood, states and parameters integrated out, but for a constant.
    converged : bool
    measurements : tuple of Measurement
    record : Record
        The frames as the estimator saw them.
    states : ndarray (n, d)
        The state at each frame of `record`.
    state_covariance : ndarray (n, d, d)
    misfit, misfit_variance : ndarray (n, m)
        What was seen less what was fitted, NaN where nothing was seen, and the variance of what was fitted.
    defect : ndarray (n - 1, d)
        By how much each state misses what the model makes of the one before, per second: the residual of each
        equation. NaN where frames are not linked.
    noise : Noise
        The measurement's noise as the record shows it.
    widened : float
        By what `errors` were multiplied, and the covariance twice, for what the model may miss.
    unit_doubt : str or None
        The unit that explains the record far better than the one stated, in a sentence.
    """

    models: tuple[Model, ...]
    parameters: dict[str, float]
    errors: dict[str, float]
    covariance: Array
    chi2: float
    dof: float
    evidence: float
    converged: bool
    iterations: int
    measurements: tuple[Measurement, ...]
    record: Record
    states: Array
    state_covariance: Array
    misfit: Array
    misfit_variance: Array
    defect: Array
    noise: Noise
    problem: Problem
    point: Point
    widened: float = 1.0
    unit_doubt: str | None = None

    @property
    def model(self) -> Model:
        """The fitted model, of the first measurement."""
        return self.models[0]

    @property
    def measurement(self) -> Measurement:
        """The first measurement."""
        return self.measurements[0]

    @property
    def channels(self) -> tuple[str, ...]:
        """What `misfit` is of: the measurement's columns, or all that a user's own model shows."""
        return self.model.channels if isinstance(self.model, FormulaModel) else self.measurement.names

    @property
    def blurring(self) -> Array:
        """The angular speed that noise may grow with, rad/s; a user's state need not be one."""
        omega = self.states[:, 0]
        return np.zeros(len(omega)) if self.model.profile.written else omega

    @property
    def residuals(self) -> Array:
        """What was seen less what was fitted, for every row of the measurement; NaN where not seen.

        Those of several measurements come one after the other.
        """
        rows = [np.full((len(m), self.misfit.shape[1]), np.nan) for m in self.measurements]
        for film, own in enumerate(rows):
            there = (self.record.film == film) & (self.record.row >= 0)
            own[self.record.row[there]] = self.misfit[there]
        return np.concatenate(rows)

    @property
    def observations(self) -> int:
        """How many numbers were seen."""
        return int(np.isfinite(self.misfit).sum())

    @property
    def level(self) -> int:
        """How tightly the model was held: the place of its assumed error in the schedule."""
        return self.problem.schedule.index(self.problem.diffusion)

    @property
    def scatter(self) -> float:
        """chi2 per degree of freedom: 1 where model and noise explain the data."""
        return self.chi2 / (self.dof if self.dof > 0.0 else 1.0)

    @property
    def leverage(self) -> float:
        """How closely the fit follows each frame: its variance in units of the noise's, in the mean."""
        sd = self.noise.sd(self.record, self.states[:, 0])
        return float((self.misfit_variance / sd**2)[self.record.observed].mean())

    @property
    def faults(self) -> float:
        """How much of chi2 a film's faults that go with the motion may make up: 0 where noise hides them."""
        sd = self.noise.sd(self.record, self.states[:, 0])
        fault = np.array(self.model.profile.sensor.faults)
        return float(np.square(fault / sd, where=self.record.observed, out=np.zeros(sd.shape)).sum())

    put_away = renamed_attribute("put_away", "without_cache")

    def without_cache(self) -> Fit:
        """The same without what its solve left for those who ask for more: a kilobyte and a half a frame."""
        return replace(self, point=self.point.bare())

    def inflation(self, before: Fit) -> float:
        """By what a fall of chi2 from another fit is divided before it counts.

        The scatter that remains, times how much stronger the misfits are at the frequencies where the two
        differ.
        """
        return max(self.scatter, 1.0) * self._colour(before)

    @cached_property
    def shown(self) -> float:
        """The scatter, at least 1 where the noise was known; how forms are told apart.

        A pendulum's film is not taken for better than its geometry, which many are.
        """
        assumed = geometry_limits(self.model.profile.sensor, self.measurement)
        return self.scatter if assumed else max(self.scatter, 1.0)

    def _colour(self, before: Fit) -> float:
        sd = self.noise.sd(self.record, self.states[:, 0])
        return colour(self.misfit / sd, (before.misfit - self.misfit) / sd)

    @cached_property
    def doubts(self) -> Diagnostics:
        """What the fit shows of its own faults: whether something is missing, and what ran off."""
        from .diagnostics import doubts

        return doubts(self)

    def doubted(self) -> Fit:
        """The same with standard errors that contain what the model may miss, see :class:`Diagnostics`."""
        factor = self.doubts.factor / self.widened
        if factor == 1.0:
            return self
        errors = {name: factor * error for name, error in self.errors.items()}
        widened = factor * self.widened
        result = replace(self, errors=errors, covariance=factor**2 * self.covariance, widened=widened)
        result.__dict__["doubts"] = self.doubts
        return result

    @renamed(held="fixed")
    @checked_arguments(error=FitError)
    def budget(self, fixed: Mapping[str, float] | None = None, k: float = 2.0) -> Budget:
        """Uncertainty budget (GUM) of the fitted numbers, see :mod:`udd.fitting.uncertainty_budget`."""
        from .uncertainty_budget import budget

        return budget(self, fixed, k)

    def summary(self) -> str:
        """The fit on one screen: what it shows of its own faults, and every parameter with its unit."""
        return "\n".join([self._state, *self.doubts.sentences, *self._table()])

    @property
    def _state(self) -> str:
        state = "converged" if self.converged else "NOT converged"
        return f"{state}, chi2/dof = {self.scatter:.3f}, {len(self.record.t)} frames"

    def _table(self) -> list[str]:
        """Every parameter on a line."""
        from .diagnostics import units
        from .parameter_meanings import meaning

        known = units(self)
        return [
            f"  {name:<24} {value:>12.5g} +- {self.errors[name]:<8.2g} {known[name]:<6} "
            f"{meaning(name, self.model.kind)}".rstrip()
            for name, value in self.parameters.items()
        ]

    def __repr__(self) -> str:
        """One line; :meth:`summary` says more."""
        numbers = ", ".join(f"{name} = {value:.5g}" for name, value in list(self.parameters.items())[:4])
        more = ", ..." if len(self.parameters) > 4 else ""
        kinds = ", ".join(dict.fromkeys(type(model).__name__ for model in self.models))
        return f"<Fit of {kinds}: {self._state}; {numbers}{more}>"

    def _repr_html_(self) -> str:
        """As :meth:`summary`, for notebooks."""
        from html import escape

        first, *more = self.doubts.sentences
        items = "".join(f"<li>{escape(line)}</li>" for line in more)
        table = escape("\n".join(self._table()))
        head = f"<p>{escape(self._state)}: <strong>{escape(first)}</strong></p>"
        return f"{head}<ul>{items}</ul><pre>{table}</pre>"

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads: parameters with errors, noise, goodness, and what there is to doubt."""
        return self.numbers() | {"doubts": self.doubts.to_dict()}

    def numbers(self) -> dict[str, Any]:
        """Parameters with errors, noise and goodness, as a machine reads them."""
        return {
            "model": repr(self.model),
            "parameters": {n: {"value": v, "se": self.errors[n]} for n, v in self.parameters.items()},
            "chi2": self.chi2,
            "dof": self.dof,
            "converged": self.converged,
            "noise": {
                name: {"factor": float(f), "per_rad_per_s": float(b), "memory": float(m)}
                for name, f, b, m in zip(
                    self.channels, self.noise.factor, self.noise.blur, self.noise.memory, strict=True
                )
            },
        }

    def __str__(self) -> str:
        return self.summary()
