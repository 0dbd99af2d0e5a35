"""Acceptance of a trial: the best form, if it passes all tests."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd._util.parallel import parallel_map
from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.score_scan import Scan
from udd.discovery.symbolic.formulas import Formula, formulas_for, power_for, without
from udd.discovery.validation.confirmation import Pair, confirmed_by, same_level
from udd.discovery.validation.held_out_errors import (
    Errors,
    Ratio,
    held_out_errors,
    improvement,
)
from udd.discovery.validation.sensor_drift import drift_gain
from udd.errors import FitError
from udd.fitting import (
    Fit,
    Record,
    eased,
    far_off,
    most_probable,
    ran_away,
    released_anew,
    started_at,
)
from udd.fitting.parameters import Free

from .hypotheses import Hypothesis, lead, log_evidence, log_prior, named, ranked, rivals, simplest
from .results import Alternative
from .score_rounds import ScoreRound
from .thresholds import ALPHA, EVIDENCE_MARGIN, ROUGH_MARGIN, Confirmation
from .time_budget import Clock
from .trial_fits import TrialFit, attempted, fitted_ones, needed_in, of_curve, of_formula, of_library

_WORSE = 1.1  # lower end of the errors' ratio at some horizon, above which an effect is rejected
_DRIFT = 0.7  # share of an effect's gain above which a sensor's drift, with the motion fixed, may explain it
_FORMULAS = 3  # for each curve, fitted in full
# ratio of the scatter of all data to that of the training part, above which a fit may have ended elsewhere
_MAX_SCATTER_RATIO = 1.5
# While parameters are fixed, forms with a scatter within this factor of the least are compared with all
# parameters free.
_BIAS_SCATTER_RATIO = 3.0
_COMPARED = 12  # maximum of forms that are compared on all data


@dataclass(frozen=True)
class SearchState:
    """State of the search: fits of the training part and of all data, and held-out errors.

    With whole held-out records both are one fit, of all other records.
    """

    part: Fit
    whole: Fit
    errors: Errors


def _pair_differences(
    effects: Sequence[Candidate], rival_effects: Sequence[Candidate]
) -> list[tuple[Candidate, Candidate]]:
    """Pair the effects in which two hypotheses differ."""
    first_only = [c for c in effects if c.effect not in [o.effect for o in rival_effects]]
    second_only = [o for o in rival_effects if o.effect not in [c.effect for c in effects]]
    return list(zip(first_only, second_only, strict=False))


def _chance(pair: Pair, trial: TrialFit, scores: ScoreRound) -> tuple[float, float]:
    """Compute the decrease in chi2 between two fits of all data, and its probability by chance."""
    from scipy.stats import ncx2  # half a second to import

    before, after = pair
    inflation = after.inflation(before)
    fall = (before.chi2 - after.chi2) / inflation
    # A film's faults add a non-central part to chi2.
    return fall, min(
        float(ncx2.sf(fall, trial.freedom, after.film_error_chi2 / inflation)) * scores.comparisons, 1.0
    )


@dataclass(frozen=True)
class TestResult:
    """Results of the tests of a trial.

    Attributes
    ----------
    whole : Fit
        Fit of all data.
    chi2, p : float
        Decrease in chi2, and the probability of that by chance.
    ratio : tuple of float
        Cost of the held-out frames after over before, with its 95 % interval.
    witness : {"held", "fitted", "halves"} or None
        Test that confirms it, see :func:`udd.discovery.validation.confirmation.confirmed_by`. A trial that
        chance explains is not tested.
    drifts : bool
        True if a slow drift of the sensor's zero would explain more.
    """

    whole: Fit
    chi2: float
    p: float
    ratio: Ratio
    witness: Confirmation | None
    drifts: bool = False


@dataclass(frozen=True)
class Step:
    """Accepted addition: a hypothesis with its test results, and its rivals."""

    chosen: Hypothesis
    result: TestResult
    alternatives: list[Alternative]

    @property
    def candidates(self) -> list[Candidate]:
        """The added candidate, two together, or a curve."""
        return self.chosen.trial.candidates

    @property
    def curve(self) -> Curve | None:
        """The located curve, if it was added or has a formula."""
        return self.chosen.trial.curve


def _fitted_to(whole: Fit, trial: TrialFit) -> TrialFit | None:
    """Fit a proposal to all data, starting at the end of a fit of these without it."""
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
    """Tests that a trial must pass, and the choice between those that do."""

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

    def refitted(self, state: SearchState, work: Callable[[Fit], Fit]) -> SearchState:
        """Refit the training part and all data, with their held-out errors; once if they are one fit."""
        fits = parallel_map(work, [state.part] if state.part is state.whole else [state.part, state.whole])
        return SearchState(fits[0], fits[-1], self.errors(fits[0]))

    def errors(self, fitted: Fit) -> Errors:
        """Compute the held-out errors of a fit of the training part."""
        return held_out_errors(fitted, self.record, self.held_out, unit=self.unit)

    def improvement(self, before: Errors, after: Errors) -> Ratio:
        """Compute the ratio of held-out errors, after over before.

        For the disk, which is chaotic, it is taken at the horizon of comparison; for a pendulum over the
        whole run.
        """
        return improvement(before, after, before.horizon)

    def best(
        self, current: SearchState, trials: list[TrialFit], scores: ScoreRound
    ) -> tuple[Step, SearchState] | None:
        """Return the most probable hypothesis, if it passes all tests.

        If it fails one, a clearly less probable hypothesis does not replace it, unless held-out data refute
        it: with it they are less probable than without.
        """
        trials = [t for t in trials if t.fit.level >= current.part.level and t.needed]
        while trials:
            order = ranked(self.hypotheses(current, trials, scores))
            order = simplest(named(order, self.known_parameters))
            most = max((h.log_z for h in order), default=0.0)
            refuted: list[TrialFit] = []
            for chosen in (h for h in order if h.log_z >= most - EVIDENCE_MARGIN):
                judged = self.judged(current, chosen.trial, scores, chosen.again)
                if judged is None:
                    continue
                errors = self.errors_or_none(chosen.trial.fit) if judged.witness else None
                if judged.witness and errors is not None and not self.worse(current.errors, errors):
                    step = Step(chosen, judged, self._alternatives(chosen, order, scores.library))
                    return step, SearchState(chosen.trial.fit, judged.whole, errors)
                if judged.witness or judged.ratio[1] > 1.0:
                    refuted.append(chosen.trial)
            if not refuted:
                return None
            # Without this a curve over the speed that follows a camera's errors hides a string's drag.
            # The fit of all data has a curve of its own, so a formula is recognised by its curve's name.
            curves = [t.curve.name for t in refuted if t.curve is not None]
            trials = [
                t for t in trials if t not in refuted and (t.curve is None or t.curve.name not in curves)
            ]
        return None

    def log_evidence(self, fitted: Fit, steps: Sequence[Step]) -> float:
        """Compute the log evidence of a fit of all data after these steps, with their priors."""
        chosen = [step.chosen for step in steps]
        names = [name for h in chosen for name in h.trial.names]
        cost = sum(log_evidence(h.whole, h.again.names) - h.log_z for h in chosen)
        return log_evidence(self._at_own_noise(fitted), names) - cost

    def hypotheses(
        self, current: SearchState, trials: list[TrialFit], scores: ScoreRound
    ) -> list[Hypothesis]:
        """Return the most probable proposals, each fitted to all data at its own noise and model error."""
        terms = len(scores.library.scored) + len(scores.curves)

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

        result = wholes(self._leading(current, trials, terms))
        result += wholes(self._leading(current, self._written(current, ranked(result)), terms))
        return result + wholes(self._shortened(current, ranked(result)))

    def _leading(self, current: SearchState, trials: list[TrialFit], terms: int) -> list[TrialFit]:
        """Return the proposals that are likely by the training part, for a library with so many terms."""

        def first(trial: TrialFit) -> float:
            try:
                return Hypothesis(trial, trial, eased(trial.fit), log_prior(trial, terms)).log_z
            except FitError:
                return -math.inf

        if self.all_are_free(current.part):
            behind = [-z for z in self.clock.each(first, trials)]
            most = min(behind, default=0.0) + ROUGH_MARGIN
        else:  # fixed parameters distort forms: compare them with all parameters free, and on all data
            behind = [t.fit.scatter for t in trials]
            most = _BIAS_SCATTER_RATIO * min(behind, default=0.0)
        likely = sorted((value, k) for k, value in enumerate(behind) if value < most)
        return [trials[k] for k in sorted(k for _value, k in likely[:_COMPARED])]

    def _at_own_noise(self, fitted: Fit) -> Fit:
        """Refit at the most probable noise and model error, with all the user's free parameters."""
        return most_probable(self._all_free(fitted))

    def _written(self, current: SearchState, order: Sequence[Hypothesis]) -> list[TrialFit]:
        """Return formulas for the likely splines, as fitted to all data.

        A velocity with and without its momentum also tries the formulas of the other: as splines they are
        almost identical, and a formula may be found for only one of them.
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
        """Return the most probable formula without each of its needless amplitudes."""
        best = order[0].again if order else None
        if best is None or best.curve is None or best.formula is None:
            return []
        needless = [name for name in best.names if not needed_in(order[0].whole, [name])]
        shorter = [without(best.formula, name.rpartition(".")[2]) for name in needless]
        return fitted_ones([of_formula(current.part, best.curve, f) for f in shorter if f is not None])

    def _formulas(self, fitted: Fit, curve: Curve) -> list[Formula]:
        taken, number = fitted.model.state_names, fitted.observations
        formulas = formulas_for(curve, number, taken=taken)[:_FORMULAS]
        name = curve.coordinates[0].name
        # The library has powers of the speed.
        if len(curve.coordinates) > 1 or name in (curve.slot.equation, f"|{curve.slot.equation}|"):
            return formulas
        power = power_for(curve, number, taken)
        return [*formulas, power] if power is not None else formulas

    def all_are_free(self, fitted: Fit) -> bool:
        """Return True if all of the user's free parameters are free; at a search's start some may not be."""
        names = set(fitted.parameters)
        return all(f.name in names for f in self.free)

    def _all_free(self, fitted: Fit) -> Fit:
        """Refit with all of the user's free parameters, unless that diverges.

        A drive that is fixed 0.1 % off distorts forms more than they differ.
        """
        # Without this a slip in the constraint alone is mistaken for a consistent one with radial friction.
        result = None if self.all_are_free(fitted) else attempted(released_anew, fitted, self.free)
        better = result and result.converged and result.level >= fitted.level and not ran_away(result)
        return result if result and better else fitted

    def judged(
        self,
        current: SearchState,
        trial: TrialFit,
        scores: ScoreRound,
        fit_of_all: TrialFit | None = None,
    ) -> TestResult | None:
        """Run the tests of a trial, with its fit of all data if it is known; None if that fit fails."""
        try:
            whole = fit_of_all or self._again(current, trial)
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
        """Compute the held-out errors; None if the model cannot be run over the held-out frames."""
        return attempted(self.errors, fitted)

    def _again(self, current: SearchState, trial: TrialFit) -> TrialFit | None:
        """Fit the same proposal to all data."""
        if current.whole is current.part:
            return trial
        # With all data the known model diverges further than in the training part, and phases may be off by
        # turns.
        starts = [current.whole, started_at(current.whole, trial.fit, ~self.held_out)]
        if far_off(current.whole):
            starts.reverse()
        refits = []
        for start in starts:
            trial_again = _fitted_to(start, trial)
            if (
                trial_again
                and trial_again.fit.level >= trial.fit.level
                and trial_again.fit.scatter < _MAX_SCATTER_RATIO * trial.fit.scatter
            ):
                return trial_again
            refits.append(trial_again)
        return min(fitted_ones(refits), key=lambda t: t.rank, default=None)

    def worse(self, before: Errors, after: Errors) -> bool:
        """Return True if a chaotic model's forecasts get significantly worse at some horizon."""
        chaotic = before.horizon is not None
        return chaotic and any(improvement(before, after, h)[1] > _WORSE for h in before.horizons)

    def _alternatives(
        self, chosen: Hypothesis, order: Sequence[Hypothesis], scanned: Scan
    ) -> list[Alternative]:
        listed = [s.candidate for s in scanned.scored]
        result: dict[tuple[str, str, str | None], Alternative] = {}
        for other in rivals(chosen, order, self.known_parameters):
            for chosen_form, theirs in _pair_differences(chosen.trial.candidates, other.trial.candidates):
                if theirs.title == chosen_form.title:
                    continue  # the same except for the width of its smoothed sign
                is_scored = chosen_form in listed and theirs in listed
                likeness = (
                    scanned.likeness(listed.index(chosen_form), listed.index(theirs)) if is_scored else 0.0
                )
                named = {p: f"{theirs.effect.name}.{p}" for p in theirs.effect.parameters}
                fitted = other.again.fit.parameters
                effect = theirs.effect.replace(**{p: fitted[n] for p, n in named.items() if n in fitted})
                nats = lead(chosen, other)
                alternative = Alternative(
                    chosen_form.effect.name, effect, theirs.title, theirs.effect.equation, nats, likeness
                )
                # An effect may have several partners; the best is listed.
                key = (chosen_form.effect.name, theirs.title, theirs.effect.momentum)
                if key not in result or nats < result[key].nats:
                    result[key] = alternative
        return list(result.values())
