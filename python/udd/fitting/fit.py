"""The fit of a model to a measurement: weak-constraint multiple shooting."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from udd import _core
from udd.effects import Effect
from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import Model

from .noise import estimated, stated
from .parameters import Free, free_parameters
from .problem import FOLLOWS, Fit, Point, Problem, levels
from .record import Record, record_of
from .solve import solve, tighten

_NOISE_ROUNDS = 12
_BELIEVED = 3.0  # a measurement's own errors are good to this factor; what is larger is the model's fault


def fit(
    measurement: Measurement,
    model: Model,
    free: Iterable[str] | None = None,
    *,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
) -> Fit:
    """Fit a model to measured motion.

    Unknown are the state at every frame, the model's free parameters and the camera's; minimised is the sum
    of the squared misfits in units of the noise and of the squared model errors in units of an assumed one,
    which is lowered in steps (weak-constraint multiple shooting). No data are differentiated, and chaotic
    records of any length can be fitted. The model's time counts from the measurement's first row.

    Parameters
    ----------
    measurement : Measurement
        Of the disk (``Y, Z, beta``) or of a pendulum (``theta``).
    model : Disk or Pendulum
        Its parameters are the start and the priors' means.
    free : iterable of str, optional
        Names of the model's free parameters; by default ``k0, k1, k2, W`` (with a prior of 5 %) of a disk,
        ``k0, length, inertia`` of a pendulum, and the amplitudes of all effects.
    camera : bool or iterable of str
        Whether the camera's parameters are free (pivot ``y0, z0``, ``tilt``, ``scale``, ``lag`` of the
        orientation, ``row`` time of a rolling shutter, ``clock``), or which of them.
    priors : mapping of str to (mean, standard deviation), optional
        Replaces the default priors.

    Returns
    -------
    Fit

    Raises
    ------
    FitError
        The measurement does not suit the model, is too short, or does not determine the parameters.

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
    return fit_record(measurement, record_of(measurement), model, free, camera=camera, priors=priors)


def fit_record(
    measurement: Measurement,
    record: Record,
    model: Model,
    free: Iterable[str] | None = None,
    *,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
) -> Fit:
    """As :func:`fit`, of some of the measurement's frames."""
    if measurement.kind != getattr(model, "kind", None):
        raise FitError(
            f"the measurement has columns {', '.join(measurement.names)}, "
            f"which {type(model).__name__} does not explain"
        )
    parameters = free_parameters(model, free, camera, priors)
    cameras = _core.camera_parameters(measurement.kind)
    schedule = levels(measurement.kind)
    problem = Problem(model, record, parameters, stated(record), schedule, schedule[0])
    return _anneal(measurement, problem, Point(record.states, model.parameters, np.zeros(len(cameras)), 0.0))


def extend(fitted: Fit, effects: Sequence[Effect], amplitudes: Sequence[float]) -> Fit:
    """Fit again with more effects, all coefficients free, from where a fit ended.

    The noise stays as it was estimated, so that the two fits' chi2 compare. A frequency is free within its
    line.

    Parameters
    ----------
    fitted : Fit
    effects : sequence of Effect
        The effects to add.
    amplitudes : sequence of float
        Where their amplitudes start, in order.
    """
    names = [f"{e.name}.{p}" for e in effects for p in e.amplitudes]
    t = fitted.record.t
    line = 0.5 / float(t[-1] - t[0])
    scanned = [(e, p.name) for e in effects for p in e.spec.parameters if p.role == "frequency"]
    waves = [(f"{e.name}.{name}", e.parameters[name]) for e, name in scanned]
    model = fitted.model.with_effects((*fitted.model.effects, *effects))
    model = model.with_parameters(dict(zip(names, amplitudes, strict=True)))
    order = list(model.parameters)
    more = tuple(Free(name, "model", order.index(name), 0.0, np.inf) for name in names)
    more += tuple(Free(name, "model", order.index(name), f, line) for name, f in waves)
    problem = replace(fitted.problem, model=model, free=fitted.problem.free + more)
    start = replace(fitted.point, model=model.parameters)
    return tighten(fitted.measurement, problem, start, problem.schedule[1:])


def _anneal(measurement: Measurement, problem: Problem, point: Point) -> Fit:
    """Solve from loose to tight.

    The noise is estimated at the loosest level at which the misfits still show it: there a wrong model does
    the least harm. At looser ones the states follow every frame, and noise and model error cannot be told
    apart.
    """
    as_stated, first = problem.noise, point
    for number, diffusion in enumerate(problem.schedule):
        problem = replace(problem, diffusion=diffusion, noise=as_stated)
        shown, problem, point = _estimate_noise(measurement, problem, point)
        if shown:
            return tighten(measurement, problem, point, problem.schedule[number:])
    # A film so precise that its noise never shows, or shows less than the model's faults, is believed.
    return tighten(measurement, replace(problem, noise=as_stated), first, problem.schedule)


def _estimate_noise(measurement: Measurement, problem: Problem, point: Point) -> tuple[bool, Problem, Point]:
    """Fit and estimate the noise in turns; whether the misfits show it, and what was found."""
    for _ in range(_NOISE_ROUNDS):
        result = solve(measurement, problem, point)
        point, before = result.point, problem.noise
        omega = point.states[:, 0]
        if result.leverage > FOLLOWS:
            return False, problem, point
        noise = estimated(problem.record, omega, result.misfit, result.misfit_variance, before)
        if measurement.sigma is not None and noise.beyond(problem.record, omega, _BELIEVED):
            return False, problem, point
        problem = replace(problem, noise=noise)
        if before.like(noise, problem.record, omega):
            break
    return True, problem, point
