"""What a round of the search tries: candidates that score well, and their kin, fitted in full."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from udd._util import chi_squared
from udd.discovery.nonparametric.curve_scan import EVIDENCE_MARGIN, Curve
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.look_alikes import look_alikes
from udd.discovery.scoring.score_scan import Scored
from udd.effects.user_defined import along_of
from udd.fitting import Fit, Goal

from .score_rounds import ScoreRound, states_first
from .thresholds import ALPHA
from .time_budget import Clock
from .trial_fits import (
    TrialFit,
    fitted_ones,
    from_none,
    of_curve,
    of_library,
    one_of_each,
    price_of,
    with_more,
)

_TRIED = 12  # of the best candidates, fitted in full
_ALIKE = 6  # more of them, that do nearly the same as the best
_TOGETHER = 6  # pairs that may pass only together
_COORDINATES = 4  # over which curves are located
_HOPELESS = 2.0  # times the chi2 of the best fit: one above it that does not converge is given up
_PAIRED = 4  # of the effects that are scored best, of which all pairs are fitted in full


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


class Proposals:
    """Trial fits around a model, from the scores of what it may lack.

    Parameters
    ----------
    fit : Fit
        Of the first part of the record.
    scores : ScoreRound
    clock : Clock
    """

    def __init__(self, fit: Fit, scores: ScoreRound, clock: Clock) -> None:
        self.fit, self.scores, self.clock = fit, scores, clock

    def effects(self) -> tuple[list[TrialFit], set[str]]:
        """What the library has, one effect or two, and the names of those with which the model does worse.

        Curves over the coordinates that score as well are located beside them, and their formulas.
        """
        passing = self.scores.passing()
        trials = self._singles(passing)
        trials += self._look_alikes(trials)
        # With these the model cannot even be held as tightly as without: nor with another one beside.
        tight = [t for t in trials if t.fit.level >= self.fit.level]
        loose = {t.candidates[0].effect.name for t in trials} - {t.candidates[0].effect.name for t in tight}
        if trials:
            trials += self.curves(self._near_curves())
        if trials and (self.fit.model.profile.discovery.pairs or any(t.curve for t in trials)):
            trials += self._pairs(loose, tight)
        return trials, loose

    def _near_curves(self) -> list[Curve]:
        """The likeliest curves, over each coordinate that scores about as well as the best.

        A score around a wrong model does not tell one coordinate from another that turns with it. The
        friction as a function of the speed is among them, for drags are its rivals.
        """
        single = [c for c in states_first(self.scores.curves) if len(c.coordinates) == 1]
        if not single:
            return []
        near = [c for c in single if c.evidence > single[0].evidence - EVIDENCE_MARGIN]
        near += [c for c in single if c.name == ("friction", "|Omega|") and c not in near]
        kinds = list(dict.fromkeys(c.kin for c in near))[:_COORDINATES]
        return [c for c in near if c.kin in kinds]

    def only_together(self, loose: set[str]) -> tuple[list[TrialFit], int]:
        """Two effects at once that may pass only together, but for the `loose`, and of how many pairs."""
        best, number = self.scores.library.pairs(_TOGETHER)
        likely = [
            [s.candidate for s in group]
            for group, fall in best
            if len({s.candidate.effect.name for s in group} - loose) == 2
            and fall > self.scores.fit.faults
            and chi_squared.sf(fall, sum(len(s.amplitudes) for s in group)) * number < ALPHA
        ]
        return self._together(likely), number

    def curves(self, likely: list[Curve]) -> list[TrialFit]:
        """Curves, located as splines."""
        self.clock.trying([curve.title for curve in likely])
        return fitted_ones(self.clock.each(lambda curve: of_curve(self.fit, curve), likely))

    def tried(self, some: list[Scored]) -> list[TrialFit]:
        """Candidates fitted in full, from the amplitudes that the score foretells."""
        return one_of_each(self._in_full([(s.candidate, list(s.amplitudes)) for s in some]))

    def _singles(self, passing: list[Scored]) -> list[TrialFit]:
        best = [(s.candidate, list(s.amplitudes)) for s in _machines_first(passing)]
        self.clock.trying([candidate.title for candidate, _amplitudes in best])
        # A wrong one may take a hundred times as long as the right one, which most often is the first.
        first = self._in_full(best[:1])
        return self._worthwhile(one_of_each(first + self._in_full(best[1:], self._beside(first))))

    def _worthwhile(self, trials: list[TrialFit]) -> list[TrialFit]:
        """Leave out laws with a scanned number that explain hardly more than the best law that has none.

        A free power looks like every drag. If its gain does not pay half of its number in the first part, it
        pays none in all data.
        """
        # Without this half of a search's time goes to powers beside a quadratic drag.
        plain = min((t for t in trials if not t.candidates[0].scanned), key=lambda t: t.rank, default=None)
        if plain is None:
            return trials
        price = price_of(self.fit) / 2 * max(plain.fit.scatter, 1.0)

        def leads(trial: TrialFit) -> bool:
            level, chi2 = trial.rank
            return (level, chi2 + price * trial.candidates[0].scanned) < plain.rank

        return [t for t in trials if not t.candidates[0].scanned or leads(t)]

    def _look_alikes(self, tried: list[TrialFit]) -> list[TrialFit]:
        """What does nearly the same along the motion as the best of those tried, whatever its score."""
        if not tried or not self.fit.model.profile.written:
            return []
        names = {t.candidates[0].effect.name for t in tried}
        others = [s.candidate for s in self.scores.library.scored if s.candidate.effect.name not in names]
        best = min(tried, key=lambda t: t.rank)
        likest = look_alikes(self.fit.model, best.fit, others)[:_ALIKE]
        self.clock.trying([candidate.title for candidate, _amplitude in likest])
        some = [(candidate, [amplitude]) for candidate, amplitude in likest]
        return one_of_each(self._in_full(some, self._beside(tried)))

    def _beside(self, trials: list[TrialFit]) -> Goal | None:
        """What a fit must reach to be of use beside the best of those tried."""
        best = min(trials, key=lambda t: t.rank, default=None)
        if best is None:
            return None
        return Goal(self.fit.level, lost=_HOPELESS * best.fit.chi2, rival=best.fit.level)

    def _in_full(self, some: list[tuple[Candidate, list[float]]], goal: Goal | None = None) -> list[TrialFit]:
        """Candidates fitted in full, each from its amplitudes."""
        return fitted_ones(self.clock.each(lambda one: of_library(self.fit, [one[0]], one[1], goal), some))

    def _pairs(self, loose: set[str], singles: list[TrialFit]) -> list[TrialFit]:
        """Two effects at once, of those that the scores rank first, to compare with one and with formulas.

        One that drives where it should brake may do so because another one brakes too much. What does not
        explain as much as one of the `singles` is given up.
        """
        scored = sorted((s for s in self.scores.library.scored if not s.absorbed), key=lambda s: -s.chi2)
        first: dict[str, Candidate] = {}
        for one in scored:
            if one.candidate.usual and not one.candidate.scanned and one.candidate.effect.name not in loose:
                first.setdefault(one.candidate.effect.name, one.candidate)
        best = list(first.values())[:_PAIRED]
        pairs = [list(pair) for pair in itertools.combinations(best, 2)]
        # What is best alone may only hide the rest: with it each of those that score best and brake.
        leader = min(singles, key=lambda t: (-t.fit.level, t.fit.chi2 + t.price), default=None)
        usable = list(dict.fromkeys(first.get(s.candidate.effect.name) for s in self.scores.usable()))
        for other in filter(None, usable[:_PAIRED]):
            pair = [leader.candidates[0], other] if leader else []
            if (
                pair
                and pair[0].effect.name != other.effect.name
                and pair not in pairs
                and pair[::-1] not in pairs
            ):
                pairs.append(pair)
        # What one joint of a machine has the others have too, whatever the scores around a wrong motion say.
        alike = [pair for pair in itertools.combinations(first.values(), 2) if pair[0].form == pair[1].form]
        pairs += [list(pair) for pair in alike if pair[0].form and not set(pair) <= set(best)]
        return self._together(pairs, singles)

    def _together(self, groups: list[list[Candidate]], singles: Sequence[TrialFit] = ()) -> list[TrialFit]:
        """Several effects at once fitted in full, each from where the best of the `singles` in it ended."""
        goal = Goal(self.fit.level, min((t.fit.chi2 for t in singles), default=np.inf))
        starts = sorted((t for t in singles if t.curve is None), key=lambda t: t.fit.chi2)

        def together(group: list[Candidate]) -> TrialFit | None:
            first = next((t for t in starts if t.candidates[0] in group), None)
            if first is None:
                return from_none(self.fit, group, goal)
            return with_more(self.fit, first, group, goal)

        self.clock.trying([" with ".join(c.title for c in group) for group in groups])
        return fitted_ones(self.clock.each(together, groups))
