"""The catalogue of attractors found so far, and which of them a motion has settled on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .attractor import Attractor
from .classification import Classification, MotionClassifier, decided
from .section_runs import Crossings


@dataclass
class AttractorCatalogue:
    """Attractors in the order in which they were met."""

    judge: MotionClassifier
    attractors: list[Attractor] = field(default_factory=list)

    def places(self, crossings: Crossings, verdicts: Classification) -> NDArray[np.int32]:
        """Return the place of each job's attractor, or -1; add new attractors."""
        result = np.full(len(crossings.outcome), -1, dtype=np.int32)
        is_decided = decided(crossings, verdicts)
        for period in np.unique(verdicts.period[is_decided]).tolist():
            for rest in (False, True):
                jobs = np.flatnonzero(is_decided & (verdicts.period == period) & (verdicts.rest == rest))
                if len(jobs):
                    self._place(crossings, verdicts, jobs, result)
        return result

    def _place(
        self,
        crossings: Crossings,
        verdicts: Classification,
        jobs: NDArray[np.intp],
        result: NDArray[np.int32],
    ) -> None:
        """Jobs of one kind and period: with those that are known, then one new one after the other."""
        first = self.judge.attractor(crossings, verdicts, int(jobs[0]))
        if first.kind == "equilibrium":
            ends = [self.judge.attractor(crossings, verdicts, int(job)).points for job in jobs]
            points = np.stack(ends)
        else:
            n = crossings.points.shape[1]
            points = self.judge.coordinates(crossings.points[jobs][:, n - (first.period or n) :])
        for place, attractor in enumerate(self.attractors):
            if (attractor.kind, attractor.period) == (first.kind, first.period):
                open_ = np.flatnonzero(result[jobs] < 0)
                if not len(open_):
                    return
                result[jobs[open_[attractor.holds(points[open_], self.judge.tight)]]] = place
        while len(open_ := np.flatnonzero(result[jobs] < 0)):
            new = self.judge.attractor(crossings, verdicts, int(jobs[open_[0]]))
            self.attractors.append(new)
            on = new.holds(points[open_], self.judge.tight)
            on[0] = True
            result[jobs[open_[on]]] = len(self.attractors) - 1
