"""Further fits that begin at the end of a fit: more effects, other free parameters, another model error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd.effects import Effect, Parameter

from .fit_result import Fit, minimise
from .minimum import SolveError
from .model_error_schedule import ANY, NAT, Goal, far_off, increase_model_error, solve
from .noise_estimation import FINEST, least_noise, own_noise, solve_with_noise
from .parameters import Free
from .problem import Point, Problem, levels, start_point
from .record import Record


def widened(fitted: Fit, effects: Sequence[Effect]) -> tuple[Problem, Point]:
    """Add effects, with fixed parameters, to the problem of a fit; return it with the fit's end point."""
    models = tuple(model.with_effects((*model.effects, *effects)) for model in fitted.models)
    known_count = len(fitted.model.parameters)
    effect_values = [value for effect in effects for value in effect.values]
    end = fitted.point.with_values(lambda values: [*values[:known_count], *effect_values])
    return replace(fitted.problem, models=models), end


def started_at(fitted: Fit, last: Fit, seen: slice | NDArray[np.bool_] = slice(None)) -> Fit:
    """Return a fit that continues from the end of another one, which may have more effects.

    The same parameters are free as in `last`. `seen` selects the frames that `last` was fitted to. The other
    frames start at the states as read.
    """
    known_count = len(fitted.model.parameters)
    free = tuple(f for f in last.problem.free if f.role != "model" or f.index < known_count)
    states = fitted.record.states.copy()
    states[seen] = last.states
    end = Point(states, last.point.with_values(lambda values: values[:known_count]).sets)
    return replace(fitted, problem=_with_free(fitted, free), point=end)


def extend(fitted: Fit, effects: Sequence[Effect], amplitudes: Sequence[float], goal: Goal = ANY) -> Fit:
    """Fit again with more effects, all coefficients free, starting at the end of a fit.

    The noise stays fixed, so that the chi2 of both fits can be compared. A frequency is free within its
    spectral line. Shapes that may have any value are freed after the rest has converged: within a factor of
    about two, or for a place within about its width.

    Parameters
    ----------
    fitted : Fit
    effects : sequence of Effect
        The effects to add.
    amplitudes : sequence of float
        Start values of their amplitudes, in order.
    goal : Goal
        Targets that the fit must reach to be useful.
    """
    left = list(amplitudes)
    effects = [e.replace(**{p: left.pop(0) for p in e.amplitudes}) for e in effects]
    problem, point = widened(fitted, effects)
    line = 0.5 / float(np.ptp(fitted.record.t))
    amplitude_priors = {f"{e.name}.{p}": (0.0, np.inf) for e in effects for p in e.amplitudes}
    sought = [(f"{e.name}.{p.name}", e, p) for e in effects for p in e.spec.parameters if p.sought]
    waves = {name: (e.parameters[p.name], line) for name, e, p in sought if p.role == "frequency"}
    shapes = {
        name: (e.parameters[p.name], _spread(e, p)) for name, e, p in sought if p.role in ("shape", "scanned")
    }
    problem = problem.freeing({**amplitude_priors, **waves})
    if shapes:
        later = replace(goal, chi2=np.inf)  # chi2 falls once the shapes are free
        point = solve(problem, problem.schedule[1:], point, goal=later).point
        problem = problem.freeing(shapes)
    # With a small model error, a shape and its amplitude move slowly: the fit stopped 100 in chi2 too high.
    return solve(problem, problem.schedule[1:], point, goal=goal)


def _spread(effect: Effect, parameter: Parameter) -> float:
    """Return a shape's (or place's) prior standard deviation: the distance to the next value of a scan."""
    widths = [effect.parameters[p.name] for p in effect.spec.parameters if p.role == "shape"]
    if parameter.role == "scanned" and widths:
        return widths[0]
    return abs(effect.parameters[parameter.name])


def as_stated(fitted: Fit) -> Fit:
    """Fit again with the drive and the camera (except the pivot) at their given values; for a search."""
    profile = fitted.model.profile

    def kept(free: Free) -> bool:
        if free.role == "model":
            return free.base not in profile.fit.stated
        return free.role == "camera" and free.base in profile.sensor.pivot

    problem = replace(fitted.problem, free=tuple(filter(kept, fitted.problem.free)))
    return solve_with_noise(problem, start_point(problem.models, fitted.measurements, fitted.record))


def released(fitted: Fit, free: Sequence[Free]) -> Fit:
    """Fit again with more free parameters, alongside those of the added effects.

    The schedule starts at the largest model error: with a small one, chaos has a minimum near every start
    value.
    """
    # Without this, a spurious slip follows a load-dependent drive.
    return solve(_with_free(fitted, free), fitted.problem.schedule, fitted.point)


def released_anew(fitted: Fit, free: Sequence[Free]) -> Fit:
    """Fit as :func:`released` does, and estimate the noise again: a diverged model hardly shows it."""
    return solve_with_noise(_with_free(fitted, free), fitted.point)


def _with_free(fitted: Fit, free: Sequence[Free]) -> Problem:
    names = {f.name for f in free}
    added = tuple(f for f in fitted.problem.free if f.name not in names)
    return replace(fitted.problem, free=(*free, *added))


def refit(fitted: Fit) -> Fit:
    """Fit the same model again with new noise, at the most probable smaller model error.

    In a search the noise stays that of the first model, so that chi2 can be compared. The noise of a film
    stays at its assumed value.
    """
    return _tightened(fitted, trusted=not least_noise(fitted.measurements, search=True) > FINEST)


def most_probable(fitted: Fit) -> Fit:
    """Fit the same model at its most probable noise and model error, smaller or larger.

    The model error of a film with less noise than its geometric error only gets smaller: a larger one would
    follow the geometry's faults, and all forms would be equal.
    """
    # To the minimum itself a law with a kink converges slowly, and ends at a larger model error.
    tightest = _tightened(fitted, trusted=True, enough=NAT)
    # Without this no form of a real pendulum's drag is distinguished from another.
    if (tightest.noise.factor < least_noise(fitted.measurements, search=True)).any():
        return tightest
    if tightest.level > fitted.level:  # on the way the evidence rose
        return tightest
    result = eased(tightest)
    # Without this, one form is compared at its most probable model error, another 180 nats below its own.
    if result.level < tightest.level:
        try:
            result = minimise(*own_noise(result), decrease=NAT)
        except SolveError:
            return tightest
    return result if result.converged else tightest


def _tightened(fitted: Fit, trusted: bool, enough: float | None = None) -> Fit:
    """Reduce the model error to the most probable one, with the fit's own noise if that is `trusted`."""
    schedule = levels(fitted.model.kind) or fitted.problem.schedule
    fitted = replace(fitted, problem=replace(fitted.problem, schedule=schedule))
    try:
        problem, point = own_noise(fitted) if trusted else (fitted.problem, fitted.point)
        levels_left = schedule[fitted.level :]
        result = solve(problem, levels_left, point, enough=enough)
    except SolveError:  # for example, a threshold that ends at or below zero
        return fitted
    return result if result.converged else fitted


def within(fitted: Fit, frames: NDArray[np.bool_]) -> Fit:
    """Fit the same model to some of the frames (a mask), with the same model error, from the fit's end."""
    noise = replace(fitted.noise, weight=fitted.noise.weight[frames])
    problem = replace(fitted.problem, record=fitted.record.part(frames), noise=noise)
    start = Point(fitted.states[frames], fitted.point.sets)
    return minimise(problem, start, decrease=fitted.smallest_decrease)


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
        result = minimise(fitted.problem.with_model_error(diffusion), result.point)
    for factor in (10.0, 100.0) if far_off(result) else ():
        if result.scatter < scatter:
            break
        beyond = fitted.problem.with_model_error(tuple(factor * q for q in schedule[0]))
        result = minimise(beyond, result.point)
    return result


def at_level(fitted: Fit, level: int) -> Fit:
    """Fit the same model at a level of the schedule."""
    if level == fitted.level:
        return fitted
    problem = fitted.problem.with_model_error(fitted.problem.schedule[level])
    return minimise(problem, fitted.point, decrease=fitted.smallest_decrease)


def eased(fitted: Fit) -> Fit:
    """Fit the same model at the most probable model error, starting at the end of a fit."""
    problem = replace(fitted.problem, likeliest=True)
    return increase_model_error(replace(fitted, problem=problem), problem.schedule)


def smoothed_states(fitted: Fit, record: Record, level: int) -> Fit:
    """Estimate the states of another record, with all parameters fixed, at a level of the schedule.

    A wrong model may not reach that level; the result's level says how far it came.
    """
    problem, start = fitted.problem.of_states(record), Point(record.states, fitted.point.sets)
    return solve(problem, problem.schedule[: level + 1], start)


def beyond_schedule(fitted: Fit) -> bool:
    """Return True if a fit has more model error than the largest of its schedule."""
    return fitted.problem.diffusion not in fitted.problem.schedule
