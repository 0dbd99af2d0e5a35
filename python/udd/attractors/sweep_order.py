"""The order of a sweep: all values at once, or the state carried from value to value."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from udd._util.memory import require_memory
from udd.models.state_scaling import Floats
from udd.simulation.outcomes import OUTCOMES

from .section_runs import INTERRUPTED, UNDECIDED, Crossings, parts

PATHS = {"independent": ("independent",), "up": ("up",), "down": ("down",), "both": ("up", "down")}

# In no particular direction, so that it breaks every symmetry.
_KICK = np.array([1.0, -0.7, 0.4, -0.2, 0.1])
_GOES_ON = [OUTCOMES.index("finished"), OUTCOMES.index("time ran out"), UNDECIDED]


def nothing(jobs: int, n: int, dim: int) -> Crossings:
    """Before the work: nothing is there, as after Ctrl-C."""
    require_memory(f"{n} points of each of {jobs} jobs", jobs, (n + 1) * (dim + 1), itemsize=8)
    return Crossings.none(n, INTERRUPTED, np.full((jobs, dim), np.nan))


def perturbation(size: Floats, nudge: float) -> Floats:
    """Return the perturbation of a state that is carried over; `size` is that of the components."""
    result: Floats = nudge * np.where(np.isfinite(size), size, 0.0) * np.resize(_KICK, len(size))
    return result


def run_in_order(
    work: Callable[[NDArray[np.intp], Floats], None],
    crossings: Crossings,
    begin: Floats,
    places: NDArray[np.intp],
    names: tuple[str, ...],
    added: Floats,
    each: int,
    tell: Callable[[int], object],
) -> bool:
    """Do every job, and say whether it was stopped by Ctrl-C.

    Parameters
    ----------
    work : callable
        Takes jobs and their initial states, and fills `crossings`.
    crossings : Crossings
        Result of all jobs.
    begin : ndarray (starts, dim)
        Initial states. Each path begins at all of them.
    places : ndarray (paths, starts, values)
        Number of each job.
    names : tuple of str
        Names of the paths.
    added : ndarray (dim,)
        Perturbation of a state that is carried over. It leads away from an unstable orbit.
    each : int
        Section points of a job.
    tell : callable
        Called with the number of jobs that were done since the last call.
    """
    steps = _at_once(begin, places, each) if names == ("independent",) else None
    states = np.tile(begin, (len(names), 1))
    values = places.shape[2]
    try:
        if steps is not None:
            for these, starts in steps:
                work(these, starts)
                tell(len(these))
                if (crossings.outcome[these] == INTERRUPTED).any():
                    return True
            return False
        for k in range(values):
            columns = [k if name == "up" else values - 1 - k for name in names]
            these = np.concatenate([places[i, :, c] for i, c in enumerate(columns)])
            work(these, states)
            tell(len(these))
            if (crossings.outcome[these] == INTERRUPTED).any():
                return True
            end = crossings.end[these]
            goes_on = np.isin(crossings.outcome[these], _GOES_ON) & np.isfinite(end).all(axis=1)
            states = np.where(goes_on[:, None], end + added, np.tile(begin, (len(names), 1)))
        return False
    except KeyboardInterrupt:
        return True


def _at_once(begin: Floats, places: NDArray[np.intp], each: int) -> list[tuple[NDArray[np.intp], Floats]]:
    """Neighbouring values side by side, each from its initial state."""
    states = np.repeat(begin, places.shape[2], axis=0)
    return [(places.ravel()[part], states[part]) for part in parts(places.size, each)]
