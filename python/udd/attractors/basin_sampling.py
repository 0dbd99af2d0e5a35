"""Many initial states, each integrated until its attractor is identified."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from udd._util.progress import Count
from udd.models.state_scaling import Floats
from udd.simulation.outcomes import FINISHED

from .arguments import parameter_rows
from .attractor import Attractor
from .catalogue import AttractorCatalogue
from .classification import follow
from .section_runs import INTERRUPTED, UNDECIDED, SectionRunner, parts


class InitialStates:
    """Initial states, and what has become of each.

    Attributes
    ----------
    place : ndarray of int (jobs,)
        Place of its attractor in the register, or -1.
    outcome : ndarray (jobs,)
        How it ended.
    """

    def __init__(
        self, runner: SectionRunner, register: AttractorCatalogue, starts: Floats, n: int, longest: int
    ) -> None:
        self.runner, self.register, self.starts = runner, register, starts
        self._n, self._longest = n, longest
        self._end = starts.copy()
        self.place = np.full(len(starts), -1, dtype=np.int32)
        self.outcome = np.full(len(starts), INTERRUPTED, dtype=np.uint8)

    def run(self, transient: int, bar: Count) -> bool:
        """Do all the work; whether it was stopped by Ctrl-C."""
        jobs = np.arange(len(self.starts))
        spent = transient + self._n
        try:
            for part in parts(len(jobs), spent):
                if not self._follow(jobs[part], transient):
                    return True
                bar.update(part.stop - part.start)
            bar.say("following what is aperiodic")
            return self._confirm(spent)
        except KeyboardInterrupt:
            return True

    def _follow(self, jobs: NDArray[np.intp], skip: int) -> bool:
        """Follow some on from where they are; whether all of them were finished."""
        rows = parameter_rows(self.runner.model, {}, len(jobs))
        judge = self.register.judge
        values = np.zeros(len(jobs))
        crossings, verdicts = follow(
            self.runner, judge, rows, values, self._end[jobs], skip, self._n, self._longest
        )
        done = crossings.outcome != INTERRUPTED
        place = self.register.places(crossings, verdicts)
        self.place[jobs[done]] = place[done]
        self.outcome[jobs[done]] = np.where(place >= 0, FINISHED, crossings.outcome)[done]
        self._end[jobs[done]] = crossings.end[done]
        return bool(done.all())

    def _confirm(self, spent: int) -> bool:
        """Follow the aperiodic ones twice as far, until none of an attractor's leave it any more.

        Those of which some still leave it at the longest are undecided.
        """
        open_ = self._aperiodic()
        while len(open_):
            before = self.place[open_]
            for part in parts(len(open_), spent + self._n):
                if not self._follow(open_[part], spent):
                    return True
            left = np.unique(before[self.place[open_] != before])
            spent += spent + self._n
            open_ = np.intersect1d(open_[np.isin(before, left)], self._aperiodic())
            if 2 * spent + self._n > self._longest:
                self.place[open_], self.outcome[open_] = -1, UNDECIDED
                break
        return False

    def _aperiodic(self) -> NDArray[np.intp]:
        kinds = np.array([one.kind == "aperiodic" for one in self.register.attractors] + [False])
        return np.flatnonzero(kinds[self.place])

    def ranked(self) -> tuple[list[Attractor], NDArray[np.int32]]:
        """Sort attractors by their basins, the largest first, and number the jobs' attractors from 1."""
        counts = np.bincount(self.place[self.place >= 0], minlength=len(self.register.attractors))
        order = np.argsort(-counts, kind="stable")[: int((counts > 0).sum())]
        number = np.zeros(len(counts) + 1, dtype=np.int32)
        number[order] = np.arange(1, len(order) + 1)
        return [self.register.attractors[k] for k in order], number[self.place]
