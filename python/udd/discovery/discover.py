"""Find the terms missing from a fitted model and confirm them on held-out data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from udd._util import background_import
from udd._util.arguments import checked_arguments
from udd._util.expressions import Expression
from udd._util.progress import Progress, with_status
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.term_library import given_terms
from udd.discovery.validation.by_record import by_record
from udd.discovery.validation.held_camera import camera_shows
from udd.discovery.validation.held_out_errors import lacks_more, misses_the_motion
from udd.discovery.validation.sensor_drift import FORETELLS, as_random
from udd.effects import Effect
from udd.errors import FitError
from udd.fitting import UNEXPLAINED, Fit, as_stated, eased, options_of, ran_away, refit
from udd.fitting.time_scale import motion_time_scale
from udd.measurement import Measurement
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .acceptance import Acceptance, SearchState, Step
from .results import AddedEffect, Discovery, RejectedEffect
from .search import Outcome, Search
from .search_data import SearchData, known_model_fits, prepared
from .thresholds import SAME
from .time_budget import Clock, TimeUpError
from .trial_fits import attempted
from .verdict import doubts_of, verdict_of

#: Share of the record for training; the rest is for tests.
TRAIN = 0.6


@checked_arguments(error=FitError)
@with_status
def discover(
    measurement: Measurement | Sequence[Measurement],
    model: Model | Sequence[Model],
    free: Iterable[str] | None = None,
    *,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
    each: Iterable[str] | None = None,
    state0: Mapping[str, float] | Sequence[Mapping[str, float]] | None = None,
    candidates: Iterable[tuple[str, Expression]] = (),
    held_out: Iterable[int] | None = None,
    budget: float | None = None,
    progress: Progress = None,
) -> Discovery:
    """Select missing effects forward, by score tests and held-out data.

    The model is fitted to the first 60 % of the record. Score tests (Rao) rank all effects of the library
    around that fit, and penalised splines of every coordinate. The best are fitted in full, alone and in
    twos, and so are formulas for the likely splines. The form with the largest log evidence on all data is
    added if it is physical, significant at 0.1 % over all candidates (Bonferroni), and confirmed by the last
    40 %. Then all coefficients are refitted, and the search continues. Forms within 10 nats are listed as
    alternatives. The page "How discovery decides" explains the tests, and the conditions of "effect
    identified".

    An effect is not confirmed if free runs over the last 40 % do not improve significantly, unless they are
    at the noise floor already. If nothing passes, but chi2 per degree of freedom exceeds 2.5 or free runs
    lose the motion, the model lacks an effect that these data do not identify. The closest candidates are
    listed with their held-out errors. If nothing passes in the first 60 %, but the fit of all data shows
    that something is missing, the search is repeated with the last 60 % for training.

    Records of more than 8000 frames (2000 if inputs were measured) are averaged in blocks as far as their
    motion and noise allow.

    *Parameters* of the model that the data do not determine are constrained to their given values ± 100 %,
    and the remarks list them.

    *Several records* share the model, and an effect must be missing in all of them. Its amplitudes are fitted
    to each record separately; if it is not significant in a record that could show it, it is not identified.
    Whole records can replace the last 40 % of each as held-out data.

    Parameters
    ----------
    measurement : Measurement or sequence of Measurement
        The record, or several records.
    model : Disk, Pendulum or a user's own Model, or a sequence of them
        The known model. Its parameters are the start values and the means of the priors.
    free, camera, priors, each, state0
        As for :func:`udd.fit`.
    candidates : iterable of (str, formula)
        Terms to try in a user's own model in addition to those made of its states: the state whose equation
        gets the term, and the term, as in ``("v", "abs(v)*v")``. For a model with a mass matrix also a force,
        as in ``("force(b - a)", "q^5")``.
    held_out : iterable of int, optional
        Numbers (from 0) of whole measurements that test the effects. No fit uses them.
        Effects are sought in all frames of the others, and are confirmed only by their cost on these. In
        names like ``W[0]`` the held-out measurements count last.
    budget : float, optional
        Seconds after which the search ends with its current result; the verdict then says so. The known
        model's fit and the final one are made in any case.
    progress : bool or callable, optional
        True or None shows the current stage, False nothing. A function is called with it as text.

    Returns
    -------
    Discovery
        `verdict` first; then `effects`, `alternatives`, `ratio` (held-out error after over before) and
        `remarks`. ``udd.plot.evidence``, ``udd.plot.errors`` and ``udd.plot.curve`` draw it; ``report``
        writes a page.

    Raises
    ------
    FitError
        The record is too short, or the model cannot be fitted to it.

    See Also
    --------
    udd.fit : fit the known model alone.
    udd.prune : remove needless terms.

    References
    ----------
    Score test: C. R. Rao, Proc. Cambridge Philos. Soc. 44 (1948) 50 [54]. Penalised splines: P. H. C. Eilers
    and B. D. Marx, Stat. Sci. 11 (1996) 89 [56]. Information criterion: G. Schwarz, Ann. Stat. 6 (1978) 461
    [55].

    Examples
    --------
    A pendulum with quadratic air resistance, whose model has viscous friction only.

    >>> import numpy as np, udd
    >>> t = np.arange(0, 60, 0.05)
    >>> truth = udd.Pendulum(1.0, k0=0.01, effects=[udd.effects.quadratic_drag(c=0.05)])
    >>> theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    >>> noise = 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    >>> discovery = udd.discover(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0, k0=0.03))
    >>> [effect.title for effect in discovery.effects]
    ['quadratic drag']
    """
    assert callable(progress)
    clock = Clock(budget, progress)
    options = options_of(free, camera, priors, each)
    data = prepared(measurement, model, state0, held_out, TRAIN)
    if data.held_out and (each is not None or any("[" in name for name in priors or {})):
        raise FitError(
            "held_out cannot be used with each, or with priors of single records: "
            "the parameters of a held-out record would be undetermined"
        )
    given = _given(next(iter(model), None) if isinstance(model, (list, tuple)) else model, candidates)
    clock.finish("fitting the known model")
    background_import.importing("scipy.stats", "pyoperon.sklearn")
    result = _searched(data, options, given, clock)
    # The first part of a decaying swing may hide two effects that balance there.
    if not data.held_out and result.hides_an_effect:
        other = _searched(data.exchanged(TRAIN), options, given, clock)
        result = other if other.end.accepted else result
    clock.finish("fitting the model as found")
    return _answer(result)


@dataclass(frozen=True)
class _Searched:
    """A finished search, with its data and its start."""

    data: SearchData
    known_fits: SearchState
    constrained: Mapping[str, tuple[float, float]]
    search: Search
    begin: SearchState
    end: Outcome

    @property
    def hides_an_effect(self) -> bool:
        """True if nothing passed in the training part, though all data show that something is missing."""
        end = self.end
        return not (end.accepted or end.unconfirmed or end.stopped) and self.known_fits.whole.doubts.missing


def _searched(
    data: SearchData, options: dict[str, Any], given: Sequence[Candidate], clock: Clock
) -> _Searched:
    """Search on the training frames."""
    part, whole, constrained = known_model_fits(data, options)
    tests = Acceptance(data.record, ~data.train, clock, motion_time_scale(part), part.problem.free)
    known_fits = SearchState(part, whole, tests.errors(part))
    search = Search(tests, given)
    begin = _begin(search, known_fits)
    return _Searched(data, known_fits, constrained, search, begin, search.run(begin, known_fits))


def _answer(result: _Searched) -> Discovery:
    """Describe the end of a search, with its verdict."""
    data, search, end = result.data, result.search, result.end
    baseline, before = result.known_fits.whole, result.known_fits.errors
    final = refit(end.state.whole)
    reported = eased(final) if final.scatter > UNEXPLAINED else final
    reported = (
        replace(reported, unit_doubt=result.known_fits.part.unit_doubt).without_cache().with_diagnostics()
    )
    added = [
        replace(f, by_record=by_record(baseline, end.state.whole, f.effect, data.order)[0])
        for step in end.accepted
        for f in _describe(step, reported)
    ]
    others = [a for step in end.accepted for a in step.alternatives]
    is_incomplete = lacks_more(final, end.state.errors)
    excused = camera_shows(baseline, end.state.whole) if added and not end.stopped else None
    ratio = search.tests.improvement(before, end.state.errors) if added else (1.0, 1.0, 1.0)
    # Random forces predict nothing: only a law improves free runs that much.
    random = as_random(baseline, end.state.whole) if added and ratio[2] > FORETELLS else None
    unexplained = not added and (
        max(baseline.scatter, final.scatter) > UNEXPLAINED
        # Without this a wave of 1.6 Hz that only a random force imitates is "nothing missing".
        or not reported.doubts.tight
        or misses_the_motion(before, data.record, ~data.train)
        or is_incomplete
    )
    rejected: list[RejectedEffect] = end.unconfirmed
    stopped = end.stopped
    if unexplained and not rejected and end.rounds:
        try:
            search.clock.tell("trying the closest candidates")
            with search.clock.limited():
                rejected = search.rejected(result.begin, end.rounds[-1], data.order)
        except TimeUpError as up:
            stopped = stopped or str(up)
    doubtful = any(a.likeness < SAME for a in others)
    open_form = doubtful or is_incomplete or random is not None or excused is not None or unexplained
    held_out = int(data.record.part(~data.train).observed.sum())
    doubts = doubts_of(added, reported, ratio, held_out) if added else []
    return Discovery(
        verdict=verdict_of(added, bool(end.unconfirmed), doubts, open_form, bool(stopped)),
        baseline=baseline.without_cache().with_diagnostics() if added else reported,
        fit=reported,
        effects=added,
        alternatives=others,
        error_before=before,
        error_after=end.state.errors,
        ratio=ratio,
        scans=[sorted(scores.library.scored, key=lambda s: -s.chi2) for scores in end.rounds],
        curves=[scores.curves for scores in end.rounds],
        comparisons=[scores.comparisons for scores in end.rounds],
        split=data.split,
        trained=end.state.part.without_cache(),
        rejected=rejected,
        thinned=data.thin if any(part.every > 1 for part in data.thin) else [],
        budget=search.clock.budget if stopped else None,
        stopped=stopped,
        excused=None if excused is None else [f.title for f in added if f.effect.name in excused],
        random=random.doubts.missed if random else [],
        held_out=data.held_out_numbers,
        undetermined=tuple(result.constrained),
        doubts=doubts,
    )


def _begin(search: Search, start: SearchState) -> SearchState:
    """Return the start of the search: the known model's fit, or one with its drive and camera fixed.

    If the drive or the camera ran away, a strong effect is missing, and the free parameters would hide it.
    """
    if not (ran_away(start.part) or ran_away(start.whole)):
        return start
    # Without this a formula of the friction replaces a strong cubic drag.
    return attempted(search.tests.refitted, start, as_stated) or start


def _given(model: object, candidates: Iterable[tuple[str, Expression]]) -> list[Candidate]:
    """Make the user's own candidates."""
    listed = list(candidates)
    if isinstance(model, FormulaModel):
        return given_terms(model, listed)
    if listed:
        raise FitError(
            "candidates are for a model of your own; those of a disk and a pendulum come from the library"
        )
    return []


def _title(candidate: Candidate, fitted: Effect) -> str:
    """Return an effect's title for a reader: its candidate's, with the fitted frequency."""
    if fitted.spec.shaped:
        return fitted.title
    title = candidate.title
    for p in fitted.spec.parameters:
        if p.role == "frequency":
            tried, fitted_value = candidate.effect.parameters[p.name], fitted.parameters[p.name]
            for digits in (4, 3):
                title = title.replace(f" {tried:.{digits}g} ", f" {fitted_value:.4g} ")
    return title


def _describe(step: Step, final: Fit) -> list[AddedEffect]:
    """Describe the effects of a step, with the numbers of the fit to all data."""
    result, tests = [], step.result
    assert tests.witness is not None
    for candidate in step.candidates:
        effect = next(e for e in final.model.effects if e.name == candidate.effect.name)
        names = {p: f"{effect.name}.{p}" for p in effect.parameters}
        result.append(
            AddedEffect(
                effect=effect,
                title=_title(candidate, effect),
                equation=effect.equation,
                expression=effect.expression,
                parameters=dict(effect.parameters),
                errors={p: final.errors[name] for p, name in names.items() if name in final.errors},
                chi2=tests.chi2,
                p=tests.p,
                ratio=tests.ratio,
                witness=tests.witness,
                curve=step.curve,
                is_law=step.chosen.is_law,
                tried=candidate.title,
            )
        )
    return result
