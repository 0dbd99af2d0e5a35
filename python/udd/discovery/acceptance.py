"""Which of several trials is accepted: the best form, if it passes all tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd.discovery.nonparametric.curve_scan import EVIDENCE_MARGIN, Curve
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.score_scan import Scan
from udd.discovery.validation.confirmation import Pair, confirmed_by, same_level
from udd.discovery.validation.held_out_errors import (
    Errors,
    Ratio,
    comparison_horizon,
    held_out_errors,
    improvement,
    whole_improvement,
)
from udd.discovery.validation.predictive_comparison import Foretelling
from udd.discovery.validation.sensor_drift import drift_gain
from udd.errors import FitError
from udd.fitting import Fit, Record, at_level, far_off, ran_away, released, started_at
from udd.fitting.parameters import Free

from .results import Alternative
from .score_rounds import ScoreRound
from .thresholds import ALPHA, Confirmation
from .time_budget import Clock
from .trial_fits import TrialFit, fitted_ones, from_none, of_curve, of_formula, of_library, same_law

_SUPERSET = 0.95  # a form with more parameters and this likeness is the same form with more freedom
_WORSE = 1.1  # an effect is refused if the lower end of the errors' ratio exceeds this at some horizon
_DRIFT = 0.7  # of an effect's gain from which on a drifting sensor, its motion held, may be all there is
#: In chi2: forms that differ by less are compared by all data and by what they foretell.
_TIED = 4 * EVIDENCE_MARGIN
_ASTRAY = 1.5  # times the scatter of the first part, of all data: that fit may have ended elsewhere
_FORETOLD = 0.9  # cost of held-out frames over another form's, below which forms of equal cost part
#: Times chi2, by which what is held as stated may part forms: with it free, all data compare them.
_BENT = 2.0
_EQUALS = 10  # forms between which all data decide


@dataclass(frozen=True)
class Step:
    """An addition that was accepted: one candidate, two together, or a curve.

    Attributes
    ----------
    candidates : list of Candidate
    curve : Curve or None
        The curve that was located, where that is what was added or what a formula was found for.
    chi2, p : float
        By how much chi2 fell, and the probability of that by chance.
    ratio : tuple of float
        Cost of the held-out frames after over before, with its 95 % interval.
    witness : {"held", "fitted", "halves"}
        What bears it out, see :func:`udd.discovery.validation.confirmation.confirmed_by`.
    alternatives : list of Alternative
    price : float
        What its freedom costs, in chi2; more for a formula, and for a curve, than for what physics knows.
    """

    candidates: list[Candidate]
    curve: Curve | None
    chi2: float
    p: float
    ratio: Ratio
    witness: Confirmation
    alternatives: list[Alternative]
    price: float

    @property
    def is_curve(self) -> bool:
        """Whether it is a curve without a formula."""
        return self.curve is not None and self.candidates[0].title == self.curve.title


@dataclass(frozen=True)
class SearchState:
    """Where the search stands: fits of the first part and of all data, and held-out errors.

    Where whole records are held out both are one fit, of all other records.
    """

    part: Fit
    whole: Fit
    errors: Errors


def _clearly(ratio: Ratio) -> bool:
    """Whether one form foretells at less cost than another, beyond doubt and by an amount that matters."""
    return ratio[0] < _FORETOLD and ratio[2] < 1.0


def _beside(mine: Sequence[Candidate], others: Sequence[Candidate]) -> list[tuple[Candidate, Candidate]]:
    """Which effects of one list stand in the place of which of another, those in both left out."""
    left = [c for c in mine if c.effect not in [o.effect for o in others]]
    right = [o for o in others if o.effect not in [c.effect for c in mine]]
    return list(zip(left, right, strict=False))


def _chance(pair: Pair, trial: TrialFit, scores: ScoreRound) -> tuple[float, float]:
    """By how much chi2 fell from one fit of all data to another, and the probability of that by chance."""
    from scipy.stats import ncx2  # takes half a second to import

    before, after = pair
    inflation = after.inflation(before)
    fall = (before.chi2 - after.chi2) / inflation
    # What a film's faults make up is no sum of squares of chance alone.
    return fall, min(float(ncx2.sf(fall, trial.freedom, after.faults / inflation)) * scores.comparisons, 1.0)


@dataclass(frozen=True)
class TestResult:
    """What the tests say of a trial.

    Attributes
    ----------
    whole : Fit
        Of all data.
    chi2, p, ratio, witness
        As of a :class:`Step`; a trial that chance explains is not asked for a witness.
    drifts : bool
        Whether a slow drift of the sensor's zero would explain more.
    """

    whole: Fit
    chi2: float
    p: float
    ratio: Ratio
    witness: Confirmation | None
    drifts: bool = False


def _compared(trials: Sequence[TrialFit], level: int) -> list[TrialFit]:
    """Trials held as tightly as one another, without those that cannot be solved there."""
    result = []
    for trial in trials:
        try:
            result.append(replace(trial, compared=at_level(trial.fit, level)))
        except FitError:
            continue
    return result


def _fitted_to(whole: Fit, trial: TrialFit) -> TrialFit | None:
    """A proposal fitted to all data, from where a fit of these without it ended."""
    if trial.curve is None:
        return of_library(whole, trial.candidates, trial.amplitudes)
    if trial.formula is None:
        return of_curve(whole, trial.curve)
    return of_formula(whole, trial.curve, trial.formula)


class Acceptance:
    """The tests that a trial must pass, and the choice between those that do."""

    def __init__(
        self,
        record: Record,
        held_out: NDArray[np.bool_],
        clock: Clock,
        unit: float = 1.0,
        free: Sequence[Free] = (),
    ) -> None:
        self.record, self.held_out, self.clock, self.unit = record, held_out, clock, unit
        self.free = free

    def errors(self, fitted: Fit) -> Errors:
        """Held-out errors of a fit of the first part."""
        return held_out_errors(fitted, self.record, self.held_out, unit=self.unit)

    def improvement(self, before: Errors, after: Errors) -> Ratio:
        """Held-out error after over before.

        Of the disk, which is chaotic, at the horizon of comparison; of a pendulum over the whole run.
        """
        if before.unit == "rad":
            return whole_improvement(before, after)
        return improvement(before, after, comparison_horizon(before))

    def best(
        self, current: SearchState, trials: list[TrialFit], scores: ScoreRound
    ) -> tuple[Step, SearchState] | None:
        """The best trial that passes all tests."""
        trials = [t for t in trials if t.fit.level >= current.part.level and t.needed]
        if not trials:
            return None
        # chi2 compares only where the models are held equally tightly.
        level = min(t.fit.level for t in trials)
        trials = _compared(trials, level)
        if not trials:
            return None
        first, before = min(trials, key=lambda t: t.compared.chi2).compared, at_level(current.part, level)
        unit = first.inflation(before)
        # Equal ones, like a slip and a relaxation at one drive, come in the library's order; what physics
        # knows comes before a formula, and a formula before a curve, that fit about as well.
        trials = sorted(trials, key=lambda t: round(t.criterion(unit) + t.prior_penalty, 3))
        paid = {id(t): t.criterion(unit) + (t.prior_penalty if t.is_curve else 0.0) for t in trials}
        near = [t for t in trials if paid[id(t)] - min(paid.values()) <= _TIED]
        if not self.all_are_free(current.part):
            near = [t for t in trials if t.compared.chi2 < _BENT * first.chi2]
        near = self._once(near)
        costs, wholes = self._costs(current, near[:_EQUALS], first.unit(before), unit)
        near = sorted((t for t in near if id(t) in costs), key=lambda t: round(costs[id(t)], 3))
        foretelling = Foretelling(current.whole.record, wholes, self.unit)
        near = self._foretelling(near, costs, foretelling)
        # Where the best form fails a test, a clearly worse one is not named instead.
        for chosen in (t for t in near if costs[id(t)] - costs[id(near[0])] <= 2 * EVIDENCE_MARGIN):
            trial = self._in_other_widths(current, chosen, scores.library)
            judged = self.judged(current, trial, scores)
            if judged is None or judged.witness is None:
                continue
            errors = self.errors_or_none(trial.fit)
            if errors is not None and not self.worse(current.errors, errors):
                others = self._alternatives(chosen, trials, scores.library, costs, foretelling)
                step = Step(
                    candidates=trial.candidates,
                    curve=trial.curve,
                    chi2=judged.chi2,
                    p=judged.p,
                    ratio=judged.ratio,
                    witness=judged.witness,
                    alternatives=others,
                    price=trial.price + trial.prior_penalty,
                )
                return step, SearchState(trial.fit, judged.whole, errors)
        return None

    def _in_other_widths(self, current: SearchState, trial: TrialFit, scanned: Scan) -> TrialFit:
        """Several effects at once, with every width of those that turn over one: a fit may be stuck at it.

        Around a model that lacks two of them the width that scores best need not be near that of the fit.
        """
        if len(trial.candidates) < 2:
            return trial
        groups = [
            [other if c is mine else c for c in trial.candidates]
            for mine in trial.candidates
            for other in (s.candidate for s in scanned.scored)
            if other.title == mine.title and other is not mine
        ]
        found = fitted_ones(self.clock.each(lambda group: from_none(current.part, group), groups))
        level = trial.fit.level
        some = [trial, *(t for t in found if t.fit.level >= level and t.needed)]
        return min(_compared(some, level), key=lambda t: t.compared.chi2, default=trial)

    def _once(self, near: list[TrialFit]) -> list[TrialFit]:
        """Without formulas that are one of the library's laws in other words."""
        # Without this "friction = a |Omega| |Omega|" is told as an alternative to quadratic drag.
        known = [t for t in near if t.curve is None]
        return [
            t
            for t in near
            if t.formula is None or not any(same_law(t.compared, other.compared) for other in known)
        ]

    def _foretelling(
        self, near: list[TrialFit], costs: dict[int, float], foretelling: Foretelling
    ) -> list[TrialFit]:
        """Forms in order of their cost, but first one of about equal cost that foretells clearly better."""
        # Without this a cubic drag stands for a pendulum's quadratic drag and dry friction.
        best = near[0] if near else None
        for other in near[1:]:
            tied = costs[id(other)] - costs[id(near[0])] <= _TIED
            if best and tied and _clearly(foretelling.ratio(best, other)):
                best = other
        return [best, *(t for t in near if t is not best)] if best else near

    def _costs(
        self, current: SearchState, near: list[TrialFit], unit: float, most: float
    ) -> tuple[dict[int, float], dict[int, TrialFit]]:
        """What each of several forms costs that explain the first part about as well: by all data; the fits.

        Forms that tie in the first part may part on the rest. By Dawid's prequential argument the criterion
        of all data is, but for a constant, the cost of predicting each stretch from those before it.
        """
        if len(near) < 2:
            return {id(t): t.criterion(unit) + t.prior_penalty for t in near if t.needed}, {}

        def again(trial: TrialFit) -> TrialFit | None:
            try:
                whole = self._again(current, trial)
                return whole and replace(whole, fit=self._all_free(whole.fit))
            except FitError:
                return None

        pairs = zip(near, self.clock.each(again, near), strict=True)
        wholes = [(t, w) for t, w in pairs if w is not None and w.needed]
        level = min((w.fit.level for _t, w in wholes), default=0)
        result = {}
        for trial, whole in wholes:
            try:
                # What no library has is not chosen for fitting what the noise is not sure to show.
                paid = trial.price + trial.prior_penalty * (most / unit if trial.curve else 1.0)
                result[id(trial)] = float(at_level(whole.fit, level).chi2 / unit + paid)
            except FitError:
                continue
        return result, {id(t): w for t, w in wholes}

    def all_are_free(self, fitted: Fit) -> bool:
        """Whether everything is free that the user leaves free, as where a search begins it may not be."""
        names = set(fitted.parameters)
        return all(f.name in names for f in self.free)

    def _all_free(self, fitted: Fit) -> Fit:
        """With everything free that the user leaves free, where that does not go astray.

        A drive that is held 0.1 % off bends forms more than they differ.
        """
        # Without this a slip in the constraint alone is taken for a consistent one with a radial friction.
        if self.all_are_free(fitted):
            return fitted
        try:
            found = released(fitted, self.free)
        except FitError:
            return fitted
        return found if found.converged and found.level >= fitted.level and not ran_away(found) else fitted

    def judged(self, current: SearchState, trial: TrialFit, scores: ScoreRound) -> TestResult | None:
        """What the tests say of a trial; None where it cannot be fitted to all data."""
        try:
            whole = self._again(current, trial)
            if whole is None:
                return None
            pair = same_level(current.whole, whole.fit)
            fall, p = _chance(pair, trial, scores)
            ratio: Ratio = (math.nan, math.nan, math.nan)
            witness: Confirmation | None = None
            before, after = pair
            drifts = _DRIFT * (before.chi2 - after.chi2) / max(before.scatter, 1.0) < drift_gain(before)
            if p < ALPHA and not drifts:
                part, rest = (current.part, trial.fit), self.record.part(self.held_out)
                ratio, witness = confirmed_by(part, pair, rest, trial.names, self.unit)
        except FitError:
            return None
        return TestResult(whole.fit, fall, p, ratio, witness, drifts)

    def errors_or_none(self, fitted: Fit) -> Errors | None:
        """None where the model cannot be run over the held-out frames."""
        try:
            return self.errors(fitted)
        except FitError:
            return None

    def _again(self, current: SearchState, trial: TrialFit) -> TrialFit | None:
        """The same proposal fitted to all data."""
        if current.whole is current.part:
            return trial
        # All data take the known model farther astray than the first part, and phases may be turns off.
        starts = [current.whole, started_at(current.whole, trial.fit, ~self.held_out)]
        if far_off(current.whole):
            starts.reverse()
        found = []
        for start in starts:
            one = _fitted_to(start, trial)
            if one and one.fit.level >= trial.fit.level and one.fit.scatter < _ASTRAY * trial.fit.scatter:
                return one
            found.append(one)
        return min(fitted_ones(found), key=lambda t: t.rank, default=None)

    def worse(self, before: Errors, after: Errors) -> bool:
        """Whether a chaotic model's forecasts get worse beyond doubt at some horizon."""
        return before.unit != "rad" and any(
            improvement(before, after, h)[1] > _WORSE for h in before.horizons
        )

    def _says_less(self, formula: TrialFit, chosen: TrialFit, nats: float) -> bool:
        """Whether a formula is the chosen law in other words, or has more constants for nothing."""
        # Without this a formula beside dry friction leaves the verdict at "form not identified".
        return same_law(formula.compared, chosen.compared) or (
            nats > 0 and len(formula.names) > len(chosen.names)
        )

    def _alternatives(
        self,
        chosen: TrialFit,
        trials: list[TrialFit],
        scanned: Scan,
        costs: dict[int, float],
        foretelling: Foretelling,
    ) -> list[Alternative]:
        listed = [s.candidate for s in scanned.scored]
        result: dict[tuple[str, str, str | None], Alternative] = {}

        def cost(trial: TrialFit) -> float:  # a formula may be it as well as what was chosen
            return costs[id(trial)] - trial.prior_penalty

        best = cost(chosen)
        for trial in (t for t in trials if id(t) in costs):
            nats = (cost(trial) - best) / 2
            if (
                trial is chosen
                or nats > EVIDENCE_MARGIN
                or len(trial.candidates) != len(chosen.candidates)
                or trial.is_curve
                or (trial.formula is not None and self._says_less(trial, chosen, nats))
                or _clearly(foretelling.ratio(trial, chosen))
            ):
                continue
            for mine, other in _beside(chosen.candidates, trial.candidates):
                if other.title == mine.title:
                    continue  # but for the width that its sign is smoothed over
                known = mine in listed and other in listed
                likeness = scanned.likeness(listed.index(mine), listed.index(other)) if known else 0.0
                if likeness > _SUPERSET and other.parameters > mine.parameters:
                    continue  # the chosen form with something more that the data do not ask for
                named = {p: f"{other.effect.name}.{p}" for p in other.effect.parameters}
                fitted = trial.fit.parameters
                effect = other.effect.replace(**{p: fitted[n] for p, n in named.items() if n in fitted})
                one = Alternative(
                    mine.effect.name, effect, other.title, other.effect.equation, nats, likeness
                )
                # The same may stand beside several partners; the best is told.
                key = (mine.effect.name, other.title, other.effect.momentum)
                if key not in result or nats < result[key].nats:
                    result[key] = one
        return list(result.values())
