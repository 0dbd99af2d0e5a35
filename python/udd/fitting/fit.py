"""Fit a model to a measurement by weak-constraint multiple shooting."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .continuous import continuous
from .fit_result import Fit
from .formula_models import levels_of
from .input_noise import LEVEL_RATIO, diffusion_by_noise
from .minimum import SolveError
from .model_error_schedule import with_negligible_model_error
from .noise import stated
from .noise_estimation import solve_with_noise
from .parameters import free_parameters, names_of, shapes
from .problem import Point, Problem, levels, one_model_each, start_point
from .record import Record, record_of
from .sensor import is_encoder
from .units import checked_units


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
    measurement's first row. Outliers have a smaller weight, and gross ones none (``result.noise.weight``).
    Blocks of up to 20 frames with a jump at each end have weight 0. So have repeated codes for missing
    values, such as -999, if they are far beyond all other values.

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
    models = one_model_each(model, measurements)
    kind, profile = models[0].kind, models[0].profile
    zero = profile.sensor.zero
    if camera is True and zero is not None and all(is_encoder(film) for film in measurements):
        camera = (zero,)  # an encoder has no perspective
    parameters = free_parameters(models, free, camera, priors, each)
    if isinstance(models[0], FormulaModel):
        schedule = levels_of(models[0], record.t, record.states, record.sigma, record.linked)
    else:
        schedule = levels(kind)[: profile.fit.searched if search else None]
    problem = Problem(
        models, record, parameters, stated(record), schedule, schedule[0], not search, measurements
    )
    start = start_point(models, measurements, record)
    if search and models[0].inputs:  # a fit finds the model error itself
        problem = _with_input_noise(problem, start)
    return solve_with_noise(problem, start) if search else _most_probable_end(problem, start)


def _most_probable_end(problem: Problem, start: Point) -> Fit:
    """Fit with all parameters free; if that ends badly, also with the shapes of effects freed at the end."""
    names = {name for model in problem.models for name in shapes(model)}
    early = tuple(f for f in problem.free if f.base not in names)

    def shapes_last(problem: Problem, start: Point) -> Fit:
        held = solve_with_noise(replace(problem, free=early), start)
        left = replace(problem, schedule=problem.schedule[held.level :])
        result = solve_with_noise(left, held.point)
        return replace(result, problem=replace(result.problem, schedule=problem.schedule))

    fits: list[Fit] = []
    failures: list[SolveError] = []
    # A large model error hardly determines a shape: the first steps may lead far away from a good start.
    for work in (solve_with_noise, shapes_last) if len(early) < len(problem.free) else (solve_with_noise,):
        try:
            fits.append(work(problem, start))
        except SolveError as error:
            failures.append(error)
        if fits and fits[-1].problem.has_smallest_model_error:
            break
    if not fits:
        raise failures[0]
    return max(fits, key=lambda fitted: fitted.evidence)


def _with_input_noise(problem: Problem, start: Point) -> Problem:
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
        fitted = solve_with_noise(replace(problem, likeliest=True), start)
        if (np.array(fitted.problem.diffusion)[moved] < noise[moved] / LEVEL_RATIO).any():
            return problem
    except SolveError:
        pass  # a failed fit says nothing about the noise
    schedule = tuple(tuple(np.hypot(level, noise).tolist()) for level in problem.schedule)
    return replace(problem, schedule=schedule, diffusion=schedule[0])
