"""The fit of a model to a measurement: weak-constraint multiple shooting."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.effects import Effect
from udd.errors import FitError
from udd.measurement import Measurement
from udd.models import Model

from .noise import Noise, colour, estimated, stated
from .parameters import Free, free_parameters
from .record import Record, record_of

Array = NDArray[np.float64]

#: The model's assumed error over one frame of 40 ms, from loose to tight, per state: ``[Omega, Y, Z, beta]``
#: in rad/s, m, m, rad; ``[Omega, theta]`` in rad/s, rad. At the loose end a wrong model follows the data,
#: which is where the noise is estimated; at the tight end small effects show. A disk of LEGO is not held
#: tighter than 10 um a frame: below that no film is without faults of its own.
SCHEDULE: dict[str, tuple[tuple[float, ...], ...]] = {
    "disk": (
        (0.1, 1e-4, 1e-4, 1e-3),
        (0.02, 3e-5, 3e-5, 3e-4),
        (3e-3, 1e-5, 1e-5, 1e-4),
    ),
    "pendulum": ((0.1, 1e-3), (0.01, 3e-4), (1e-3, 3e-5), (1e-4, 3e-6), (1e-5, 3e-7)),
}
_FRAME = 0.04
_NOISE_ROUNDS = 12
_STEPS = 20  # a right model converges in three to seven
_FOLLOWS = 0.7  # a fit whose leverage is larger follows each frame
_BELIEVED = 3.0  # a measurement's own errors are good to this factor; what is larger is the model's fault


@dataclass(frozen=True)
class Problem:
    """A measurement laid out for a model, with everything that a solve needs but its start."""

    model: Model
    record: Record
    free: tuple[Free, ...]
    noise: Noise
    schedule: tuple[tuple[float, ...], ...]
    diffusion: tuple[float, ...]

    def arguments(
        self, point: Point
    ) -> tuple[
        Model,
        tuple[Array, Array, Array, NDArray[np.bool_]],
        tuple[Array, Array, float],
        list[tuple[str, int, float, float]],
        list[float],
    ]:
        """What the core takes to describe a problem at a point."""
        r = self.record
        information = self.noise.information(r, point.states[:, 0])
        return (
            self.model.with_parameters(point.model),
            (r.t, r.seen, information, r.linked),
            (point.states, point.camera, point.clock),
            [f.core for f in self.free],
            list(self.diffusion),
        )


@dataclass(frozen=True)
class Point:
    """Values of all unknowns: the states, the model's parameters, the camera's, and the clock's error."""

    states: Array
    model: Mapping[str, float]
    camera: Array
    clock: float


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to a measurement.

    Attributes
    ----------
    model : Disk or Pendulum
        With the fitted parameters.
    parameters : dict of str to float
        The free parameters, the camera's included.
    errors : dict of str to float
        Their standard errors.
    covariance : ndarray (p, p)
        In the order of `parameters`.
    chi2, dof : float
        Sum of squares in units of the assumed noise and model error, and what it should be.
    converged : bool
    measurement : Measurement
    record : Record
        The frames as the estimator saw them.
    states : ndarray (n, d)
        The state at each frame of `record`.
    state_covariance : ndarray (n, d, d)
    misfit, misfit_variance : ndarray (n, m)
        What was seen less what was fitted, NaN where nothing was seen, and the variance of what was fitted.
    defect : ndarray (n - 1, d)
        By how much each state misses what the model makes of the one before, per second: the residual of each
        equation. NaN where frames are not linked.
    noise : Noise
        The measurement's noise as the record shows it.
    """

    model: Model
    parameters: dict[str, float]
    errors: dict[str, float]
    covariance: Array
    chi2: float
    dof: float
    converged: bool
    iterations: int
    measurement: Measurement
    record: Record
    states: Array
    state_covariance: Array
    misfit: Array
    misfit_variance: Array
    defect: Array
    noise: Noise
    problem: Problem
    point: Point

    @property
    def residuals(self) -> Array:
        """What was seen less what was fitted, for every row of the measurement; NaN where not seen."""
        rows = np.full((len(self.measurement), self.misfit.shape[1]), np.nan)
        there = self.record.row >= 0
        rows[self.record.row[there]] = self.misfit[there]
        return rows

    @property
    def level(self) -> int:
        """How tightly the model was held: the place of its assumed error in the schedule."""
        return self.problem.schedule.index(self.problem.diffusion)

    @property
    def scatter(self) -> float:
        """chi2 per degree of freedom: 1 where model and noise explain the data."""
        return self.chi2 / self.dof

    def inflation(self, before: Fit) -> float:
        """By what a fall of chi2 from another fit is divided before it counts.

        The scatter that remains, times how much stronger the misfits are at the frequencies where the two
        differ.
        """
        sd = self.noise.sd(self.record, self.states[:, 0])
        misfit, signature = self.misfit / sd, (before.misfit - self.misfit) / sd
        return max(self.scatter, 1.0) * colour(misfit, signature)

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads: parameters with errors, noise, goodness."""
        return {
            "model": repr(self.model),
            "parameters": {n: {"value": v, "se": self.errors[n]} for n, v in self.parameters.items()},
            "chi2": self.chi2,
            "dof": self.dof,
            "converged": self.converged,
            "noise": {
                name: {"factor": float(f), "per_rad_per_s": float(b)}
                for name, f, b in zip(self.measurement.names, self.noise.factor, self.noise.blur, strict=True)
            },
        }

    def __str__(self) -> str:
        lines = [
            f"  {name:<24} {value:>12.5g} +- {self.errors[name]:.2g}"
            for name, value in self.parameters.items()
        ]
        verdict = "converged" if self.converged else "NOT converged"
        head = f"{verdict}, chi2/dof = {self.scatter:.3f}, {len(self.record.t)} frames"
        return "\n".join([head, *lines])


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
    records of any length can be fitted.

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
    return _tighten(fitted.measurement, problem, start, problem.schedule[1:])


def levels(kind: str) -> tuple[tuple[float, ...], ...]:
    """The model's assumed error, loose to tight, per square root of a second."""
    return tuple(tuple(q / _FRAME**0.5 for q in level) for level in SCHEDULE[kind])


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
            return _tighten(measurement, problem, point, problem.schedule[number:])
    # A film so precise that its noise never shows, or shows less than the model's faults, is believed.
    return _tighten(measurement, replace(problem, noise=as_stated), first, problem.schedule)


def _estimate_noise(measurement: Measurement, problem: Problem, point: Point) -> tuple[bool, Problem, Point]:
    """Fit and estimate the noise in turns; whether the misfits show it, and what was found."""
    for _ in range(_NOISE_ROUNDS):
        result = solve(measurement, problem, point)
        point, before = result.point, problem.noise
        omega = point.states[:, 0]
        seen = problem.record.observed
        leverage = (result.misfit_variance / before.sd(problem.record, omega) ** 2)[seen]
        if leverage.mean() > _FOLLOWS:
            return False, problem, point
        noise = estimated(problem.record, omega, result.misfit, result.misfit_variance, before)
        if measurement.sigma is not None and noise.beyond(problem.record, omega, _BELIEVED):
            return False, problem, point
        problem = replace(problem, noise=noise)
        if before.like(noise, problem.record, omega):
            break
    return True, problem, point


def _tighten(
    measurement: Measurement, problem: Problem, point: Point, schedule: Sequence[tuple[float, ...]]
) -> Fit:
    """Solve for ever smaller errors of the model, as far as it goes: a wrong model gets stuck."""
    best: Fit | None = None
    for diffusion in schedule:
        problem = replace(problem, diffusion=diffusion)
        result = solve(measurement, problem, point, _STEPS)
        if best is not None and not result.converged:
            break
        best, point = result, result.point
    assert best is not None
    return best


def loosened(fitted: Fit, scatter: float) -> Fit:
    """The tightest fit, of those that led to this one, whose scatter is below a limit; else the loosest.

    A wrong model that is held tightly bends everything to obey it; where it is held less tightly it shows
    what is missing.
    """
    problem, result = fitted.problem, fitted
    for diffusion in reversed(problem.schedule[: fitted.level]):
        if result.scatter < scatter:
            break
        result = solve(fitted.measurement, replace(problem, diffusion=diffusion), result.point)
    return result


def held_cost(fitted: Fit, record: Record) -> Array:
    """Cost of every frame of another record, with all parameters held and the states free.

    Parameters
    ----------
    fitted : Fit
        Its parameters, camera and noise are held.
    record : Record

    Returns
    -------
    cost : ndarray (n,)
        Squared misfit of a frame in units of the noise, with the squared defect of the link that leaves it in
        units of the model's assumed error.
    """
    problem = replace(fitted.problem, record=record, free=(), model=fitted.model)
    problem = replace(problem, noise=replace(fitted.noise, weight=np.ones(len(record.t))))
    start = replace(fitted.point, states=record.states)
    end = _tighten(fitted.measurement, problem, start, problem.schedule)
    information = problem.noise.information(record, end.states[:, 0])
    misfit = np.nan_to_num(end.misfit)
    cost: Array = np.einsum("ni,nij,nj->n", misfit, information, misfit)
    # A defect is kept per second; its variance over a link of length dt is diffusion^2 dt.
    dt = np.diff(record.t)[:, None]
    links = np.nan_to_num(end.defect) ** 2 * dt / np.array(end.problem.diffusion) ** 2
    cost[:-1] += links.sum(axis=1)
    return cost


def information_for(fitted: Fit, record: Record) -> Array:
    """The information of another record's frames, with the noise that a fit found."""
    noise = replace(fitted.noise, weight=np.ones(len(record.t)))
    return noise.information(record, record.states[:, 0])


def solve(measurement: Measurement, problem: Problem, point: Point, iterations: int = 40) -> Fit:
    """Minimise once, for the problem's assumed model error, from a point."""
    try:
        found = _core.solve(*problem.arguments(point), iterations)
    except ValueError as error:
        raise FitError(f"the fit failed: {error}") from error
    record = problem.record
    model = problem.model.with_parameters(dict(zip(problem.model.parameters, found["model"], strict=True)))
    names = [f.name for f in problem.free]
    end = Point(found["states"], model.parameters, found["camera"], found["clock"])
    values = {f.name: _value(f, found) for f in problem.free}
    chi2 = float(sum(found["cost"]))
    seen = record.observed
    # Every state but a run's first is tied to the one before: what remains are the frames' misfits.
    runs = 1 + int((~record.linked).sum())
    proper = sum(np.isfinite(f.sd) for f in problem.free)
    dof = float(seen.sum()) + proper - len(problem.free) - runs * found["states"].shape[1]
    defect = np.where(record.linked[:, None], found["defect"] / np.diff(record.t)[:, None], np.nan)
    return Fit(
        model=model,
        parameters=values,
        errors=dict(zip(names, np.sqrt(np.diag(found["covariance"])).tolist(), strict=True)),
        covariance=found["covariance"],
        chi2=chi2,
        dof=dof,
        converged=found["converged"],
        iterations=found["iterations"],
        measurement=measurement,
        record=record,
        states=found["states"],
        state_covariance=found["state_covariance"],
        misfit=np.where(seen, found["misfit"], np.nan),
        misfit_variance=found["seen_variance"],
        defect=defect,
        noise=problem.noise,
        problem=problem,
        point=end,
    )


def _value(free: Free, found: Mapping[str, Any]) -> float:
    if free.role == "clock":
        return float(found["clock"])
    return float(found[free.role][free.index])
