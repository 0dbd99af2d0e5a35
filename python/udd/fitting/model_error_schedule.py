"""Homotopy in the model-error variance: minimise, reduce it, repeat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from udd.errors import FitError
from udd.measurement import Measurement

from .noise import estimated, remembered
from .problem import Fit, Point, Problem
from .record import Record
from .solve import DONE, done, solve

#: Most steps at one level: a right model takes three to seven, but for kinks of its law.
STEPS = 30
#: Steps in which a right model gets from one level to any other.
FEW = 12
LEAP = 3  # levels that it takes at once
#: Fall of chi2 below which a fit no longer changes what it says of the noise; its likelihood counts it.
ROUGH = 10.0
#: Nats by which the evidence may fall when the model is held more tightly.
LESS = 3.0
_LITTLE = 3  # steps more, of a fit that may be near its minimum
_FAR_OFF = 10.0  # chi2 per degree of freedom of a model that is far from explaining the data
_LOOSE = 0.3  # leverage from which on misfits are not the noise
_SAME = 0.03  # autocorrelations that differ by less need no other fit


@dataclass(frozen=True)
class Goal:
    """What a fit must reach to be of use.

    Attributes
    ----------
    level : int
        How tightly the model must be held at the end: below it the fit is not brought to its minimum. Nor
        is, there, what is far from explaining the data, which is not held more tightly either.
    chi2 : float
        At most that, there: it only rises on the way, so a fit above it is given up.
    lost : float
        A fit above it that does not converge is given up, as far as the level `rival`.
    rival : int
        How tightly a fit is held whose chi2 is far below `lost`.
    """

    level: int = 0
    chi2: float = np.inf
    lost: float = np.inf
    rival: int = 0


#: Whatever a fit comes to is of use.
ANY = Goal()


def reduce_model_error(
    measurements: tuple[Measurement, ...],
    problem: Problem,
    point: Point,
    schedule: Sequence[tuple[float, ...]],
    best: Fit | None = None,
    steps: int = STEPS,
    goal: Goal = ANY,
) -> Fit:
    """Homotopy in the model-error variance: solve, reduce it, solve again from there.

    It ends at the level where the minimiser no longer converges, which a wrong model reaches early, or, if
    the problem asks for the likeliest level, where the evidence falls. `best` is a fit at a larger model
    error; it is returned if no tighter one converges. `steps` bounds the iterations at each level.

    Raises
    ------
    FitError
        No level can be solved, or chi2 is above the goal's.
    """
    levels = list(schedule)
    if best is None:
        if not levels:
            raise FitError("the fit has no level to solve at")
        best = provisional_fit(measurements, problem.with_model_error(levels.pop(0)), point, steps)
        point = best.point
        _give_up_above(goal, best)
    far = _skip_levels(best, point, levels) if problem.likeliest else None
    if far:
        best = _increase_model_error(far, levels)
    for diffusion in () if far else levels:
        if _explains_little(best, goal):
            return best
        result = provisional_fit(measurements, best.problem.with_model_error(diffusion), point, steps)
        if not _stands(result, best):
            break
        best, point = result, result.point
        _give_up_above(goal, best)
    if _is_last(best.problem) or best.level < goal.level or _explains_little(best, goal):
        return best
    return _settled(best, schedule, steps)


def _give_up_above(goal: Goal, best: Fit) -> None:
    """Give up a fit that is above its goal already."""
    above = best.level <= goal.level and best.chi2 > goal.chi2
    lost = best.level <= goal.rival and best.chi2 > goal.lost and not best.converged
    if above or lost:
        raise FitError("the model explains less than another one that is held as tightly")


def _explains_little(best: Fit, goal: Goal) -> bool:
    """Whether a fit with a goal is as tight as that asks, and far from explaining the data."""
    tight = goal != ANY and best.level >= goal.level
    return tight and best.converged and far_off(best)


def far_off(fitted: Fit) -> bool:
    """Whether a fit is far from explaining the data."""
    return fitted.scatter > _FAR_OFF


def beyond_schedule(fitted: Fit) -> bool:
    """Whether a fit has more model error than the largest of its schedule."""
    return fitted.problem.diffusion not in fitted.problem.schedule


def provisional_fit(
    measurements: tuple[Measurement, ...], problem: Problem, point: Point, iterations: int = STEPS
) -> Fit:
    """A fit on the way to tighter ones; where its likelihood is of interest, with the noise's memory."""
    result = _nearly(solve(measurements, problem, point, iterations, _enough(problem)), iterations)
    return with_noise_correlation(result) if problem.likeliest and result.converged else result


def _nearly(fitted: Fit, steps: int) -> Fit:
    """A fit of a search that came near its minimum, which is enough to test it, or else as it was.

    Along what the data hardly determine, like a frequency beside its phase, a law with kinks gets there in
    ever smaller steps. To turn a right model away for it would make room for a wrong one. What is given few
    `steps`, because it may have no end, is taken at its word.
    """
    if fitted.converged or fitted.problem.likeliest or steps < STEPS:
        return fitted
    near = solve(fitted.measurements, fitted.problem, fitted.point, _LITTLE, ROUGH)
    return near if near.converged else fitted


def _is_last(problem: Problem) -> bool:
    """Whether the model is held as tightly as it can be."""
    return problem.diffusion == problem.schedule[-1]


def _enough(problem: Problem) -> float:
    """How far a fit goes: to the end at the last level."""
    return DONE if _is_last(problem) else ROUGH


def _stands(tighter: Fit, looser: Fit) -> bool:
    """Whether a fit that is held more tightly takes the place of a looser one."""
    less_likely = tighter.problem.likeliest and tighter.evidence < looser.evidence - LESS
    return tighter.converged and not less_likely


def _skip_levels(best: Fit, point: Point, levels: Sequence[tuple[float, ...]]) -> Fit | None:
    """The fit at the last level, over a few others: a right model gets from one to the next in few steps.

    None where it does not; what it came to on the way is then no good start.
    """
    for diffusion in levels[(len(levels) - 1) % LEAP :: LEAP]:
        try:
            result = provisional_fit(best.measurements, best.problem.with_model_error(diffusion), point, FEW)
        except FitError:
            return None
        if not _stands(result, best):
            return None
        best, point = result, result.point
    return best if levels else None


def _increase_model_error(fitted: Fit, levels: Sequence[tuple[float, ...]]) -> Fit:
    """The fit held more loosely again, level by level, as long as that is likelier."""
    for diffusion in reversed(levels[: levels.index(fitted.problem.diffusion)]):
        problem = fitted.problem.with_model_error(diffusion)
        looser = solve(fitted.measurements, problem, fitted.point, decrease=ROUGH)
        if _stands(fitted, looser):
            break
        fitted = looser
    return fitted


def _settled(fitted: Fit, levels: Sequence[tuple[float, ...]], steps: int) -> Fit:
    """The end of a rough fit, or where it has none in sight that of a looser one."""
    own = fitted.problem.diffusion
    for diffusion in (own, *reversed(levels[: levels.index(own)] if own in levels else ())):
        problem = fitted.problem.with_model_error(diffusion)
        fitted = _nearly(solve(fitted.measurements, problem, fitted.point, steps, done(fitted)), steps)
        if fitted.converged:
            break
    return fitted


def with_noise_correlation(fitted: Fit) -> Fit:
    """The same with noise that remembers itself, where the record makes that likelier.

    Frames whose noise goes together are worth less than independent ones: without this the model would be
    held too loosely, to follow the noise, and standard errors would be too small.
    """
    if fitted.leverage > _LOOSE:
        return fitted
    # Without this k0, k2 of a record with coloured noise move by three of their standard errors.
    sd = fitted.noise.sd(fitted.record, fitted.blurring)
    memory = remembered(fitted.record, fitted.misfit, sd, fitted.noise.weight)
    if not memory.any() or np.abs(memory - fitted.noise.memory).max() < _SAME:
        return fitted
    noise = estimated(fitted.record, fitted.blurring, fitted.misfit, fitted.misfit_variance, fitted.noise)
    problem = replace(fitted.problem, noise=replace(noise, memory=memory))
    result = solve(fitted.measurements, problem, fitted.point, STEPS, _enough(problem))
    return result if result.converged and result.evidence > fitted.evidence + LESS else fitted


def with_larger_model_error(fitted: Fit, scatter: float) -> Fit:
    """Increase the model-error variance until chi2 per degree of freedom is below a limit.

    With a small model error a wrong model distorts states and parameters. With a larger one its residuals
    show what is missing. Where the fit is far from explaining the data with the largest of the schedule, the
    error is increased tenfold beyond it, twice at most; such a fit has no level.
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
    """The same model, held as tightly as a level of the schedule says."""
    if level == fitted.level:
        return fitted
    problem = fitted.problem.with_model_error(fitted.problem.schedule[level])
    return solve(fitted.measurements, problem, fitted.point, decrease=done(fitted))


def with_noise_of(fitted: Fit, other: Fit) -> Fit:
    """The same model, the noise as another fit of the same data has it: then their chi2 compare."""
    if fitted.problem.noise is other.problem.noise:
        return fitted
    problem = replace(fitted.problem, noise=other.problem.noise)
    return solve(fitted.measurements, problem, fitted.point, decrease=done(fitted))


def eased(fitted: Fit) -> Fit:
    """The same model, held as loosely as is likeliest, from where a fit ended."""
    problem = replace(fitted.problem, likeliest=True)
    return _increase_model_error(replace(fitted, problem=problem), problem.schedule)


def smoothed_states(fitted: Fit, record: Record, level: int) -> Fit:
    """The states of another record alone, with all parameters of a fit held, as tightly as a level says.

    A wrong model may not get that far: the level of the result says how far it got.
    """
    problem = replace(fitted.problem, record=record, free=(), models=fitted.models)
    problem = replace(problem, noise=fitted.noise.everywhere(len(record.t)))
    start = Point(record.states, fitted.point.sets)
    return reduce_model_error(fitted.measurements, problem, start, problem.schedule[: level + 1])
