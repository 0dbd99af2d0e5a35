"""Runs of a model."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.labelled import of_states
from udd._util.validation import array, number
from udd.errors import IncompleteWarning, ModelError, outside
from udd.models import Model, require_model

from .below_tolerance import warn_of
from .model_inputs import driven

if TYPE_CHECKING:
    import xarray as xr

    from udd.measurement import InputSignal

__all__ = ["Event", "Events", "Stats", "Trajectory", "simulate"]


class Event(NamedTuple):
    """Event of a run.

    Attributes
    ----------
    kind : str
        ``"reversal"`` (Omega = 0), ``"friction kink"`` (k reaches its floor) or ``"edge"`` (the disk loses
        contact). Dry friction that is not smoothed also has ``"stick"`` (it stops and sticks), ``"slip"`` (it
        starts to move) and ``"band"`` (the speed passes the edge of Karnopp's band).
    t : float
        Time of the event.
    state : ndarray, shape (dim,)
        State at this time. It lies on the event's surface to 1e-12 of its size.
    """

    kind: str
    t: float
    state: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Events:
    """The events of a run, in order.

    Attributes
    ----------
    kind : tuple of str
        Kind of each event.
    t : ndarray, shape (n,)
        Times of the events.
    state : ndarray, shape (n, dim)
        States at these times.
    """

    kind: tuple[str, ...]
    t: NDArray[np.float64]
    state: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.kind)

    def __getitem__(self, index: int) -> Event:
        return Event(self.kind[index], float(self.t[index]), self.state[index])

    def __iter__(self) -> Iterator[Event]:
        return (self[index] for index in range(len(self)))

    def of(self, kind: str) -> Events:
        """Return the events of one kind."""
        chosen = np.array([event_kind == kind for event_kind in self.kind], dtype=bool)
        return Events(
            tuple(event_kind for event_kind in self.kind if event_kind == kind),
            self.t[chosen],
            self.state[chosen],
        )


class Stats(NamedTuple):
    """Statistics of a run.

    Attributes
    ----------
    accepted, rejected : int
        Numbers of steps.
    evaluations : int
        Number of evaluations of the rates.
    grazes : int
        Number of jumps of the law that the run only just reached. The derivatives after them are in doubt.
    method : str
        The method that took the steps: ``"dopri5"``, ``"dop853"``, ``"taylor"`` or ``"rodas"``.
    """

    accepted: int
    rejected: int
    evaluations: int
    grazes: int
    method: str


@dataclass(frozen=True, eq=False)
class Trajectory(Drawable):
    """Run of a model: times, states and events.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Times, in s (dimensionless for the DLE).
    state : ndarray, shape (n, dim)
        States, in the order of ``model.state_names``. The components are attributes too: ``run.Omega``.
    events : Events
        Crossings of the surfaces where the law changes, and of the disk's edge.
    outcome : {"finished", "ejected", "chattering"}
        An ejected run ends on the disk's edge. A chattering run ends at a point where the law switches again
        and again while time stands still. The last time and state are there.
    stats : Stats
        Accepted and rejected steps, evaluations of the rates, and the method that ran.
    model : Model
        The model of the run.
    dense : callable or None
        The core's record of all steps, if ``simulate(..., dense=True)`` was called. Call the trajectory
        instead.

    See Also
    --------
    udd.simulate : makes it.
    udd.plot.time_series : draw its coordinates.
    udd.energy_balance : compute its work and energy.
    """

    t: NDArray[np.float64]
    state: NDArray[np.float64]
    events: Events
    outcome: str
    stats: Stats
    model: Model
    dense: _core.Dense | None = None

    def to_xarray(self) -> xr.Dataset:
        """Return the run as labelled arrays: every state over ``t``, with its unit.

        Returns
        -------
        xarray.Dataset
            ``to_dataframe()`` of it is a table for pandas.

        Examples
        --------
        >>> import udd
        >>> udd.simulate(udd.Disk(0.039), [0, 1], [0, 0.001, 0.04, 0]).to_xarray().Y.attrs
        {'units': 'm'}
        """
        model = self.model
        attrs = {"model": repr(model), "outcome": self.outcome}
        return of_states(model.state_names, model.state_units, self.state, ["t"], {"t": self.t}, **attrs)

    def __call__(self, t: ArrayLike) -> NDArray[np.float64]:
        """Evaluate the state at any times within the run, as accurately as the method's dense output.

        Parameters
        ----------
        t : array_like, shape (...)
            Times.

        Returns
        -------
        ndarray, shape (..., dim)

        Raises
        ------
        ModelError
            The run kept no dense output.
        IntegrationError
            A time outside the run.
        """
        if self.dense is None:
            raise ModelError("this run kept no dense output; use simulate(..., dense=True)")
        times = array("t", t)
        return self.dense(times.ravel()).reshape(*times.shape, len(self.model.state_names))

    def __getattr__(self, name: str) -> NDArray[np.float64]:
        # Only for what is not an attribute otherwise; `model` is missing while unpickling.
        names = self.__dict__["model"].state_names if "model" in self.__dict__ else ()
        if name in names:
            column: NDArray[np.float64] = self.state[:, names.index(name)]
            return column
        raise AttributeError(f"a trajectory of this model has no {name!r}")

    def __dir__(self) -> list[str]:
        return sorted([*super().__dir__(), *self.model.state_names])

    def __repr__(self) -> str:
        return (
            f"<Trajectory of {self.model!r}: {len(self.t)} states, t = {self.t[0]:g} to {self.t[-1]:g}, "
            f"{len(self.events)} events, {self.outcome}>"
        )


_MOST_STEPS = 1e12  # of a run: they take days
METHODS = ("auto", "dopri5", "dop853", "taylor", "rodas")
"""How steps may be taken."""


def method_for(model: Model, method: str, rtol: float) -> str:
    """Return the meant method: for ``"auto"`` the faster one at equal error, as measured.

    The choice follows the table that `benches/python/methods.py` prints: the series wins for every law that
    has one; the core hands runs over to others where it does not serve. Friction with modes is left to
    Runge-Kutta methods, which know all its treatments.
    """
    if method not in METHODS:
        raise ModelError(f"method must be one of {', '.join(METHODS)}, not {method!r}")
    if method != "auto":
        return method
    effects = getattr(model, "effects", ())
    if any(getattr(effect, "treatment", "smoothed") not in (None, "smoothed") for effect in effects):
        return "dop853" if rtol <= 1e-8 else "dopri5"
    # A law that a user wrote may depend on comparisons.
    written = model.profile.written or any(effect.made for effect in effects)
    return "dop853" if written and not _core.has_series(model) else "auto"


def tolerances(rtol: float, atol: float) -> tuple[float, float]:
    """Checked tolerances."""
    # Below rounding no step size would do.
    rtol, atol = number("rtol", rtol, least=1e-15), number("atol", atol, above=0.0)
    return rtol, atol


def longest_step(max_step: float | None, span: float = 0.0) -> float:
    """Return a checked longest step, infinite if none is given, for a run of this length.

    Raises
    ------
    ModelError
        It is not positive, or the run would take days.
    """
    step = math.inf if max_step is None else number("max_step", max_step, above=0.0)
    if step * _MOST_STEPS < span:
        raise ModelError(
            f"max_step is {step:.3g}: a run of {span:.3g} would take more than {_MOST_STEPS:.0e} such steps; "
            "give a longer one"
        )
    return step


def checked_times(t: ArrayLike) -> NDArray[np.float64] | float:
    """Checked times at which states are wanted, or the end of a run from 0."""
    times = array("t", t)
    if times.ndim > 1 or times.size == 0:
        raise ModelError(f"t must be a number or a list of times, not of shape {times.shape}")
    if times.ndim == 0:
        return number("t", float(times), least=0.0)
    if not (times[1:] > times[:-1]).all():
        raise ModelError("the times must increase, without duplicates")
    return times


def initial_state(model: Model, state0: ArrayLike) -> NDArray[np.float64]:
    """Check an initial state."""
    require_model(model)
    state = array("state0", state0)
    if state.shape != (len(model.state_names),):
        raise ModelError(
            f"state0 must have the {len(model.state_names)} components {', '.join(model.state_names)}, "
            f"not shape {state.shape}"
        )
    return state


@checked_arguments
def simulate(
    model: Model,
    t: ArrayLike,
    state0: ArrayLike,
    *,
    rtol: float = 1e-9,
    atol: float = 1e-12,
    max_step: float | None = None,
    method: str = "auto",
    dense: bool = False,
    inputs: Mapping[str, InputSignal | ArrayLike] | None = None,
) -> Trajectory:
    """Run a model from an initial state.

    Parameters
    ----------
    model : Model
        :class:`udd.DLE`, :class:`udd.Disk`, :class:`udd.Pendulum` or a user's own :class:`udd.Model`.
    t : array_like, shape (n,), or float
        Increasing times of the states. The first is the initial time. A number is the end of a run from 0,
        and the states after all accepted steps are returned. The steps of a power
        series are long: ``"auto"`` gives seven states within each of them, too.
    state0 : array_like, shape (dim,)
        The initial state.
    rtol, atol : float
        Relative (at least 1e-15) and absolute (positive) tolerance of a step's error. They hold for each
        component, in its unit.
    max_step : float, optional
        The longest step. By default only the error limits it. Without it a smooth pulse that is shorter than
        a step can be missed.
    method : {"auto", "dopri5", "dop853", "taylor", "rodas"}
        ``"auto"`` takes the fastest, as measured. This is the power series if the law has one, and
        ``"dop853"`` if the series fails, as next to a pole. It is ``"rodas"`` for a model of your own that
        turns out to be stiff. ``run.stats.method`` says which one ran. ``"dopri5"`` is Dormand &
        Prince's method of order 5(4), with dense output of order 4; ``"dop853"`` is theirs of order 8(5, 3),
        with dense output of order 7, for tight tolerances. ``"taylor"`` follows the solution's power series
        to order 10 or 18, by the tolerance; its dense output is as accurate as its steps. ``"rodas"`` is the
        Rosenbrock method Rodas5P of order 5(4), with dense output of order 4, for stiff laws. All land on the
        surfaces where the law changes.
    dense : bool
        If True, the polynomials of all steps are kept, and the trajectory can be called with any times.
    inputs : mapping of str to InputSignal or array_like, optional
        The signal of each measured input of the model. Samples without times belong to the times `t`. The
        steps land on the samples at which the signal has a kink.

    Returns
    -------
    Trajectory
        Fields ``t``, ``state``, ``outcome``, ``events``, ``stats``; each component by name. A run that leaves
        the disk is cut at the edge and has the outcome "ejected".

    Raises
    ------
    ModelError
        Times, state or tolerances that cannot be used; a start outside the disk.
    IntegrationError
        The solution blows up.
    KeyboardInterrupt
        On Ctrl-C, at once.

    Warns
    -----
    IncompleteWarning
        The disk left the wheels.
    StiffnessWarning
        A model of your own that is stiff is run by a method for those that are not; the warning comes while
        the run goes on.
    ToleranceWarning
        A component falls below `atol` and grows again in proportion to itself, as a population does: an error
        of `atol` there changes what follows.

    See Also
    --------
    udd.ensemble : many runs at once.
    udd.poincare : crossings of a surface.
    udd.plot.time_series : draw the coordinates over time.
    udd.plot.orbit : draw the path.

    References
    ----------
    Orders 5 and 8: J. R. Dormand and P. J. Prince [8], E. Hairer et al. [10]. Taylor series: À. Jorba and M.
    Zou [13]. Rodas5P: G. Steinebach [12]. Sliding on a surface: A. F. Filippov [16].

    Examples
    --------
    >>> import numpy as np
    >>> import udd
    >>> run = udd.simulate(udd.DLE(1.0), np.linspace(0, 10, 101), [1.0, 1.0, 0.01])
    >>> run.state.shape, run.outcome
    ((101, 3), 'finished')
    >>> print(np.round(run.state[-1], 8))
    [0.97664031 0.9831748  0.04343309]

    A mass that a measured force pushes, here x = t^3/6:

    >>> mass = udd.Model(["x", "v"], ["v", "force"], inputs=["force"])
    >>> push = udd.InputSignal([0.0, 2.0], [0.0, 2.0])
    >>> print(np.round(udd.simulate(mass, [0, 1, 2], [0, 0], inputs={"force": push}).x, 12))
    [0.         0.16666667 1.33333333]
    """
    trajectory = integrated(
        model, t, state0, rtol=rtol, atol=atol, max_step=max_step, method=method, dense=dense, inputs=inputs
    )
    if trajectory.outcome == "ejected":
        warnings.warn(
            f"the disk left the wheels at t = {trajectory.t[-1]:.6g} s, where the run ends; a disk with "
            'edge="ignore" goes on by the equations alone, beyond where they hold',
            IncompleteWarning,
            stacklevel=outside(),
        )
    warn_of(trajectory.model, trajectory.t, trajectory.state, *tolerances(rtol, atol))
    return trajectory


def integrated(
    model: Model,
    t: ArrayLike,
    state0: ArrayLike,
    *,
    rtol: float = 1e-9,
    atol: float = 1e-12,
    max_step: float | None = None,
    method: str = "dopri5",
    dense: bool = False,
    inputs: Mapping[str, InputSignal | ArrayLike] | None = None,
) -> Trajectory:
    """Run a model without a warning if the disk loses contact; the caller reads the outcome."""
    state = initial_state(model, state0)
    rtol, atol = tolerances(rtol, atol)
    times = checked_times(t)
    longest = longest_step(max_step, times if isinstance(times, float) else float(times[-1] - times[0]))
    stepper = method_for(model, method, rtol)
    model = driven(model, np.array([0.0, times]) if isinstance(times, float) else times, inputs)
    if isinstance(times, float):
        raw = _core.simulate(model, None, times, state.tolist(), rtol, atol, longest, stepper, dense)
    else:
        raw = _core.simulate(model, times, math.nan, state.tolist(), rtol, atol, longest, stepper, dense)
    events = Events(tuple(raw["event_kind"]), raw["event_t"], raw["event_state"])
    stats = Stats(*raw["counts"], raw["method"])
    return Trajectory(raw["t"], raw["state"], events, raw["outcome"], stats, model, raw["dense"])
