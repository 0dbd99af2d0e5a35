"""Runs from section to section, in parts that a progress bar can follow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.memory import require_memory
from udd.models import Model
from udd.models.parameter_batch import outside_domain
from udd.models.state_scaling import Floats
from udd.simulation.batch import Batch
from udd.simulation.outcomes import OUTCOMES

START_OUTSIDE = len(OUTCOMES)
UNDECIDED = START_OUTSIDE + 1
ALL_OUTCOMES = (*OUTCOMES, "start outside", "undecided")
"""How a job may end, by number: as runs do, not begun as it starts off the wheels, or without a verdict."""
INTERRUPTED, OUT_OF_TIME = OUTCOMES.index("interrupted"), OUTCOMES.index("time ran out")

_AT_ONCE = 1_000_000  # section points in one call of the core, about a second of work


@dataclass(eq=False)
class Crossings:
    """Section points of many jobs: `points` (jobs, n, dim) and `t` (jobs, n), NaN where there are fewer."""

    points: Floats
    t: Floats
    outcome: NDArray[np.uint8]
    end: Floats
    t_end: Floats

    @classmethod
    def none(cls, n: int, outcome: int, end: Floats) -> Crossings:
        """Return `n` missing points of each job, which ends at a state (jobs, dim)."""
        jobs, dim = end.shape
        points, t = np.full((jobs, n, dim), np.nan), np.full((jobs, n), np.nan)
        return cls(points, t, np.full(jobs, outcome, dtype=np.uint8), end, np.zeros(jobs))

    def only(self, some: NDArray[np.bool_]) -> Crossings:
        """Return the crossings of some jobs."""
        return Crossings(
            self.points[some], self.t[some], self.outcome[some], self.end[some], self.t_end[some]
        )


@dataclass(frozen=True)
class SectionRunner:
    """The settings that all jobs of an analysis have in common."""

    model: Model
    section: tuple[str, ...]
    direction: tuple[int, ...]
    rtol: float
    atol: float
    threads: int
    t_each: float
    """The longest time that a point may take on average."""
    max_step: float

    def __call__(self, values: Floats, starts: Floats, skip: int, count: int) -> Crossings:
        """`count` points of each job after leaving out `skip`.

        Parameters
        ----------
        values : ndarray (jobs, parameters)
        starts : ndarray (jobs, dim)
        skip, count : int

        Returns
        -------
        Crossings
            Jobs that were stopped by Ctrl-C have the outcome "interrupted".
        """
        outside = outside_domain(self.model, values, starts)
        jobs = len(starts)
        require_memory(
            f"{count} points of each of {jobs} runs", jobs, count, starts.shape[1] + 1, itemsize=16
        )
        crossings = Crossings.none(count, START_OUTSIDE, starts.copy())
        runs = np.flatnonzero(~outside)
        if len(runs):
            run_values, first = np.ascontiguousarray(values[runs]), np.ascontiguousarray(starts[runs])
            batch = Batch(
                self.model, run_values, first, self.rtol, self.atol, self.threads, None, self.max_step
            )
            surfaces = list(zip(self.section, self.direction, strict=True))
            got = _core.sections(batch, surfaces, skip, count, self.t_each * (skip + count))
            columns = got["t"].shape[1]  # fewer after Ctrl-C
            crossings.points[runs, :columns], crossings.t[runs, :columns] = got["points"], got["t"]
            crossings.outcome[runs], crossings.end[runs], crossings.t_end[runs] = (
                got["outcome"],
                got["end"],
                got["t_end"],
            )
            cut = crossings.outcome == INTERRUPTED
            crossings.points[cut], crossings.t[cut] = np.nan, np.nan
        return crossings


def parts(jobs: int, each: int) -> Iterator[slice]:
    """Jobs of `each` section points, cut into calls of the core."""
    size = max(256, _AT_ONCE // max(each, 1))
    for first in range(0, jobs, size):
        yield slice(first, min(first + size, jobs))
