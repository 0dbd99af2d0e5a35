"""Lyapunov spectrum by QR, Kaplan-Yorke dimension, and covariant Lyapunov vectors."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.labelled import dataset
from udd._util.memory import require_memory
from udd._util.one_line import OneLine
from udd._util.validation import number, whole
from udd._util.value_text import with_error
from udd.errors import ConvergenceWarning, IntegrationError, outside
from udd.models import DLE, Model, require_model
from udd.models.parameter_batch import default_state
from udd.simulation.batch import Batch
from udd.simulation.below_tolerance import warn_from
from udd.simulation.outcomes import FAILED, FINISHED, OUTCOMES
from udd.simulation.trajectory import initial_state, longest_step, tolerances

from .fate import Fate, Orbit
from .largest_exponent import LOOK, reason, span

if TYPE_CHECKING:
    import xarray as xr

    from .poincare_sections import Section

__all__ = ["Covariant", "Spectrum", "covariant_vectors", "lyapunov_spectrum"]

_Floats = NDArray[np.float64]

_SIGMAS = 4.0  # An exponent this many standard errors from zero is not zero.
_POWER = 2.0  # Neighbours that separate no faster than this power of the time are no chaos.
_STAYS = 1e-3  # A smaller exponent, per typical time, counts as zero.
_GROWTH = 3.0  # A distance that changes by less than exp of this does not change.
_LONG = 1e3  # Mean times between section points in a run that shows aperiodic motion.
_PERIODS = 10.0  # A shorter run does not show which exponent of a cycle is zero.
_FAR = 1e6  # Times its start, or from 0: a run that fails there has gone to infinity.


@dataclass(frozen=True, eq=False)
class Spectrum(Drawable):
    """Lyapunov exponents of an orbit.

    Attributes
    ----------
    exponents : ndarray, shape (dim,)
        Largest first, per unit of time (1/s for a model with units). It is -inf if a contact sticks.
    standard_errors : ndarray, shape (dim,)
        Standard errors from the scatter of the means over blocks of the run.
    dimension : float
        The Kaplan-Yorke dimension: the number of exponents, the last one in part, that add up to zero. NaN of
        an orbit that escapes.
    verdict : {"chaos", "periodic orbit", "torus", "equilibrium", "escapes", "undecided"}
        Final motion of the orbit. Neither the origin nor the size of the motion matters. At an equilibrium
        the orbit comes nearer to it for several times its slowest decay, or the rates in its only slow
        direction lead to it, however slowly. A periodic orbit comes back, modulo turns of angles, and one
        exponent is zero; a running pendulum is one. An orbit that escapes has a
        component, not an angle, that grows without bound. Chaos has a largest exponent at least four standard
        errors above zero, and neighbours that part faster than as the square of the time (in typical times);
        in a plane there is none. A torus (quasiperiodic motion) has two exponents or more that are smaller
        than 1e-3 per typical time, and none above. Time counts as a direction if the rates depend on it.
    period : float
        Period of a periodic orbit. NaN if the orbit was not seen to come back.
    invariants : dict of str to float
        Quantities that are zero on every bounded orbit, with their values in this run. Examples are ``"<z>"``
        and the sum of the exponents less the mean divergence. Averages of chaotic motion scatter like the
        exponents do.
    t : float
        Time that the averages cover. It begins after the transient.
    transient : float
        Upper limit of the time that the orbit took to settle. It is 0 unless the first averages belonged to
        another motion, such as transient chaos.
    end : ndarray, shape (dim,)
        The last state.
    converged : bool
        True if the standard error of the largest exponent met the tolerance, and the motion has settled.
    model : Model
        What was run.
    section : Section or None
        Crossings of a surface after the last state. None if no section was asked for.

    See Also
    --------
    udd.lyapunov_spectrum : makes it.
    udd.plot.spectrum : draw one spectrum.
    udd.plot.exponents : draw several over a parameter.

    References
    ----------
    Dimension: J. L. Kaplan and J. A. Yorke [21].
    """

    exponents: _Floats
    standard_errors: _Floats
    dimension: float
    verdict: str
    period: float
    invariants: dict[str, float]
    t: float
    transient: float
    end: _Floats
    converged: bool
    model: Model
    section: Section | None = None

    def to_xarray(self) -> xr.Dataset:
        """Return labelled arrays: exponents with standard errors over ``number``; attributes for the rest.

        Returns
        -------
        xarray.Dataset
        """
        numbers = {"number": np.arange(1, len(self.exponents) + 1)}
        columns = {"exponent": self.exponents, "standard_error": self.standard_errors}
        attrs: dict[str, Any] = {"model": repr(self.model), "verdict": self.verdict}
        attrs |= {"dimension": self.dimension, "period": self.period, "t": self.t, **self.invariants}
        return dataset(columns, ["number"], {}, numbers, **attrs)

    def __repr__(self) -> str:
        pairs = zip(self.exponents, self.standard_errors, strict=True)
        values = ", ".join(with_error(value, error) for value, error in pairs)
        after = f" after a transient of {self.transient:.4g}" if self.transient else ""
        return (
            f"<Spectrum of {self.model!r}: {values}; {self.verdict}{after}, dimension {self.dimension:.4g}>"
        )


@checked_arguments
def lyapunov_spectrum(
    w: float | Model,
    *,
    t: float | None = None,
    tol: float | None = None,
    transient: float | None = None,
    state0: ArrayLike | None = None,
    section: str | Sequence[str] | None = None,
    rtol: float = 1e-9,
    atol: float = 1e-12,
    max_step: float | None = None,
) -> Spectrum:
    """Compute all Lyapunov exponents of an orbit, and classify its motion.

    Parameters
    ----------
    w : float or Model
        Drive of the undamped diffusionless Lorenz equations, or any model.
    t : float, optional
        Longest time of the run. The default is 2e5, or 5e4 s for a model with units.
    tol : float, optional
        The run ends when the standard error of the largest exponent is below this. The default is 1e-3 per
        unit of time, or 4e-3 /s.
    transient : float, optional
        Time at the start that is left out in any case, by default 400, or 100 s (less for a short `t`).
        Should the first half of what follows disagree with the second, it is left out too.
    state0 : array_like, shape (dim,), optional
        Initial state. If several attractors coexist, it decides between them.
    section : str or list of str, optional
        A surface, or several, as in :func:`udd.poincare`, whose crossings are wanted too. The result's
        `section` then holds the next 600 of them. They continue the orbit from the last state of the run,
        `end`, after the transient.
    rtol, atol : float
        Tolerances of the run.
    max_step : float, optional
        The longest step, as for :func:`udd.simulate`.

    Returns
    -------
    Spectrum
        Fields ``exponents``, ``standard_errors``, ``dimension``, ``verdict``, ``period``, ``invariants``.

    Raises
    ------
    ModelError
        A drive or an option that cannot be used.
    IntegrationError
        The disk leaves the wheels (use ``edge="ignore"``), or the rates cease to be defined. An orbit that
        goes to infinity has the verdict "escapes"; its exponents are NaN if it does so in the transient.
        An orbit that turns or grows ever faster, so that the run would hardly end, is refused.

    Warns
    -----
    ConvergenceWarning
        Where the standard error does not meet `tol` after the time `t`.
    ToleranceWarning
        A component falls below `atol` and grows again, and an error of `atol` changes what follows.
    IncompleteWarning
        Where the orbit does not cross the `section` so often, as at rest, or on Ctrl-C meanwhile.

    See Also
    --------
    udd.lyapunov : the largest exponent, of many orbits.
    udd.covariant_vectors : directions of growth.
    udd.plot.spectrum : draw the exponents.

    Notes
    -----
    Tangents are the derivative part of a run over dual numbers, made orthonormal after every step
    (G. Benettin et al., Meccanica 15 (1980) 9). Chaos is followed on, without tangents, for the time `t` in
    all, or 36,000 section points. If it ends on a periodic orbit or at rest, or spirals there slowly, the
    exponents are computed again for the final motion. Longer transients are not seen as such:
    their mean is 8200 near w = 4.5, and 27000 at B = 0.2, w = 3.7.

    References
    ----------
    QR method: G. Benettin et al. [20]. Dimension: J. L. Kaplan and J. A. Yorke [21].

    Examples
    --------
    >>> import udd
    >>> spectrum = udd.lyapunov_spectrum(1.0, tol=5e-3)
    >>> spectrum.verdict, round(float(spectrum.exponents.sum()), 6)
    ('chaos', -1.0)
    >>> udd.lyapunov_spectrum(10.0).verdict
    'periodic orbit'

    Heights of the maxima on the attractor:

    >>> maxima = udd.lyapunov_spectrum(1.0, tol=5e-3, section="maxima of z").section
    >>> maxima.component("z").shape, maxima.residual < 1e-12
    ((600,), True)
    """
    model = w if isinstance(w, Model) else DLE(number("w", w, least=0.0))
    time_scale = model.time_scale
    time, skipped = span(t, transient, longest=2e5 * time_scale, skip=400.0 * time_scale)
    goal = number("tol", 1e-3 / time_scale if tol is None else tol, above=0.0)
    rtol, atol = tolerances(rtol, atol)
    start = initial_state(model, default_state(model) if state0 is None else state0)

    run = _Run(model, rtol, atol, longest_step(max_step, time))
    if section is not None:
        run.refuse(section, start)
    orbits, fate = run.look(start, time, skipped, goal)
    spent, finer = float(orbits["time"][0]), goal
    while not (fate.ordered or _positive(orbits, time_scale)) and spent < time:
        # Neither order nor chaos yet: on from here, for longer.
        finer /= 2.0
        orbits, fate = run.look(orbits["end"][0], time - spent, 0.0, finer)
        spent += float(orbits["time"][0])
    if not fate.ordered:
        # Chaos that has not ended may yet do so; without tangents the way there is short.
        fate = run.fate(orbits["end"][0], time - spent)
    settles = fate.kind not in ("aperiodic", "escapes")
    other = settles and (_positive(orbits, time_scale) or fate.t > 0.0)
    aside = spent + fate.t if other else 0.0
    if settles and abs(orbits["value"][0, 0]) > _SIGMAS * orbits["standard_error"][0, 0]:
        # The averages are of the way there: once more, of what it leads to.
        orbits, fate = run.look(fate.state, time, 0.0, goal)
        if fate.kind == "settling" and _positive(orbits, time_scale):
            # Neighbours diverge all the way: chaos in bands so narrow that they look like points.
            fate = replace(fate, kind="aperiodic")
        aside = aside if fate.kind not in ("aperiodic", "escapes") else 0.0
    values, errors = orbits["value"][0], orbits["standard_error"][0]
    verdict = _verdict(run, fate, orbits)
    settles = fate.kind == "settling" and verdict == "undecided"
    converged = bool(errors[0] <= goal) and not settles
    if settles:
        warnings.warn(
            f"the motion still settles after t = {spent + fate.t:g}: these are no exponents of its end; "
            f"a longer t (now {time:g}) would help",
            ConvergenceWarning,
            stacklevel=outside(),
        )
    elif not converged and fate.kind != "escapes":
        warnings.warn(
            f"the largest exponent has a standard error of {errors[0]:.2g}, above tol = {goal:g}; "
            f"a longer t (now {time:g}) would help",
            ConvergenceWarning,
            stacklevel=outside(),
        )
    if fate.kind not in ("equilibrium", "escapes"):
        warn_from(model, orbits["end"][0], 0.0, min(time, LOOK * time_scale), rtol, atol)
    order = np.argsort(-values, kind="stable")
    values, errors = values[order], errors[order]
    # On an attractor that is a curve the exponent along it is zero, whatever the averages still say.
    dimensions = {"equilibrium": 0.0, "periodic orbit": 1.0, "escapes": np.nan}
    dimension = dimensions[verdict] if verdict in dimensions else kaplan_yorke(values)
    if verdict == "torus":
        dimension = kaplan_yorke(np.where(np.abs(values) < _STAYS / time_scale, 0.0, values))
    return Spectrum(
        values,
        errors,
        dimension,
        verdict,
        fate.period if verdict == "periodic orbit" else np.nan,
        _invariants(model, values, orbits["mean"][0], orbits["product"][0]),
        float(orbits["time"][0]),
        aside,
        orbits["end"][0],
        converged,
        model,
        None if section is None else run.points(orbits["end"][0], section),
    )


def _verdict(run: _Run, fate: Fate, orbits: _core._Orbits) -> str:
    """Return the fate of the orbit if the exponents agree with it, else the verdict of the exponents."""
    time_scale = run.model.time_scale
    zeros = _zeros(run, orbits)
    if fate.kind == "periodic orbit":
        # Nothing grows or shrinks along a cycle.
        long = float(orbits["time"][0]) > _PERIODS * fate.period
        return "undecided" if long and zeros < 1 else fate.kind
    if fate.ordered:
        return fate.kind
    if fate.kind == "settling":
        return "torus" if _neither_settles_nor_parts(run, fate, orbits) else "undecided"
    if _positive(orbits, time_scale):
        # Orbits in a plane cannot cross, so that none of them is chaotic.
        return "chaos" if len(run.kept) + run.timed > 2 else "undecided"
    value = orbits["value"][0]
    if value.max() < _STAYS / time_scale and np.isfinite(fate.clock):
        # Neighbours stay as near as they are over many returns of the orbit.
        if zeros >= 2 and float(orbits["time"][0]) > _PERIODS * fate.clock:
            return "torus"
        if zeros == 1:
            return "periodic orbit"
    return "undecided"


def _neither_settles_nor_parts(run: _Run, fate: Fate, orbits: _core._Orbits) -> bool:
    """Return True if distances in two directions stayed the same for the whole of a long run.

    A torus that nearly comes back looks as if it settled, but what settles shrinks meanwhile.
    """
    time = float(orbits["time"][0])
    growth = orbits["value"][0] * time
    free = len(run.model.state_names) - len(run.kept)
    stay = int((np.abs(growth) < _GROWTH).sum()) - free + run.timed
    return bool(stay >= 2 and growth.max() < _GROWTH and time > _LONG * fate.clock)


def _zeros(run: _Run, orbits: _core._Orbits) -> int:
    """Count the directions in which distances stay the same, without angles that nothing depends on.

    Time is a direction, too, if the rates depend on it.
    """
    free = len(run.model.state_names) - len(run.kept)
    small = np.maximum(_SIGMAS * np.nan_to_num(orbits["standard_error"][0]), _STAYS / run.model.time_scale)
    return int((np.abs(orbits["value"][0]) < small).sum()) - free + run.timed


def _positive(orbits: _core._Orbits, time_scale: float) -> bool:
    """Return True if neighbouring orbits separate faster than by any power of the time up to the second.

    If energy is conserved, neighbours of a regular motion separate in proportion to time. The scatter of an
    exponent's means does not show that: all of them are above zero.
    """
    value, time = orbits["value"][0, 0], float(orbits["time"][0])
    grown = value * time > _POWER * np.log1p(time / time_scale)
    return bool(value > _SIGMAS * orbits["standard_error"][0, 0] and grown)


@dataclass(frozen=True)
class _Run(Orbit):
    """One orbit's exponents and fate."""

    def __call__(self, start: _Floats, time: float, skipped: float, goal: float) -> _core._Orbits:
        row = np.array([list(self.model.parameters.values())])
        batch = Batch(self.model, row, start[None, :], self.rtol, self.atol, max_step=self.longest)
        return _core.lyapunov(batch, True, time, skipped, goal)

    def look(self, start: _Floats, time: float, skipped: float, goal: float) -> tuple[_core._Orbits, Fate]:
        """Compute the exponents of a run, and follow the orbit after it."""
        orbits = self(start, time, skipped, goal)
        outcome, end = int(orbits["outcome"][0]), orbits["end"][0]
        if outcome == FINISHED:
            return orbits, self.fate(end)
        plain = [name not in self.model.angles for name in self.model.state_names]
        far = np.abs(end) > _FAR * np.maximum(1.0, np.abs(start))
        if outcome == FAILED and (far & plain).any():
            return orbits, Fate("escapes", np.nan, end, 0.0)
        raise IntegrationError(f"there is no spectrum: {reason(OUTCOMES[outcome], orbits['failure'])}")

    def refuse(self, section: str | Sequence[str], start: _Floats) -> None:
        """Refuse a surface that cannot be used, before the long run."""
        self.points_if_any(start, section, n=1, t_max=1e-9)


def kaplan_yorke(exponents: ArrayLike) -> float:
    """Compute the Kaplan-Yorke dimension [21] of exponents in decreasing order.

    Parameters
    ----------
    exponents : array_like, shape (dim,)

    Returns
    -------
    float
        The number k of leading exponents whose sum is not negative, and the part of the next one that brings
        it to zero: ``k + sum / |next|`` (J. L. Kaplan and J. A. Yorke, Lecture Notes in Mathematics 730
        (1979) 204).

    Examples
    --------
    >>> from udd.chaos.spectrum import kaplan_yorke
    >>> round(kaplan_yorke([0.21016, 0.0, -1.21016]), 5)
    2.17366
    """
    values = np.asarray(exponents, dtype=np.float64)
    sums = np.cumsum(values)
    leading = int(np.argmax(sums < 0.0)) if (sums < 0.0).any() else len(values)
    if leading in (0, len(values)):
        return float(leading)
    return float(leading + sums[leading - 1] / abs(values[leading]))


def _invariants(model: Model, exponents: _Floats, mean: _Floats, product: _Floats) -> dict[str, float]:
    """Return the deviations of exact averages from their values.

    They follow from the rates of functions of the state, which average to zero on bounded orbits.
    """
    averages = model.profile.dynamics.averages
    return {} if averages is None else averages(model, exponents, mean, product)


@dataclass(frozen=True, eq=False, repr=False)
class Covariant(Drawable, OneLine):
    """Covariant Lyapunov vectors along an orbit, with the exponents of finite times.

    Attributes
    ----------
    t : ndarray, shape (n + 1,)
        Times. They are equally spaced.
    state : ndarray, shape (n + 1, dim)
        States at these times.
    vectors : ndarray, shape (n + 1, dim, dim)
        ``vectors[k, i]`` is the unit vector i at time k. It grows at the rate of exponent i, forwards and
        backwards in time.
    local_exponents : ndarray, shape (n, dim)
        Mean growth rates of the orthonormal frame in each interval: the exponents of finite time. Their mean
        over all intervals is the spectrum.

    See Also
    --------
    udd.covariant_vectors : makes it.
    udd.plot.spectrum : draw the finite-time exponents.

    References
    ----------
    F. Ginelli et al. [22].
    """

    t: _Floats
    state: _Floats
    vectors: _Floats
    local_exponents: _Floats

    @property
    def angles(self) -> _Floats:
        """The angles in rad between the first vector and the others, shape (n + 1, dim - 1)."""
        along = np.einsum("kn,kin->ki", self.vectors[:, 0], self.vectors[:, 1:])
        angles: _Floats = np.arccos(np.clip(np.abs(along), 0.0, 1.0))
        return angles


@checked_arguments
def covariant_vectors(
    model: Model,
    n: int = 1000,
    *,
    dt: float | None = None,
    state0: ArrayLike | None = None,
    transient: float | None = None,
    rtol: float = 1e-9,
    atol: float = 1e-12,
    max_step: float | None = None,
) -> Covariant:
    """Compute covariant Lyapunov vectors and finite-time exponents along an orbit.

    Parameters
    ----------
    model : Model
        :class:`udd.DLE`, :class:`udd.Disk` or :class:`udd.Pendulum`.
    n : int
        Number of intervals.
    dt : float, optional
        Length of an interval. The default is 0.5, or 0.125 s for a model with units.
    state0 : array_like, shape (dim,), optional
        Initial state.
    transient : float, optional
        Time run before the first and after the last interval, in which the frame and the vectors converge, by
        default 200, or 50 s.
    rtol, atol : float
        Tolerances of the run.
    max_step : float, optional
        The longest step, as for :func:`udd.simulate`.

    Returns
    -------
    Covariant
        Fields ``t``, ``state``, ``vectors``, ``local_exponents`` and ``angles``.

    Raises
    ------
    ModelError
        Options that cannot be used.
    IntegrationError
        The disk leaves the wheels, the solution blows up, or a direction dies out where a contact sticks.
    MemoryError
        There is no room for so many intervals: `n` of them and twice the `transient`, each of length `dt`.

    See Also
    --------
    udd.lyapunov_spectrum : the exponents alone.
    udd.plot.spectrum : draw the finite-time exponents.

    Notes
    -----
    The method is that of F. Ginelli et al., Physical Review Letters 99 (2007) 130601 [22]. Forwards in time
    the frame is made orthonormal after each interval. Backwards the vectors inside it converge to the
    covariant ones.

    Examples
    --------
    The vector of the zero exponent is the direction of the flow:

    >>> import numpy as np
    >>> import udd
    >>> covariant = udd.covariant_vectors(udd.DLE(1.0), 100)
    >>> flow = udd.DLE(1.0).rates(covariant.t, covariant.state)
    >>> flow /= np.linalg.norm(flow, axis=1, keepdims=True)
    >>> bool(abs(np.einsum("kn,kn->k", flow, covariant.vectors[:, 1])).min() > 1 - 1e-6)
    True
    """
    require_model(model)
    n = whole("n", n, 1)
    time_scale = model.time_scale
    step = number("dt", 0.5 * time_scale if dt is None else dt, above=0.0)
    aside = number("transient", 200.0 * time_scale if transient is None else transient, least=0.0)
    rtol, atol = tolerances(rtol, atol)
    longest = longest_step(max_step, step * n)
    start = initial_state(model, default_state(model) if state0 is None else state0)
    count = n + 2.0 * aside / step  # infinite where dt is tiny
    require_memory(
        f"{count:.6g} intervals", int(min(count, 1e300)), itemsize=8 * len(start) * (4 * len(start) + 3)
    )
    extra = int(np.ceil(aside / step))
    raw = _core.frames(model, start.tolist(), step, int(n) + 2 * extra, rtol, atol, longest)
    kept = slice(extra, extra + n + 1)
    times: _Floats = step * np.arange(extra, extra + n + 1, dtype=np.float64)
    return Covariant(
        times,
        raw["states"][kept],
        raw["covariant"][kept],
        raw["growth"][extra : extra + n] / step,
    )
