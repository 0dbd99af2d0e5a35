"""Hypotheses as data, and the criterion that ranks them: their log evidence."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from udd.discovery.scoring.candidate import changes_with_time, like_geometry
from udd.discovery.scoring.look_alikes import by_parameter
from udd.discovery.symbolic.expressions import is_single_term, length
from udd.effects import Effect
from udd.errors import ModelError
from udd.fitting import Fit

from .thresholds import EVIDENCE_MARGIN
from .trial_fits import TrialFit

Array = NDArray[np.float64]

_SYMBOL = math.log(12)  # nats: a formula's symbol is one of 12 operations and functions
_PLACES = 400  # places of a motion at which laws are compared
_EQUAL = 1e-2  # relative difference below which two laws are equal


def log_evidence(fitted: Fit, names: Sequence[str]) -> float:
    """Compute the log evidence by Laplace's approximation, with unit-information priors.

    The states are integrated out, and so are the parameters. Those that the hypothesis adds, `names`, have a
    prior that carries as much information as one number of the record does (Kass and Wasserman 1995). A model
    error larger than that of a right model is a random force. It costs ten nats.
    """
    # Without this cost a cubic drag with a larger model error leads where a power explains more.
    evidence = fitted.evidence - EVIDENCE_MARGIN * (not fitted.problem.has_smallest_model_error)
    if not names:
        return evidence
    order = list(fitted.parameters)
    rows = [order.index(name) for name in names]
    covariance = fitted.covariance[np.ix_(rows, rows)] / fitted.widened**2
    sign, size = np.linalg.slogdet(covariance)
    if sign <= 0:
        return -math.inf
    return float(evidence - size / 2 - len(rows) * math.log(fitted.observations) / 2)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One or several laws, fitted to the training part of a record and to all of it.

    Attributes
    ----------
    trial, again : TrialFit
        The proposal, fitted to the training part and to all data.
    whole : Fit
        Fit of all data at its own most probable noise and model error.
    prior : float
        Log prior probability: that of one term among all, or of a formula of its length.
    """

    trial: TrialFit
    again: TrialFit
    whole: Fit
    prior: float

    @cached_property
    def log_z(self) -> float:
        """Log evidence of all data, minus the cost of a curve's freedom, plus the log prior.

        The geometry of a film is less accurate than its noise suggests. A curve, a formula, a shape and a law
        that resembles its faults pay in units of the geometry's assumed error; plain laws do not.
        """
        fitted = self.again.fit
        # Without this a real pendulum's quadratic drag becomes a curve, a power, or friction near an angle.
        unsure = max(fitted.scatter, 1.0) / fitted.shown - 1.0
        shapes = sum(c.shapes for c in self.trial.candidates) * math.log(fitted.observations) / 2
        angles = EVIDENCE_MARGIN * sum(like_geometry(c.effect) for c in self.trial.candidates)
        # A spline's coefficients are fixed in a fit: the cost of their freedom is known from its score.
        freedom = self.again.cost if self.again.is_curve else 0.0
        cost = freedom + shapes + angles - (self.prior if self.trial.curve is not None else 0.0)
        return log_evidence(self.whole, self.again.names) - freedom + self.prior - cost * unsure

    @property
    def is_law(self) -> bool:
        """True for terms of the library, and for a formula that is one term."""
        formula = self.trial.formula
        return self.trial.curve is None or (formula is not None and is_single_term(formula.node))

    @property
    def constants(self) -> int:
        """Count of estimated numbers."""
        return max(len(self.trial.names), sum(c.parameters for c in self.trial.candidates))


def log_prior(trial: TrialFit, terms: int) -> float:
    """Compute a proposal's log prior probability, for a library with so many terms.

    A term of the library is one of these. A formula costs its description length in nats, and its coordinate.
    A spline says less than a law and must be far better to lead. A coordinate such as the time, which can
    imitate others, costs more. A term that machines hardly have, and friction or a torque that changes with
    time, must be five nats better.
    """
    single = -math.log(terms)
    unusual = EVIDENCE_MARGIN / 2 * sum(not c.usual or changes_with_time(c.effect) for c in trial.candidates)
    if trial.curve is not None:
        unusual -= trial.curve.log_prior
    if trial.formula is not None:
        return single - unusual - _SYMBOL * length(trial.formula.node)
    return len(trial.candidates) * single - unusual - EVIDENCE_MARGIN * trial.is_curve


def contains(law: Hypothesis, other: Hypothesis, known_parameters: Sequence[str]) -> bool:
    """Return True if one law can imitate another one, along the motion that was fitted with the other.

    The law's constants are fitted to the other one's rates by least squares. The part that the known model's
    free parameters absorb is removed.
    """
    first = other.whole.record.film == 0
    t, states = other.whole.record.t[first], other.whole.states[first]
    some = np.linspace(0, len(t) - 1, min(len(t), _PLACES)).astype(int)
    t, states = t[some], states[some]
    model = other.whole.model
    plain = model.with_effects(model.effects[: len(model.effects) - len(other.trial.candidates)])
    without = plain.rates(t, states)
    able = by_parameter(plain, [name for name in known_parameters if name in plain.parameters], t, states)
    basis = np.linalg.qr(able)[0]

    def unabsorbed(rates: Array) -> Array:
        work = (rates - without).ravel()
        result: Array = work - basis @ (basis.T @ work)
        return result

    target = unabsorbed(model.rates(t, states))
    size = float(np.linalg.norm(target))
    effects = law.whole.model.effects[len(law.whole.model.effects) - len(law.trial.candidates) :]
    values = {f"{e.name}.{p}": e.parameters[p] for e in effects for p in e.parameters}
    constants = {name: value for name, value in values.items() if name in law.whole.parameters}
    if size == 0.0:
        return False
    base = plain.with_effects((*plain.effects, *effects))

    def distance(limit: Mapping[str, float]) -> float:
        """Fit the constants that are not at a limit; return the relative difference that is left."""
        varied = [name for name in constants if name not in limit]
        scale = np.array([abs(constants[name]) or 1.0 for name in varied])

        def residual(x: Array) -> Array:
            try:
                fitted = dict(zip(varied, (x * scale).tolist(), strict=True))
                rates = base.with_parameters(fitted | dict(limit)).rates(t, states)
                off = (unabsorbed(rates) - target) / size
            except ModelError:
                return np.full(target.shape, 1e3)
            return np.where(np.isfinite(off), off, 1e3)

        start = np.array([constants[name] for name in varied]) / scale
        try:
            solved = least_squares(residual, start, max_nfev=30 * (len(varied) + 1))
        except ValueError:
            return math.inf
        return float(np.linalg.norm(solved.fun))

    return any(distance(limit) < _EQUAL for limit in _limits(effects, constants))


def _limits(effects: Sequence[Effect], constants: Iterable[str]) -> Iterator[dict[str, float]]:
    """Yield no limit, then each fitted shape at the ends of its range.

    A law may become another one only there, as Stribeck's friction becomes dry friction.
    """
    yield {}
    for effect in effects:
        for p in effect.spec.parameters:
            name = f"{effect.name}.{p.name}"
            for end in p.range if p.role == "shape" and name in constants else ():
                if np.isfinite(end):
                    yield {name: end}


def ranked(hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Sort hypotheses by their log evidence, the best first.

    Those that are behind by the same number of nats tie: laws come before other formulas. Otherwise they keep
    their order, as a slip and a relaxation do, which are identical at one drive.
    """
    most = max((h.log_z for h in hypotheses), default=0.0)
    return sorted(hypotheses, key=lambda h: (round(most - h.log_z), not h.is_law))


def named(order: Sequence[Hypothesis], known_parameters: Sequence[str]) -> list[Hypothesis]:
    """Put the library's law before the leading formula of ranked hypotheses if they are equivalent."""
    if not order or order[0].trial.formula is None:
        return list(order)
    first = order[0]
    for other in order[1:]:
        is_close = other.trial.curve is None and other.log_z > first.log_z - EVIDENCE_MARGIN
        if is_close and other.constants <= first.constants and contains(other, first, known_parameters):
            return _led_by(other, order)
    return list(order)


def simplest(order: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Put a hypothesis first if the leading one only adds effects to it, and gains less than ten nats."""
    # Without this, a disk with drag above 4 rad/s gets a negative cubic drag, too.
    names = [{c.effect.name for c in h.trial.candidates} for h in order]
    for other, its_names in zip(order, names, strict=True):
        if its_names < names[0] and other.log_z > order[0].log_z - EVIDENCE_MARGIN:
            return _led_by(other, order)
    return list(order)


def _led_by(first: Hypothesis, order: Sequence[Hypothesis]) -> list[Hypothesis]:
    return [first, *(h for h in order if h is not first)]


def lead(chosen: Hypothesis, other: Hypothesis) -> float:
    """Return the number of nats by which one hypothesis leads another.

    A spline over another coordinate than a formula's does not pay the ten nats that it costs more than a law:
    it is a rival of the coordinate, not of the form.
    """
    # Without this, two brakes of a pendulum at 1 and -1 rad are identified as friction over the load.
    waived = EVIDENCE_MARGIN if _doubts_the_coordinate(chosen, other) else 0.0
    return chosen.log_z - other.log_z - waived


def _doubts_the_coordinate(chosen: Hypothesis, other: Hypothesis) -> bool:
    """Return True for a spline over another coordinate than a formula's."""
    curve, spline = chosen.trial.curve, other.trial.curve
    if chosen.trial.formula is None or not other.trial.is_curve or curve is None or spline is None:
        return False
    over, rather = ({c.name.strip("|") for c in located.coordinates} for located in (curve, spline))
    return over != rather


def rivals(
    chosen: Hypothesis, others: Sequence[Hypothesis], known_parameters: Sequence[str]
) -> list[Hypothesis]:
    """Return the hypotheses that the data cannot distinguish from the chosen one.

    They are at most ten nats behind. If a law was chosen, a spline is a rival only if it doubts a formula's
    coordinate. A formula that the chosen law or a better rival contains is no rival. Nor is a law that
    contains the chosen one, with more constants and no gain.
    """
    result: list[Hypothesis] = []
    for other in others:
        if other is chosen or lead(chosen, other) > EVIDENCE_MARGIN:
            continue
        if other.trial.is_curve:
            if chosen.trial.is_curve or _doubts_the_coordinate(chosen, other):
                result.append(other)
            continue
        wider = other.constants > chosen.constants
        # Without the rounding, drag above 0.16 rad/s is a rival of quadratic drag: it gains 0.01 nats.
        gains = round(other.log_z - chosen.log_z) > 0
        if wider and not gains and contains(other, chosen, known_parameters):
            continue
        if other.trial.formula is not None and any(
            contains(law, other, known_parameters)
            for law in (chosen, *result)
            if law.constants >= other.constants and not law.trial.is_curve
        ):
            continue  # the same law in another notation
        result.append(other)
    return result
