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
from .score_rounds import ScoreRound, score_round, states_first, with_surfaces
from .thresholds import ALPHA, RejectionReason
from .time_budget import TimeUpError
from .trial_fits import fitted_ones, needed_in, of_library

_NEAREST = 4  # of them where none passes, to tell what they would do
_MOST = 3  # effects added
_CURVES = 2  # of the likeliest, located
_LIKELY = 0.5  # of the evidence for the likeliest, which they have at least


def map_fits(work: Callable[[Fit], Fit], part: Fit, whole: Fit) -> tuple[Fit, Fit]:
    """The same done to the fits of the first part and of all data, once where they are one."""
    if part is whole:
        return (work(part),) * 2
    one, other = parallel_map(work, (part, whole))
    return one, other


@dataclass(frozen=True)
class Outcome:
    """Where a search ended: fits of the first part and of all data, errors, what was seen and done.

    `stopped` is what it was at when its time was up.
    """

    part: Fit
    whole: Fit
    errors: Errors
    accepted: list[Step]
    rounds: list[ScoreRound]
    unconfirmed: list[RejectedEffect]
    stopped: str | None = None


class Search:
    """The search on the first part of a record, tested on the rest."""

    def __init__(self, tests: Acceptance, given: Sequence[Candidate] = ()) -> None:
        self.tests, self.given = tests, given
        self.clock, self.tell = tests.clock, tests.clock.tell

    def run(self, begin: SearchState, known_model: SearchState | None = None) -> Outcome:
        """Add effects to the first state until none passes; `known_model` has the fits of the known model."""
        accepted: list[Step] = []
        rounds: list[ScoreRound] = []
        states = [begin]
        stopped = None
        try:
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
            # What the library has been asked for already, or what is strong, and what a curve still says far
            # more of than anything in it, is no bent view of something known. Of a machine it may be: its
            # library holds most of what machines have.
            chaotic = states[-1].part.model.profile.discovery.chaotic
            first = scores.curve_leads() and (accepted or scores.off_track or chaotic)
            tried = scores.passing_curves() if first else []
            addition = self._located(states[-1], scores) if tried else None
            addition = addition or self._library_step(states[-1], scores)
            if addition is None:
                self.tell("scoring surfaces over two coordinates")
                rounds[-1] = scores = with_surfaces(scores)
                addition = self._located(states[-1], scores, tried)
            if addition is None:
                break
            accepted.append(addition[0])
            states.append(addition[1])
            self._backward_elimination(accepted, states, rounds)
            bent, states[-1] = states[-1], self._released(states[-1])
            if states[-1] is not bent and accepted[-1].is_curve:
                # What was held had bent it, which hides its formula.
                self._relocated(len(accepted) - 1, accepted, states, rounds)
            # What takes another's place may give way to it again: then the search goes in circles.
            titles = tuple(c.title for step in accepted for c in step.candidates)
            if titles in seen_titles:
                break
            seen_titles.add(titles)
            # What no library has, and free runs contradict, is no ground to search on from.
            contradicted = self.tests.improvement(states[-2].errors, states[-1].errors)[1] > 1.0
            if accepted[-1].curve is not None and contradicted:
                break

    def _confirmed_by_free_runs(self, known_model: SearchState, states: list[SearchState]) -> int:
        """How many of the steps free runs on the held-out data confirm."""
        for number in range(len(states) - 1, 0, -1):
            errors = states[number].errors
            one_more = self.tests.improvement(states[number - 1].errors, errors)
            ratio = self.tests.improvement(known_model.errors, errors)
            if not confirmed(known_model.errors, ratio) or one_more[1] > 1.0:
                continue
            # Runs that are too short to show it do not confirm what forces at random do as well.
            if ratio[2] < 1.0 or as_random(known_model.whole, states[number].whole) is None:
                return number
        return 0

    def _unconfirmed(
        self, known_model: SearchState, steps: list[Step], end: SearchState
    ) -> list[RejectedEffect]:
        """What passed all other tests."""
        ratio = self.tests.improvement(known_model.errors, end.errors)
        return [
            RejectedEffect(
                effect=next(e for e in end.whole.model.effects if e.name == c.effect.name),
                title=c.title,
                chi2=step.chi2,
                p=step.p,
                errors=end.errors,
                ratio=ratio,
                why="unconfirmed",
            )
            for step in steps
            for c in step.candidates
        ]

    def _released(self, state: SearchState, anew: bool = False) -> SearchState:
        """With everything free that the user leaves free, unless that goes astray.

        Where all is free already it stays as it is, unless the noise is to be estimated `anew`. A camera may
        well be farther off than is usual: held-out data that are foretold better beyond doubt with what it
        came to say that it is.
        """
        # Without this a strong cubic drag is followed by an eccentric mass and a curve that are not there.
        if self.tests.all_are_free(state.part) and not anew:
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
        """What comes nearest where nothing passes: the strongest of the library, by their held-out errors.

        Of several records, by `numbers`, first of all what only some of them want: the form that explains
        these best where each has its own amplitude.
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

    def _library_step(self, current: SearchState, scores: ScoreRound) -> tuple[Step, SearchState] | None:
        """The best addition of the library that passes: an effect, or two of them together."""
        proposals = Proposals(current.part, scores, self.clock)
        trials, loose = proposals.effects()
        if single := self.tests.best(current, trials, scores):
            return single
        together, number = proposals.only_together(loose)
        return self.tests.best(current, together, replace(scores, comparisons=number))

    def _located(
        self, current: SearchState, scores: ScoreRound, tried: Sequence[Curve] = ()
    ) -> tuple[Step, SearchState] | None:
        """The best curve or surface that passes; of some those that would have been chosen were tried."""

        def best(curves: Sequence[Curve]) -> list[Curve]:
            most = max((c.evidence for c in curves), default=0.0)
            one_each: dict[tuple[str, ...], list[Curve]] = {}
            for curve in states_first([c for c in curves if c.evidence > _LIKELY * most]):
                one_each.setdefault(curve.key_without_momentum, []).append(curve)
            # A velocity with its momentum and without: which of them it is a full fit says.
            groups = list(one_each.values())[:_CURVES]
            return [*groups[0], *(curve for curve, *_others in groups[1:])] if groups else []

        tried_names = [c.name for c in best(tried)]
        likely = [c for c in best(scores.passing_curves()) if c.name not in tried_names]
        trials = Proposals(current.part, scores, self.clock).curves(likely)
        return self.tests.best(current, trials, scores)

    def _backward_elimination(
        self, accepted: list[Step], states: list[SearchState], rounds: list[ScoreRound]
    ) -> None:
        """Leave out effects that a later one makes needless.

        A wrong form of the library takes up a part of what an effect outside of it does, or of what another
        one of the library does that is found after it.
        """
        self._leave_out(accepted, states, rounds)
        for k in range(len(accepted) - 1):
            last = accepted[-1]
            if last.curve is None:
                return
            title = accepted[k].candidates[0].title
            self.tell(f"trying {last.curve.title} instead of {title}")
            if self._relocated(k, accepted, states, rounds):
                return

    def _relocated(
        self, k: int, accepted: list[Step], states: list[SearchState], rounds: list[ScoreRound]
    ) -> bool:
        """Locate the last curve again in the place of all steps from a number on; whether that is better."""
        before, curve = states[k], accepted[-1].curve
        if curve is None:
            return False
        from_there = started_at(before.part, states[-1].part)
        trials = Proposals(from_there, rounds[k], self.clock).curves([curve])
        replacement = self.tests.best(before, trials, rounds[k])
        if replacement is None:
            return False
        replacement = replacement[0], self._released(replacement[1], anew=True)
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
        """Leave out effects of the library that chance explains beside those found after them.

        All of them at once first: of two that are not needed neither is missed, but the other still fails.
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
            left = {c.effect.name for c in kept}
            others = [a for s in later for a in s.alternatives if a.instead_of in left]
            accepted[k:] = [replace(replacement[0], alternatives=others)]
            states[k + 1 :], rounds[k + 1 :] = [replacement[1]], []
            return
