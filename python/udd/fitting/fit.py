"""The fit of a model to a measurement: weak-constraint multiple shooting."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd.effects import Effect, Parameter
from udd.errors import FitError, outside
from udd.measurement import Measurement
from udd.models import Model, profile_of
from udd.models.formula_model import FormulaModel

from .continuous import continuous
from .estimator_input import FilmParameters
from .formula_models import driven, levels_of
from .input_noise import LEVELS_APART, diffusion_by_noise
from .model_error_schedule import ANY, FEW, LEAP, ROUGH, Goal, provisional_fit, reduce_model_error
from .noise import estimated, stated
from .parameters import Free, free_parameters, known_camera, names_of
from .problem import FOLLOWS, Fit, Point, Problem, levels
from .record import Record, record_of
from .sensor import is_encoder
from .solve import MOST, SolveError, solve
from .units import Scale, ask, drive_seen, other_unit

_NOISE_ROUNDS = 12
_FAR = 10.0  # standard deviations from what was stated: the fit is one of something else
#: chi2 per degree of freedom above which a model does not explain its data, whatever it lacks.
UNEXPLAINED = 2.5
_OFF = 3.0  # times the drive that was stated: more than what is missing does
_PACE = 2.0  # times a pendulum's stated ratio of length to inertia
#: Of what a camera's noise is taken to be: computed motion has none, and would weigh without bound.
_FINEST = 1e-3
_BELIEVED = 3.0  # a measurement's own errors are good to this factor; what is larger is the model's fault

#: What misfits show: the noise, next to nothing where the states follow every frame, or the model's faults.
Misfits = Literal["noise", "little", "faults"]


@checked_arguments(error=FitError)
def fit(
    measurement: Measurement | Sequence[Measurement],
    model: Model | Sequence[Model],
    free: Iterable[str] | None = None,
    *,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
    each: Iterable[str] | None = None,
    state0: Mapping[str, float] | Sequence[Mapping[str, float]] | None = None,
) -> Fit:
    """Fit a model to measured motion.

    Unknown are the state at every frame, the model's free parameters and the camera's; minimised is the sum
    of the squared misfits in units of the noise and of the squared model errors in units of an assumed one,
    which is lowered in steps (weak-constraint multiple shooting). No data are differentiated, and chaotic
    records of any length can be fitted. The model's time counts from the measurement's first row.

    Parameters
    ----------
    measurement : Measurement or sequence of Measurement
        Of the disk (``Y, Z, beta``) or of a pendulum (``theta``), or of states of a user's own model, by
        their names. Several are fitted jointly: they share the device's parameters.
    model : Disk, Pendulum or a user's own Model, or a sequence of them
        Its parameters are the start and the priors' means. For several measurements one each, alike but for
        their parameters' values, or one for all.
    free : iterable of str, optional
        Names of the model's free parameters; by default ``k0, k1, k2, W`` (with a prior of 5 %) of a disk,
        ``k0, length, inertia`` of a pendulum, and the amplitudes of all effects; all of a user's own model.
    camera : bool or iterable of str
        Whether the camera's parameters are free (pivot ``y0, z0``, ``tilt``, ``scale``, the marks' centre
        ``right, up`` of the disk's, ``lag`` of the orientation, ``row`` time of a rolling shutter,
        ``shutter`` for means over an exposure, ``lens``, ``clock``; of a pendulum ``theta0, aside, above``),
        or which of them. Of a pendulum that an encoder read only the zero ``theta0`` is:
        the measurement says ``sensor = encoder`` (in its `meta`, or a line of its file), or its angles come
        in steps that drown all other noise.
    priors : mapping of str to (mean, standard deviation), optional
        Replaces the default priors.
    each : iterable of str, optional
        The model's parameters that every measurement has a value of its own of; by default the drive ``W``.
        They are called ``W[0]``, ``W[1]`` ... then, as the camera's are.
    state0 : mapping of str to float, optional
        Where states of your own model that are not seen start, by their names; of several measurements also a
        list of such tables. The search for them begins with the motion from there, driven by what was seen.
        Without it a state begins at the rate, or the integral, of what is seen; one whose law is undefined or
        flat below zero at the size of what is seen; any other at zero.

    Returns
    -------
    Fit
        Its ``summary()`` says first whether something is missing: how large an error of the model the record
        needed beside what a right one needs, whether the innovations are white, what ran off. Where
        something is, the standard errors contain that. If another unit explains the record far better, a
        warning says so, and the fit is that of the numbers as stated.

    Raises
    ------
    FitError
        The measurement does not suit the model, is too short, or does not determine the parameters; or its
        numbers cannot be in s, m and rad.

    Examples
    --------
    >>> import numpy as np, udd
    >>> t = np.arange(0, 20, 0.05)
    >>> truth = udd.Pendulum(1.0, k0=0.02)
    >>> theta = udd.simulate(truth, t, [0.0, 0.5]).state[:, 1]
    >>> rng = np.random.default_rng(1)
    >>> measured = udd.Measurement(t, {"theta": theta + 1e-3 * rng.standard_normal(len(t))})
    >>> result = udd.fit(measured, udd.Pendulum(1.0, k0=0.1), free=["k0"])
    >>> bool(abs(result.parameters["k0"] - 0.02) < 4 * result.errors["k0"])
    True
    """
    measurement = continuous(measurement, model)
    record = record_of(measurement, model, state0)
    options = options_of(free, camera, priors, each)
    (found,) = checked_units(
        measurement, model, options, lambda: (fit_record(measurement, record, model, **options),)
    )
    return found.without_cache().doubted()


def options_of(
    free: Iterable[str] | None,
    camera: bool | Iterable[str],
    priors: Mapping[str, tuple[float, float]] | None,
    each: Iterable[str] | None,
) -> dict[str, Any]:
    """What a user may say of a fit's parameters, to be read more than once."""
    lists = {
        "free": None if free is None else names_of("free", free),
        "camera": camera if isinstance(camera, bool) else names_of("camera", camera),
        "each": None if each is None else names_of("each", each),
    }
    if not (priors is None or isinstance(priors, Mapping)):
        raise FitError(f"priors must be a mean and a standard deviation by name, not {priors!r:.80}")
    return {**lists, "priors": priors}


def fit_record(
    measurement: Measurement | Sequence[Measurement],
    record: Record,
    model: Model | Sequence[Model],
    free: Iterable[str] | None = None,
    *,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
    each: Iterable[str] | None = None,
    search: bool = False,
) -> Fit:
    """As :func:`fit`, of some of the measurement's frames.

    For a search the model is held as tightly as it can be, within what a film allows.
    """
    measurements = (measurement,) if isinstance(measurement, Measurement) else tuple(measurement)
    models = _models(model, measurements)
    kind, profile = models[0].kind, models[0].profile
    zero = profile.sensor.zero
    if camera is True and zero is not None and all(is_encoder(own) for own in measurements):
        camera = (zero,)  # and no perspective
    parameters = free_parameters(models, free, camera, priors, each)
    if isinstance(models[0], FormulaModel):
        schedule = levels_of(models[0], record.t, record.states, record.sigma, record.linked)
    else:
        schedule = levels(kind)[: profile.fit.searched if search else None]
    problem = Problem(models, record, parameters, stated(record), schedule, schedule[0], not search)
    point = _start(models, measurements, record)
    if search and models[0].inputs:  # a fit finds out by itself how tightly the model is held
        problem = _with_input_noise(measurements, problem, point)
    return _anneal(measurements, problem, point)


def _with_input_noise(measurements: tuple[Measurement, ...], problem: Problem, point: Point) -> Problem:
    """The problem with the noise of inputs as a part of the model's error.

    Not where the inputs have none: then the model's likeliest error is far below what it would make.
    """
    # Without this a driven machine that lacks nothing gets a formula, and one with dry friction a wave.
    noise = diffusion_by_noise(problem.models, problem.record)
    moved = noise > 0.0
    if not moved.any():
        return problem
    try:
        found = _anneal(measurements, replace(problem, likeliest=True), point)
        if (np.array(found.problem.diffusion)[moved] < noise[moved] / LEVELS_APART).any():
            return problem
    except SolveError:
        pass  # which says nothing of the noise
    schedule = tuple(tuple(np.hypot(level, noise).tolist()) for level in problem.schedule)
    return replace(problem, schedule=schedule, diffusion=schedule[0])


def astray(fitted: Fit) -> bool:
    """Whether a fit explains so little, or is so far from what was stated, that a unit may be wrong.

    An effect that is missing does as much: :func:`udd.fitting.units.other_unit` tells the two apart.
    """
    pairs = zip(fitted.models, fitted.problem.models, strict=True)
    return fitted.scatter > UNEXPLAINED or ran_away(fitted) or any(_pace_is_off(*pair) for pair in pairs)


def ran_away(fitted: Fit) -> bool:
    """Whether the drive or the camera of a fit came out where no drive and no camera is.

    A strong effect that is missing does that: the fit then makes up for it with a clock that is off by a
    third, or with a drive a fifth of the stated.
    """
    stated = fitted.model.profile.fit.stated
    parts = [f for f in fitted.problem.free if f.role != "model" or f.name.partition("[")[0] in stated]
    return any(abs(fitted.point.value(f) - f.mean) > _FAR * f.sd for f in parts)


def _pace_is_off(found: Model, known: Model) -> bool:
    """Whether the motion has another pace than stated by far, as a pendulum's swings may."""
    pace = known.profile.fit.pace
    if pace is None:
        return False
    ratio = pace(found.parameters) / pace(known.parameters)
    return not 1 / _PACE < ratio < _PACE


def _drive_is_off(measurement: Measurement, model: Model) -> bool:
    """Whether the frames alone show another drive than stated by far."""
    fit, name = model.profile.fit, model.profile.dynamics.drive
    if fit.drive_seen is None or name is None or measurement.kind != model.kind or not model.parameters[name]:
        return False
    return not 1 / _OFF < drive_seen(measurement) / model.parameters[name] < _OFF


def checked_units(
    measurement: Measurement | Sequence[Measurement],
    model: Model | Sequence[Model],
    options: Mapping[str, Any],
    fits: Callable[[], tuple[Fit, ...]],
) -> tuple[Fit, ...]:
    """Fits of a measurement, with a word on whether its numbers may be in another unit than stated.

    Parameters
    ----------
    measurement, model
        As for :func:`fit`.
    options : mapping
        Its ``free``, ``camera``, ``priors`` and ``each``.
    fits : callable
        Makes the fits.

    Returns
    -------
    tuple of Fit
        Of which :attr:`Fit.unit_doubt` says if another unit explains the measurement far better. A warning
        says so too.

    Raises
    ------
    FitError
        Numbers that cannot be in s, m and rad; or what `fits` raises.
    """
    measurements = (measurement,) if isinstance(measurement, Measurement) else tuple(measurement)
    models = _models(model, measurements)
    free = options["free"]
    free_parameters(models, **options)  # which says what is wrong with them
    ask(measurements, models)
    unknown = models[0].profile.fit.unknown
    left = [name for name in unknown if free is None or name in free]
    asked: list[str | None] = []

    def check(ends: Sequence[Sequence[Model]] = ()) -> None:
        if asked or not unknown:
            return
        asked.append(other_unit(measurements, models, ends, partial(_loosest, left)))
        if asked[0]:
            warnings.warn(f"{asked[0]}; the fit goes on as stated", stacklevel=outside())

    if any(_drive_is_off(*pair) for pair in zip(measurements, models, strict=True)):
        check()
    try:
        found = fits()
    except SolveError as error:
        check()
        if asked and asked[0]:  # which is why, most probably
            raise FitError(f"{error}; {asked[0]}") from error
        raise
    if any(astray(one) for one in found):
        check([one.models for one in found])
    return tuple(replace(one, unit_doubt=asked[0]) for one in found) if asked and asked[0] else found


def _loosest(
    free: Sequence[str],
    record: Record,
    measurements: Sequence[Measurement],
    models: Sequence[Model],
    start: Sequence[Model],
    scale: Scale,
    fixed: frozenset[str],
) -> Fit:
    """The fit of a model with a large model error, its drive and the camera as stated."""
    profile = models[0].profile
    some = [name for name in free if name not in fixed]
    parameters = free_parameters(models, some, profile.sensor.pivot, each=())
    size = scale.sizes(models[0].state_names)
    loose = [np.array(level) * size for level in levels(models[0].kind)[profile.fit.hardly :][:1]]
    schedule = tuple(tuple(level.tolist()) for level in loose)
    problem = Problem(
        tuple(models), record, parameters, stated(record), schedule, schedule[0], likeliest=False
    )
    point = _start(start, measurements, record)
    return _anneal(tuple(measurements), problem, point)


def _start(models: Sequence[Model], measurements: Sequence[Measurement], record: Record) -> Point:
    """The states as they were read, all parameters as they are known."""
    sets = tuple(
        FilmParameters(list(own.parameters.values()), known_camera(own.kind, film.meta), 0.0)
        for own, film in zip(models, measurements, strict=True)
    )
    return Point(record.states, sets)


def _models(model: Model | Sequence[Model], measurements: Sequence[Measurement]) -> tuple[Model, ...]:
    """One model per measurement, alike but for their numbers."""
    models = tuple(model) if isinstance(model, Sequence) else (model,) * len(measurements)
    if len(models) != len(measurements):
        raise FitError(f"there are {len(measurements)} measurements but {len(models)} models")
    for own, measurement in zip(models, measurements, strict=True):
        if not isinstance(own, Model):
            raise FitError(f"a model is needed (udd.Disk, udd.Pendulum, udd.Model), not {own!r}")
        if not own.profile.written and measurement.kind != own.kind:
            raise FitError(
                f"the measurement has columns {', '.join(measurement.names)}, "
                f"which {type(own).__name__} does not explain"
            )
        if list(own.parameters) != list(models[0].parameters):
            raise FitError(
                "the models of several measurements must be alike but for their parameters' values"
            )
    written = [own for own in models if isinstance(own, FormulaModel)]
    return driven(written, measurements) if written and written[0].inputs else models


def widened(fitted: Fit, effects: Sequence[Effect], start: Fit | None = None) -> tuple[Problem, Point]:
    """The problem of a fit with more effects, held as they are, and where that fit ended.

    Or where another fit of the same data ended.
    """
    models = tuple(own.with_effects((*own.effects, *effects)) for own in fitted.models)
    known = len(fitted.model.parameters)
    more = [value for effect in effects for value in effect.values]
    end = (start or fitted).point
    sets = tuple(
        FilmParameters([*values[:known], *more], camera, clock) for values, camera, clock in end.sets
    )
    return replace(fitted.problem, models=models), Point(end.states, sets)


def started_at(fitted: Fit, last: Fit, seen: NDArray[np.bool_] | None = None) -> Fit:
    """A fit to be gone on from where another one ended, of more effects perhaps, with as much free as there.

    `seen` is the part of the data that it was of, if not of all. The states of the rest start as they were
    read.
    """
    known = len(fitted.model.parameters)
    free = tuple(f for f in last.problem.free if f.role != "model" or f.index < known)
    sets = tuple(FilmParameters(values[:known], camera, clock) for values, camera, clock in last.point.sets)
    states = fitted.record.states.copy()
    states[slice(None) if seen is None else seen] = last.states
    return replace(fitted, problem=_with_free(fitted, free), point=Point(states, sets))


def extend(fitted: Fit, effects: Sequence[Effect], amplitudes: Sequence[float], goal: Goal = ANY) -> Fit:
    """Fit again with more effects, all coefficients free, from where a fit ended.

    The noise stays as it was estimated, so that the two fits' chi2 compare. A frequency is free within its
    line; a shape that may have any value is, once the rest has been found, within a factor of some two, or
    a place by about the width that belongs to it.

    Parameters
    ----------
    fitted : Fit
    effects : sequence of Effect
        The effects to add.
    amplitudes : sequence of float
        Where their amplitudes start, in order.
    goal : Goal
        What the fit must reach to be of use.
    """
    left = list(amplitudes)
    effects = [e.replace(**{p: left.pop(0) for p in e.amplitudes}) for e in effects]
    problem, point = widened(fitted, effects)
    order = list(problem.models[0].parameters)
    names = [f"{e.name}.{p}" for e in effects for p in e.amplitudes]
    line = 0.5 / float(np.ptp(fitted.record.t))
    more = tuple(Free(name, "model", order.index(name), 0.0, np.inf) for name in names)
    own = [(e, p) for e in effects for p in e.spec.parameters if p.sought]
    waves = [(f"{e.name}.{p.name}", e.parameters[p.name]) for e, p in own if p.role == "frequency"]
    shapes = [
        (f"{e.name}.{p.name}", e.parameters[p.name], _spread(e, p))
        for e, p in own
        if p.role in ("shape", "scanned")
    ]
    more += tuple(Free(name, "model", order.index(name), f, line) for name, f in waves)
    problem = replace(problem, free=problem.free + more)
    first = replace(goal, chi2=np.inf) if shapes else goal  # which is lower once the shapes are free
    found = reduce_model_error(fitted.measurements, problem, point, problem.schedule[1:], goal=first)
    if not shapes:
        return found
    more = tuple(Free(name, "model", order.index(name), value, sd) for name, value, sd in shapes)
    problem = replace(problem, free=problem.free + more)
    if found.level > 1:
        try:
            tight = problem.schedule[found.level :]
            shaped = reduce_model_error(fitted.measurements, problem, found.point, tight, goal=goal)
            if shaped.converged:
                return shaped
        except FitError:
            pass
    # Far from its shape a model that is held that tightly does not find the way.
    return reduce_model_error(fitted.measurements, problem, found.point, problem.schedule[1:], goal=goal)


def _spread(effect: Effect, parameter: Parameter) -> float:
    """The standard deviation of the prior of a shape, or of a place: as far as the next that a scan tries."""
    widths = [effect.parameters[p.name] for p in effect.spec.parameters if p.role == "shape"]
    if parameter.role == "scanned" and widths:
        return widths[0]
    return abs(effect.parameters[parameter.name])


def as_stated(fitted: Fit) -> Fit:
    """Fit anew with the drive and the camera, but for the pivot, held as they were stated; for a search."""
    profile = fitted.model.profile

    def kept(free: Free) -> bool:
        name = free.name.partition("[")[0]
        if free.role == "model":
            return name not in profile.fit.stated
        return free.role == "camera" and name in profile.sensor.pivot

    free = tuple(one for one in fitted.problem.free if kept(one))
    problem = replace(fitted.problem, free=free, noise=stated(fitted.record))
    start = _start(problem.models, fitted.measurements, fitted.record)
    return _anneal(fitted.measurements, problem, start)


def released(fitted: Fit, free: Sequence[Free]) -> Fit:
    """The same with more parameters free, those of effects that were added to the model beside them.

    From the largest model error on: held tightly, chaos has a minimum near every value that they had.
    """
    # Without this a load-dependent drive is followed by a slip that is not there.
    problem = _with_free(fitted, free)
    return reduce_model_error(fitted.measurements, problem, fitted.point, problem.schedule)


def released_anew(fitted: Fit, free: Sequence[Free]) -> Fit:
    """As :func:`released`, with the noise estimated anew: around a model that went astray it hardly shows."""
    problem = replace(_with_free(fitted, free), noise=stated(fitted.record))
    return _anneal(fitted.measurements, problem, fitted.point)


def _with_free(fitted: Fit, free: Sequence[Free]) -> Problem:
    known = {f.name for f in free}
    added = tuple(f for f in fitted.problem.free if f.name not in known)
    return replace(fitted.problem, free=(*free, *added))


def refit(fitted: Fit, *, trusted: bool = False) -> Fit:
    """The same model fitted again, the noise estimated anew, and held as tightly as is likeliest.

    In a search the noise stays as the first model showed it, so that chi2 compares. The noise of a film whose
    geometry is not `trusted` stays as it was assumed.
    """
    schedule = levels(fitted.model.kind) or fitted.problem.schedule
    problem = replace(fitted.problem, schedule=schedule, likeliest=True)
    misfits: Misfits = "little"
    point = fitted.point
    try:
        if trusted or not _least(fitted.measurements, search=True) > _FINEST:
            misfits, problem, point = _estimate_noise(fitted.measurements, problem, point)
        if misfits != "noise":
            problem, point = replace(fitted.problem, schedule=problem.schedule), fitted.point
        result = reduce_model_error(fitted.measurements, problem, point, problem.schedule[fitted.level :])
    except SolveError:  # as where a threshold ends at zero, and beyond
        return fitted
    return result if result.converged else fitted


def _anneal(measurements: tuple[Measurement, ...], problem: Problem, point: Point) -> Fit:
    """Solve from loose to tight.

    The noise is estimated at the loosest level at which the misfits still show it, where a wrong model does
    the least harm, and again at the last one if the model gets there. At looser ones the states follow every
    frame, and noise and model error cannot be told apart.
    """
    as_stated, first = problem.noise, point
    for number, diffusion in enumerate(problem.schedule):
        problem = replace(problem, diffusion=diffusion, noise=as_stated)
        misfits, problem, point = _estimate_noise(measurements, problem, point)
        if misfits == "faults":
            break  # held more tightly, they show even more of them
        if misfits == "noise":
            loose = provisional_fit(measurements, problem, point)
            # Of a pendulum's film a search does not believe what the noise is to better than its geometry.
            if problem.likeliest or not profile_of(measurements[0].kind).sensor.faithful:
                loose = _likeliest_noise(loose, problem.schedule[number + 1 :])
            tighter = problem.schedule[loose.level + 1 :]
            if not tighter:
                return loose
            return reduce_model_error(measurements, loose.problem, _afresh(loose), tighter, loose)
    # A film so precise that its noise never shows, or shows less than the model's faults, is believed.
    believed = as_stated.everywhere(len(problem.record.t))
    return reduce_model_error(measurements, replace(problem, noise=believed), first, problem.schedule)


def _likeliest_noise(fitted: Fit, tighter: Sequence[tuple[float, ...]]) -> Fit:
    """The fit of the last level with the noise estimated there, if that is likelier all the way.

    Where the states still follow the frames the noise comes out too small, and a right model would then be
    found wanting. A right model takes several levels at once; of one that does not get to the last the noise
    stays as it was found.
    """
    # Without this a plain disk seen to 0.1 mm and 1 mrad is said to lack something.
    found, left = fitted, list(tighter)
    while left:
        ahead = min(LEAP, len(left))
        further = (_likelier(found, left[k - 1]) for k in dict.fromkeys((ahead, 1)))
        one = next(filter(None, further), None)
        if one is None:
            return fitted
        found, left = one, left[left.index(one.problem.diffusion) + 1 :]
    return found


def _likelier(fitted: Fit, diffusion: tuple[float, ...]) -> Fit | None:
    """The fit held as tightly, with the noise estimated there, if that makes the record likelier."""
    problem = fitted.problem.with_model_error(diffusion)
    try:
        misfits, problem, point = _estimate_noise(fitted.measurements, problem, _afresh(fitted), FEW)
        if misfits != "noise":
            return None
        found = provisional_fit(fitted.measurements, problem, point, FEW)
    except FitError:
        return None
    return found if found.converged and found.evidence > fitted.evidence else None


def _afresh(fitted: Fit) -> Point:
    """The states of a fit, with those of the model's parameters that have a prior at its mean.

    Where states follow the frames a law that bends with the speed, as the friction's does, may come out
    flat, and would then stay so.
    """
    sets = [FilmParameters([*values], camera, clock) for values, camera, clock in fitted.point.sets]
    for free in fitted.problem.free:
        if free.role == "model" and np.isfinite(free.sd):
            for values, _camera, _clock in sets if free.film is None else [sets[free.film]]:
                values[free.index] = free.mean
    return Point(fitted.states, tuple(sets))


def _is_known(measurement: Measurement) -> bool:
    """Whether the noise is known beforehand: stated, or as the frames of a sensor show it."""
    return measurement.sigma is not None or profile_of(measurement.kind).written or is_encoder(measurement)


def _least(measurements: Sequence[Measurement], search: bool) -> float:
    """What the noise is at least, in units of what is known beforehand."""
    result = 0.0 if profile_of(measurements[0].kind).written else _FINEST
    for own in measurements:
        least = profile_of(own.kind).sensor.faithful
        if least and is_encoder(own):
            return 1.0
        if search and own.sigma is None:
            result = max(result, least)
    return result


def _estimate_noise(
    measurements: tuple[Measurement, ...], problem: Problem, point: Point, steps: int = MOST
) -> tuple[Misfits, Problem, Point]:
    """Fit and estimate the noise in turns; what the misfits show, and what was found.

    A model that does not get there in so many `steps` is wrong.
    """
    known = all(_is_known(own) for own in measurements)
    least = _least(measurements, search=not problem.likeliest)
    for _ in range(_NOISE_ROUNDS):
        result = solve(measurements, problem, point, steps, decrease=ROUGH)
        point, before = result.point, problem.noise
        if steps < MOST and not result.converged:
            return "faults", problem, point
        if result.leverage > FOLLOWS:
            return "little", problem, point
        noise = estimated(problem.record, result.blurring, result.misfit, result.misfit_variance, before)
        if known and noise.beyond(problem.record, result.blurring, _BELIEVED):
            return "faults", problem, point
        noise = replace(noise, factor=np.maximum(noise.factor, least))
        problem = replace(problem, noise=noise)
        if before.like(noise, problem.record, result.blurring):
            break
    return "noise", problem, point
