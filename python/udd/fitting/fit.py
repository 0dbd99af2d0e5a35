"""Fit a model to a measurement by weak-constraint multiple shooting."""

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
from .input_noise import LEVEL_RATIO, diffusion_by_noise
from .model_error_schedule import (
    ANY,
    FEW,
    LEAP,
    NAT,
    ROUGH,
    Goal,
    eased,
    provisional_fit,
    reduce_model_error,
    with_negligible_model_error,
)
from .noise import estimated, stated
from .parameters import Free, free_parameters, known_camera, names_of
from .problem import FOLLOWS, Fit, Point, Problem, levels
from .record import Record, record_of
from .sensor import is_encoder
from .solve import MOST, SolveError, solve
from .units import Scale, ask, drive_seen, other_unit

_NOISE_ROUNDS = 12
_RUNAWAY_SD = 10.0  # standard deviations from the given value: the fit describes another device
#: chi2 per degree of freedom above which a model does not explain its data, whatever it lacks.
UNEXPLAINED = 2.5
_MAX_DRIVE_RATIO = 3.0  # ratio to the given drive that no missing effect explains
_MAX_FREQUENCY_RATIO = 2.0  # ratio to a pendulum's given length over inertia
#: Lower limit of the noise, as a share of a camera's assumed noise: computed motion has no noise, and its
#: weights would have no bound.
_FINEST = 1e-3
# factor by which a measurement's stated errors may be too small; a larger misfit is the model's fault
_BELIEVED = 3.0

#: Source of the misfits: the noise; almost nothing, because the states follow every frame; or the model's
#: faults.
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

    The unknowns are the state at every frame, the model's free parameters and the camera's. The fit minimises
    the squared misfits in units of the noise, plus the squared model errors in units of an assumed model
    error. It reduces that assumed error in steps (weak-constraint multiple shooting). No data are
    differentiated, and chaotic records of any length can be fitted. The model's time counts from the
    measurement's first row.

    Parameters
    ----------
    measurement : Measurement or sequence of Measurement
        Motion of the disk (``Y, Z, beta``), of a pendulum (``theta``), or of states of a user's own model, by
        name. Several measurements are fitted jointly: they share the device's parameters.
    model : Disk, Pendulum or a user's own Model, or a sequence of them
        Its parameters are the start values and the means of the priors. With several measurements: one model
        for all, or one for each that differs only in parameter values.
    free : iterable of str, optional
        Names of the model's free parameters. Default: ``k0, k1, k2, W`` (with a prior of 5 %) for a disk,
        ``k0, length, inertia`` for a pendulum, and the amplitudes of all effects. For a user's own model all
        parameters.
    camera : bool or iterable of str
        True if the camera's parameters are free, or the names of the free ones. A disk has the pivot ``y0,
        z0``, ``tilt``, ``scale``, the marks' centre ``right, up`` relative to the disk's, ``lag`` of the
        orientation, ``row`` time of a rolling shutter, ``shutter`` for means over an exposure, ``lens`` and
        ``clock``. A pendulum has ``theta0, aside, above``; if an encoder read it, only the zero ``theta0``.
        An encoder is assumed if the measurement says ``sensor = encoder`` (in its `meta`, or a line of its
        file), or if its angles come in steps larger than all other noise.
    priors : mapping of str to (mean, standard deviation), optional
        Replaces the default priors.
    each : iterable of str, optional
        Parameters of the model with a separate value for every measurement; default: the drive ``W``.
        They are then called ``W[0]``, ``W[1]`` ..., as the camera's are.
    state0 : mapping of str to float, optional
        Start values of unobserved states of a user's own model, by name; for several measurements also a list
        of such tables. The search for these states begins with the motion from there, driven by the observed
        columns. Default: the rate, or the integral, of an observed state; the typical size of the
        observations if the law is undefined or flat below zero; else zero.

    Returns
    -------
    Fit
        Call ``summary()`` first: it says whether the model lacks something, from the model error that the
        record needed, the whiteness of the innovations and runaway parameters. If it does, the standard
        errors contain that. A warning says if another unit explains the record far better; the fit keeps the
        given units. `parameters`, `errors`, `chi2`, `states`, `residuals` and `covariance` hold the numbers;
        ``udd.plot.residuals(result)`` and ``udd.plot.misfit(result)`` show them.

    Raises
    ------
    FitError
        The measurement does not suit the model, is too short, or does not determine the parameters; or its
        numbers cannot be in s, m and rad.

    See Also
    --------
    discover : find what a fitted model lacks.
    forecast : predict the motion after the record.
    Fit.budget : uncertainty budget of the parameters.
    input_bias : bias by noisy inputs.

    References
    ----------
    Weak-constraint 4D-Var: Y. Trémolet, Q. J. R. Meteorol. Soc. 132 (2006) 2483 [47]. Multiple shooting:
    H. G. Bock, in "Modelling of Chemical Reaction Systems" (1981) 102 [48].

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
    (result,) = checked_units(
        measurement, model, options, lambda: (fit_record(measurement, record, model, **options),)
    )
    return with_negligible_model_error(result).without_cache().with_diagnostics()


def options_of(
    free: Iterable[str] | None,
    camera: bool | Iterable[str],
    priors: Mapping[str, tuple[float, float]] | None,
    each: Iterable[str] | None,
) -> dict[str, Any]:
    """Collect a user's options about parameters so that they can be read more than once."""
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
    """Fit some of the measurement's frames, as :func:`fit` does for all.

    A search uses the smallest model error that the profile allows to a search.
    """
    measurements = (measurement,) if isinstance(measurement, Measurement) else tuple(measurement)
    models = _models(model, measurements)
    kind, profile = models[0].kind, models[0].profile
    zero = profile.sensor.zero
    if camera is True and zero is not None and all(is_encoder(film) for film in measurements):
        camera = (zero,)  # an encoder has no perspective
    parameters = free_parameters(models, free, camera, priors, each)
    if isinstance(models[0], FormulaModel):
        schedule = levels_of(models[0], record.t, record.states, record.sigma, record.linked)
    else:
        schedule = levels(kind)[: profile.fit.searched if search else None]
    problem = Problem(models, record, parameters, stated(record), schedule, schedule[0], not search)
    point = _start(models, measurements, record)
    if search and models[0].inputs:  # a fit finds the model error itself
        problem = _with_input_noise(measurements, problem, point)
    return _anneal(measurements, problem, point)


def _with_input_noise(measurements: tuple[Measurement, ...], problem: Problem, point: Point) -> Problem:
    """Add the noise of the inputs to the model error.

    Return the problem unchanged if the inputs have no noise: the most probable model error is then far below
    what that noise would cause.
    """
    # Without this a complete driven machine gets a spurious formula, and one with dry friction a wave.
    noise = diffusion_by_noise(problem.models, problem.record)
    moved = noise > 0.0
    if not moved.any():
        return problem
    try:
        fitted = _anneal(measurements, replace(problem, likeliest=True), point)
        if (np.array(fitted.problem.diffusion)[moved] < noise[moved] / LEVEL_RATIO).any():
            return problem
    except SolveError:
        pass  # a failed fit says nothing about the noise
    schedule = tuple(tuple(np.hypot(level, noise).tolist()) for level in problem.schedule)
    return replace(problem, schedule=schedule, diffusion=schedule[0])


def astray(fitted: Fit) -> bool:
    """Return True if a fit is so bad, or so far from the given values, that a unit may be wrong.

    A missing effect can do the same: :func:`udd.fitting.units.other_unit` distinguishes the two.
    """
    pairs = zip(fitted.models, fitted.problem.models, strict=True)
    return fitted.scatter > UNEXPLAINED or ran_away(fitted) or any(_is_frequency_off(*pair) for pair in pairs)


def ran_away(fitted: Fit) -> bool:
    """Return True if the fitted drive or camera has impossible values.

    A strong missing effect causes that: the fit then compensates with a clock that is off by a third, or with
    a drive a fifth of the given one.
    """
    stated = fitted.model.profile.fit.stated
    parts = [f for f in fitted.problem.free if f.role != "model" or f.name.partition("[")[0] in stated]
    return any(abs(fitted.point.value(f) - f.mean) > _RUNAWAY_SD * f.sd for f in parts)


def _is_frequency_off(fitted: Model, given: Model) -> bool:
    """Return True if the measured frequency is far from the model's, as a pendulum's may be."""
    pace = given.profile.fit.pace
    if pace is None:
        return False
    ratio = pace(fitted.parameters) / pace(given.parameters)
    return not 1 / _MAX_FREQUENCY_RATIO < ratio < _MAX_FREQUENCY_RATIO


def _is_drive_off(measurement: Measurement, model: Model) -> bool:
    """Return True if the frames alone show a drive far from the given one."""
    fit, name = model.profile.fit, model.profile.dynamics.drive
    if fit.drive_seen is None or name is None or measurement.kind != model.kind or not model.parameters[name]:
        return False
    return not 1 / _MAX_DRIVE_RATIO < drive_seen(measurement) / model.parameters[name] < _MAX_DRIVE_RATIO


def checked_units(
    measurement: Measurement | Sequence[Measurement],
    model: Model | Sequence[Model],
    options: Mapping[str, Any],
    fits: Callable[[], tuple[Fit, ...]],
) -> tuple[Fit, ...]:
    """Run fits and check whether the measurement's numbers may be in another unit than assumed.

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
        With :attr:`Fit.unit_doubt` set if another unit explains the measurement far better; a warning says so
        too.

    Raises
    ------
    FitError
        The numbers cannot be in s, m and rad; or `fits` raises it.
    """
    measurements = (measurement,) if isinstance(measurement, Measurement) else tuple(measurement)
    models = _models(model, measurements)
    free = options["free"]
    free_parameters(models, **options)  # raises if an option is wrong
    ask(measurements, models)
    unknown = models[0].profile.fit.unknown
    unknown_free = [name for name in unknown if free is None or name in free]
    asked: list[str | None] = []

    def check(ends: Sequence[Sequence[Model]] = ()) -> None:
        if asked or not unknown:
            return
        asked.append(other_unit(measurements, models, ends, partial(_loosest, unknown_free)))
        if asked[0]:
            warnings.warn(f"{asked[0]}; the fit continues with the given units", stacklevel=outside())

    if any(_is_drive_off(*pair) for pair in zip(measurements, models, strict=True)):
        check()
    try:
        fitted = fits()
    except SolveError as error:
        check()
        if asked and asked[0]:  # most probably the reason
            raise FitError(f"{error}; {asked[0]}") from error
        raise
    if any(astray(each) for each in fitted):
        check([each.models for each in fitted])
    return tuple(replace(each, unit_doubt=asked[0]) for each in fitted) if asked and asked[0] else fitted


def _loosest(
    free: Sequence[str],
    record: Record,
    measurements: Sequence[Measurement],
    models: Sequence[Model],
    start: Sequence[Model],
    scale: Scale,
    fixed: frozenset[str],
) -> Fit:
    """Fit a model with a large model error, the drive and the camera fixed at their given values."""
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
    """Return the start of a fit: the states as read, all parameters at their given values."""
    sets = tuple(
        FilmParameters(list(model.parameters.values()), known_camera(model.kind, film.meta), 0.0)
        for model, film in zip(models, measurements, strict=True)
    )
    return Point(record.states, sets)


def _models(model: Model | Sequence[Model], measurements: Sequence[Measurement]) -> tuple[Model, ...]:
    """Return one model per measurement; they may differ only in parameter values."""
    models = tuple(model) if isinstance(model, Sequence) else (model,) * len(measurements)
    if len(models) != len(measurements):
        raise FitError(
            f"got {len(measurements)} measurements but {len(models)} models; expected one, or one each"
        )
    for each, measurement in zip(models, measurements, strict=True):
        if not isinstance(each, Model):
            raise FitError(f"a model is needed (udd.Disk, udd.Pendulum, udd.Model), not {each!r}")
        if not each.profile.written and measurement.kind != each.kind:
            raise FitError(
                f"the measurement has columns {', '.join(measurement.names)}, "
                f"which {type(each).__name__} does not explain"
            )
        if list(each.parameters) != list(models[0].parameters):
            raise FitError(
                "the models of several measurements must be alike but for their parameters' values"
            )
    written = [each for each in models if isinstance(each, FormulaModel)]
    return driven(written, measurements) if written and written[0].inputs else models


def widened(fitted: Fit, effects: Sequence[Effect], start: Fit | None = None) -> tuple[Problem, Point]:
    """Add effects, with fixed parameters, to the problem of a fit; return it with the fit's end point.

    `start` may be another fit of the same data whose end point is used instead.
    """
    models = tuple(model.with_effects((*model.effects, *effects)) for model in fitted.models)
    known_count = len(fitted.model.parameters)
    effect_values = [value for effect in effects for value in effect.values]
    end = (start or fitted).point
    sets = tuple(
        FilmParameters([*values[:known_count], *effect_values], camera, clock)
        for values, camera, clock in end.sets
    )
    return replace(fitted.problem, models=models), Point(end.states, sets)


def started_at(fitted: Fit, last: Fit, seen: NDArray[np.bool_] | None = None) -> Fit:
    """Return a fit that continues from the end of another one, which may have more effects.

    The same parameters are free as in `last`. `seen` masks the frames that `last` was fitted to; None for
    all. The other frames start at the states as read.
    """
    known_count = len(fitted.model.parameters)
    free = tuple(f for f in last.problem.free if f.role != "model" or f.index < known_count)
    sets = tuple(
        FilmParameters(values[:known_count], camera, clock) for values, camera, clock in last.point.sets
    )
    states = fitted.record.states.copy()
    states[slice(None) if seen is None else seen] = last.states
    return replace(fitted, problem=_with_free(fitted, free), point=Point(states, sets))


def extend(fitted: Fit, effects: Sequence[Effect], amplitudes: Sequence[float], goal: Goal = ANY) -> Fit:
    """Fit again with more effects, all coefficients free, starting at the end of a fit.

    The noise stays fixed, so that the chi2 of both fits can be compared. A frequency is free within its
    spectral line. Shapes that may have any value are freed after the rest has converged: within a factor of
    about two, or for a place within about its width.

    Parameters
    ----------
    fitted : Fit
    effects : sequence of Effect
        The effects to add.
    amplitudes : sequence of float
        Start values of their amplitudes, in order.
    goal : Goal
        Targets that the fit must reach to be useful.
    """
    left = list(amplitudes)
    effects = [e.replace(**{p: left.pop(0) for p in e.amplitudes}) for e in effects]
    problem, point = widened(fitted, effects)
    order = list(problem.models[0].parameters)
    names = [f"{e.name}.{p}" for e in effects for p in e.amplitudes]
    line = 0.5 / float(np.ptp(fitted.record.t))
    new_free = tuple(Free(name, "model", order.index(name), 0.0, np.inf) for name in names)
    optimised = [(e, p) for e in effects for p in e.spec.parameters if p.sought]
    waves = [(f"{e.name}.{p.name}", e.parameters[p.name]) for e, p in optimised if p.role == "frequency"]
    shapes = [
        (f"{e.name}.{p.name}", e.parameters[p.name], _spread(e, p))
        for e, p in optimised
        if p.role in ("shape", "scanned")
    ]
    new_free += tuple(Free(name, "model", order.index(name), f, line) for name, f in waves)
    problem = replace(problem, free=problem.free + new_free)
    first = replace(goal, chi2=np.inf) if shapes else goal  # chi2 falls once the shapes are free
    first_fit = reduce_model_error(fitted.measurements, problem, point, problem.schedule[1:], goal=first)
    if not shapes:
        return first_fit
    new_free = tuple(Free(name, "model", order.index(name), value, sd) for name, value, sd in shapes)
    problem = replace(problem, free=problem.free + new_free)
    # With a small model error, a shape and its amplitude move slowly: the fit stopped 100 in chi2 too high.
    return reduce_model_error(fitted.measurements, problem, first_fit.point, problem.schedule[1:], goal=goal)


def _spread(effect: Effect, parameter: Parameter) -> float:
    """Return a shape's (or place's) prior standard deviation: the distance to the next value of a scan."""
    widths = [effect.parameters[p.name] for p in effect.spec.parameters if p.role == "shape"]
    if parameter.role == "scanned" and widths:
        return widths[0]
    return abs(effect.parameters[parameter.name])


def as_stated(fitted: Fit) -> Fit:
    """Fit again with the drive and the camera (except the pivot) at their given values; for a search."""
    profile = fitted.model.profile

    def kept(free: Free) -> bool:
        name = free.name.partition("[")[0]
        if free.role == "model":
            return name not in profile.fit.stated
        return free.role == "camera" and name in profile.sensor.pivot

    free = tuple(parameter for parameter in fitted.problem.free if kept(parameter))
    problem = replace(fitted.problem, free=free, noise=stated(fitted.record))
    start = _start(problem.models, fitted.measurements, fitted.record)
    return _anneal(fitted.measurements, problem, start)


def released(fitted: Fit, free: Sequence[Free]) -> Fit:
    """Fit again with more free parameters, alongside those of the added effects.

    The schedule starts at the largest model error: with a small one, chaos has a minimum near every start
    value.
    """
    # Without this, a spurious slip follows a load-dependent drive.
    problem = _with_free(fitted, free)
    return reduce_model_error(fitted.measurements, problem, fitted.point, problem.schedule)


def released_anew(fitted: Fit, free: Sequence[Free]) -> Fit:
    """Fit as :func:`released` does, and estimate the noise again: a diverged model hardly shows it."""
    problem = replace(_with_free(fitted, free), noise=stated(fitted.record))
    return _anneal(fitted.measurements, problem, fitted.point)


def _with_free(fitted: Fit, free: Sequence[Free]) -> Problem:
    names = {f.name for f in free}
    added = tuple(f for f in fitted.problem.free if f.name not in names)
    return replace(fitted.problem, free=(*free, *added))


def refit(fitted: Fit) -> Fit:
    """Fit the same model again with new noise, at the most probable smaller model error.

    In a search the noise stays that of the first model, so that chi2 can be compared. The noise of a film
    stays at its assumed value.
    """
    return _tightened(fitted, trusted=not _least(fitted.measurements, search=True) > _FINEST)


def most_probable(fitted: Fit) -> Fit:
    """Fit the same model at its most probable noise and model error, smaller or larger.

    The model error of a film with less noise than its geometric error only gets smaller: a larger one would
    follow the geometry's faults, and all forms would be equal.
    """
    # To the minimum itself a law with a kink converges slowly, and ends at a larger model error.
    tightest = _tightened(fitted, trusted=True, enough=NAT)
    # Without this no form of a real pendulum's drag is distinguished from another.
    if (tightest.noise.factor < _least(fitted.measurements, search=True)).any():
        return tightest
    if tightest.level > fitted.level:  # on the way the evidence rose
        return tightest
    result = eased(tightest)
    # Without this, one form is compared at its most probable model error, another 180 nats below its own.
    if result.level < tightest.level:
        try:
            result = solve(fitted.measurements, *_own_noise(result), decrease=NAT)
        except SolveError:
            return tightest
    return result if result.converged else tightest


def _tightened(fitted: Fit, trusted: bool, enough: float | None = None) -> Fit:
    """Reduce the model error to the most probable one, with the fit's own noise if that is `trusted`."""
    schedule = levels(fitted.model.kind) or fitted.problem.schedule
    fitted = replace(fitted, problem=replace(fitted.problem, schedule=schedule))
    try:
        problem, point = _own_noise(fitted) if trusted else (fitted.problem, fitted.point)
        levels_left = schedule[fitted.level :]
        result = reduce_model_error(fitted.measurements, problem, point, levels_left, enough=enough)
    except SolveError:  # for example, a threshold that ends at or below zero
        return fitted
    return result if result.converged else fitted


def _own_noise(fitted: Fit) -> tuple[Problem, Point]:
    """Estimate the noise at a fit's model error; keep it where the misfits do not show it."""
    problem = replace(fitted.problem, likeliest=True)
    misfits, problem, point = _estimate_noise(fitted.measurements, problem, fitted.point)
    return (problem, point) if misfits == "noise" else (fitted.problem, fitted.point)


def _anneal(measurements: tuple[Measurement, ...], problem: Problem, point: Point) -> Fit:
    """Solve the problem while the model error is reduced step by step.

    The noise is estimated at the largest model error at which the misfits show it, because a wrong model does
    least harm there. It is estimated again at the last level, if the model reaches it. At still larger model
    errors the states follow every frame, and noise and model error cannot be distinguished.
    """
    as_stated, first = problem.noise, point
    for number, diffusion in enumerate(problem.schedule):
        problem = replace(problem, diffusion=diffusion, noise=as_stated)
        misfits, problem, point = _estimate_noise(measurements, problem, point)
        if misfits == "faults":
            break  # a smaller model error shows even more of them
        if misfits == "noise":
            loose = provisional_fit(measurements, problem, point)
            # A search does not trust a pendulum film's noise to be below its geometric error.
            if problem.likeliest or not profile_of(measurements[0].kind).sensor.faithful:
                loose = _likeliest_noise(loose, problem.schedule[number + 1 :])
            tighter = problem.schedule[loose.level + 1 :]
            if not tighter:
                return loose
            return reduce_model_error(measurements, loose.problem, _afresh(loose), tighter, loose)
    # If the noise never shows, or is below the model's faults, the film is very precise: use its stated
    # noise.
    believed = as_stated.everywhere(len(problem.record.t))
    return reduce_model_error(measurements, replace(problem, noise=believed), first, problem.schedule)


def _likeliest_noise(fitted: Fit, tighter: Sequence[tuple[float, ...]]) -> Fit:
    """Return the fit of the last level with the noise estimated there, if the evidence rises on the way.

    While the states still follow the frames, the noise estimate is too small, and a correct model would then
    seem incomplete. A correct model can skip levels. If a model does not reach the last level, its noise
    stays.
    """
    # Without this, a plain disk measured to 0.1 mm and 1 mrad is reported as incomplete.
    best, left = fitted, list(tighter)
    while left:
        ahead = min(LEAP, len(left))
        further = (_likelier(best, left[k - 1]) for k in dict.fromkeys((ahead, 1)))
        next_fit = next(filter(None, further), None)
        if next_fit is None:
            return fitted
        best, left = next_fit, left[left.index(next_fit.problem.diffusion) + 1 :]
    return best


def _likelier(fitted: Fit, diffusion: tuple[float, ...]) -> Fit | None:
    """Fit with this model error, the noise estimated there; None if the evidence does not rise."""
    problem = fitted.problem.with_model_error(diffusion)
    try:
        misfits, problem, point = _estimate_noise(fitted.measurements, problem, _afresh(fitted), FEW)
        if misfits != "noise":
            return None
        result = provisional_fit(fitted.measurements, problem, point, FEW)
    except FitError:
        return None
    return result if result.converged and result.evidence > fitted.evidence else None


def _afresh(fitted: Fit) -> Point:
    """Return the states of a fit; model parameters with a prior go back to its mean.

    While the states follow the frames, a law that is nonlinear in the speed, such as friction, may come out
    flat, and would then stay flat.
    """
    sets = [FilmParameters([*values], camera, clock) for values, camera, clock in fitted.point.sets]
    for free in fitted.problem.free:
        if free.role == "model" and np.isfinite(free.sd):
            for values, _camera, _clock in sets if free.film is None else [sets[free.film]]:
                values[free.index] = free.mean
    return Point(fitted.states, tuple(sets))


def _is_known(measurement: Measurement) -> bool:
    """Return True if the noise is known beforehand: stated, or shown by the frames of a sensor."""
    return measurement.sigma is not None or profile_of(measurement.kind).written or is_encoder(measurement)


def _least(measurements: Sequence[Measurement], search: bool) -> float:
    """Return the lower limit of the noise, in units of the noise that is known beforehand."""
    result = 0.0 if profile_of(measurements[0].kind).written else _FINEST
    for measurement in measurements:
        least = profile_of(measurement.kind).sensor.faithful
        if least and is_encoder(measurement):
            return 1.0
        if search and measurement.sigma is None:
            result = max(result, least)
    return result


def _estimate_noise(
    measurements: tuple[Measurement, ...], problem: Problem, point: Point, steps: int = MOST
) -> tuple[Misfits, Problem, Point]:
    """Alternate between fitting and estimating the noise; return the source of the misfits and the result.

    A model that does not converge in so many `steps` is wrong.
    """
    is_known = all(_is_known(measurement) for measurement in measurements)
    least = _least(measurements, search=not problem.likeliest)
    for _ in range(_NOISE_ROUNDS):
        result = solve(measurements, problem, point, steps, decrease=ROUGH)
        point, before = result.point, problem.noise
        if steps < MOST and not result.converged:
            return "faults", problem, point
        if result.leverage > FOLLOWS:
            return "little", problem, point
        noise = estimated(problem.record, result.blurring, result.misfit, result.misfit_variance, before)
        if is_known and noise.beyond(problem.record, result.blurring, _BELIEVED):
            return "faults", problem, point
        noise = replace(noise, factor=np.maximum(noise.factor, least))
        problem = replace(problem, noise=noise)
        if before.like(noise, problem.record, result.blurring):
            break
    return "noise", problem, point
