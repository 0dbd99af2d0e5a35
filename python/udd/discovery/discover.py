"""The loop's second half: which effect the model lacks."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from udd._util import background_import
from udd._util.arguments import checked_arguments
from udd._util.expressions import Expression
from udd._util.parallel import parallel_map
from udd._util.progress import Progress, with_status
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.term_library import given_terms
from udd.discovery.symbolic.expressions import is_single_term
from udd.discovery.validation.by_record import by_record
from udd.discovery.validation.held_camera import camera_shows
from udd.discovery.validation.held_out_errors import lacks_more, misses_the_motion
from udd.discovery.validation.sensor_drift import FORETELLS, as_random
from udd.effects import Effect
from udd.errors import FitError
from udd.fitting import (
    UNEXPLAINED,
    Fit,
    as_stated,
    checked_units,
    continuous,
    eased,
    fit_record,
    options_of,
    ran_away,
    record_of,
    refit,
)
from udd.fitting.solve import SolveError
from udd.fitting.thinning import Thinned, thinned
from udd.fitting.time_scale import motion_time_scale
from udd.measurement import Measurement
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .acceptance import Acceptance, SearchState, Step
from .results import AddedEffect, Discovery, RejectedEffect
from .search import Search, both
from .thresholds import SAME
from .time_budget import Clock, TimeUpError
from .verdict import doubts_of, verdict_of

#: The share of the record that effects are sought in; the rest is held out.
TRAIN = 0.6
_SHORTEST = 20  # frames: of fewer the first part determines no model and the rest tests none


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
    """Forward stepwise selection of missing effects, by score tests and held-out data.

    *Candidates.* The model is fitted to the first 60 % of the record. A score test (Rao) ranks all effects of
    the library around that fit, and penalised splines of every coordinate. The best are fitted in full.
    Effects that fail alone are tried in twos.

    *Acceptance.* An effect is added if it passes these tests:

    - The fall of chi2 is significant at 0.1 % over all candidates (Bonferroni), in the first 60 % and in all
      data. In the latter the colour of the residuals counts.
    - Its amplitudes are physical.
    - The last 40 % confirm it. With all parameters fixed their cost falls (95 % interval of the ratio below
      1), or chi2 falls further by more than chance once they are fitted too. Where these frames carry too
      little information, each half of the record must confirm it beside the other.
    - Forecasts get worse at no horizon.
    - No slow drift of the sensor's zero explains as much.

    *Choice.* Of several forms that one is chosen which has the largest log evidence on all data, each at its
    own noise and model error. Splines over the likely coordinates, their formulas and a power with a free
    exponent compete with the library. What lies within 10 nats is named as an alternative. After an addition
    all coefficients are refitted, and the search goes on.

    *Verdict.* An effect is identified if it has no rival, is a law of one term, each of its constants is
    determined, the held-out gain has a size, and nothing else is missing; `Discovery.doubts` says what speaks
    against it. It is not identified either if random forces explain as much, such as those of a moving
    support (a disk's film excludes them). It is not confirmed if free runs over the last 40 % do not get
    significantly better, unless they are at the noise floor already. If nothing passes, but chi2 per degree
    of freedom exceeds 2.5 or free runs lose the motion, the model lacks an effect that these data do not
    name. The nearest candidates are listed with their held-out errors.

    Records of more than 8000 frames, of 2000 where inputs were measured, are averaged in blocks as far as
    their motion and noise allow.

    *Parameters* of the model that the data do not determine are held near their stated values, give or take
    as much, and the remarks say which.

    *Several records* share the model, and what is missing must be missing in all of them: the amplitudes of
    what was found are fitted to each record apart, and where one that could show the effect does not want it,
    it is not identified. Whole records can be held out instead of the last 40 % of each.

    Parameters
    ----------
    measurement : Measurement or sequence of Measurement
    model : Disk, Pendulum or a user's own Model, or a sequence of them
        The known model; its parameters are the start and the priors' means.
    free, camera, priors, each, state0
        As for :func:`udd.fit`.
    candidates : iterable of (str, formula)
        Terms to try in a user's own model beside those made of its states: the state in whose equation it
        stands and the term, as in ``("v", "abs(v)*v")``; of a model with a mass matrix also a force, as in
        ``("force(b - a)", "q^5")``.
    held_out : iterable of int, optional
        Of several measurements, the numbers (from 0) of those that no fit sees: they are the held-out data.
        Effects are sought in all frames of the others, and their cost on these alone confirms them. In names
        like ``W[0]`` the measurements held out count last.
    budget : float, optional
        Seconds after which the search ends with what it has, which the verdict then says. The known model's
        fit, which comes first, and the last one are made in any case.
    progress : bool or callable, optional
        True or None: show what is being done; False: nothing. A function gets it in words.

    Returns
    -------
    Discovery

    Raises
    ------
    FitError
        The record is too short, or the model cannot be fitted to it.

    Examples
    --------
    A pendulum that the air resists with the square of its speed; the model knows viscous friction only.

    >>> import numpy as np, udd
    >>> t = np.arange(0, 60, 0.05)
    >>> truth = udd.Pendulum(1.0, k0=0.01, effects=[udd.effects.quadratic_drag(c=0.05)])
    >>> theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    >>> noise = 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    >>> found = udd.discover(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0, k0=0.03))
    >>> [effect.title for effect in found.effects]
    ['quadratic drag']
    """
    assert callable(progress)
    clock = Clock(budget, progress)
    options = options_of(free, camera, priors, each)
    order, apart = _held_out(measurement, held_out)
    if apart and (each is not None or any("[" in name for name in priors or {})):
        raise FitError(
            "held_out cannot go with each, or with priors of single records: "
            "nothing would determine what only a record that is held out has"
        )
    if apart:
        measurement, model, state0 = (_ordered(one, order) for one in (measurement, model, state0))
    thin = _thinned(continuous(measurement, model), model)
    measurement = [own.measurement for own in thin]
    if len(measurement) == 1:
        measurement, model, state0 = measurement[0], _only(model), _only(state0)
    record = record_of(measurement, model, state0)
    one = _first(model)
    given = _given(one, candidates)
    n = len(record.t)
    if n < _SHORTEST:
        raise FitError(f"the record has {n} frames; to find an effect and test it takes at least {_SHORTEST}")
    train = ~np.isin(record.film, range(len(order) - apart, len(order))) if apart else record.first(TRAIN)
    clock.finish("fitting the known model")
    background_import.importing("scipy.stats", "pyoperon.sklearn")

    near: dict[str, tuple[float, float]] = {}

    def fits() -> tuple[Fit, ...]:
        parts = (record.part(train), *(() if apart else (record,)))
        while True:
            options["priors"] = {**near, **(priors or {})}
            try:
                return tuple(
                    parallel_map(
                        lambda some: fit_record(measurement, some, model, **options, search=True), parts
                    )
                )
            except SolveError as error:
                more = _near_the_stated(model, error.undetermined, options["priors"])
                if not more:
                    raise
                near.update(more)

    # Where whole records are held out, all data that a fit may see are those that effects are sought in.
    base, *others_too = checked_units(measurement, model, options, fits)
    baseline = others_too[0] if others_too else base
    tests = Acceptance(record, ~train, clock, motion_time_scale(base), base.problem.free)
    search = Search(tests, given)
    before = search.tests.errors(base)
    known = SearchState(base, baseline, before)
    begin = _begin(search, known)
    end = search.run(begin, known)
    clock.finish("fitting the model as found")
    final = refit(end.whole)
    told = eased(final) if final.scatter > UNEXPLAINED else final
    told = replace(told, unit_doubt=base.unit_doubt).without_cache().doubted()
    found = [
        replace(f, by_record=by_record(baseline, end.whole, f.effect, order)[0])
        for step in end.accepted
        for f in _describe(step, told)
    ]
    others = [a for step in end.accepted for a in step.alternatives]
    doubtful = [a for a in others if a.likeness < SAME]
    left = bool(found) and lacks_more(final, end.errors)
    excused = camera_shows(known.whole, end.whole) if found and not end.stopped else None
    ratio = search.tests.improvement(before, end.errors) if found else (1.0, 1.0, 1.0)
    # Random forces foretell nothing: what makes free runs so much better is a law.
    random = as_random(baseline, end.whole) if found and ratio[2] > FORETELLS else None
    unexplained = not found and (
        max(baseline.scatter, final.scatter) > UNEXPLAINED
        or misses_the_motion(before, record, ~train)
        or lacks_more(final, end.errors)
    )
    rejected: list[RejectedEffect] = end.unconfirmed
    stopped = end.stopped
    if unexplained and not rejected and end.rounds:
        try:
            clock.tell("trying what comes nearest")
            rejected = search.rejected(begin, end.rounds[-1], order)
        except TimeUpError as up:
            stopped = stopped or str(up)
    open_form = doubtful or left or random or excused is not None or unexplained
    doubts = doubts_of(found, told, ratio, int(record.part(~train).observed.sum())) if found else []
    verdict = verdict_of(found, bool(end.unconfirmed), doubts, bool(open_form), bool(stopped))
    return Discovery(
        verdict=verdict,
        baseline=baseline.without_cache().doubted() if found else told,
        fit=told,
        effects=found,
        alternatives=others,
        error_before=before,
        error_after=end.errors,
        ratio=ratio,
        scans=[sorted(one.library.scored, key=lambda s: -s.chi2) for one in end.rounds],
        curves=[one.curves for one in end.rounds],
        comparisons=[one.comparisons for one in end.rounds],
        split=float(record.clock[np.flatnonzero(~(record.first(TRAIN) if apart else train))[0]]),
        trained=end.part.without_cache(),
        rejected=rejected,
        thinned=thin if any(own.every > 1 for own in thin) else [],
        budget=clock.budget if stopped else None,
        stopped=stopped,
        excused=None if excused is None else [f.title for f in found if f.effect.name in excused],
        random=random.doubts.missed if random else [],
        held_out=tuple(sorted(order[len(order) - apart :])),
        undetermined=tuple(near),
        doubts=doubts,
    )


def _near_the_stated(
    model: Model | Sequence[Model], names: Iterable[str], priors: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """Priors of parameters that have none: what was stated, give or take as much."""
    result = {}
    for label in sorted(names):
        name, _, film = label.partition("[")
        own = model if isinstance(model, Model) else model[int(film.rstrip("]") or 0)]
        value = own.parameters.get(name, 0.0)
        if value and not {label, name} & set(priors):
            result[label] = (value, abs(value))
    return result


def _held_out(
    measurement: Measurement | Sequence[Measurement], held_out: Iterable[int] | None
) -> tuple[list[int], int]:
    """The measurements' numbers, those to be held out last, and how many these are.

    Raises
    ------
    FitError
        Numbers that there are not, or none that is left to fit.
    """
    number = len(measurement) if isinstance(measurement, (list, tuple)) else 1
    if held_out is None:
        return list(range(number)), 0
    try:
        last = sorted({operator.index(one) for one in held_out})
    except TypeError:
        raise FitError(
            f"held_out must be a list of the measurements' numbers, as in held_out=[2], not {held_out!r}"
        ) from None
    if not last or not 0 <= last[0] <= last[-1] < number or len(last) == number:
        raise FitError(
            f"held_out must name some of the measurements 0 to {number - 1}, but not all, not {last}"
            if number > 1
            else "held_out takes several measurements: of one its last part is held out"
        )
    return [k for k in range(number) if k not in last] + last, len(last)


def _ordered(one: Any, order: Sequence[int]) -> Any:
    """A list for several measurements in another order; what is one for all as it is."""
    return [one[k] for k in order] if isinstance(one, (list, tuple)) and len(one) == len(order) else one


def _only(one: Any) -> Any:
    """What is in a list of one thing; all else as it is."""
    return one[0] if isinstance(one, (list, tuple)) and len(one) == 1 else one


def _first(models: Any) -> Any:
    """The first of a list of models, None of an empty one; a model alone as it is."""
    return next(iter(models), None) if isinstance(models, (list, tuple)) else models


def _thinned(
    measurement: Measurement | Sequence[Measurement], model: Model | Sequence[Model]
) -> list[Thinned]:
    """The measurements, those that were sampled more often than their motion needs by block averages."""
    some: list[Measurement] = [measurement] if isinstance(measurement, Measurement) else []
    if isinstance(measurement, (list, tuple)):
        some = list(measurement)
    if not some or not all(isinstance(own, Measurement) for own in some):
        record_of(measurement, model)  # which says what is wrong
    return [thinned(own) for own in some]


def _begin(search: Search, known: SearchState) -> SearchState:
    """Where the search begins: the known model's fit, but for one whose drive or camera ran away.

    There a strong effect is missing, and what else could be free bends until it hides what that is.
    """
    if not (ran_away(known.part) or ran_away(known.whole)):
        return known
    # Without this a strong cubic drag is taken for a formula of the friction.
    try:
        part, whole = both(as_stated, known.part, known.whole)
        return SearchState(part, whole, search.tests.errors(part))
    except FitError:
        return known


def _given(model: Model, candidates: Iterable[tuple[str, Expression]]) -> list[Candidate]:
    """The user's own candidates."""
    listed = list(candidates)
    if isinstance(model, FormulaModel):
        return given_terms(model, listed)
    if listed:
        raise FitError(
            "candidates can be given for a model of your own; a disk's and a pendulum's are the library's"
        )
    return []


def _title(candidate: Candidate, fitted: Effect) -> str:
    """What a reader calls an effect: its candidate's title, with the frequency that was fitted."""
    if fitted.spec.shaped:
        return fitted.title
    title = candidate.title
    for p in fitted.spec.parameters:
        if p.role == "frequency":
            tried, found = candidate.effect.parameters[p.name], fitted.parameters[p.name]
            for digits in (4, 3):
                title = title.replace(f" {tried:.{digits}g} ", f" {found:.4g} ")
    return title


def _describe(step: Step, final: Fit) -> list[AddedEffect]:
    """The effects of a step, with the numbers of the fit to all data."""
    result = []
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
                chi2=step.chi2,
                p=step.p,
                ratio=step.ratio,
                witness=step.witness,
                curve=step.curve,
                is_law=step.curve is None or (step.formula is not None and is_single_term(step.formula.node)),
                tried=candidate.title,
            )
        )
    return result
