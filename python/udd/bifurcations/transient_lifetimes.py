"""Lifetimes of transients: maximum-likelihood mean of exponential lifetimes, censored runs included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.keywords import renamed
from udd._util.validation import array, number
from udd.errors import ModelError
from udd.models import Model, beyond_the_edge, require_model
from udd.simulation.ensembles import ensemble

from .flow_map import Floats, FlowMap, flow_of
from .solutions import Equilibrium, PeriodicOrbit

__all__ = ["Lifetimes", "lifetimes"]

_STAYS = 4  # states in a row, a typical time apart, near an attractor mean that the motion stays there
_CHUNK = 256  # states of a run between two looks
_ROUND = 800  # states that show a cycle


@dataclass(frozen=True, eq=False)
class Lifetimes(Drawable):
    """Times of motions before they settle.

    Attributes
    ----------
    time : ndarray, shape (n,)
        When each run came near an attractor to stay, or was left off.
    settled : ndarray of bool, shape (n,)
        Whether it did.
    after : float
        Runs that settled before are left out of the mean.
    mean : float
        The mean lifetime, if the motion forgets how old it is: infinite where none settled.
    standard_error : float
        That of the mean: the mean divided by the square root of the number that settled.

    See Also
    --------
    udd.lifetimes : measures them.
    udd.plot.lifetimes : draw them.
    """

    time: Floats
    settled: NDArray[np.bool_]
    after: float

    @property
    def mean(self) -> float:
        """The maximum-likelihood mean of exponential lifetimes, of which some were left off."""
        old = self.time > self.after
        ended = int(self.settled[old].sum())
        return float((self.time[old] - self.after).sum() / ended) if ended else float("inf")

    @property
    def standard_error(self) -> float:
        """The standard error of the mean."""
        ended = int((self.settled & (self.time > self.after)).sum())
        return self.mean / float(np.sqrt(ended)) if ended else float("nan")

    def __repr__(self) -> str:
        ended = int((self.settled & (self.time > self.after)).sum())
        return (
            f"<Lifetimes: mean {self.mean:.4g} +- {self.standard_error:.2g}, "
            f"{ended} of {len(self.time)} runs settled after {self.after:.4g}>"
        )


@renamed(longest="t_max")
@checked_arguments
def lifetimes(
    model: Model,
    starts: ArrayLike,
    attractors: Equilibrium | PeriodicOrbit | Sequence[Equilibrium | PeriodicOrbit],
    *,
    t_max: float,
    after: float | None = None,
    near: float = 0.02,
    threads: int | None = None,
) -> Lifetimes:
    """Measure the times of motions before they settle on known attractors.

    Parameters
    ----------
    model : Model
        Its rates must not depend on time. The disk's edge is ignored.
    starts : array_like, shape (n, dim)
        States, best of the transient motion itself.
    attractors : Equilibrium, PeriodicOrbit or a sequence of them
        Stable ones, from :func:`udd.equilibria` and :func:`udd.periodic_orbit`; their mirror images count
        too.
    t_max : float
        Runs that last longer are left off.
    after : float, optional
        The time in which the starts are forgotten, by default 20 typical times: what settles before is left
        out of the mean.
    near : float
        The distance, in typical sizes, within which an attractor keeps what comes.
    threads : int, optional
        By default one per core.

    Returns
    -------
    Lifetimes

    Raises
    ------
    ModelError
        Attractors that are not stable, or options that cannot be used.

    See Also
    --------
    udd.crises : the value at which a transient begins.
    udd.basins : which start ends where.
    udd.plot.lifetimes : draw them.

    Examples
    --------
    The chaotic motion that coexists with the stable rotation of the damped equations:

    >>> import numpy as np
    >>> import udd
    >>> model = udd.DLE(3.4, B=0.2)
    >>> rotation = [rest for rest in udd.equilibria(model) if rest.stable]
    >>> starts = np.random.default_rng(1).normal(size=(64, 3)) + [0, 1, -3]
    >>> lifetimes = udd.lifetimes(model, starts, rotation, t_max=2000.0)
    >>> bool(lifetimes.settled.mean() > 0.0)
    True
    """
    require_model(model)
    free = beyond_the_edge(model)
    given = np.atleast_2d(array("starts", starts))
    dim = len(model.state_names)
    if given.ndim != 2 or given.shape[1] != dim or not given.size:
        raise ModelError(f"starts must be states of {dim} components, not of shape {given.shape}")
    flow = flow_of(free, given)
    listed = [attractors] if isinstance(attractors, Equilibrium | PeriodicOrbit) else list(attractors)
    if not listed:
        raise ModelError("at least one attractor is needed")
    tree = cKDTree(np.vstack([_points(flow, one) for one in listed]))
    end = number("t_max", t_max, above=0.0)
    begin = number("after", 20.0 * flow.clock if after is None else after, least=0.0)
    radius = number("near", near, above=0.0)
    time, settled = np.full(len(given), end), np.zeros(len(given), dtype=bool)
    states, here = given.copy(), 0.0
    close = np.zeros((len(given), _STAYS - 1), dtype=bool)
    while here < end and not settled.all():
        jobs = np.flatnonzero(~settled)
        times = np.arange(min(_CHUNK, int(np.ceil((end - here) / flow.clock)) + 1)) * flow.clock
        run = ensemble(free, times, states[jobs], threads=threads).state
        states[jobs] = run[:, -1]
        scaled = flow.reduced(run[:, 1:]) / flow.size
        seen = np.hstack([close[jobs], tree.query(scaled)[0] < radius])
        close[jobs] = seen[:, 1 - _STAYS :]
        place, stays = first_stay(seen, _STAYS)
        first = here + (place + 2 - _STAYS) * flow.clock
        done = stays & (first < end)
        settled[jobs[done]], time[jobs[done]] = True, np.maximum(first[done], 0.0)
        here += float(times[-1])
    return Lifetimes(time, settled, begin)


def first_stay(close: NDArray[np.bool_], count: int) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return where each row (n, k) first has `count` true values in a row, and whether it has them."""
    if close.shape[1] < count:
        return np.zeros(len(close), dtype=np.intp), np.zeros(len(close), dtype=bool)
    stays = np.all(np.lib.stride_tricks.sliding_window_view(close, count, axis=1), axis=2)
    return np.argmax(stays, axis=1), stays.any(axis=1)


def _points(flow: FlowMap, attractor: Equilibrium | PeriodicOrbit) -> Floats:
    """States of an attractor and of its mirror image, scaled."""
    if not isinstance(attractor, Equilibrium | PeriodicOrbit) or not attractor.stable:
        raise ModelError(f"a stable equilibrium or cycle is needed, not {attractor!r}")
    own = attractor.state[np.newaxis]
    if isinstance(attractor, PeriodicOrbit):
        own = attractor.trajectory(_ROUND).state
    x = flow.reduced(own)
    return np.vstack([signs * x for signs in flow.images]) / flow.size
