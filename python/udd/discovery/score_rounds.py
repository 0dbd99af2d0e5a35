"""One round of score tests around a fit: of the library, and of curves over any coordinate."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from udd._util.parallel import parallel_map
from udd.discovery.nonparametric.curve_scan import Curve, scan_curves
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.candidates import library
from udd.discovery.scoring.score_scan import Scan, Scored, scan, strongest_ripple
from udd.discovery.scoring.shape_scan import strongest_shapes
from udd.fitting import Fit, beyond_schedule, with_larger_model_error

from .thresholds import ALPHA, EVIDENCE_MARGIN
from .trial_fits import cost_of_parameter

_LEADS = 2.0  # ratio to the gain of the library's best; no two of its effects gain more together
# the same if the model is off track: wrong effects of the library then take minutes to fit
_LEADS_OFF_TRACK = 1.5
_SCATTER = 3.0  # chi2 per degree of freedom, below which candidates are scored around a fit


@dataclass(frozen=True)
class ScoreRound:
    """Scores of the library and of curves around one fit, the most probable curve first.

    `comparisons` is the number of tests for Bonferroni's correction: of scores that could have been the best.
    """

    fit: Fit
    library: Scan
    curves: list[Curve]
    comparisons: int

    @property
    def off_track(self) -> bool:
        """True if the model follows the data only with more model error than the schedule has."""
        return beyond_schedule(self.fit)

    def usable(self) -> list[Scored]:
        """Return candidates with physical amplitudes that no free parameter absorbs, the strongest first."""
        candidates = [s for s in self.library.scored if s.physical and not s.absorbed]
        # Without the cost of a scanned number a free power comes before the right law.
        cost = cost_of_parameter(self.fit)
        return sorted(candidates, key=lambda s: -round(s.chi2 - 2 * cost * s.candidate.scanned, 3))

    def passing(self) -> list[Scored]:
        """Return usable candidates that neither chance nor a film's faults explain."""
        faults = self.fit.film_error_chi2
        return [s for s in self.usable() if s.p * self.comparisons < ALPHA and s.chi2 > faults]

    def passing_curves(self) -> list[Curve]:
        """Return curves that neither chance nor a film's faults explain."""
        return [
            c for c in self.curves if c.p * self.comparisons < ALPHA and c.chi2 > self.fit.film_error_chi2
        ]

    def nats(self, scored: Scored) -> float:
        """Return a candidate's gain in nats minus its parameters' cost, as a curve's evidence."""
        return scored.chi2 / 2 - scored.candidate.parameters * cost_of_parameter(self.fit)

    def strongest(self) -> float:
        """Return the gain of the best explanation."""
        return max([c.evidence for c in self.curves] + [self._library_gain()], default=0.0)

    def curve_leads(self) -> bool:
        """Return True if a curve over one coordinate gains far more than every effect of the library."""
        best = max((c.evidence for c in self.curves if len(c.coordinates) == 1), default=0.0)
        leads = _LEADS_OFF_TRACK if self.off_track else _LEADS
        return best > leads * max(self._library_gain(), 0.0) + EVIDENCE_MARGIN

    def _library_gain(self) -> float:
        """Return the gain of the library's best effect."""
        return max((self.nats(s) for s in self.library.scored if s.physical), default=-math.inf)


def score_round(
    fitted: Fit,
    given: Sequence[Candidate] = (),
    each: Callable[[Callable[[Fit], ScoreRound], list[Fit]], list[ScoreRound]] = parallel_map,
) -> ScoreRound:
    """Score every candidate and curve around the fit; with more model error if it explains little.

    A wrong chaotic model shows what it lacks only with a large model error: high scores around a tighter fit
    may be misleading. So does a model that needs more model error than the schedule has. For these the
    tighter fit counts only if the looser one shows nothing, as with few or exact data. For other models both
    are scored, and the scores with the stronger explanation count: slow decays show only with a small model
    error.
    `given` are the user's own candidates; `each` maps work while a search has time.
    """

    def score(current: Fit) -> ScoreRound:
        ripple, frequencies = strongest_ripple(current)
        shaped, shapes = strongest_shapes(current)
        best = [s.candidate for s in (*([ripple] if ripple else []), *shaped)]
        scanned = scan(current, [*library(current.model, given, current.states), *best])
        curves = scan_curves(current)
        comparisons = len(scanned.scored) + frequencies + shapes + curves.comparisons
        return ScoreRound(current, scanned, curves.curves, comparisons)

    looser = with_larger_model_error(fitted, _SCATTER)
    if looser is fitted:
        return each(score, [fitted])[0]
    both = not (fitted.model.profile.discovery.chaotic or beyond_schedule(looser))
    rounds = each(score, [fitted, looser] if both else [looser])
    if not (both or rounds[0].passing() or rounds[0].passing_curves()):
        rounds += each(score, [fitted])
    return replace(
        max(rounds, key=ScoreRound.strongest), comparisons=sum(entry.comparisons for entry in rounds)
    )


def with_surfaces(scores: ScoreRound) -> ScoreRound:
    """Add the scores of surfaces over two coordinates."""
    surfaces = scan_curves(scores.fit, only=lambda _slot, coords: len(coords) == 2, pairs=True)
    curves = sorted(scores.curves + surfaces.curves, key=lambda c: -c.evidence)
    return replace(scores, curves=curves, comparisons=scores.comparisons + surfaces.comparisons)


def most_probable_first(curves: list[Curve]) -> list[Curve]:
    """Sort curves by their evidence and prior."""
    return sorted(curves, key=lambda c: -(c.evidence + c.log_prior))
