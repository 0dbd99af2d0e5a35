"""Stepwise search for effects: score tests, full fits, tests on held-out data."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from udd._util import chi_squared
from udd._util.parallel import parallel_map
from udd.discovery.nonparametric.curve_scan import EVIDENCE_MARGIN, Curve
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.look_alikes import look_alikes
from udd.discovery.scoring.score_scan import Scored
from udd.discovery.symbolic.formulas import Formula, formulas_for
from udd.discovery.validation.by_record import by_record, contested
from udd.discovery.validation.confirmation import same_level
from udd.discovery.validation.held_out_errors import (
    Errors,
    confirmed,
)
from udd.discovery.validation.sensor_drift import as_random
from udd.effects.user_defined import along_of
from udd.errors import FitError
from udd.fitting import Fit, Record, at_level, ran_away, released, started_at
from udd.fitting.parameters import Free

from .acceptance import Acceptance, SearchState, Step
from .results import RejectedEffect
from .score_rounds import ScoreRound, score_round, states_first, with_surfaces
from .thresholds import ALPHA, RejectionReason
from .time_budget import Clock, TimeUpError
from .trial_fits import (
    TrialFit,
    fitted_ones,
    from_none,
    needed_in,
    of_curve,
    of_formula,
    of_library,
    one_of_each,
)

_EXPLAINED = 1.6  # chi2 per degree of freedom below which nothing strong is missing
_TRIED = 12  # of the best candidates, fitted in full
_ALIKE = 6  # more of them, that do nearly the same as the best
_TOGETHER = 6  # pairs that may pass only together
_NEAREST = 4  # of them where none passes, to tell what they would do
_MOST = 3  # effects added
_CURVES = 2  # of the likeliest, located
_FORMULAS = 3  # for each, fitted in full
_PAIRED = 4  # of the effects that are scored best, of which all pairs are fitted in full


def both(work: Callable[[Fit], Fit], part: Fit, whole: Fit) -> tuple[Fit, Fit]:
    """The same done to the fits of the first part and of all data, once where they are one."""
    if part is whole:
        return (work(part),) * 2
    one, other = parallel_map(work, (part, whole))
    return one, other


def _cheaper(
    found: tuple[Step, SearchState], steps: Sequence[Step], start: SearchState, end: SearchState
) -> bool:
    """Whether one step explains the data as well as several from the same start, their freedom paid for."""
    step, state = found
    several, one = same_level(end.part, state.part)
    unit = one.inflation(at_level(start.part, one.level))
    return one.chi2 / unit + step.price < several.chi2 / unit + sum(s.price for s in steps)


def _machines_first(passing: Sequence[Scored]) -> list[Scored]:
    """The best to be tried, of a machine the forces that machines have, each in the width that scores best.

    Around a model that is far off many a product of states scores as high as they do.
    """
    usual = [s for s in passing if s.candidate.usual] or passing
    if not any(along_of(s.candidate.effect.slots[0]) for s in passing):
        return list(passing[:_TRIED])
    first: dict[str, Scored] = {}
    for one in usual:
        first.setdefault(one.candidate.effect.name, one)
    return list(first.values())[:_TRIED]


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

    def __init__(
        self,
        record: Record,
        held_out: NDArray[np.bool_],
        clock: Clock,
        unit: float = 1.0,
        given: Sequence[Candidate] = (),
        free: Sequence[Free] = (),
    ) -> None:
        self.clock, self.tell = clock, clock.tell
        self.given, self.free = given, free
        self.tests = Acceptance(record, held_out, clock, unit)

    def run(self, begin: SearchState, known: SearchState | None = None) -> Outcome:
        """Add effects until none passes, from where the search begins; `known` is the known model's fit."""
        accepted: list[Step] = []
        rounds: list[ScoreRound] = []
        states = [begin]
        stopped = None
        try:
            self._forward_selection(accepted, states, rounds)
        except TimeUpError as up:
            stopped = str(up)
        number = self._confirmed_by_free_runs(known or states[0], states)
        unconfirmed = self._unconfirmed(known or states[0], accepted[number:], states[-1])
        end = states[number] if number else known or states[0]
        return Outcome(end.part, end.whole, end.errors, accepted[:number], rounds, unconfirmed, stopped)

    def _forward_selection(
        self, accepted: list[Step], states: list[SearchState], rounds: list[ScoreRound]
    ) -> None:
        """Add effects to the lists as they pass."""
        known: set[tuple[str, ...]] = set()
        while sum(len(step.candidates) for step in accepted) < _MOST:
            self.tell("scoring candidates" + (" for a further effect" if accepted else ""))
            scores = score_round(states[-1].part, self.given, self.clock.watched)
            rounds.append(scores)
            # What the library has been asked for already, and what a curve still says far more of than
            # anything in it, is no bent view of something known.
            tried = scores.curves if accepted and scores.curve_leads() else []
            found = self._located(states[-1], scores) if tried else None
            found = found or self._known(states[-1], scores)
            if found is None:
                self.tell("scoring surfaces over two coordinates")
                rounds[-1] = scores = with_surfaces(scores)
                found = self._located(states[-1], scores, tried)
            if found is None:
                break
            accepted.append(found[0])
            states.append(found[1])
            self._backward_elimination(accepted, states, rounds)
            states[-1] = self._released(states[-1])
            # What takes another's place may give way to it again: then the search goes in circles.
            titles = tuple(c.title for step in accepted for c in step.candidates)
            if titles in known:
                break
            known.add(titles)
            # What no library has, and free runs contradict, is no ground to search on from.
            contradicted = self.tests.improvement(states[-2].errors, states[-1].errors)[1] > 1.0
            if accepted[-1].curve is not None and contradicted:
                break

    def _confirmed_by_free_runs(self, known: SearchState, states: list[SearchState]) -> int:
        """How many of the steps free runs on the held-out data confirm."""
        for number in range(len(states) - 1, 0, -1):
            errors = states[number].errors
            one_more = self.tests.improvement(states[number - 1].errors, errors)
            ratio = self.tests.improvement(known.errors, errors)
            if not confirmed(known.errors, ratio) or one_more[1] > 1.0:
                continue
            # Runs that are too short to show it do not confirm what forces at random do as well.
            if ratio[2] < 1.0 or as_random(known.whole, states[number].whole) is None:
                return number
        return 0

    def _unconfirmed(self, known: SearchState, steps: list[Step], end: SearchState) -> list[RejectedEffect]:
        """What passed all other tests."""
        ratio = self.tests.improvement(known.errors, end.errors)
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

    def _released(self, state: SearchState) -> SearchState:
        """With everything free that the user leaves free, unless that goes astray.

        A camera may well be farther off than is usual: held-out data that are foretold better beyond doubt
        with what it came to say that it is.
        """
        # Without this a strong cubic drag is followed by an eccentric mass and a curve that are not there.
        names = set(state.part.parameters)
        if all(f.name in names for f in self.free):
            return state
        try:
            part, whole = both(partial(released, free=self.free), state.part, state.whole)
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
        for one in scores.usable():
            strongest.setdefault((one.candidate.effect.name, one.candidate.effect.momentum), one)
        shown = [s.candidate for s in scores.passing()]
        rejected, apart = [], []
        for trial in self._tried(base, list(strongest.values())[:_NEAREST]):
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
            told = RejectedEffect(effect, title, judged.chi2, judged.p, errors, ratio, why, answers)
            rejected.append(told)
            if contested(answers):
                apart.append((chi2, told))
        near = sorted((r for r in rejected if r.ratio[2] < 1.0), key=lambda r: r.ratio[0])
        if not apart:
            return near
        best = min(apart, key=lambda pair: pair[0])[1]
        return [replace(best, why="records"), *(r for r in near if r is not best)]

    def _known(self, current: SearchState, scores: ScoreRound) -> tuple[Step, SearchState] | None:
        """The best addition of the library that passes: an effect, or two of them together.

        What physics knows comes first: as long as something else is missing too, a curve bends to explain a
        part of that. Once effects of the library explain the data, formulas compete with them.
        """
        passing = scores.passing()
        curve = next((c for c in states_first(scores.curves) if len(c.coordinates) == 1), None)
        with ThreadPoolExecutor(1) as beside:  # a search in Python beside fits in the core
            sought = beside.submit(self._formulas, current, curve) if curve and passing else None
            singles = self._singles(current, passing)
        singles += self._look_alikes(current, scores, singles)
        # With these the model cannot even be held as tightly as without: nor with another one beside.
        tight = [t for t in singles if t.fit.level >= current.part.level]
        loose = {t.candidates[0].effect.name for t in singles} - {t.candidates[0].effect.name for t in tight}
        if curve and sought and singles and min(t.fit.scatter for t in singles) < _EXPLAINED:
            # Formulas that may explain the data as well as what the library has.
            known = max(scores.nats(s) for s in passing)
            rivals = [f for f in sought.result() if curve.evidence + f.nats > known - EVIDENCE_MARGIN]
            singles += self._written(current, curve, rivals)
        if singles and (current.part.model.profile.discovery.pairs or any(t.formula for t in singles)):
            singles += self._pairs(current, scores, loose, min((t.fit.chi2 for t in tight), default=np.inf))
        return self.tests.best(current, singles, scores) or self._two_together(current, scores, loose)

    def _located(
        self, current: SearchState, scores: ScoreRound, tried: Sequence[Curve] = ()
    ) -> tuple[Step, SearchState] | None:
        """The best curve or surface that passes; of some those that would have been chosen were tried."""
        faults = scores.fit.faults

        def best(curves: Sequence[Curve]) -> list[Curve]:
            shown = [c for c in curves if c.p * scores.comparisons < ALPHA and c.chi2 > faults]
            return states_first(shown)[:_CURVES]

        known = [c.name for c in best(tried)]
        likely = [c for c in best(scores.curves) if c.name not in known]
        return self.tests.best(current, self._curves(current, likely), scores)

    def _written(self, current: SearchState, curve: Curve, formulas: list[Formula]) -> list[TrialFit]:
        """Formulas for a curve, fitted."""
        self._trying([f.text for f in formulas])
        return fitted_ones(
            self.clock.each(lambda written: of_formula(current.part, curve, written), formulas)
        )

    def _trying(self, titles: list[str]) -> None:
        if titles:
            self.tell(f"trying {titles[0]}" + (f" and {len(titles) - 1} more" if titles[1:] else ""))

    def _formulas(self, current: SearchState, curve: Curve) -> list[Formula]:
        part = current.part
        return formulas_for(curve, part.observations, taken=part.model.state_names).formulas[:_FORMULAS]

    def _singles(self, current: SearchState, passing: list[Scored]) -> list[TrialFit]:
        best = _machines_first(passing)
        self._trying([s.candidate.title for s in best])
        return self._tried(current, best)

    def _look_alikes(self, current: SearchState, scores: ScoreRound, tried: list[TrialFit]) -> list[TrialFit]:
        """What does nearly the same along the motion as the best of those tried, whatever its score."""
        if not tried or not current.part.model.profile.written:
            return []
        names = {t.candidates[0].effect.name for t in tried}
        others = [s.candidate for s in scores.library.scored if s.candidate.effect.name not in names]
        best = min(tried, key=lambda t: (-t.fit.level, t.fit.chi2))
        likest = look_alikes(current.part.model, best.fit, others)[:_ALIKE]
        self._trying([candidate.title for candidate, _amplitude in likest])
        return self._in_full(current, [(candidate, [amplitude]) for candidate, amplitude in likest])

    def _tried(self, current: SearchState, some: list[Scored]) -> list[TrialFit]:
        """Candidates fitted in full, from the amplitudes that the score foretells."""
        return self._in_full(current, [(s.candidate, list(s.amplitudes)) for s in some])

    def _in_full(self, current: SearchState, some: list[tuple[Candidate, list[float]]]) -> list[TrialFit]:
        """Candidates fitted in full, each from its amplitudes."""
        found = self.clock.each(lambda one: of_library(current.part, [one[0]], one[1]), some)
        return one_of_each(fitted_ones(found))

    def _pairs(
        self, current: SearchState, scores: ScoreRound, loose: set[str], most: float
    ) -> list[TrialFit]:
        """Two effects at once, of those that the scores rank first, to compare with one and with formulas.

        One that drives where it should brake may do so because another one brakes too much. `most` is the
        chi2 of the best of the others.
        """
        scored = sorted((s for s in scores.library.scored if not s.absorbed), key=lambda s: -s.chi2)
        first: dict[str, Candidate] = {}
        for one in scored:
            if one.candidate.usual and one.candidate.effect.name not in loose:
                first.setdefault(one.candidate.effect.name, one.candidate)
        best = list(first.values())[:_PAIRED]
        pairs = [list(pair) for pair in itertools.combinations(best, 2)]
        # What one joint of a machine has the others have too, whatever the scores around a wrong motion say.
        alike = [pair for pair in itertools.combinations(first.values(), 2) if pair[0].form == pair[1].form]
        pairs += [list(pair) for pair in alike if pair[0].form and not set(pair) <= set(best)]
        return self._together(current, pairs, most)

    def _together(
        self, current: SearchState, groups: list[list[Candidate]], most: float = np.inf
    ) -> list[TrialFit]:
        """Several effects at once fitted in full, from none."""
        self._trying([" with ".join(c.title for c in group) for group in groups])
        return fitted_ones(self.clock.each(lambda group: from_none(current.part, group, most), groups))

    def _two_together(
        self, current: SearchState, scores: ScoreRound, loose: set[str]
    ) -> tuple[Step, SearchState] | None:
        """Two effects at once that pass only together."""
        best, number = scores.library.pairs(_TOGETHER)
        likely = [
            [s.candidate for s in group]
            for group, fall in best
            if len({s.candidate.effect.name for s in group} - loose) == 2
            and fall > scores.fit.faults
            and chi_squared.sf(fall, sum(len(s.amplitudes) for s in group)) * number < ALPHA
        ]
        return self.tests.best(current, self._together(current, likely), replace(scores, comparisons=number))

    def _curves(self, current: SearchState, likely: list[Curve]) -> list[TrialFit]:
        """The likeliest curves, as splines and by short formulas."""
        trials: list[TrialFit] = []
        self._trying([curve.title for curve in likely])
        for located in fitted_ones(self.clock.each(lambda curve: of_curve(current.part, curve), likely)):
            trials.append(located)
            if located.curve is not None:
                trials += self._written(current, located.curve, self._formulas(current, located.curve))
        return trials

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
            before = states[k]
            found = self.tests.best(before, self._curves(before, [last.curve]), rounds[k])
            if found is None:
                continue
            if _cheaper(found, accepted[k:], states[k], states[-1]):
                accepted[k:], states[k + 1 :], rounds[k + 1 :] = [found[0]], [found[1]], []
                return

    def _leave_out(self, accepted: list[Step], states: list[SearchState], rounds: list[ScoreRound]) -> None:
        """Leave out effects of the library that chance explains beside those found after them.

        All of them at once first: of two that are not needed neither is missed, but the other still fails.
        """
        whole = states[-1].whole
        idle = [
            (k, one)
            for k, step in enumerate(accepted[:-1])
            for one in step.candidates
            if not any(s.curve for s in accepted[k:]) and not needed_in(whole, one.amplitude_names)
        ]
        for group in [idle, *([one] for one in idle)] if len(idle) > 1 else [idle] if idle else []:
            k, names = group[0][0], {one.effect.name for _k, one in group}
            later = accepted[k:]
            self.tell(f"trying without {' and '.join(one.title for _k, one in group)}")
            kept = [c for s in later for c in s.candidates if c.effect.name not in names]
            values = [states[-1].part.parameters[name] for c in kept for name in c.amplitude_names]
            last = states[-1].part
            from_there = started_at(states[k].part, last, np.ones(len(last.record.t), dtype=bool))
            trial = of_library(from_there, kept, values)
            found = self.tests.best(states[k], fitted_ones([trial]), rounds[k])
            if found is None or not _cheaper(found, later, states[k], states[-1]):
                continue
            left = {c.effect.name for c in kept}
            others = [a for s in later for a in s.alternatives if a.instead_of in left]
            accepted[k:] = [replace(found[0], alternatives=others)]
            states[k + 1 :], rounds[k + 1 :] = [found[1]], []
            return
