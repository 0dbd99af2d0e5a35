"""Classification of long-term motion: runs are extended until it is clear, or undecided."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from udd.chaos.recurrence import APERIODIC, SETTLING, Tightness, periods, tightness
from udd.chaos.rest import equilibrium_near
from udd.models import Model
from udd.models.state_scaling import Coordinates, Floats
from udd.simulation.outcomes import FINISHED

from .attractor import Attractor
from .motion_size import rest_test
from .section_runs import INTERRUPTED, OUT_OF_TIME, UNDECIDED, Crossings, SectionRunner


@dataclass(frozen=True)
class MotionClassifier:
    """Tells equilibria, periodic and aperiodic motions, and what still settles."""

    model: Model
    parameter: str | None
    coordinates: Coordinates
    runner: SectionRunner

    @cached_property
    def tight(self) -> Tightness:
        """Return the tolerances within which points must agree."""
        return tightness(self.runner.rtol)

    def __call__(self, crossings: Crossings, values: Floats) -> Classification:
        """Classify each job; `values` (jobs,) are those of the parameter that varies."""
        jobs = len(crossings.points)
        whole = np.flatnonzero(crossings.outcome == FINISHED)
        period = np.full(jobs, APERIODIC, dtype=np.int32)
        period[whole] = periods(self.coordinates(crossings.points[whole]), self.tight)
        rest = np.zeros(jobs, dtype=bool)
        # An equilibrium lies on the section, or the motion never gets there.
        crossed = np.flatnonzero((period == 1) & (crossings.outcome == FINISHED))
        for rows, states in (
            (crossed, crossings.points[:, -1]),
            (np.flatnonzero(crossings.outcome == OUT_OF_TIME), crossings.end),
        ):
            for value in np.unique(values[rows]):
                here = rows[values[rows] == value]
                model = self.at(value)
                slow = here[self.coordinates.speed(model, states[here]) < 20.0 * self.tight.settled]
                rest[slow], passes = self._resting(model, states[slow])
                # A cycle may be slow, too, but does not stay next to an equilibrium.
                period[slow[passes if rows is crossed else ~rest[slow]]] = SETTLING
        period[rest] = 1
        return Classification(period, rest)

    def _resting(self, model: Model, states: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return masks of the nearly resting states: at an attracting equilibrium, and passing another."""
        # A diagram also shows orbits that a symmetry keeps on what repels.
        kept = np.flatnonzero(np.isfinite(self.coordinates.size))
        test = rest_test(self.runner, model, self.coordinates)
        rest, passes = np.zeros((2, len(states)), dtype=bool)
        equilibria: list[Floats] = []
        for k, state in enumerate(states):
            place = self.coordinates(state)
            if any(np.abs(place - other).max(initial=0.0) < self.tight.same for other in equilibria):
                rest[k] = True
            elif test(state, attracts=self.parameter is None) is not None:
                rest[k] = True
                equilibria.append(place)
            elif (equilibrium := equilibrium_near(model, state, kept, 0.0)) is not None:
                there = state.copy()
                there[kept] = equilibrium.state
                off = np.abs(self.coordinates(there) - place).max(initial=0.0)
                passes[k] = off < 20.0 * self.tight.settled
        return rest, passes

    def at(self, value: float) -> Model:
        """Return the model with a value of the parameter."""
        return self.model if self.parameter is None else self.model.with_parameters({self.parameter: value})

    def attractor(self, crossings: Crossings, verdicts: Classification, job: int) -> Attractor:
        """Return the attractor on which a job with a verdict ended."""
        period = int(verdicts.period[job])
        if verdicts.rest[job]:
            last = crossings.points[job, -1]
            states = (last if np.isfinite(last).all() else crossings.end[job])[None]
            return Attractor("equilibrium", states, self.coordinates(states))
        if period == APERIODIC:
            states = crossings.points[job].copy()
            return Attractor("aperiodic", states, self.coordinates(states))
        states = crossings.points[job, -period:].copy()
        t = crossings.t[job]
        return Attractor("periodic", states, self.coordinates(states), float(t[-1] - t[-1 - period]))


@dataclass(eq=False)
class Classification:
    """The period of each job (see :func:`udd.chaos.recurrence.periods`), and whether it is at rest."""

    period: NDArray[np.int32]
    rest: NDArray[np.bool_]

    @classmethod
    def none(cls, jobs: int) -> Classification:
        """Before the work."""
        return cls(np.full(jobs, APERIODIC, dtype=np.int32), np.zeros(jobs, dtype=bool))

    def only(self, some: NDArray[np.bool_]) -> Classification:
        """Return the entries of some jobs."""
        return Classification(self.period[some], self.rest[some])

    def put(self, rows: NDArray[np.intp], other: Classification) -> None:
        """Replace some."""
        self.period[rows], self.rest[rows] = other.period, other.rest


def put(crossings: Crossings, rows: NDArray[np.intp], other: Crossings) -> None:
    """Replace some jobs' points by later ones."""
    for name in ("points", "t", "outcome", "end"):
        getattr(crossings, name)[rows] = getattr(other, name)
    crossings.t_end[rows] += other.t_end


def decided(crossings: Crossings, verdicts: Classification) -> NDArray[np.bool_]:
    """Return a mask of the jobs that have ended on an attractor."""
    is_decided: NDArray[np.bool_] = (
        (crossings.outcome == FINISHED) & (verdicts.period != SETTLING)
    ) | verdicts.rest
    return is_decided


def followed_on(crossings: Crossings, verdicts: Classification) -> NDArray[np.bool_]:
    """Return a mask of the jobs that still settle: they nearly return or rest, and can be continued."""
    some: NDArray[np.bool_] = np.isin(crossings.outcome, (FINISHED, OUT_OF_TIME))
    some &= verdicts.period == SETTLING
    return some


def follow(
    runner: SectionRunner,
    judge: MotionClassifier,
    rows: Floats,
    values: Floats,
    starts: Floats,
    transient: int,
    n: int,
    longest: int,
) -> tuple[Crossings, Classification]:
    """Run jobs, and those that still settle for twice as long, again and again, up to `longest` points.

    A job that is still not clear has the outcome "undecided".
    """
    crossings = runner(rows, starts, transient, n)
    verdicts = judge(crossings, values)
    spent = transient + n
    while len(open_ := np.flatnonzero(followed_on(crossings, verdicts))):
        stopped = (crossings.outcome == INTERRUPTED).any()
        if 2 * spent + n > longest and not stopped:
            crossings.outcome[open_] = UNDECIDED
        elif stopped or not again(runner, judge, rows, values, crossings, verdicts, open_, spent, n):
            still = open_[verdicts.period[open_] == SETTLING]
            crossings.outcome[still], crossings.points[still] = INTERRUPTED, np.nan
        spent += spent + n
    return crossings, verdicts


def again(
    runner: SectionRunner,
    judge: MotionClassifier,
    rows: Floats,
    values: Floats,
    crossings: Crossings,
    verdicts: Classification,
    jobs: NDArray[np.intp],
    skip: int,
    n: int,
) -> bool:
    """Follow some jobs on from where they are; whether all were finished. Others stay as they were."""
    continued = runner(rows[jobs], crossings.end[jobs], skip, n)
    done = continued.outcome != INTERRUPTED
    put(crossings, jobs[done], continued.only(done))
    verdicts.put(jobs[done], judge(continued, values[jobs]).only(done))
    return bool(done.all())
