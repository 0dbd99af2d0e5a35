"""Stepwise search for effects: score tests, full fits, tests on held-out data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from udd._util.parallel import parallel_map
from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.score_scan import Scored
from udd.discovery.validation.by_record import by_record, contested
from udd.discovery.validation.held_out_errors import (
    Errors,
    confirmed,
)
from udd.discovery.validation.sensor_drift import as_random
from udd.errors import FitError
from udd.fitting import (
    Fit,
    ran_away,
    released_anew,
    started_at,
)

from .acceptance import Acceptance, SearchState, Step
from .proposals import Proposals
from .results import RejectedEffect
from .score_rounds import ScoreRound, most_probable_first, score_round
from .thresholds import ALPHA, RejectionReason
from .time_budget import TimeUpError
from .trial_fits import fitted_ones, needed_in, of_library

_NEAREST = 6  # closest candidates to report if none passes
_MOST = 3  # maximum of added effects
_CURVES = 2  # most probable curves that are located
_LIKELY = 0.5  # minimum evidence of these, as a share of the highest


def map_fits(work: Callable[[Fit], Fit], part: Fit, whole: Fit) -> tuple[Fit, Fit]:
    """Apply `work` to the training fit and the full-data fit; once if they are identical."""
    if part is whole:
        return (work(part),) * 2
    training, full = parallel_map(work, (part, whole))
    return training, full


@dataclass(frozen=True)
class Outcome:
    """Result of the search: training and full-data fits, held-out errors, accepted steps, score rounds.

    `stopped` is the activity at which the time was up.
    """

    part: Fit
    whole: Fit
    errors: Errors
    accepted: list[Step]
    rounds: list[ScoreRound]
    unconfirmed: list[RejectedEffect]
    stopped: str | None = None


class Search:
    """Search on the training part of a record, tested on the rest."""

    def __init__(self, tests: Acceptance, given: Sequence[Candidate] = ()) -> None:
        self.tests, self.given = tests, given
        self.clock, self.tell = tests.clock, tests.clock.tell

    def run(self, begin: SearchState, known_model: SearchState | None = None) -> Outcome:
        """Add effects until none passes, starting at `begin`; `known_model` has the known model's fits."""
        accepted: list[Step] = []
        rounds: list[ScoreRound] = []
        states = [begin]
        stopped = None
        try:
            with self.clock.limited():
                self._forward_selection(accepted, states, rounds)
        except TimeUpError as up:
            stopped = str(up)
        number = self._confirmed_by_free_runs(known_model or states[0], states)
        unconfirmed = self._unconfirmed(known_model or states[0], accepted[number:], states[-1])
        end = states[number] if number else known_model or states[0]
        return Outcome(end.part, end.whole, end.errors, accepted[:number], rounds, unconfirmed, stopped)

    def _forward_selection(
        self, accepted: list[Step], states: list[SearchState], rounds: list[ScoreRound]
    ) -> None:
        """Add effects to the lists as they pass."""
        seen_titles: set[tuple[str, ...]] = set()
        while sum(len(step.candidates) for step in accepted) < _MOST:
            self.tell("scoring candidates" + (" for a further effect" if accepted else ""))
            scores = score_round(states[-1].part, self.given, self.clock.watched)
            rounds.append(scores)
            addition = self._addition(states[-1], scores, with_more=bool(accepted))
            if addition is None:
                break
            accepted.append(addition[0])
            states.append(addition[1])
            self._backward_elimination(accepted, states, rounds)
            before_release, states[-1] = states[-1], self._released(states[-1])
            if states[-1] is not before_release and accepted[-1].chosen.trial.is_curve:
                # Fixed parameters biased the curve and hid its formula; relocate it with all parameters free.
                self._relocated(len(accepted) - 1, accepted, states, rounds)
            # An effect may replace another and be replaced by it again: then the search is circular.
            titles = tuple(c.title for step in accepted for c in step.candidates)
            if titles in seen_titles:
                break
            seen_titles.add(titles)
            # A curve that free runs contradict is no basis for a further search.
            contradicted = self.tests.improvement(states[-2].errors, states[-1].errors)[1] > 1.0
            if accepted[-1].curve is not None and contradicted:
                break

    def _confirmed_by_free_runs(self, known_model: SearchState, states: list[SearchState]) -> int:
        """Count the steps that free runs on the held-out data confirm."""
        for number in range(len(states) - 1, 0, -1):
            errors = states[number].errors
            one_more = self.tests.improvement(states[number - 1].errors, errors)
            ratio = self.tests.improvement(known_model.errors, errors)
            if not confirmed(known_model.errors, ratio) or one_more[1] > 1.0:
                continue
            # Runs that are too short to show an effect do not confirm it if random forces explain as much.
            if ratio[2] < 1.0 or as_random(known_model.whole, states[number].whole) is None:
                return number
        return 0

    def _unconfirmed(
        self, known_model: SearchState, steps: list[Step], end: SearchState
    ) -> list[RejectedEffect]:
        """List effects that passed all other tests."""
        ratio = self.tests.improvement(known_model.errors, end.errors)
        return [
            RejectedEffect(
                effect=next(e for e in end.whole.model.effects if e.name == c.effect.name),
                title=c.title,
                chi2=step.result.chi2,
                p=step.result.p,
                errors=end.errors,
                ratio=ratio,
                why="unconfirmed",
            )
            for step in steps
            for c in step.candidates
        ]

    def _released(self, state: SearchState, reestimate_noise: bool = False) -> SearchState:
        """Refit with all of the user's free parameters, unless that diverges.

        If all are free already the state stays, unless `reestimate_noise`. A camera may be farther off than
        usual: significantly better predictions of held-out data confirm its fitted parameters.
        """
        # Without this a spurious eccentric mass and a spurious curve follow a strong cubic drag.
        if self.tests.all_are_free(state.part) and not reestimate_noise:
            return state
        try:
            part, whole = map_fits(partial(released_anew, free=self.tests.free), state.part, state.whole)
            if not (part.converged and whole.converged):
                return state
            errors = self.tests.errors(part)
            strayed = ran_away(part) or ran_away(whole)
            if strayed and not self.tests.improvement(state.errors, errors)[2] < 1.0:
                return state
        except FitError:
            return state
        return state if self.tests.worse(state.errors, errors) else SearchState(part, whole, errors)

    def rejected(
        self, base: SearchState, scores: ScoreRound, numbers: Sequence[int] = (0,)
    ) -> list[RejectedEffect]:
        """Return the closest effects if nothing passes: the library's strongest, by held-out errors.

        With several records, named by `numbers`, the first is an effect that only some of them support: the
        form that explains these best with separate amplitudes.
        """
        strongest: dict[object, Scored] = {}
        for scored in scores.usable():
            strongest.setdefault((scored.candidate.effect.name, scored.candidate.effect.momentum), scored)
        shown = [s.candidate for s in scores.passing()]
        rejected, record_dependent = [], []
        proposals = Proposals(base.part, scores, self.clock)
        for trial in proposals.tried(list(strongest.values())[:_NEAREST]):
            if trial.fit.level < base.part.level:
                continue
            judged, errors = self.tests.judged(base, trial, scores), self.tests.errors_or_none(trial.fit)
            if judged is None or errors is None:
                continue
            why: RejectionReason = "form"
            if judged.p >= ALPHA:
                why = "chance"
            elif judged.drifts:
                why = "drift"
            elif trial.candidates[0] not in shown:
                why = "part"
            elif judged.witness is None or self.tests.worse(base.errors, errors):
                why = "held"
            effect, ratio = judged.whole.model.effects[-1], self.tests.improvement(base.errors, errors)
            answers, chi2 = by_record(base.whole, judged.whole, effect, numbers)
            title = trial.candidates[0].title
            rejection = RejectedEffect(effect, title, judged.chi2, judged.p, errors, ratio, why, answers)
            rejected.append(rejection)
            if contested(answers):
                record_dependent.append((chi2, rejection))
        near_misses = sorted((r for r in rejected if r.ratio[2] < 1.0), key=lambda r: r.ratio[0])
        if not record_dependent:
            return near_misses
        best = min(record_dependent, key=lambda pair: pair[0])[1]
        return [replace(best, why="records"), *(r for r in near_misses if r is not best)]

    def _addition(
        self, current: SearchState, scores: ScoreRound, with_more: bool
    ) -> tuple[Step, SearchState] | None:
        """Return the best passing addition: effects of the library, one or two, or a curve.

        If no single effect of the library can be fitted, pairs that pass only together are tried, then
        curves.
        """
        # A curve that clearly beats every library term cannot be a biased view of one if the library was
        # tried before or the effect is strong. For a machine it can, because its library has most terms of
        # machines.
        chaotic = current.part.model.profile.discovery.chaotic
        leads = scores.curve_leads() and (with_more or scores.off_track or chaotic)
        if leads and (located := self._located(current, scores)):
            return located
        proposals = Proposals(current.part, scores, self.clock)
        if trials := proposals.effects():
            return self.tests.best(current, trials, scores)
        together, number = proposals.only_together()
        pair = self.tests.best(current, together, replace(scores, comparisons=number))
        return pair or (None if leads else self._located(current, scores))

    def _located(self, current: SearchState, scores: ScoreRound) -> tuple[Step, SearchState] | None:
        """Return the best passing curve."""
        curves = scores.passing_curves()
        most = max((c.evidence for c in curves), default=0.0)
        one_each: dict[tuple[str, ...], list[Curve]] = {}
        for curve in most_probable_first([c for c in curves if c.evidence > _LIKELY * most]):
            one_each.setdefault(curve.key_without_momentum, []).append(curve)
        # A full fit decides between a velocity with its momentum and without.
        groups = list(one_each.values())[:_CURVES]
        likely = [*groups[0], *(curve for curve, *_others in groups[1:])] if groups else []
        trials = Proposals(current.part, scores, self.clock).curves(likely)
        return self.tests.best(current, trials, scores)

    def _backward_elimination(
        self, accepted: list[Step], states: list[SearchState], rounds: list[ScoreRound]
    ) -> None:
        """Remove effects that a later one makes needless.

        A wrong form of the library absorbs a part of an effect outside of it, or of another effect that is
        found later.
        """
        self._leave_out(accepted, states, rounds)
        for k in range(len(accepted) - 1):
            last = accepted[-1]
            if last.curve is None:
                return
            title = accepted[k].candidates[0].title
            self.tell(f"trying {last.curve.title} instead of {title}")
            # ODEBench 35: otherwise three effects replace one formula, with three times its held-out error.
            if self._relocated(k, accepted, states, rounds):
                return

    def _relocated(
        self, k: int, accepted: list[Step], states: list[SearchState], rounds: list[ScoreRound]
    ) -> bool:
        """Relocate the last curve in place of all steps from a number on; return True if that is better."""
        before, curve = states[k], accepted[-1].curve
        if curve is None:
            return False
        from_there = started_at(before.part, states[-1].part)
        trials = Proposals(from_there, rounds[k], self.clock).curves([curve])
        replacement = self.tests.best(before, trials, rounds[k])
        if replacement is None:
            return False
        replacement = replacement[0], self._released(replacement[1], reestimate_noise=True)
        if not self._likelier(replacement, accepted[k:], states[-1]):
            return False
        accepted[k:], states[k + 1 :], rounds[k + 1 :] = [replacement[0]], [replacement[1]], []
        return True

    def _likelier(
        self, replacement: tuple[Step, SearchState], steps: Sequence[Step], end: SearchState
    ) -> bool:
        """Return True if one step has a larger log evidence than several from the same start."""
        step, state = replacement
        try:
            evidence = self.tests.log_evidence(state.whole, [step])
            return evidence > self.tests.log_evidence(end.whole, steps)
        except FitError:
            return False

    def _leave_out(self, accepted: list[Step], states: list[SearchState], rounds: list[ScoreRound]) -> None:
        """Remove effects of the library that are not significant next to those found after them.

        All of them are removed at once first: of two needless effects each may fail a test with the other
        present.
        """
        whole = states[-1].whole
        idle = [
            (k, candidate)
            for k, step in enumerate(accepted[:-1])
            for candidate in step.candidates
            if not any(s.curve for s in accepted[k:]) and not needed_in(whole, candidate.amplitude_names)
        ]
        for group in (
            [idle, *([candidate] for candidate in idle)] if len(idle) > 1 else [idle] if idle else []
        ):
            k, names = group[0][0], {candidate.effect.name for _k, candidate in group}
            later = accepted[k:]
            self.tell(f"trying without {' and '.join(candidate.title for _k, candidate in group)}")
            kept = [c for s in later for c in s.candidates if c.effect.name not in names]
            values = [states[-1].part.parameters[name] for c in kept for name in c.amplitude_names]
            from_there = started_at(states[k].part, states[-1].part)
            trial = of_library(from_there, kept, values)
            replacement = self.tests.best(states[k], fitted_ones([trial]), rounds[k])
            if replacement is None:
                continue
            replacement = replacement[0], self._released(replacement[1])
            if not self._likelier(replacement, later, states[-1]):
                continue
            kept_names = {c.effect.name for c in kept}
            others = [a for s in later for a in s.alternatives if a.instead_of in kept_names]
            accepted[k:] = [replace(replacement[0], alternatives=others)]
            states[k + 1 :], rounds[k + 1 :] = [replacement[1]], []
            return
