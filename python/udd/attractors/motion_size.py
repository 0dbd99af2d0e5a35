"""Size of the motions whose attractors are compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from udd.chaos.rest import RestTest
from udd.models import Model
from udd.models.state_scaling import Coordinates, Floats, coordinates_of
from udd.simulation.below_tolerance import warn_of_some
from udd.simulation.outcomes import FINISHED
from udd.simulation.sampling import states_along

from .section_runs import INTERRUPTED, OUT_OF_TIME, SectionRunner

_LONGEST = 1e3  # times the longest time for a section point: a slow decay is followed for no longer
_PILOTS = 16
_RETURNS = 20  # section points along which the extent of a motion is measured
_SAMPLES = 1000


def rest_test(runner: SectionRunner, model: Model, coordinates: Coordinates) -> RestTest:
    """Make the test for orbits that settle at an equilibrium."""
    kept = np.flatnonzero(np.isfinite(coordinates.size))
    longest = _LONGEST * runner.t_each
    return RestTest(model, kept, coordinates.clock, longest, runner.rtol, runner.atol)


def sized_by_motion(
    runner: SectionRunner, row: Floats, starts: Floats, transient: int, n: int
) -> tuple[Coordinates, bool]:
    """Return the coordinates for orbits from states (jobs, dim), and True if Ctrl-C stopped the search.

    Warn if runs lose components below `atol`.

    If the model has no sizes itself, a component's size is half its range along some of the motions, on
    the way to rest, or among the states: the origin does not count.
    """
    model = runner.model
    coordinates = coordinates_of(model, starts)
    if model.profile.dynamics.sizes is not None:
        return coordinates, False
    some = np.unique(np.linspace(0, len(starts) - 1, min(_PILOTS, len(starts))).astype(int))
    crossings = runner(np.tile(row, (len(some), 1)), starts[some], transient, n)
    stopped = bool((crossings.outcome == INTERRUPTED).any())
    if not stopped:
        warn_of_some(model, row[None], starts[some], crossings.t_end, runner.rtol, runner.atol)
    rests = rest_test(runner, model, coordinates)
    range_, way = np.zeros((2, starts.shape[1]))
    for job in np.flatnonzero(np.isin(crossings.outcome, (FINISHED, OUT_OF_TIME))):
        if crossings.outcome[job] == FINISHED and rests(crossings.points[job, -1]) is None:
            span = float(crossings.t[job, -1] - crossings.t[job, -1 - min(_RETURNS, n - 1)])
            range_ = np.maximum(range_, _range(runner, crossings.points[job, -1], span))
        else:
            # An equilibrium is moved by errors alone.
            way = np.maximum(way, _range(runner, starts[some[job]], float(crossings.t_end[job])))
    between = np.ptp(starts, axis=0)
    noise = 100.0 * (runner.atol + runner.rtol * np.abs(starts).max(axis=0))
    size = coordinates.size
    for measured in (between, way, range_):
        size = np.where(measured > noise, 0.5 * measured, size)
    size = np.where(np.isfinite(coordinates.size), size, np.inf)
    return replace(coordinates, size=size), stopped


def _range(runner: SectionRunner, start: Floats, span: float) -> Floats:
    """Return the range of each component along an orbit, zero if it ends before."""
    states = states_along(runner.model, span, _SAMPLES, start, runner.rtol, runner.atol)
    result: Floats = np.zeros(len(start)) if states is None else np.ptp(states, axis=0)
    return result
