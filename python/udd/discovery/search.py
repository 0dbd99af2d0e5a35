"""Stepwise search for effects: score tests, full fits, tests on held-out data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.score_scan import Scored
from udd.discovery.validation.by_record import by_record, contested
from udd.discovery.validation.held_out_errors import confirmed
from udd.discovery.validation.sensor_drift import as_random
from udd.errors import FitError
from udd.fitting import ran_away, released_anew, started_at

from .acceptance import Acceptance, SearchState, Step
from .proposals import Proposals
from .results import RejectedEffect
from .score_rounds import ScoreRound, most_probable_first, score_round, with_surfaces
from .thresholds import ALPHA, RejectionReason
from .time_budget import TimeUpError
from .trial_fits import TrialFit, attempted, fitted_ones, needed_in, of_library

_NEAREST = 6  # closest candidates to report if none passes
_MOST = 3  # maximum of added effects
_CURVES = 2  # most probable curves that are located
_LIKELY = 0.5  # minimum evidence of these, as a share of the highest


@dataclass
class SearchPath:
    """Accepted steps, the states before and after them, and the score round around each state."""

    states: list[SearchState]
    steps: list[Step] = field(default_factory=list)
    rounds: list[ScoreRound] = field(default_factory=list)


@dataclass(frozen=True)
class Outcome:
    """Result of the search: its last confirmed state, the steps to it, score rounds, unconfirmed effects.

    `stopped` is the activity at which the time was up.
    """

    state: SearchState
    accepted: list[Step]
    rounds: list[ScoreRound]
    unconfirmed: list[RejectedEffect]
    stopped: str | None = None


class Search:
    """Search on the training part of a record, tested on the rest."""

    def __init__(self, tests: Acceptance, given: Sequence[Candidate] = ()) -> None:
        self.tests, self.given = tests, given
        self.clock, self.tell = tests.clock, tests.clock.tell

    def run(self, begin: SearchState, known_model: SearchState) -> Outcome:
        """Add effects until none passes, starting at `begin`; `known_model` has the known model's fits."""
        path, stopped = SearchPath([begin]), None
        try:
            with self.clock.limited():
                self._forward_selection(path)
        except TimeUpError as up:
            stopped = str(up)
        number = self._confirmed_by_free_runs(known_model, path.states)
        unconfirmed = self._unconfirmed(known_model, path.steps[number:], path.states[-1])
        end = path.states[number] if number else known_model
        return Outcome(end, path.steps[:number], path.rounds, unconfirmed, stopped)

    def _forward_selection(self, path: SearchPath) -> None:
        """Add effects to the path as they pass."""
        seen_titles: set[tuple[str, ...]] = set()
        states, rounds = path.states, path.rounds
        while sum(len(step.candidates) for step in path.steps) < _MOST:
            self.tell("scoring candidates" + (" for a further effect" if path.steps else ""))
            rounds.append(score_round(states[-1].part, self.given, self.clock.each))
            addition = self._addition(states[-1], rounds, with_more=bool(path.steps))
            if addition is None:
                break
            path.steps.append(addition[0])
            states.append(addition[1])
            self._backward_elimination(path)
            before_release, states[-1] = states[-1], self._released(states[-1])
            if states[-1] is not before_release and path.steps[-1].chosen.trial.is_curve:
                # Fixed parameters biased the curve and hid its formula; relocate it with all parameters free.
                self._relocated(path, len(path.steps) - 1)
            # An effect may replace another and be replaced by it again: then the search is circular.
            titles = tuple(c.title for step in path.steps for c in step.candidates)
            if titles in seen_titles:
                break
            seen_titles.add(titles)
            # A curve that free runs contradict is no basis for a further search.
            contradicted = self.tests.improvement(states[-2].errors, states[-1].errors)[1] > 1.0
            if path.steps[-1].curve is not None and contradicted:
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
        free = attempted(self.tests.refitted, state, partial(released_anew, free=self.tests.free))
        if free is None:
            return state
        fits = free.part, free.whole
        better = not any(map(ran_away, fits)) or self.tests.improvement(state.errors, free.errors)[2] < 1.0
        is_usable = all(fit.converged for fit in fits) and better
        return free if is_usable and not self.tests.worse(state.errors, free.errors) else state

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
        self, current: SearchState, rounds: list[ScoreRound], with_more: bool
    ) -> tuple[Step, SearchState] | None:
        """Return the best passing addition: effects of the library with likely curves, else two together.

        A curve that leads comes first; otherwise curves come last, with surfaces unless the model is chaotic.
        """
        scores = rounds[-1]
        # A curve that clearly beats every library term cannot be a biased view of one if the library was
        # tried before or the effect is strong. For a machine it can, because its library has most terms of
        # machines.
        chaotic = current.part.model.profile.discovery.chaotic
        leads = scores.curve_leads() and (with_more or scores.off_track or chaotic)
        tried = self._likely(scores) if leads else []
        if located := self._located(current, scores, tried):
            return located
        proposals = Proposals(current.part, scores, self.clock)
        trials = proposals.effects()
        if addition := self.tests.best(current, trials, scores):
            return addition
        together, number = proposals.only_together(trials)
        if pair := self.tests.best(current, together, replace(scores, comparisons=number)):
            return pair
        # For a disk no surface was ever accepted, and its fits take five minutes. Without surfaces the error
        # of a real cup on a string is twice as large.
        if not chaotic:
            self.tell("scoring surfaces over two coordinates")
            rounds[-1] = scores = with_surfaces(scores)
        # Without this a string's drag is lost, whose best form in the training part fails a test.
        names = [curve.name for curve in tried]
        return self._located(current, scores, [c for c in self._likely(scores) if c.name not in names])

    def _located(
        self, current: SearchState, scores: ScoreRound, curves: Sequence[Curve]
    ) -> tuple[Step, SearchState] | None:
        """Return the best of these curves that passes."""
        trials = Proposals(current.part, scores, self.clock).curves(list(curves)) if curves else []
        return self.tests.best(current, trials, scores)

    def _likely(self, scores: ScoreRound) -> list[Curve]:
        """Return the most probable curves over different coordinates."""
        curves = scores.passing_curves()
        most = max((c.evidence for c in curves), default=0.0)
        one_each: dict[tuple[str, ...], list[Curve]] = {}
        for curve in most_probable_first([c for c in curves if c.evidence > _LIKELY * most]):
            one_each.setdefault(curve.key_without_momentum, []).append(curve)
        # A full fit decides between a velocity with its momentum and without.
        groups = list(one_each.values())[:_CURVES]
        return [*groups[0], *(curve for curve, *_others in groups[1:])] if groups else []

    def _backward_elimination(self, path: SearchPath) -> None:
        """Remove effects that a later one makes needless.

        A wrong form of the library absorbs a part of an effect outside of it, or of another effect that is
        found later.
        """
        self._leave_out(path)
        *earlier, last = path.steps
        if last.curve is None:
            return
        for k, step in enumerate(earlier):
            self.tell(f"trying {last.curve.title} instead of {step.candidates[0].title}")
            # ODEBench 35: otherwise three effects replace one formula, with three times its held-out error.
            if self._relocated(path, k):
                return

    def _relocated(self, path: SearchPath, k: int) -> bool:
        """Relocate the last curve in place of all steps from a number on; return True if that is better."""
        curve = path.steps[-1].curve
        start = started_at(path.states[k].part, path.states[-1].part)
        trials = Proposals(start, path.rounds[k], self.clock).curves([curve] if curve else [])
        return self._replaced(path, k, trials, reestimate_noise=True)

    def _leave_out(self, path: SearchPath) -> None:
        """Remove effects of the library that are not significant next to those found after them.

        All of them are removed at once first: of two needless effects each may fail a test with the other
        present.
        """
        end = path.states[-1]
        idle = [
            (k, candidate)
            for k, step in enumerate(path.steps[:-1])
            for candidate in step.candidates
            if not any(s.curve for s in path.steps[k:])
            and not needed_in(end.whole, candidate.amplitude_names)
        ]
        for group in [idle, *([each] for each in idle)] if len(idle) > 1 else [idle] if idle else []:
            k, gone = group[0][0], [candidate for _k, candidate in group]
            self.tell(f"trying without {' and '.join(candidate.title for candidate in gone)}")
            later = path.steps[k:]
            names = [c.effect.name for c in gone]
            kept = [c for s in later for c in s.candidates if c.effect.name not in names]
            values = [end.part.parameters[name] for c in kept for name in c.amplitude_names]
            trial = of_library(started_at(path.states[k].part, end.part), kept, values)
            if self._replaced(path, k, fitted_ones([trial])):
                kept_names = {c.effect.name for c in kept}
                others = [a for s in later for a in s.alternatives if a.instead_of in kept_names]
                path.steps[k] = replace(path.steps[k], alternatives=others)
                return

    def _replaced(
        self, path: SearchPath, k: int, trials: list[TrialFit], reestimate_noise: bool = False
    ) -> bool:
        """Replace all steps from number k on by the best trial; return True if that is better."""
        replacement = self.tests.best(path.states[k], trials, path.rounds[k])
        if replacement is None:
            return False
        step, state = replacement[0], self._released(replacement[1], reestimate_noise)
        try:
            evidence = self.tests.log_evidence(state.whole, [step])
            if not evidence > self.tests.log_evidence(path.states[-1].whole, path.steps[k:]):
                return False
        except FitError:
            return False
        path.steps[k:], path.states[k + 1 :], path.rounds[k + 1 :] = [step], [state], []
        return True
