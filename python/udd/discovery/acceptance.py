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
from udd.discovery.symbolic.formulas import Formula, formulas_for, power_for, without
from udd.discovery.validation.confirmation import Pair, confirmed_by, same_level
from udd.discovery.validation.held_out_errors import (
    Errors,
    Ratio,
    comparison_horizon,
    held_out_errors,
    improvement,
    whole_improvement,
)
from udd.discovery.validation.sensor_drift import drift_gain
from udd.errors import FitError
from udd.fitting import Fit, Record, at_level, eased, far_off, ran_away, refit, released_anew, started_at
from udd.fitting.parameters import Free

from .hypotheses import Hypothesis, log_evidence, log_prior, named, ranked, rivals, spent
from .results import Alternative
from .score_rounds import ScoreRound
from .thresholds import ALPHA, Confirmation
from .time_budget import Clock
from .trial_fits import TrialFit, fitted_ones, from_none, needed_in, of_curve, of_formula, of_library

_WORSE = 1.1  # an effect is refused if the lower end of the errors' ratio exceeds this at some horizon
_DRIFT = 0.7  # of an effect's gain from which on a drifting sensor, its motion held, may be all there is
_FORMULAS = 3  # for each curve, fitted in full
_WIDE = 3  # times the margin, by which a form may be behind in the first part
_ASTRAY = 1.5  # times the scatter of the first part, of all data: that fit may have ended elsewhere
_BENT = 3.0  # times the least scatter, by which what is held as stated may part forms
_COMPARED = 12  # forms between which all data decide


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
    formula : Formula or None
        What the curve is written as.
    names : list of str
        The parameters that came in with it.
    cost : float
        What its log evidence pays, nats, for a spline's freedom and for its prior.
    """

    candidates: list[Candidate]
    curve: Curve | None
    chi2: float
    p: float
    ratio: Ratio
    witness: Confirmation
    alternatives: list[Alternative]
    formula: Formula | None
    names: list[str]
    cost: float

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


def _fitted_to(whole: Fit, trial: TrialFit) -> TrialFit | None:
    """A proposal fitted to all data, from where a fit of these without it ended."""
    if trial.curve is None:
        added = trial.fit.model.effects[-len(trial.candidates) :]
        shaped = [
            replace(c, effect=e.replace(**dict.fromkeys(e.amplitudes, 0.0)))
            for c, e in zip(trial.candidates, added, strict=True)
        ]
        return of_library(whole, shaped, trial.amplitudes)
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

    @property
    def known_parameters(self) -> list[str]:
        """Names of the known model's free parameters."""
        return [f.name for f in self.free if f.role == "model"]

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
        """The likeliest hypothesis, if it passes all tests."""
        trials = [t for t in trials if t.fit.level >= current.part.level and t.needed]
        order = named(ranked(self.hypotheses(current, trials, scores)), self.known_parameters)
        # Where the likeliest fails a test, a clearly less likely one is not named instead.
        most = max((h.log_z for h in order), default=0.0)
        for chosen in (h for h in order if h.log_z >= most - EVIDENCE_MARGIN):
            trial = self._in_other_widths(current, chosen.trial, scores.library)
            judged = self.judged(current, trial, scores)
            if judged is None or judged.witness is None:
                continue
            errors = self.errors_or_none(trial.fit)
            if errors is not None and not self.worse(current.errors, errors):
                step = Step(
                    candidates=trial.candidates,
                    curve=trial.curve,
                    chi2=judged.chi2,
                    p=judged.p,
                    ratio=judged.ratio,
                    witness=judged.witness,
                    alternatives=self._alternatives(chosen, order, scores.library),
                    formula=trial.formula,
                    names=trial.names,
                    cost=log_evidence(chosen.whole, chosen.again.names) - chosen.log_z,
                )
                return step, SearchState(trial.fit, judged.whole, errors)
        return None

    def log_evidence(self, fitted: Fit, steps: Sequence[Step]) -> float:
        """Log evidence of a fit of all data to which steps led, with the priors of these."""
        names = [name for step in steps for name in step.names]
        cost = sum(step.cost for step in steps)
        return log_evidence(self._at_own_noise(fitted), names) - cost

    def hypotheses(
        self, current: SearchState, trials: list[TrialFit], scores: ScoreRound
    ) -> list[Hypothesis]:
        """The likeliest proposals, each fitted to all data at its own noise and model error."""
        terms = len(scores.library.scored) + len(scores.curves)

        def first(trial: TrialFit) -> float:
            try:
                return log_evidence(eased(trial.fit), trial.names) - spent(trial)
            except FitError:
                return -math.inf

        if self.all_are_free(current.part):
            evidence = self.clock.each(first, trials)
            most = max(evidence, default=0.0) - _WIDE * EVIDENCE_MARGIN
            likely = sorted(zip(evidence, trials, strict=True), key=lambda pair: -pair[0])
            leading = [trial for z, trial in likely if z > most]
        else:  # what is held as stated bends forms: only with it free, and all data, do they compare
            least = min((t.fit.scatter for t in trials), default=0.0)
            leading = sorted(
                (t for t in trials if t.fit.scatter < _BENT * least), key=lambda t: t.fit.scatter
            )
        likeliest = {id(trial) for trial in leading[:_COMPARED]}
        leading = [trial for trial in trials if id(trial) in likeliest]

        def whole(trial: TrialFit) -> Hypothesis | None:
            try:
                again = self._again(current, trial)
                if again is None or not again.needed:
                    return None
                return Hypothesis(trial, again, self._at_own_noise(again.fit), log_prior(trial, terms))
            except FitError:
                return None

        def wholes(some: Sequence[TrialFit]) -> list[Hypothesis]:
            return [h for h in self.clock.each(whole, some) if h is not None]

        result = wholes(leading)
        result += wholes(self._written(current, ranked(result)))
        return result + wholes(self._shortened(current, ranked(result)))

    def _at_own_noise(self, fitted: Fit) -> Fit:
        """A fit at its own noise and model error, with all free that the user leaves free."""
        return refit(self._all_free(fitted), trusted=True)

    def _written(self, current: SearchState, order: Sequence[Hypothesis]) -> list[TrialFit]:
        """Formulas for the likely splines, as all data show them.

        A velocity with its momentum and without is tried by each other's formulas too: as splines they look
        nearly the same, and a formula may be found for one of them only.
        """
        least = order[0].log_z - 2 * EVIDENCE_MARGIN if order else 0.0
        curves = [h.again.curve for h in order if h.trial.is_curve and h.log_z > least and h.again.curve]
        sought = [(curve, self._formulas(current.whole, curve)) for curve in curves]
        pairs: dict[tuple[tuple[str, ...], str], tuple[Curve, Formula]] = {}
        for curve, _own in sought:
            for other, formulas in sought:
                if other.key_without_momentum == curve.key_without_momentum:
                    pairs |= {(curve.name, f.text): (curve, f) for f in formulas}
        some = list(pairs.values())
        self.clock.trying([formula.text for _curve, formula in some])
        return fitted_ones(self.clock.each(lambda pair: of_formula(current.part, *pair), some))

    def _shortened(self, current: SearchState, order: Sequence[Hypothesis]) -> list[TrialFit]:
        """The likeliest formula without each of its amplitudes that the data do not need."""
        best = order[0].again if order else None
        if best is None or best.curve is None or best.formula is None:
            return []
        needless = [name for name in best.names if not needed_in(order[0].whole, [name])]
        shorter = [without(best.formula, name.rpartition(".")[2]) for name in needless]
        return fitted_ones([of_formula(current.part, best.curve, f) for f in shorter if f is not None])

    def _formulas(self, fitted: Fit, curve: Curve) -> list[Formula]:
        taken, number = fitted.model.state_names, fitted.observations
        formulas = formulas_for(curve, number, taken=taken).formulas[:_FORMULAS]
        name = curve.coordinates[0].name
        # The library has the speed's.
        if len(curve.coordinates) > 1 or name in (curve.slot.equation, f"|{curve.slot.equation}|"):
            return formulas
        power = power_for(curve, number, taken)
        return [*formulas, power] if power is not None else formulas

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

        def chi2(one: TrialFit) -> float:  # held as tightly as the others
            try:
                return at_level(one.fit, level).chi2
            except FitError:
                return math.inf

        return min(some, key=chi2)

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
            found = released_anew(fitted, self.free)
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
        refits = []
        for start in starts:
            one = _fitted_to(start, trial)
            if one and one.fit.level >= trial.fit.level and one.fit.scatter < _ASTRAY * trial.fit.scatter:
                return one
            refits.append(one)
        return min(fitted_ones(refits), key=lambda t: t.rank, default=None)

    def worse(self, before: Errors, after: Errors) -> bool:
        """Whether a chaotic model's forecasts get worse beyond doubt at some horizon."""
        return before.unit != "rad" and any(
            improvement(before, after, h)[1] > _WORSE for h in before.horizons
        )

    def _alternatives(
        self, chosen: Hypothesis, order: Sequence[Hypothesis], scanned: Scan
    ) -> list[Alternative]:
        listed = [s.candidate for s in scanned.scored]
        result: dict[tuple[str, str, str | None], Alternative] = {}
        for other in rivals(chosen, order, self.known_parameters):
            for mine, theirs in _beside(chosen.trial.candidates, other.trial.candidates):
                if theirs.title == mine.title:
                    continue  # but for the width that its sign is smoothed over
                known = mine in listed and theirs in listed
                likeness = scanned.likeness(listed.index(mine), listed.index(theirs)) if known else 0.0
                named = {p: f"{theirs.effect.name}.{p}" for p in theirs.effect.parameters}
                fitted = other.again.fit.parameters
                effect = theirs.effect.replace(**{p: fitted[n] for p, n in named.items() if n in fitted})
                nats = chosen.log_z - other.log_z
                alternative = Alternative(
                    mine.effect.name, effect, theirs.title, theirs.effect.equation, nats, likeness
                )
                # The same may stand beside several partners; the best is told.
                key = (mine.effect.name, theirs.title, theirs.effect.momentum)
                if key not in result or nats < result[key].nats:
                    result[key] = alternative
        return list(result.values())
