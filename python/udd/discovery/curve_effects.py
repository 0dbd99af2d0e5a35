"""Fits in full of a located curve, or of a formula for it, with everything else."""

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
from udd.fitting import Fit, Goal, widened
from udd.fitting.model_error_schedule import ANY, FEW, ROUGH, STEPS, reduce_model_error
from udd.fitting.parameters import Free
from udd.fitting.solve import done, solve

Array = NDArray[np.float64]

_MOVES = 12  # of a curve, most, for one model error
_LOST = 3  # solves on end that do not converge, after which the curve leads nowhere
_SHORTEST = 0.2  # share of a move, below which there is none that makes the fit better
_WORSE = 1.02  # times chi2
_SLOW = 0.01  # of chi2: where it falls by less the model may be held more tightly
_SOFT = 1e-3
_STILL = 0.05  # nats that another move would bring


@dataclass(frozen=True, repr=False)
class CurveFit(OneLine):
    """A model with a curve, fitted.

    Attributes
    ----------
    fit : Fit
        Its model holds the curve as its last effect.
    curve : Curve
        As it came out, its band less what the model's other parameters can do.
    price : float
        What the curve's freedom costs, nats: as half a parameter's logarithm of the numbers in the record is
        by the Bayesian information criterion.
    """

    fit: Fit
    curve: Curve
    price: float

    @property
    def effect(self) -> Effect:
        """The curve as an effect."""
        return self.fit.model.effects[-1]


def curve_effect(curve: Curve, name: str = "curve") -> Effect:
    """A curve, or a surface, as an effect that a model can have.

    Parameters
    ----------
    curve : Curve
    name : str
        What its parameters are called after.
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


def fit_curve(fit: Fit, curve: Curve, name: str = "curve") -> CurveFit:
    """Add a curve to a fitted model and refit everything: Gauss-Newton in the curve, the rest projected out.

    In turns the curve is moved to where it is most likely, everything else following, and the model's
    parameters and states are fitted with the curve held: first with the largest model error, around which all
    is nearly linear, and once the curve is nearly still with a smaller one, as far as that goes. A move that
    makes the fit worse is halved.

    Parameters
    ----------
    fit : Fit
        Around which the curve was found, or a looser one of the same data.
    curve : Curve
    name : str
        What the effect's parameters are called after.

    Raises
    ------
    FitError
        The curve cannot be added to a model, or the model with it cannot be solved.
    """
    curve = refined(curve, fit)
    here = _Held(curve, curve.coefficients, _solved(fit, curve, name, fit, 0))
    slow = _SLOW
    while True:
        here, settled = _moved(fit, here, name, slow)
        tighter = _tightened(fit, here, name)
        if tighter is None and not slow:
            break
        here, slow = (here, 0.0) if tighter is None else (tighter, _SLOW)
    # What the model holds; the next move would be within the last one.
    curve, at, score = replace(here.curve, coefficients=here.at), here.at, here.curve.score
    fitted = _solved(fit, curve, name, here.fit, here.fit.level, STEPS, done(here.fit))
    gain = float(score.gradient @ at - at @ score.information @ at / 2)
    price = gain - curve.evidence
    if not settled:  # where the curve is still on its way, what it gains here says nothing of its price
        price = max(price, curve.df * math.log(fit.observations) / 2)
    return CurveFit(fitted, identifiable_part(curve, fitted), price)


@dataclass(frozen=True)
class _Held:
    """The coefficients that a model holds its curve with, its fit, and the curve as it is likeliest there."""

    curve: Curve
    at: Array
    fit: Fit


def _moved(fit: Fit, here: _Held, name: str, slow: float) -> tuple[_Held, bool]:
    """Move the curve until chi2 falls by no more than a share of itself, or is still; whether it settled."""
    at, current, fall, share, lost = here.at, here.fit, math.inf, 1.0, 0
    for left in reversed(range(_MOVES)):
        curve = rescored(here.curve, current, at)
        move, unit = curve.coefficients - at, max(1.0, current.scatter)
        settled = bool(move @ curve.score.information @ move / 2 < _STILL * unit)
        if settled or not left or abs(fall) < max(slow * current.chi2, 2 * _STILL * unit):
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
    return _Held(curve, at, current), settled


def _tightened(fit: Fit, here: _Held, name: str) -> _Held | None:
    """The same with a smaller model error, or None where it cannot be."""
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
    """The model with the curve held, as tightly as a level says, fitted from where another fit ended."""
    problem, point = widened(fit, [curve_effect(curve, name)], start)
    problem = problem.with_model_error(problem.schedule[level])
    return solve(fit.measurements, problem, point, steps, decrease)


def formula_effect(curve: Curve, formula: Formula, name: str = "formula") -> Effect:
    """A formula for a curve as an effect that a model can have.

    Broken powers, whose slope at zero has no end, are rounded off within a thousandth of the curve's range.
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

    The noise stays as it was estimated, so that chi2 compares with that of the curve.

    Raises
    ------
    FitError
        The formula cannot be added to the model, the fit fails, or does not reach its goal.
    """
    problem, point = widened(fit, [formula_effect(curve, formula, name)])
    order = list(problem.models[0].parameters)
    names = [f"{name}.{p}" for p in formula.parameters]
    more = tuple(Free(n, "model", order.index(n), 0.0, np.inf) for n in names)
    problem = replace(problem, free=problem.free + more)
    # Where its constants run away, or trade for each other, there is no end to come to.
    return reduce_model_error(
        fit.measurements, problem, point, problem.schedule[1:], steps=FEW, goal=goal or ANY
    )
