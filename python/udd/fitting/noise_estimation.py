"""Fits in which the noise is estimated with the states, the parameters and the model error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import profile_of

from .fit_result import Fit, minimise
from .minimum import MOST
from .model_error_schedule import FEW, LEAP, ROUGH, provisional_fit, solve
from .noise import estimated, stated
from .problem import FOLLOWS, Point, Problem
from .sensor import is_encoder

_NOISE_ROUNDS = 12
#: Lower limit of the noise, as a share of a camera's assumed noise: computed motion has no noise, and its
#: weights would have no bound.
FINEST = 1e-3
# factor by which a measurement's stated errors may be too small; a larger misfit is the model's fault
_BELIEVED = 3.0

#: Source of the misfits: the noise; almost nothing, because the states follow every frame; or the model's
#: faults.
Misfits = Literal["noise", "little", "faults"]


def solve_with_noise(problem: Problem, point: Point) -> Fit:
    """Solve the problem while the model error is reduced step by step; estimate the noise again on the way.

    The noise is estimated at the largest model error at which the misfits show it, because a wrong model does
    least harm there. It is estimated again at the last level, if the model reaches it. At still larger model
    errors the states follow every frame, and noise and model error cannot be distinguished.
    """
    as_stated, first = replace(problem, noise=stated(problem.record)), point
    for number, diffusion in enumerate(problem.schedule):
        problem = as_stated.with_model_error(diffusion)
        misfits, problem, point = _estimate_noise(problem, point)
        if misfits == "faults":
            break  # a smaller model error shows even more of them
        if misfits == "noise":
            loose = provisional_fit(problem, point)
            # A search does not trust a pendulum film's noise to be below its geometric error.
            if problem.likeliest or not profile_of(problem.measurements[0].kind).sensor.faithful:
                loose = _likeliest_noise(loose, problem.schedule[number + 1 :])
            tighter = problem.schedule[loose.level + 1 :]
            if not tighter:
                return loose
            return solve(loose.problem, tighter, _afresh(loose), best=loose)
    # If the noise never shows, or is below the model's faults, the film is very precise: use its stated
    # noise.
    return solve(as_stated, problem.schedule, first)


def _likeliest_noise(fitted: Fit, tighter: Sequence[tuple[float, ...]]) -> Fit:
    """Return the fit of the last level with the noise estimated there, if the evidence rises on the way.

    While the states still follow the frames, the noise estimate is too small, and a correct model would then
    seem incomplete. A correct model can skip levels. If a model does not reach the last level, its noise
    stays.
    """
    # Without this, a plain disk measured to 0.1 mm and 1 mrad is reported as incomplete.
    best, left = fitted, list(tighter)
    while left:
        ahead = min(LEAP, len(left))
        further = (_likelier(best, left[k - 1]) for k in dict.fromkeys((ahead, 1)))
        next_fit = next(filter(None, further), None)
        if next_fit is None:
            return fitted
        best, left = next_fit, left[left.index(next_fit.problem.diffusion) + 1 :]
    return best


def _likelier(fitted: Fit, diffusion: tuple[float, ...]) -> Fit | None:
    """Fit with this model error, the noise estimated there; None if the evidence does not rise."""
    problem = fitted.problem.with_model_error(diffusion)
    try:
        misfits, problem, point = _estimate_noise(problem, _afresh(fitted), FEW)
        if misfits != "noise":
            return None
        result = provisional_fit(problem, point, FEW)
    except FitError:
        return None
    return result if result.converged and result.evidence > fitted.evidence else None


def _afresh(fitted: Fit) -> Point:
    """Return the states of a fit; model parameters with a prior go back to its mean.

    While the states follow the frames, a law that is nonlinear in the speed, such as friction, may come out
    flat, and would then stay flat.
    """
    sets = fitted.point.with_values(list).sets
    for free in fitted.problem.free:
        if free.role == "model" and np.isfinite(free.sd):
            for film in sets if free.film is None else [sets[free.film]]:
                film.model[free.index] = free.mean
    return Point(fitted.states, sets)


def _is_known(measurement: Measurement) -> bool:
    """Return True if the noise is known beforehand: stated, or shown by the frames of a sensor."""
    return measurement.sigma is not None or profile_of(measurement.kind).written or is_encoder(measurement)


def least_noise(measurements: Sequence[Measurement], search: bool) -> float:
    """Return the lower limit of the noise, in units of the noise that is known beforehand."""
    result = 0.0 if profile_of(measurements[0].kind).written else FINEST
    for measurement in measurements:
        least = profile_of(measurement.kind).sensor.faithful
        if least and is_encoder(measurement):
            return 1.0
        if search and measurement.sigma is None:
            result = max(result, least)
    return result


def _estimate_noise(problem: Problem, point: Point, steps: int = MOST) -> tuple[Misfits, Problem, Point]:
    """Alternate between fitting and estimating the noise; return the source of the misfits and the result.

    A model that does not converge in so many `steps` is wrong.
    """
    is_known = all(_is_known(measurement) for measurement in problem.measurements)
    least = least_noise(problem.measurements, search=not problem.likeliest)
    for _ in range(_NOISE_ROUNDS):
        result = minimise(problem, point, steps, decrease=ROUGH)
        point, before = result.point, problem.noise
        if steps < MOST and not result.converged:
            return "faults", problem, point
        if result.leverage > FOLLOWS:
            return "little", problem, point
        noise = estimated(result)
        if is_known and noise.beyond(problem.record, result.blurring, _BELIEVED):
            return "faults", problem, point
        noise = replace(noise, factor=np.maximum(noise.factor, least))
        problem = replace(problem, noise=noise)
        if before.like(noise, problem.record, result.blurring):
            break
    return "noise", problem, point


def own_noise(fitted: Fit) -> tuple[Problem, Point]:
    """Estimate the noise at a fit's model error; keep it where the misfits do not show it."""
    problem = replace(fitted.problem, likeliest=True)
    misfits, problem, point = _estimate_noise(problem, fitted.point)
    return (problem, point) if misfits == "noise" else (fitted.problem, fitted.point)
