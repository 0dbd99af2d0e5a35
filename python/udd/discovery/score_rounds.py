"""One round of score tests around a fit: of the library, and of curves of any coordinate."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from udd._util.parallel import parallel_map
from udd.discovery.nonparametric.curve_scan import EVIDENCE_MARGIN, Curve, scan_curves
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.candidates import library
from udd.discovery.scoring.score_scan import Scan, Scored, scan, strongest_ripple
from udd.discovery.scoring.shape_scan import strongest_shapes
from udd.fitting import Fit, beyond_schedule, with_larger_model_error

from .thresholds import ALPHA
from .trial_fits import price_of

_LEADS = 2.0  # times the gain of the library's best; no two of its effects gain more together
_LEADS_OFF_TRACK = 1.5  # where wrong effects of the library take minutes to fit
_SCATTER = 3.0  # candidates are scored around a fit whose chi2 per degree of freedom is below this


@dataclass(frozen=True)
class ScoreRound:
    """What the scores around one fit say.

    Attributes
    ----------
    fit : Fit
    library : Scan
    curves : list of Curve
        The likeliest first.
    comparisons : int
        How many scores could have been the best: the number of tests, by which Bonferroni's correction
        multiplies each probability.
    """

    fit: Fit
    library: Scan
    curves: list[Curve]
    comparisons: int

    @property
    def off_track(self) -> bool:
        """Whether the model follows the data only with more model error than the schedule has."""
        return beyond_schedule(self.fit)

    def usable(self) -> list[Scored]:
        """The candidates with physical numbers whose work no free parameter does, the strongest first."""
        found = [s for s in self.library.scored if s.physical and not s.absorbed]
        # Without the price of what a scan chose a free power comes before the law that is right.
        price = price_of(self.fit)
        return sorted(found, key=lambda s: -round(s.chi2 - price * s.candidate.scanned, 3))

    def passing(self) -> list[Scored]:
        """Those of them that neither chance nor a film's faults explain."""
        faults = self.fit.faults
        return [s for s in self.usable() if s.p * self.comparisons < ALPHA and s.chi2 > faults]

    def passing_curves(self) -> list[Curve]:
        """The curves that neither chance nor a film's faults explain."""
        return [c for c in self.curves if c.p * self.comparisons < ALPHA and c.chi2 > self.fit.faults]

    def nats(self, scored: Scored) -> float:
        """A candidate's gain over nothing, its parameters paid for, as a curve's evidence counts."""
        return (scored.chi2 - scored.candidate.parameters * price_of(self.fit)) / 2

    def strongest(self) -> float:
        """The gain of the best explanation."""
        return max([c.evidence for c in self.curves] + [self._known()], default=0.0)

    def curve_leads(self) -> bool:
        """Whether a curve over one coordinate gains far more than every effect of the library."""
        best = max((c.evidence for c in self.curves if len(c.coordinates) == 1), default=0.0)
        leads = _LEADS_OFF_TRACK if self.off_track else _LEADS
        return best > leads * max(self._known(), 0.0) + EVIDENCE_MARGIN

    def _known(self) -> float:
        """The gain of the library's best."""
        return max((self.nats(s) for s in self.library.scored if s.physical), default=-math.inf)


def score_round(
    fitted: Fit,
    given: Sequence[Candidate] = (),
    watched: Callable[[Callable[[Fit], ScoreRound]], Callable[[Fit], ScoreRound]] = lambda work: work,
) -> ScoreRound:
    """Score every candidate and curve around the fit or, where that explains little, around a looser one.

    A chaotic model that is wrong shows what it lacks only where it is held loosely: what scores high around a
    tighter fit need not be what is missing. That one counts where the looser one shows nothing, as of few
    data. Of other models both are scored, and the scores with the stronger explanation count: what dies down
    slowly shows only where they are held tightly. Where the model needs more model error than the schedule
    has, the looser one alone counts. `given` are the user's own candidates; `watched` makes work that does
    not begin once a search's time is up.
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
    alone = looser is fitted or beyond_schedule(looser)
    chaotic = fitted.model.profile.discovery.chaotic
    found = parallel_map(watched(score), [looser] if alone or chaotic else [fitted, looser])
    if not alone and chaotic and not (found[0].passing() or found[0].passing_curves()):
        found.append(watched(score)(fitted))
    return replace(max(found, key=ScoreRound.strongest), comparisons=sum(one.comparisons for one in found))


def with_surfaces(scores: ScoreRound) -> ScoreRound:
    """With the surfaces over two coordinates."""
    found = scan_curves(scores.fit, only=lambda _slot, own: len(own) == 2, pairs=True)
    curves = sorted(scores.curves + found.curves, key=lambda c: -c.evidence)
    return replace(scores, curves=curves, comparisons=scores.comparisons + found.comparisons)


def states_first(curves: list[Curve]) -> list[Curve]:
    """The likeliest first, but after those as likely what stands for states in a roundabout way.

    Curves over time take up anything slow, and curves over the direction can do much of what those over Y
    and Z do. A velocity without its momentum comes before the same with it.
    """

    # Without this an uneven grip is written as a function of atan2(Y, Z), not of Y.
    def prior_penalty(curve: Curve) -> float:
        own = curve.coordinates[0]
        roundabout = 2 if own.name == "t" else 1 if own.angle and own.text != own.name else 0
        return EVIDENCE_MARGIN * (roundabout + 0.5 * (curve.slot.momentum == "consistent"))

    return sorted(curves, key=lambda c: -c.evidence + prior_penalty(c))
