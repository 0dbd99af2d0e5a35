"""Result of a fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.drawable import Drawable
from udd._util.keywords import renamed_attribute
from udd._util.value_text import with_error
from udd.measurement import Measurement
from udd.models import Model
from udd.models.formula_model import FormulaModel

from . import uncertainty_budget
from .diagnostics import Diagnostics, doubts, units
from .minimum import DONE, MOST, minimum
from .noise import Noise, colour
from .parameter_meanings import meaning
from .problem import Point, Problem
from .record import Record
from .sensor import geometry_limits

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fit(Drawable):
    """Result of fitting a model to a measurement, or to several.

    Attributes
    ----------
    models : tuple of Model
        With the fitted parameters, one per measurement.
    parameters : dict of str to float
        The free parameters, the camera's included. Those of one of several measurements are followed by its
        number in brackets.
    errors : dict of str to float
        Their standard errors.
    covariance : ndarray (p, p)
        In the order of `parameters`.
    chi2, dof : float
        Sum of squares in units of the assumed noise and model error, and its expected value.
    evidence : float
        Log likelihood of the record, states and parameters integrated out, up to a constant.
    converged : bool
    measurements : tuple of Measurement
    record : Record
        The frames as the estimator used them.
    states : ndarray (n, d)
        The state at each frame of `record`.
    state_covariance : ndarray (n, d, d)
    misfit, misfit_variance : ndarray (n, m)
        Observations minus fitted values, NaN if nothing was observed, and the variance of the fitted values.
    defect : ndarray (n - 1, d)
        Residual of each equation: the difference between each state and the model's prediction from the one
        before, per second. NaN if frames are not linked.
    noise : Noise
        The measurement's noise as the record shows it.
    widened : float
        Factor by which `errors` were inflated for missing physics; the covariance by its square.
    limit : tuple of float, optional
        Model error of the parameters and their covariance, per square root of a second, if it is below that
        of `problem`. The numbers of a right law do not depend on it.
    unit_doubt : str or None
        Sentence about a unit that explains the record far better than the given one.

    See Also
    --------
    udd.plot.residuals : draw the residuals of an equation over a coordinate.
    udd.plot.misfit : draw observations minus fitted values over time.
    udd.plot.residual_map : draw the residuals over two coordinates.
    udd.plot.whiteness : draw the autocorrelation of the innovations.
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
    limit: tuple[float, ...] | None = None
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
        """Channels of `misfit`: the measurement's columns, or all channels of a user's own model."""
        return self.model.channels if isinstance(self.model, FormulaModel) else self.measurement.names

    @property
    def blurring(self) -> Array:
        """Angular speed that noise may grow with, rad/s; zero for a user's own model."""
        omega = self.states[:, 0]
        return np.zeros(len(omega)) if self.model.profile.written else omega

    @property
    def residuals(self) -> Array:
        """Observations minus fitted values, for every row of the measurement; NaN if not observed.

        Those of several measurements follow one after the other.
        """
        rows = [np.full((len(m), self.misfit.shape[1]), np.nan) for m in self.measurements]
        for film, film_rows in enumerate(rows):
            there = (self.record.film == film) & (self.record.row >= 0)
            film_rows[self.record.row[there]] = self.misfit[there]
        return np.concatenate(rows)

    @property
    def observations(self) -> int:
        """Count of observed numbers."""
        return int(np.isfinite(self.misfit).sum())

    @property
    def level(self) -> int:
        """Index of the model error in the schedule: a higher level is a smaller error."""
        return self.problem.schedule.index(self.problem.diffusion)

    @property
    def scatter(self) -> float:
        """chi2 per degree of freedom: 1 if model and noise explain the data."""
        return self.chi2 / (self.dof if self.dof > 0.0 else 1.0)

    @property
    def noise_sd(self) -> Array:
        """Standard deviation of the noise of every frame and channel, (n, m)."""
        return self.noise.sd(self.record, self.blurring)

    @property
    def smallest_decrease(self) -> float:
        """Decrease of chi2 at which a further fit stops; `scatter` scales it, as it scales errors."""
        return DONE * max(1.0, self.scatter)

    @property
    def frame_costs(self) -> Array:
        """Cost of every frame, (n,): its squared misfit plus the squared defect of the link after it.

        The misfit counts in units of the noise, the defect in units of the assumed model error.
        """
        record, problem = self.record, self.problem
        information = problem.noise.information(record, self.states[:, 0])
        misfit = np.nan_to_num(self.misfit)
        cost: Array = np.einsum("ni,nij,nj->n", misfit, information, misfit)
        # Defects are per second; the variance over a link of length dt is diffusion^2 dt.
        dt = np.abs(np.diff(record.t))[:, None]
        links = np.nan_to_num(self.defect) ** 2 * dt / np.array(problem.diffusion) ** 2
        cost[:-1] += links.sum(axis=1)
        return cost

    @property
    def leverage(self) -> float:
        """Mean variance of the fitted values in units of the noise: how closely the fit follows frames."""
        return float((self.misfit_variance / self.noise_sd**2)[self.record.observed].mean())

    @property
    def film_error_chi2(self) -> float:
        """Share of chi2 that a film's faults can explain if they follow the motion: 0 if noise hides them."""
        fault = np.array(self.model.profile.sensor.faults) / self.noise_sd
        return float(np.square(fault, where=self.record.observed, out=np.zeros(fault.shape)).sum())

    put_away = renamed_attribute("put_away", "without_cache")
    doubted = renamed_attribute("doubted", "with_diagnostics")
    faults = renamed_attribute("faults", "film_error_chi2")

    def without_cache(self) -> Fit:
        """Return the fit without its solve's linearisation, which takes about 1.5 kB a frame.

        Returns
        -------
        Fit
            With the same numbers.
        """
        return replace(self, point=self.point.without_cache())

    def inflation(self, before: Fit) -> float:
        """Return the factor by which a decrease of chi2 from another fit is divided.

        It is the remaining scatter times the misfits' excess power at the frequencies in which the two fits
        differ.

        Parameters
        ----------
        before : Fit
            Fit of the smaller model to the same record.

        Returns
        -------
        float
            The factor.
        """
        difference = (before.misfit - self.misfit) / self.noise_sd
        return max(self.scatter, 1.0) * colour(self.misfit / self.noise_sd, difference)

    @cached_property
    def shown(self) -> float:
        """Scatter, at least 1 if the noise was known; used to distinguish forms.

        A pendulum's film is not assumed to be more accurate than its geometry, as many are not.
        """
        assumed = geometry_limits(self.model.profile.sensor, self.measurement)
        return self.scatter if assumed else max(self.scatter, 1.0)

    @cached_property
    def doubts(self) -> Diagnostics:
        """Goodness of fit: remaining model error, whiteness, runaway parameters."""
        return doubts(self)

    def with_diagnostics(self) -> Fit:
        """Return the fit with standard errors that include missing physics.

        Returns
        -------
        Fit
            With errors and covariance inflated by the factor of its :class:`Diagnostics`.
        """
        factor = self.doubts.factor / self.widened
        if factor == 1.0:
            return self
        errors = {name: factor * error for name, error in self.errors.items()}
        covariance, widened = factor**2 * self.covariance, factor * self.widened
        result = replace(self, errors=errors, covariance=covariance, widened=widened)
        result.__dict__["doubts"] = self.doubts
        return result

    budget = uncertainty_budget.budget

    def summary(self) -> str:
        """Summarise the fit on one screen: its diagnostics, and every parameter with its unit.

        Returns
        -------
        str
            Text with several lines.
        """
        head = "parameters, with the standard error of the last digits in brackets:"
        return "\n".join([self._state, *self.doubts.sentences, head, *self._table()])

    @property
    def _state(self) -> str:
        state = "converged" if self.converged else "NOT converged"
        return f"{state}, chi2/dof = {self.scatter:.3f}, {len(self.record.t)} frames"

    def _table(self) -> list[str]:
        """Format every parameter on a line."""
        all_units = units(self)
        return [
            f"  {name:<24} {with_error(value, self.errors[name]):<18} {all_units[name]:<6} "
            f"{meaning(name, self.model.kind)}".rstrip()
            for name, value in self.parameters.items()
        ]

    def __repr__(self) -> str:
        """Describe the fit in one line; :meth:`summary` says more."""
        numbers = ", ".join(f"{name} = {value:.5g}" for name, value in list(self.parameters.items())[:4])
        ending = ", ..." if len(self.parameters) > 4 else ""
        written = [
            "Model" if isinstance(model, FormulaModel) else type(model).__name__ for model in self.models
        ]
        kinds = ", ".join(dict.fromkeys(written))
        return f"<Fit of {kinds}: {self._state}; {numbers}{ending}>"

    def _repr_html_(self) -> str:
        """Format :meth:`summary` for notebooks."""
        first, *other_sentences = self.doubts.sentences
        items = "".join(f"<li>{escape(line)}</li>" for line in other_sentences)
        table = escape("\n".join(self._table()))
        head = f"<p>{escape(self._state)}: <strong>{escape(first)}</strong></p>"
        return f"{head}<ul>{items}</ul><pre>{table}</pre>"

    def to_dict(self) -> dict[str, Any]:
        """Return parameters with errors, noise, goodness of fit and diagnostics as JSON-ready values.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
        return self.numbers() | {"doubts": self.doubts.to_dict()}

    def numbers(self) -> dict[str, Any]:
        """Return parameters with errors, noise and goodness of fit as JSON-ready values.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
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


def minimise(problem: Problem, point: Point, iterations: int = MOST, decrease: float = DONE) -> Fit:
    """Fit with the problem's assumed model error, from a point, as :func:`.minimum.minimum` does."""
    models, end, result = minimum(problem, point, iterations, decrease)
    record = problem.record
    seen = record.observed
    # Every state except a run's first is tied to the one before: the frames' misfits remain.
    runs = 1 + int((~record.linked).sum())
    proper = sum(np.isfinite(f.sd) for f in problem.free)
    counted = float(seen[problem.noise.weight > 0.0].sum())
    dof = counted + proper - len(problem.free) - runs * end.states.shape[1]
    linked = record.linked[:, None]
    dt = np.where(linked, np.diff(record.t)[:, None], 1.0)
    errors = np.sqrt(np.diag(result["covariance"])).tolist()
    return Fit(
        models=models,
        parameters={f.name: end.value(f) for f in problem.free},
        errors=dict(zip((f.name for f in problem.free), errors, strict=True)),
        covariance=result["covariance"],
        chi2=float(sum(result["cost"])),
        dof=dof,
        evidence=result["evidence"],
        converged=result["converged"],
        iterations=result["iterations"],
        measurements=problem.measurements,
        record=record,
        states=end.states,
        state_covariance=result["state_covariance"],
        misfit=np.where(seen, result["misfit"], np.nan),
        misfit_variance=result["seen_variance"],
        defect=np.where(linked, result["defect"] / dt, np.nan),
        noise=problem.noise,
        problem=problem,
        point=end,
    )
