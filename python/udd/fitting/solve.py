"""One Gauss-Newton minimisation for an assumed model error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.time_limit import check_time
from udd.errors import FitError, ModelError
from udd.measurement import Measurement
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .estimator_input import EstimatorInput, FilmParameters, Observations
from .formula_models import state_noise
from .problem import Fit, Point, Problem
from .record import Record

Array = NDArray[np.float64]

#: Maximum of steps of a single fit.
MOST = 40
#: A step that promises a smaller decrease of chi2 is the last: it changes no parameter by 0.1 standard
#: errors.
DONE = 0.01


class SolveError(FitError):
    """A fit that could not be solved, unlike one that was set up wrongly.

    Attributes
    ----------
    undetermined : tuple of str
        Parameters that can change together without changing the fit.
    """

    undetermined: tuple[str, ...] = ()


def solve(
    measurements: tuple[Measurement, ...],
    problem: Problem,
    point: Point,
    iterations: int = MOST,
    decrease: float = DONE,
) -> Fit:
    """Minimise once, for the problem's assumed model error, from a point.

    It stops when a step promises to decrease chi2 by less than `decrease`. It does not start once the time of
    a search is up.
    """
    check_time()
    try:
        result = _core.solve(problem.at(point), iterations, decrease)
    except ValueError as error:
        unsolved = SolveError(_said(error, problem))
        if len(error.args) == 2:
            unsolved.undetermined = tuple(problem.free[k].name for k in error.args[1])
        raise unsolved from error
    record = problem.record
    names = [f.name for f in problem.free]
    sets = tuple(FilmParameters(*film_parameters) for film_parameters in result["sets"])
    end = Point(result["states"], sets, result["linear"])
    try:
        models = tuple(
            model.with_parameters(dict(zip(model.parameters, values, strict=True)))
            for model, (values, _camera, _clock) in zip(problem.models, end.sets, strict=True)
        )
    except ModelError as error:  # a shape left its range
        raise SolveError(f"the fit reached parameters that are invalid for the model: {error}") from error
    seen = record.observed
    # Every state except a run's first is tied to the one before: the frames' misfits remain.
    runs = 1 + int((~record.linked).sum())
    proper = sum(np.isfinite(f.sd) for f in problem.free)
    dof = float(seen.sum()) + proper - len(problem.free) - runs * result["states"].shape[1]
    linked = record.linked[:, None]
    dt = np.where(linked, np.diff(record.t)[:, None], 1.0)
    return Fit(
        models=models,
        parameters={f.name: end.value(f) for f in problem.free},
        errors=dict(zip(names, np.sqrt(np.diag(result["covariance"])).tolist(), strict=True)),
        covariance=result["covariance"],
        chi2=float(sum(result["cost"])),
        dof=dof,
        evidence=result["evidence"],
        converged=result["converged"],
        iterations=result["iterations"],
        measurements=measurements,
        record=record,
        states=result["states"],
        state_covariance=result["state_covariance"],
        misfit=np.where(seen, result["misfit"], np.nan),
        misfit_variance=result["seen_variance"],
        defect=np.where(linked, result["defect"] / dt, np.nan),
        noise=problem.noise,
        problem=problem,
        point=end,
    )


def _said(error: ValueError, problem: Problem) -> str:
    """Explain an error of the core; name parameters that can change together."""
    if len(error.args) == 2:
        together = [problem.free[k].name for k in error.args[1]]
        return (
            f"the data do not determine the free parameters: {' and '.join(together)} can change "
            "together without changing the fit; give one of them a prior, or fix it"
            if len(together) > 1
            else f"the data do not depend on {together[0]}; give it a prior, or fix it"
        )
    model = problem.models[0]
    if "do not determine the state" in str(error) and isinstance(model, FormulaModel):
        noise = state_noise(model, problem.record.t, problem.record.states, problem.record.sigma)
        hidden = [name for name, sd in zip(model.state_names, noise, strict=True) if not np.isfinite(sd)]
        asked = ", ".join(f"'{name}': ..." for name in hidden)
        if hidden:
            is_not = "is" if len(hidden) == 1 else "are"
            return (
                f"the fit failed: {error}; {', '.join(hidden)} {is_not} not observed: "
                f"say where the motion starts, state0={{{asked}}}"
            )
    return f"the fit failed: {error}"


def predicted(
    models: Sequence[Model],
    sets: Sequence[FilmParameters],
    film: NDArray[np.int64],
    t0: Array,
    states: Array,
    times: Array,
) -> Array:
    """Predict the observations at times (k, h), increasing, after starts (k,), by the models alone.

    Parameters
    ----------
    models : sequence of Model
        One per film, with the same parameters; their values are those of `sets`.
    sets : sequence of FilmParameters
        As a fit's ``point.sets``.
    film : ndarray of int (k,)
        Film of each start.
    t0, states : ndarray (k,), (k, d)
    times : ndarray (k, h)

    Returns
    -------
    ndarray (k, h, m)
        NaN after the point at which the model's solution diverges.
    """
    try:
        return _core.predict(models[0], sets, film.tolist(), t0, states, times)
    except FitError:
        if len(t0) > 1:
            rows = [slice(k, k + 1) for k in range(len(t0))]
            some = [predicted(models, sets, film[k], t0[k], states[k], times[k]) for k in rows]
            return np.concatenate(some)
        return _as_far_as_it_runs(models, sets, film, t0, states, times)


def _as_far_as_it_runs(
    models: Sequence[Model],
    sets: Sequence[FilmParameters],
    film: NDArray[np.int64],
    t0: Array,
    states: Array,
    times: Array,
) -> Array:
    """Predict one run that does not reach its last time, with bisection for the last time that it reaches."""
    reached, beyond = 0, times.shape[1]
    # The observation at the start itself takes no run and gives the number of columns.
    result = np.repeat(_core.predict(models[0], sets, film.tolist(), t0, states, t0[:, None]), beyond, axis=1)
    while beyond - reached > 1:
        half = (reached + beyond) // 2
        try:
            result[:, :half] = _core.predict(models[0], sets, film.tolist(), t0, states, times[:, :half])
            reached = half
        except FitError:
            beyond = half
    result[:, reached:] = np.nan
    return result


def filtered(
    fitted: Fit, record: Record, windows: NDArray[np.int64], diffusion: Sequence[float]
) -> tuple[Array, Array, Array]:
    """Filter windows of frames: states at the first and the last frame, covariance of the last.

    All parameters are those of a fit.
    """
    seen = Observations.of(record, fitted.noise.everywhere(len(record.t)), record.states[:, 0])
    fixed = EstimatorInput(fitted.model, seen, record.states, fitted.point.sets, (), diffusion)
    return _core.filter(fixed, [(int(a), int(b)) for a, b in windows])


def within(fitted: Fit, frames: NDArray[np.bool_]) -> Fit:
    """Fit the same model to some of the frames (a mask), with the same model error, from the fit's end."""
    noise = replace(fitted.noise, weight=fitted.noise.weight[frames])
    problem = replace(fitted.problem, record=fitted.record.part(frames), noise=noise)
    start = Point(fitted.states[frames], fitted.point.sets)
    return solve(fitted.measurements, problem, start, decrease=done(fitted))


def done(fitted: Fit) -> float:
    """Return `DONE` scaled by a fit's chi2 per degree of freedom, which scales its standard errors."""
    return DONE * max(1.0, fitted.scatter)


def frame_costs(fitted: Fit) -> Array:
    """Compute the cost of every frame of a fit.

    Returns
    -------
    cost : ndarray (n,)
        Squared misfit of a frame in units of the noise, plus the squared defect of the link after it in units
        of the assumed model error.
    """
    record, problem = fitted.record, fitted.problem
    information = problem.noise.information(record, fitted.states[:, 0])
    misfit = np.nan_to_num(fitted.misfit)
    cost: Array = np.einsum("ni,nij,nj->n", misfit, information, misfit)
    # Defects are per second; the variance over a link of length dt is diffusion^2 dt.
    dt = np.abs(np.diff(record.t))[:, None]
    links = np.nan_to_num(fitted.defect) ** 2 * dt / np.array(problem.diffusion) ** 2
    cost[:-1] += links.sum(axis=1)
    return cost
