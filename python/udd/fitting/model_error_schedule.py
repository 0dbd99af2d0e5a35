"""Homotopy in the model-error variance: minimise, reduce it, repeat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from udd.errors import FitError

from .fit_result import Fit, minimise
from .minimum import DONE, SolveError
from .noise import estimated, noise_autocorrelation
from .problem import Point, Problem

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

    def require(self, best: Fit) -> None:
        """Raise a FitError for a fit that is already above the goal."""
        above = best.level <= self.level and best.chi2 > self.chi2
        lost = best.level <= self.rival and best.chi2 > self.lost and not best.converged
        if above or lost:
            raise FitError("the model explains less than another one with the same model error")

    def explains_little(self, best: Fit) -> bool:
        """Return True if a fit has reached the goal's level and is far from explaining the data."""
        return self != ANY and best.level >= self.level and best.converged and far_off(best)


#: No target: every fit is useful.
ANY = Goal()


def solve(
    problem: Problem,
    schedule: Sequence[tuple[float, ...]],
    start: Point,
    *,
    best: Fit | None = None,
    steps: int = STEPS,
    goal: Goal = ANY,
    enough: float | None = None,
) -> Fit:
    """Minimise with a decreasing model-error variance: minimise, reduce it, minimise again from there.

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
        best = provisional_fit(problem.with_model_error(levels.pop(0)), start, steps, enough)
        start = best.point
        goal.require(best)
    first = best
    if problem.likeliest:
        best, start = _skip_levels(best, start, levels, enough)
    skipped = best
    for diffusion in levels if best is first else levels[levels.index(best.problem.diffusion) + 1 :]:
        if goal.explains_little(best):
            return best
        tighter = provisional_fit(best.problem.with_model_error(diffusion), start, steps, enough)
        if not _stands(tighter, best):
            break
        best, start = tighter, tighter.point
        goal.require(best)
    if best is skipped and best is not first:
        best = increase_model_error(best, levels)
    provisional = not best.problem.has_smallest_model_error and best.level >= goal.level
    if enough or not provisional or goal.explains_little(best):
        return best
    return _settled(best, schedule, steps)


def far_off(fitted: Fit) -> bool:
    """Return True if a fit is far from explaining the data."""
    return fitted.scatter > _FAR_OFF


def provisional_fit(
    problem: Problem, point: Point, iterations: int = STEPS, enough: float | None = None
) -> Fit:
    """Fit on the way to a smaller model error; with noise autocorrelation if its likelihood matters."""
    decrease = enough or (DONE if problem.has_smallest_model_error else ROUGH)
    result = _nearly(minimise(problem, point, iterations, decrease), iterations)
    return with_noise_correlation(result, decrease) if problem.likeliest and result.converged else result


def _nearly(fitted: Fit, steps: int) -> Fit:
    """Return a search's fit at its minimum if that is close, else unchanged: close is enough to test it.

    Along directions that the data hardly determine, such as a frequency and its phase, a law with kinks
    converges in ever smaller steps. To reject a right model for that would favour a wrong one. A fit with few
    `steps`, which may not converge at all, is not continued.
    """
    if fitted.converged or fitted.problem.likeliest or steps < STEPS:
        return fitted
    continued = minimise(fitted.problem, fitted.point, _LITTLE, ROUGH)
    return continued if continued.converged else fitted


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
            result = provisional_fit(tighter, point, FEW, enough)
        except FitError:
            break
        if not _stands(result, best):
            break
        best, point = result, result.point
    return best, point


def increase_model_error(fitted: Fit, levels: Sequence[tuple[float, ...]]) -> Fit:
    """Increase the model error again, level by level, as long as the evidence rises.

    A level at which a parameter leaves its range is the end.
    """
    current = best = fitted
    for diffusion in reversed(levels[: levels.index(fitted.problem.diffusion)]):
        problem = current.problem.with_model_error(diffusion)
        try:
            looser = minimise(problem, current.point, decrease=ROUGH)
        except SolveError:
            # Without this Stribeck's friction on a shaken support ends a search with an error.
            break
        # The first steps from a very small model error may gain less than a nat, the next ones thousands.
        if current.converged and not (problem.likeliest and looser.evidence > current.evidence):
            break
        current = looser
        if not _stands(best, current):
            best = current
    return best


def _settled(fitted: Fit, levels: Sequence[tuple[float, ...]], steps: int) -> Fit:
    """Converge a rough fit, or if that fails one with a larger model error."""
    current = fitted.problem.diffusion
    for diffusion in (current, *reversed(levels[: levels.index(current)] if current in levels else ())):
        problem = fitted.problem.with_model_error(diffusion)
        fitted = _nearly(minimise(problem, fitted.point, steps, fitted.smallest_decrease), steps)
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
        result = minimise(fitted.problem.with_model_error(limit), fitted.point, FEW)
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


def with_noise_correlation(fitted: Fit, decrease: float) -> Fit:
    """Refit with AR(1) noise if that raises the likelihood, until chi2 falls by less than `decrease`.

    Frames with correlated noise carry less information than independent ones. Without this the model error
    would be too large, following the noise, and standard errors would be too small.
    """
    if fitted.leverage > _LOOSE:
        return fitted
    # Without this k0 and k2 of a record with coloured noise move by three standard errors.
    memory = noise_autocorrelation(fitted)
    if not memory.any() or np.abs(memory - fitted.noise.memory).max() < _SAME:
        return fitted
    problem = replace(fitted.problem, noise=replace(estimated(fitted), memory=memory))
    result = minimise(problem, fitted.point, STEPS, decrease)
    return result if result.converged and result.evidence > fitted.evidence + LESS else fitted
