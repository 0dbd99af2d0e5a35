"""Full fits of proposals: effects of the library, a located curve, or a formula for one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ParamSpec, TypeVar

import numpy as np

from udd._util import chi_squared
from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.score_scan import physical
from udd.discovery.symbolic.formulas import Formula
from udd.errors import FitError
from udd.fitting import Fit, Goal, extend, started_at

from .curve_effects import fit_curve, fit_formula
from .thresholds import ALPHA

Work = ParamSpec("Work")
Result = TypeVar("Result")


def needed_in(fitted: Fit, names: Sequence[str]) -> bool:
    """Return True if an effect's amplitudes are significant with everything else free (Wald's test)."""
    return bool(wald(fitted, names) / fitted.shown >= chi_squared.isf(ALPHA, len(names)))


def wald(fitted: Fit, names: Sequence[str]) -> float:
    """Compute the squared distance of parameters from zero in units of their covariance.

    It is zero if they are collinear: fewer directions are identifiable than there are parameters.
    """
    order = list(fitted.parameters)
    indices = [order.index(name) for name in names]
    a = np.array([fitted.parameters[name] for name in names])
    block = fitted.covariance[np.ix_(indices, indices)]
    return float(a @ np.linalg.solve(block, a)) if np.linalg.matrix_rank(block) == len(indices) else 0.0


def cost_of_parameter(fitted: Fit) -> float:
    """Return the cost of a parameter by the Bayesian information criterion, nats."""
    return math.log(fitted.observations) / 2


def attempted(work: Callable[Work, Result], *args: Work.args, **options: Work.kwargs) -> Result | None:
    """Return a result of the fitter; None if it fails."""
    try:
        return work(*args, **options)
    except FitError:
        return None


@dataclass(frozen=True)
class TrialFit:
    """Full fit of a proposal: candidates with free amplitudes, a located curve, or a formula for one.

    Attributes
    ----------
    candidates : list of Candidate
        The effects as proposed.
    fit : Fit
    names : list of str
        Parameters that the proposal adds.
    cost : float
        Cost of its freedom, nats.
    curve : Curve or None
        The located curve.
    formula : Formula or None
        Its formula.
    """

    candidates: list[Candidate]
    fit: Fit
    names: list[str]
    cost: float
    curve: Curve | None = None
    formula: Formula | None = None

    @property
    def amplitudes(self) -> list[float]:
        """Fitted values of the added parameters."""
        return [self.fit.parameters[name] for name in self.names]

    @property
    def freedom(self) -> float:
        """Count of estimated numbers."""
        return self.curve.df if self.curve is not None and self.formula is None else len(self.names)

    @property
    def rank(self) -> tuple[int, float]:
        """Sort key: the smallest model error first, then the smallest chi2."""
        return -self.fit.level, self.fit.chi2

    @property
    def is_curve(self) -> bool:
        """True for a curve without a formula."""
        return self.curve is not None and self.formula is None

    @property
    def needed(self) -> bool:
        """True if each of several candidates is significant in addition to the others."""
        return len(self.candidates) < 2 or all(
            needed_in(self.fit, c.amplitude_names) for c in self.candidates
        )

    @property
    def physical(self) -> bool:
        """True if all amplitudes are in their ranges, and a pendulum's own friction still brakes."""
        values, errors = self.fit.parameters, self.fit.errors
        brakes = [name for name in self.fit.model.profile.discovery.brakes if name in values]
        if any(values[name] < -2 * errors[name] for name in brakes):
            return False  # two forms that cancel partly; a third would explain the sum alone
        if self.curve is not None:
            return True
        return all(
            physical(c, [values[n] for n in c.amplitude_names], [errors[n] for n in c.amplitude_names])
            for c in self.candidates
        )


def of_library(
    current: Fit, candidates: list[Candidate], start: list[float], goal: Goal | None = None
) -> TrialFit | None:
    """Fit effects of the library with free amplitudes.

    Return None if the fit fails, or explains less than the `goal` requires.
    """
    effects = [c.effect for c in candidates]
    fitted = attempted(extend, current, effects, start, goal or Goal(current.level))
    if fitted is None:
        return None
    names = [name for c in candidates for name in c.amplitude_names]
    cost = cost_of_parameter(fitted) * sum(c.parameters for c in candidates)
    trial = TrialFit(candidates, fitted, names, cost)
    return trial if trial.physical and fitted.converged else None


def of_several(
    current: Fit, candidates: list[Candidate], goal: Goal | None = None, first: TrialFit | None = None
) -> TrialFit | None:
    """Fit several effects of the library, from zero or from the end of a fit that has one of them."""
    values = first.fit.parameters if first else {}
    amplitudes = [values.get(name, 0.0) for c in candidates for name in c.amplitude_names]
    return of_library(started_at(current, first.fit) if first else current, candidates, amplitudes, goal)


def of_curve(current: Fit, curve: Curve, most: float = math.inf) -> TrialFit | None:
    """Fit a curve in full; return None if that fails, or chi2 stays above `most`."""
    kind = "curve" if len(curve.coordinates) == 1 else "surface"
    located = attempted(fit_curve, current, curve, _unused(current, kind), most)
    if located is None or not located.fit.converged:
        return None
    candidate = Candidate(located.effect, curve.title)
    return TrialFit([candidate], located.fit, [], located.cost, located.curve)


def of_formula(current: Fit, curve: Curve, written: Formula, goal: Goal | None = None) -> TrialFit | None:
    """Fit a formula for a curve, all its constants free; None as in :func:`of_library`."""
    name = _unused(current, "formula")
    fitted = attempted(fit_formula, current, curve, written, name, goal)
    if fitted is None:
        return None
    effect = fitted.model.effects[-1]
    names = [f"{name}.{p}" for p in effect.parameters]
    cost = cost_of_parameter(fitted) * len(names)
    trial = TrialFit([Candidate(effect, effect.title)], fitted, names, cost, curve, written)
    return trial if trial.physical and fitted.converged else None


def fitted_ones(trials: list[TrialFit | None]) -> list[TrialFit]:
    """Drop failed fits."""
    return [t for t in trials if t]


def one_of_each(trials: list[TrialFit]) -> list[TrialFit]:
    """Keep the best of the trials of one effect that started at different values of a free shape."""
    best: dict[object, TrialFit] = {}
    for trial in sorted(trials, key=lambda t: t.rank):
        effect = trial.candidates[0].effect
        fixed = [effect.parameters[p.name] for p in effect.spec.parameters if not p.sought]
        best.setdefault((effect.name, effect.momentum, *fixed), trial)
    return [trial for trial in trials if trial in best.values()]


def _unused(current: Fit, name: str) -> str:
    """Return an unused name for an effect of the model."""
    taken = {effect.name for effect in current.model.effects}
    return next(n for n in (name, *(f"{name}{k}" for k in range(2, 9))) if n not in taken)
