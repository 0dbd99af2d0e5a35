"""Full fits of a located curve, or of a formula for it, with everything else."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd import effects
from udd._util.one_line import OneLine
from udd.discovery.nonparametric.confounding import identifiable_part
from udd.discovery.nonparametric.curve_scan import Curve, refined, rescored
from udd.discovery.symbolic.expressions import softened, write
from udd.discovery.symbolic.formulas import Formula
from udd.effects import Effect
from udd.errors import FitError
from udd.fitting import Fit, Goal, minimise, solve, widened
from udd.fitting.model_error_schedule import ANY, FEW, ROUGH, STEPS

Array = NDArray[np.float64]

_MOVES = 12  # maximum of moves of a curve for one model error
_LOST = 3  # consecutive solves without convergence, after which the curve is abandoned
_SHORTEST = 0.2  # smallest share of a move; below it no move improves the fit
_WORSE = 1.02  # factor in chi2 that a move may cost
_SLOW = 0.01  # share of chi2; once it decreases by less the model error may be reduced
_SOFT = 1e-3
_STILL = 0.05  # nats that another move must bring


@dataclass(frozen=True, repr=False)
class CurveFit(OneLine):
    """Fitted model with a curve.

    Attributes
    ----------
    fit : Fit
        Fit whose model has the curve as its last effect.
    curve : Curve
        The fitted curve; its band excludes the part confounded with the model's other parameters.
    cost : float
        Cost of the curve's freedom, nats: the counterpart of half a parameter's log count of numbers in the
        Bayesian information criterion.
    """

    fit: Fit
    curve: Curve
    cost: float

    @property
    def effect(self) -> Effect:
        """The curve as an effect."""
        return self.fit.model.effects[-1]


def curve_effect(curve: Curve, name: str = "curve") -> Effect:
    """Make an effect from a curve, or from a surface.

    Parameters
    ----------
    curve : Curve
    name : str
        Prefix of its parameters' names.
    """
    spline, last = curve.splines[0], curve.splines[-1]
    if len(curve.coordinates) == 2:
        return effects.surface(
            curve.slot.name,
            (curve.coordinates[0].text, curve.coordinates[1].text),
            (spline.low, last.low),
            (spline.high, last.high),
            curve.coefficients.reshape(spline.size, last.size),
            periodic=last.periodic,
            momentum=curve.slot.momentum,
            name=name,
        )
    return effects.curve(
        curve.slot.name,
        curve.coordinates[0].text,
        spline.low,
        spline.high,
        curve.coefficients,
        periodic=spline.periodic,
        momentum=curve.slot.momentum,
        name=name,
    )


def fit_curve(fit: Fit, curve: Curve, name: str = "curve", most: float = math.inf) -> CurveFit:
    """Add a curve to a fitted model and refit everything: Gauss-Newton in the curve, the rest projected out.

    The curve is moved to its most probable position, everything else following; then the model's parameters
    and states are fitted with the curve fixed; and so on in turns. It starts with the largest model error,
    around which all is nearly linear. Once the curve is nearly still the model error is reduced, as far as
    the fit converges. A move that makes the fit worse is halved.

    Parameters
    ----------
    fit : Fit
        Fit around which the curve was scored, or one of the same data with a larger model error.
    curve : Curve
    name : str
        Prefix of the effect's parameters' names.
    most : float
        Upper limit of chi2. It only rises as the model error is reduced, so a fit above it is abandoned.

    Raises
    ------
    FitError
        The curve cannot be added to a model, the model with it cannot be solved, or chi2 is above `most`.
    """
    curve = refined(curve, fit)
    here = _FixedCurve(curve, curve.coefficients, _solved(fit, curve, name, fit, 0))
    slow = _SLOW
    while True:
        here, settled = _moved(fit, here, name, slow)
        # Without this splines of a strong dry friction take nine tenths of a search's time.
        if here.fit.chi2 > most:
            raise FitError("the curve explains less than a law")
        tighter = _tightened(fit, here, name)
        if tighter is None and not slow:
            break
        here, slow = (here, 0.0) if tighter is None else (tighter, _SLOW)
    # The curve of the model; the next move would be within the last one.
    curve, at, score = replace(here.curve, coefficients=here.at), here.at, here.curve.score
    fitted = _solved(fit, curve, name, here.fit, here.fit.level, STEPS, here.fit.smallest_decrease)
    gain = float(score.gradient @ at - at @ score.information @ at / 2)
    cost = gain - curve.evidence
    if not settled:  # while the curve still moves, its gain here does not determine its cost
        cost = max(cost, curve.df * math.log(fit.observations) / 2)
    return CurveFit(fitted, identifiable_part(curve, fitted), cost)


@dataclass(frozen=True)
class _FixedCurve:
    """Coefficients of the model's curve, its fit, and the most probable curve around it."""

    curve: Curve
    at: Array
    fit: Fit


def _moved(fit: Fit, here: _FixedCurve, name: str, slow: float) -> tuple[_FixedCurve, bool]:
    """Move the curve until chi2 decreases little, or the curve is still; also return whether it settled."""
    at, current, fall, share, lost = here.at, here.fit, math.inf, 1.0, 0
    for remaining in reversed(range(_MOVES)):
        curve = rescored(here.curve, current, at)
        move, unit = curve.coefficients - at, max(1.0, current.scatter)
        settled = bool(move @ curve.score.information @ move / 2 < _STILL * unit)
        if settled or not remaining or abs(fall) < max(slow * current.chi2, 2 * _STILL * unit):
            break
        while share >= _SHORTEST:
            to = at + share * move
            try:
                moved = _solved(fit, replace(curve, coefficients=to), name, current, current.level)
            except FitError:
                moved = None
            lost = 0 if moved is not None and moved.converged else lost + 1
            if lost == _LOST:
                raise FitError("the model with the curve does not converge")
            if moved is not None and moved.chi2 < _WORSE * current.chi2:
                break
            share /= 2
        else:
            break
        fall = current.chi2 - moved.chi2
        at, current, share = to, moved, min(2 * share, 1.0)
    return _FixedCurve(curve, at, current), settled


def _tightened(fit: Fit, here: _FixedCurve, name: str) -> _FixedCurve | None:
    """Reduce the model error; None if the fit then does not converge."""
    level = here.fit.level + 1
    if level == len(fit.problem.schedule):
        return None
    try:
        tighter = _solved(fit, replace(here.curve, coefficients=here.at), name, here.fit, level)
    except FitError:
        return None
    return replace(here, fit=tighter) if tighter.converged else None


def _solved(
    fit: Fit, curve: Curve, name: str, start: Fit, level: int, steps: int = FEW, decrease: float = ROUGH
) -> Fit:
    """Fit the model with the curve fixed, at a level of model error, from the end of another fit."""
    problem, point = widened(replace(fit, point=start.point), [curve_effect(curve, name)])
    problem = problem.with_model_error(problem.schedule[level])
    return minimise(problem, point, steps, decrease)


def formula_effect(curve: Curve, formula: Formula, name: str = "formula") -> Effect:
    """Make an effect from a formula for a curve.

    Broken powers, which have an infinite slope at zero, are rounded off within a thousandth of the curve's
    range.
    """
    variable = curve.coordinates[0].text
    values: dict[str, Any] = dict(formula.parameters)
    node = softened(formula.node, _SOFT * float(np.ptp(curve.places[0])))
    return effects.formula(
        curve.slot.name,
        write(node, variable, dict(enumerate(values))),
        momentum=curve.slot.momentum,
        name=name,
        title=f"{curve.slot.title} = {formula.text}",
        amplitudes=formula.amplitudes,
        **values,
    )


def fit_formula(
    fit: Fit, curve: Curve, formula: Formula, name: str = "formula", goal: Goal | None = None
) -> Fit:
    """Add a formula for a curve to a fitted model and refit everything, all of its constants free.

    The noise stays fixed, so that chi2 can be compared with that of the curve.

    Raises
    ------
    FitError
        The formula cannot be added to the model, the fit fails, or does not reach its goal.
    """
    problem, point = widened(fit, [formula_effect(curve, formula, name)])
    problem = problem.freeing({f"{name}.{p}": (0.0, np.inf) for p in formula.parameters})
    # If its constants diverge, or are collinear, the fit has no end.
    return solve(problem, problem.schedule[1:], point, steps=FEW, goal=goal or ANY)
