"""Homotopy in the model-error variance: minimise, reduce it, repeat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from udd.errors import FitError
from udd.measurement import Measurement

from .noise import estimated, noise_autocorrelation
from .problem import Fit, Point, Problem
from .record import Record
from .solve import DONE, SolveError, done, solve

#: Maximum of steps at one level: a right model takes three to seven, or more if its law has kinks.
STEPS = 30
#: Steps in which a right model converges at any other level.
FEW = 12
LEAP = 3  # levels that a right model can skip
#: Decrease of chi2 below which a fit's noise no longer changes; its likelihood is then accurate enough.
ROUGH = 10.0
#: Decrease of chi2 by a nat, at which fits of different laws can be compared.
NAT = 2.0
#: Decrease in evidence (nats) that is acceptable when the model error is reduced.
LESS = 3.0
#: Model error in units of the last level's: at a tenth of it the standard errors change by less than 0.3 %.
_NEGLIGIBLE = 1e-2
_LITTLE = 3  # Further steps for a fit that may be close to its minimum.
_FAR_OFF = 10.0  # Value of chi2 per degree of freedom of a model that is far from explaining the data.
_LOOSE = 0.3  # Leverage above which misfits do not show the noise.
_SAME = 0.03  # Autocorrelations that differ by less need no further fit.


@dataclass(frozen=True)
class Goal:
    """Targets that a fit must reach to be useful.

    Attributes
    ----------
    level : int
        Level of model error to reach: at a larger model error the fit is not brought to its minimum. If it is
        then far from explaining the data, it stops there.
    chi2 : float
        Upper limit at that level. chi2 only rises on the way, so a fit above it is abandoned.
    lost : float
        A fit above this chi2 that does not converge is abandoned, up to the level `rival`.
    rival : int
        Level of a fit whose chi2 is far below `lost`.
    """

    level: int = 0
    chi2: float = np.inf
    lost: float = np.inf
    rival: int = 0


#: No target: every fit is useful.
ANY = Goal()


def reduce_model_error(
    measurements: tuple[Measurement, ...],
    problem: Problem,
    point: Point,
    schedule: Sequence[tuple[float, ...]],
    best: Fit | None = None,
    steps: int = STEPS,
    goal: Goal = ANY,
    enough: float | None = None,
) -> Fit:
    """Minimise with a decreasing model-error variance: solve, reduce it, solve again from there.

    It ends at the level where the minimiser no longer converges, which a wrong model reaches early. If the
    problem asks for the most probable level, it ends where the evidence falls. `best` is a fit at a larger
    model error; it is returned if no tighter one converges. `steps` bounds the iterations at each level.
    With `enough`, fits stop at this decrease of chi2, also the final one.

    Raises
    ------
    FitError
        No level can be solved, or chi2 is above the goal's.
    """
    levels = list(schedule)
    if best is None:
        if not levels:
            raise FitError("the fit has no level to solve at")
        best = provisional_fit(measurements, problem.with_model_error(levels.pop(0)), point, steps, enough)
        point = best.point
        _give_up_above(goal, best)
    start = best
    if problem.likeliest:
        best, point = _skip_levels(best, point, levels, enough)
    skipped = best
    for diffusion in levels[levels.index(best.problem.diffusion) + 1 :] if best is not start else levels:
        if _explains_little(best, goal):
            return best
        tighter = best.problem.with_model_error(diffusion)
        result = provisional_fit(measurements, tighter, point, steps, enough)
        if not _stands(result, best):
            break
        best, point = result, result.point
        _give_up_above(goal, best)
    if best is skipped and best is not start:
        best = _increase_model_error(best, levels)
    if (
        enough
        or best.problem.has_smallest_model_error
        or best.level < goal.level
        or _explains_little(best, goal)
    ):
        return best
    return _settled(best, schedule, steps)


def _give_up_above(goal: Goal, best: Fit) -> None:
    """Abandon a fit that is already above its goal."""
    above = best.level <= goal.level and best.chi2 > goal.chi2
    lost = best.level <= goal.rival and best.chi2 > goal.lost and not best.converged
    if above or lost:
        raise FitError("the model explains less than another one with the same model error")


def _explains_little(best: Fit, goal: Goal) -> bool:
    """Return True if a fit has reached its goal's level and is far from explaining the data."""
    tight = goal != ANY and best.level >= goal.level
    return tight and best.converged and far_off(best)


def far_off(fitted: Fit) -> bool:
    """Return True if a fit is far from explaining the data."""
    return fitted.scatter > _FAR_OFF


def beyond_schedule(fitted: Fit) -> bool:
    """Return True if a fit has more model error than the largest of its schedule."""
    return fitted.problem.diffusion not in fitted.problem.schedule


def provisional_fit(
    measurements: tuple[Measurement, ...],
    problem: Problem,
    point: Point,
    iterations: int = STEPS,
    enough: float | None = None,
) -> Fit:
    """Fit on the way to a smaller model error; with noise autocorrelation if its likelihood matters."""
    result = _nearly(solve(measurements, problem, point, iterations, enough or _enough(problem)), iterations)
    return with_noise_correlation(result, enough) if problem.likeliest and result.converged else result


def _nearly(fitted: Fit, steps: int) -> Fit:
    """Return a search's fit at its minimum if that is close, else unchanged: close is enough to test it.

    Along directions that the data hardly determine, such as a frequency and its phase, a law with kinks
    converges in ever smaller steps. To reject a right model for that would favour a wrong one. A fit with few
    `steps`, which may not converge at all, is not continued.
    """
    if fitted.converged or fitted.problem.likeliest or steps < STEPS:
        return fitted
    continued = solve(fitted.measurements, fitted.problem, fitted.point, _LITTLE, ROUGH)
    return continued if continued.converged else fitted


def _enough(problem: Problem) -> float:
    """Return the decrease of chi2 at which a fit stops: the final one at the last level."""
    return DONE if problem.has_smallest_model_error else ROUGH


def _stands(tighter: Fit, looser: Fit) -> bool:
    """Return True if a fit with a smaller model error replaces one with a larger."""
    less_likely = tighter.problem.likeliest and tighter.evidence < looser.evidence - LESS
    return tighter.converged and not less_likely


def _skip_levels(
    best: Fit, point: Point, levels: Sequence[tuple[float, ...]], enough: float | None = None
) -> tuple[Fit, Point]:
    """Skip levels as far as that goes: a right model converges from one level to the next in few steps."""
    for diffusion in levels[(len(levels) - 1) % LEAP :: LEAP]:
        try:
            tighter = best.problem.with_model_error(diffusion)
            result = provisional_fit(best.measurements, tighter, point, FEW, enough)
        except FitError:
            break
        if not _stands(result, best):
            break
        best, point = result, result.point
    return best, point


def _increase_model_error(fitted: Fit, levels: Sequence[tuple[float, ...]]) -> Fit:
    """Increase the model error again, level by level, as long as the evidence rises.

    A level at which a parameter leaves its range is the end.
    """
    for diffusion in reversed(levels[: levels.index(fitted.problem.diffusion)]):
        problem = fitted.problem.with_model_error(diffusion)
        try:
            looser = solve(fitted.measurements, problem, fitted.point, decrease=ROUGH)
        except SolveError:
            # Without this Stribeck's friction on a shaken support ends a search with an error.
            break
        if _stands(fitted, looser):
            break
        fitted = looser
    return fitted


def _settled(fitted: Fit, levels: Sequence[tuple[float, ...]], steps: int) -> Fit:
    """Converge a rough fit, or if that fails one with a larger model error."""
    current = fitted.problem.diffusion
    for diffusion in (current, *reversed(levels[: levels.index(current)] if current in levels else ())):
        problem = fitted.problem.with_model_error(diffusion)
        fitted = _nearly(solve(fitted.measurements, problem, fitted.point, steps, done(fitted)), steps)
        if fitted.converged:
            break
    return fitted


def with_negligible_model_error(fitted: Fit) -> Fit:
    """Compute the parameters of a right law and their covariance at a negligible model error.

    An assumed model error inflates the standard errors, and the last level differs between a compiled law and
    the same law as text. Motion, misfits and diagnostics stay those of the schedule. A fit that ends at a
    larger model error stays as it is: its model lacks something.
    """
    # Without this the standard errors of a chaotic disk are 1.5 times too large.
    if not (fitted.converged and fitted.problem.has_smallest_model_error):
        return fitted
    limit = tuple(_NEGLIGIBLE * q for q in fitted.problem.diffusion)
    try:
        result = solve(fitted.measurements, fitted.problem.with_model_error(limit), fitted.point, FEW)
    except FitError:
        return fitted
    if not _stands(result, fitted):
        return fitted
    return replace(
        fitted,
        models=result.models,
        parameters=result.parameters,
        errors=result.errors,
        covariance=result.covariance,
        point=Point(fitted.states, result.point.sets),
        limit=limit,
    )


def with_noise_correlation(fitted: Fit, enough: float | None = None) -> Fit:
    """Refit with AR(1) noise if that raises the likelihood, until chi2 falls by less than `enough`.

    Frames with correlated noise carry less information than independent ones. Without this the model error
    would be too large, following the noise, and standard errors would be too small.
    """
    if fitted.leverage > _LOOSE:
        return fitted
    # Without this k0 and k2 of a record with coloured noise move by three standard errors.
    sd = fitted.noise.sd(fitted.record, fitted.blurring)
    memory = noise_autocorrelation(fitted.record, fitted.misfit, sd, fitted.noise.weight)
    if not memory.any() or np.abs(memory - fitted.noise.memory).max() < _SAME:
        return fitted
    noise = estimated(fitted.record, fitted.blurring, fitted.misfit, fitted.misfit_variance, fitted.noise)
    problem = replace(fitted.problem, noise=replace(noise, memory=memory))
    result = solve(fitted.measurements, problem, fitted.point, STEPS, enough or _enough(problem))
    return result if result.converged and result.evidence > fitted.evidence + LESS else fitted


def with_larger_model_error(fitted: Fit, scatter: float) -> Fit:
    """Increase the model-error variance until chi2 per degree of freedom is below a limit.

    With a small model error a wrong model distorts states and parameters. With a larger one its residuals
    show what is missing. If even the largest of the schedule leaves the fit far from explaining the data, the
    error is increased tenfold, twice at most; such a fit has no level.
    """
    schedule, result = fitted.problem.schedule, fitted
    for diffusion in reversed(schedule[: fitted.level]):
        if result.scatter < scatter:
            return result
        result = solve(fitted.measurements, fitted.problem.with_model_error(diffusion), result.point)
    for factor in (10.0, 100.0) if far_off(result) else ():
        if result.scatter < scatter:
            break
        beyond = fitted.problem.with_model_error(tuple(factor * q for q in schedule[0]))
        result = solve(fitted.measurements, beyond, result.point)
    return result


def at_level(fitted: Fit, level: int) -> Fit:
    """Fit the same model at a level of the schedule."""
    if level == fitted.level:
        return fitted
    problem = fitted.problem.with_model_error(fitted.problem.schedule[level])
    return solve(fitted.measurements, problem, fitted.point, decrease=done(fitted))


def eased(fitted: Fit) -> Fit:
    """Fit the same model at the most probable model error, starting at the end of a fit."""
    problem = replace(fitted.problem, likeliest=True)
    return _increase_model_error(replace(fitted, problem=problem), problem.schedule)


def smoothed_states(fitted: Fit, record: Record, level: int) -> Fit:
    """Estimate the states of another record, with all parameters fixed, at a level of the schedule.

    A wrong model may not reach that level; the result's level says how far it came.
    """
    problem = replace(fitted.problem, record=record, free=(), models=fitted.models)
    problem = replace(problem, noise=fitted.noise.everywhere(len(record.t)))
    start = Point(record.states, fitted.point.sets)
    return reduce_model_error(fitted.measurements, problem, start, problem.schedule[: level + 1])
