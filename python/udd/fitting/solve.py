"""One minimum, and chains of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.errors import FitError
from udd.measurement import Measurement

from .parameters import Free
from .problem import Fit, Point, Problem
from .record import Record

Array = NDArray[np.float64]

_STEPS = 20  # a right model converges in three to seven


def solve(measurement: Measurement, problem: Problem, point: Point, iterations: int = 40) -> Fit:
    """Minimise once, for the problem's assumed model error, from a point."""
    try:
        found = _core.solve(*problem.arguments(point), iterations)
    except ValueError as error:
        raise FitError(f"the fit failed: {error}") from error
    record = problem.record
    model = problem.model.with_parameters(dict(zip(problem.model.parameters, found["model"], strict=True)))
    names = [f.name for f in problem.free]
    end = Point(found["states"], model.parameters, found["camera"], found["clock"])
    values = {f.name: _value(f, found) for f in problem.free}
    chi2 = float(sum(found["cost"]))
    seen = record.observed
    # Every state but a run's first is tied to the one before: what remains are the frames' misfits.
    runs = 1 + int((~record.linked).sum())
    proper = sum(np.isfinite(f.sd) for f in problem.free)
    dof = float(seen.sum()) + proper - len(problem.free) - runs * found["states"].shape[1]
    defect = np.where(record.linked[:, None], found["defect"] / np.diff(record.t)[:, None], np.nan)
    return Fit(
        model=model,
        parameters=values,
        errors=dict(zip(names, np.sqrt(np.diag(found["covariance"])).tolist(), strict=True)),
        covariance=found["covariance"],
        chi2=chi2,
        dof=dof,
        converged=found["converged"],
        iterations=found["iterations"],
        measurement=measurement,
        record=record,
        states=found["states"],
        state_covariance=found["state_covariance"],
        misfit=np.where(seen, found["misfit"], np.nan),
        misfit_variance=found["seen_variance"],
        defect=defect,
        noise=problem.noise,
        problem=problem,
        point=end,
    )


def _value(free: Free, found: Mapping[str, Any]) -> float:
    if free.role == "clock":
        return float(found["clock"])
    return float(found[free.role][free.index])


def tighten(
    measurement: Measurement, problem: Problem, point: Point, schedule: Sequence[tuple[float, ...]]
) -> Fit:
    """Solve for ever smaller errors of the model, as far as it goes: a wrong model gets stuck."""
    best: Fit | None = None
    for diffusion in schedule:
        problem = replace(problem, diffusion=diffusion)
        result = solve(measurement, problem, point, _STEPS)
        if best is not None and not result.converged:
            break
        best, point = result, result.point
    if best is None:
        raise FitError("the fit has no level to solve at")
    return best


def loosened(fitted: Fit, scatter: float) -> Fit:
    """The tightest fit, of those that led to this one, whose scatter is below a limit; else the loosest.

    A wrong model that is held tightly bends everything to obey it; where it is held less tightly it shows
    what is missing.
    """
    problem, result = fitted.problem, fitted
    for diffusion in reversed(problem.schedule[: fitted.level]):
        if result.scatter < scatter:
            break
        result = solve(fitted.measurement, replace(problem, diffusion=diffusion), result.point)
    return result


def held_cost(fitted: Fit, record: Record) -> Array:
    """Cost of every frame of another record, with all parameters held and the states free.

    Parameters
    ----------
    fitted : Fit
        Its parameters, camera and noise are held.
    record : Record

    Returns
    -------
    cost : ndarray (n,)
        Squared misfit of a frame in units of the noise, with the squared defect of the link that leaves it in
        units of the model's assumed error.
    """
    problem = replace(fitted.problem, record=record, free=(), model=fitted.model)
    problem = replace(problem, noise=replace(fitted.noise, weight=np.ones(len(record.t))))
    start = replace(fitted.point, states=record.states)
    end = tighten(fitted.measurement, problem, start, problem.schedule)
    information = problem.noise.information(record, end.states[:, 0])
    misfit = np.nan_to_num(end.misfit)
    cost: Array = np.einsum("ni,nij,nj->n", misfit, information, misfit)
    # A defect is kept per second; its variance over a link of length dt is diffusion^2 dt.
    dt = np.diff(record.t)[:, None]
    links = np.nan_to_num(end.defect) ** 2 * dt / np.array(end.problem.diffusion) ** 2
    cost[:-1] += links.sum(axis=1)
    return cost


def information_for(fitted: Fit, record: Record) -> Array:
    """The information of another record's frames, with the noise that a fit found."""
    noise = replace(fitted.noise, weight=np.ones(len(record.t)))
    return noise.information(record, record.states[:, 0])
