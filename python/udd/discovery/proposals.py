"""Full fits of the candidates in one round of the search."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from udd._util import chi_squared
from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.look_alikes import look_alikes
from udd.discovery.scoring.score_scan import Scored
from udd.effects.user_defined import along_of
from udd.fitting import Fit, Goal

from .score_rounds import ScoreRound, most_probable_first
from .thresholds import ALPHA, EVIDENCE_MARGIN, ROUGH_MARGIN
from .time_budget import Clock
from .trial_fits import (
    TrialFit,
    fitted_ones,
    of_curve,
    of_library,
    of_several,
    one_of_each,
)

_TRIED = 12  # best candidates that are fitted in full
_ALIKE = 6  # further candidates that act almost like the best
_TOGETHER = 6  # pairs of effects that may pass only together
_COORDINATES = 5  # coordinates over which curves are located
_HOPELESS = 2.0  # ratio to the best fit's chi2 above which a fit that does not converge is abandoned
_PAIRED = 4  # best-scored effects of which all pairs are fitted in full


def far_behind(trials: Sequence[TrialFit]) -> float:
    """Return the chi2 of a fit that is ten nats behind the best of these."""
    # Without the margin a power hides quadratic and cubic drag, which explain almost as much.
    return min((t.fit.chi2 for t in trials), default=math.inf) + 2 * EVIDENCE_MARGIN


def _machines_first(passing: Sequence[Scored]) -> list[Scored]:
    """Return the best candidates; for a machine its usual forces, each in the width that scores best.

    Around a model that is far off many products of states score as high.
    """
    usual = [s for s in passing if s.candidate.usual] or passing
    if not any(along_of(s.candidate.effect.slots[0]) for s in passing):
        return list(passing[:_TRIED])
    first: dict[str, Scored] = {}
    for scored in usual:
        first.setdefault(scored.candidate.effect.name, scored)
    return list(first.values())[:_TRIED]


class Proposals:
    """Trial fits around a fit of the training part, from the scores of its missing effects."""

    def __init__(self, fit: Fit, scores: ScoreRound, clock: Clock) -> None:
        self.fit, self.scores, self.clock = fit, scores, clock

    def effects(self) -> list[TrialFit]:
        """Fit effects of the library, one or two at once.

        Curves over the coordinates that score about as well are located too, with their formulas.
        """
        trials = self._singles(self.scores.passing())
        trials += self._look_alikes(trials)
        if trials:
            tight = [t for t in trials if t.fit.level >= self.fit.level]
            loose = self._loose(trials)
            trials += self.curves(self._near_curves(), far_behind(tight))
            trials += self._pairs(loose, tight)
        return trials

    def _loose(self, trials: Sequence[TrialFit]) -> set[str]:
        """Name effects with which the model error cannot even be reduced as far as without them.

        With a second effect it cannot be reduced either.
        """
        singles = [t for t in trials if len(t.candidates) == 1]
        tight = {t.candidates[0].effect.name for t in singles if t.fit.level >= self.fit.level}
        return {t.candidates[0].effect.name for t in singles} - tight

    def _near_curves(self) -> list[Curve]:
        """Return the most probable curves, over each coordinate that scores about as well as the best.

        A score around a wrong model does not distinguish coordinates that turn together. The friction as a
        function of the speed is always included, because drags are its rivals.
        """
        single = most_probable_first(self.scores.curves)
        if not single:
            return []
        # If a library term scores far higher than every curve, no curve is its rival.
        least = max(single[0].evidence - EVIDENCE_MARGIN, self.scores.strongest() - ROUGH_MARGIN)
        likely = [c for c in single if c.evidence > least]
        likely += [c for c in single if c.name == ("friction", "|Omega|") and c not in likely]
        kinds = list(dict.fromkeys(c.key_without_momentum for c in likely))[:_COORDINATES]
        return [c for c in likely if c.key_without_momentum in kinds]

    def only_together(self, trials: Sequence[TrialFit]) -> tuple[list[TrialFit], int]:
        """Fit pairs of effects that may pass only together, also those of `trials`; count all pairs."""
        best, number = self.scores.library.pairs(_TOGETHER)
        loose = self._loose(trials)
        likely = [
            [s.candidate for s in group]
            for group, fall in best
            if len({s.candidate.effect.name for s in group} - loose) == 2
            and fall > self.scores.fit.film_error_chi2
            and chi_squared.sf(fall, sum(len(s.amplitudes) for s in group)) * number < ALPHA
        ]
        return self._together(likely), number

    def curves(self, likely: list[Curve], most: float = math.inf) -> list[TrialFit]:
        """Locate curves as splines; abandon those with a chi2 above `most`."""
        self.clock.trying([curve.title for curve in likely])
        return fitted_ones(self.clock.each(lambda curve: of_curve(self.fit, curve, most), likely))

    def tried(self, some: list[Scored]) -> list[TrialFit]:
        """Fit candidates in full, starting at the amplitudes that the score predicts."""
        return one_of_each(self._in_full([(s.candidate, list(s.amplitudes)) for s in some]))

    def _singles(self, passing: list[Scored]) -> list[TrialFit]:
        best = [(s.candidate, list(s.amplitudes)) for s in _machines_first(passing)]
        self.clock.trying([candidate.title for candidate, _amplitudes in best])
        # A wrong candidate may take a hundred times as long as the right one, which usually comes first.
        first = self._in_full(best[:1])
        return one_of_each(first + self._in_full(best[1:], self._beside(first)))

    def _look_alikes(self, tried: list[TrialFit]) -> list[TrialFit]:
        """Fit candidates that act almost like the best trial along the motion, whatever their scores."""
        if not tried or not self.fit.model.profile.written:
            return []
        names = {t.candidates[0].effect.name for t in tried}
        others = [s.candidate for s in self.scores.library.scored if s.candidate.effect.name not in names]
        best = min(tried, key=lambda t: t.rank)
        # ODEBench 57: otherwise a wrong formula is identified in place of the decay of z.
        similar = look_alikes(self.fit.model, best.fit, others)[:_ALIKE]
        self.clock.trying([candidate.title for candidate, _amplitude in similar])
        some = [(candidate, [amplitude]) for candidate, amplitude in similar]
        return one_of_each(self._in_full(some, self._beside(tried)))

    def _beside(self, trials: list[TrialFit]) -> Goal | None:
        """Return the goal of a fit that competes with the best trial."""
        best = min(trials, key=lambda t: t.rank, default=None)
        if best is None:
            return None
        return Goal(self.fit.level, lost=_HOPELESS * best.fit.chi2, rival=best.fit.level)

    def _in_full(self, some: list[tuple[Candidate, list[float]]], goal: Goal | None = None) -> list[TrialFit]:
        """Fit candidates in full, each starting at its amplitudes."""
        return fitted_ones(self.clock.each(lambda item: of_library(self.fit, [item[0]], item[1], goal), some))

    def _pairs(self, loose: set[str], singles: list[TrialFit]) -> list[TrialFit]:
        """Fit two effects at once, the best-scored ones, as rivals of single effects and formulas.

        An effect that drives instead of braking may only compensate another one that brakes too much. A pair
        that is ten nats behind one of the `singles` is abandoned.
        """
        scored = sorted((s for s in self.scores.library.scored if not s.absorbed), key=lambda s: -s.chi2)
        first: dict[str, Candidate] = {}
        for candidate in (s.candidate for s in scored):
            if candidate.usual and not candidate.scanned and candidate.effect.name not in loose:
                first.setdefault(candidate.effect.name, candidate)
        best = list(first.values())[:_PAIRED]
        pairs = [list(pair) for pair in itertools.combinations(best, 2)]
        # The best single effect may hide the rest: pair it with each of the best-scored effects that brake.
        leader = min(singles, key=lambda t: (-t.fit.level, t.fit.chi2 / 2 + t.cost), default=None)
        usable = list(dict.fromkeys(first.get(s.candidate.effect.name) for s in self.scores.usable()))
        for other in usable[:_PAIRED]:
            if leader and other and leader.candidates[0].effect.name != other.effect.name:
                pair = [leader.candidates[0], other]
                pairs += [pair] if pair not in pairs and pair[::-1] not in pairs else []
        # Joints of a machine may all have the same friction, whatever the scores around a wrong motion are.
        alike = [pair for pair in itertools.combinations(first.values(), 2) if pair[0].form == pair[1].form]
        pairs += [list(pair) for pair in alike if pair[0].form and not set(pair) <= set(best)]
        return self._together(pairs, singles)

    def _together(self, groups: list[list[Candidate]], singles: Sequence[TrialFit] = ()) -> list[TrialFit]:
        """Fit several effects at once, each group starting at the end of the best of its `singles`."""
        goal = Goal(self.fit.level, far_behind(singles))
        starts = sorted((t for t in singles if t.curve is None), key=lambda t: t.fit.chi2)

        def together(group: list[Candidate]) -> TrialFit | None:
            first = next((t for t in starts if t.candidates[0] in group), None)
            return of_several(self.fit, group, goal, first)

        self.clock.trying([" with ".join(c.title for c in group) for group in groups])
        trials = fitted_ones(self.clock.each(together, groups))
        best = min(trials, key=lambda t: t.rank, default=None)
        return trials + self._in_other_widths(best) if best else []

    def _in_other_widths(self, trial: TrialFit) -> list[TrialFit]:
        """Fit several effects at once with the other widths of their smoothed signs.

        Around a model that lacks two effects, the width with the best score may be far from the right one.
        """
        # Without this a curve over its speed replaces an arm's offset and dry friction.
        groups = [
            [other if c is replaced else c for c in trial.candidates]
            for replaced in trial.candidates
            for other in (s.candidate for s in self.scores.library.scored)
            if other.title == replaced.title and other is not replaced
        ]
        return fitted_ones(self.clock.each(lambda group: of_several(self.fit, group), groups))
