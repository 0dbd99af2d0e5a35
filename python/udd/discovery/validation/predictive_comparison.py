"""Prequential comparison of two forms: which predicts a record better, over several splits of time."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from udd._util.parallel import parallel_map
from udd.discovery.trial_fits import TrialFit
from udd.errors import FitError
from udd.fitting import Fit, Record, frame_costs, smoothed_states, within

from .confirmation import same_level
from .held_out_errors import Ratio, cost_improvement

#: Shares of a record that forms are fitted to, to foretell the rest of it. From less than what effects are
#: sought in, a law of two terms is known worse than a wrong one of one term.
SPLITS = (0.6, 0.7, 0.8)
_FEWEST = 20  # frames that a form is fitted to


class Foretelling:
    """Prequential (predictive) comparison of forms over several splits of a record.

    Each form is fitted to the first part of each split, then its parameters are fixed, and the cost of the
    rest is counted. A single split may favour one form by chance, as where drags differ only once a motion
    has died down. The sum over several splits averages this out.

    Parameters
    ----------
    record : Record
    wholes : mapping of int to TrialFit
        The forms fitted to all data, by the identity of the trial that they belong to.
    unit : float
        See :func:`udd.fitting.time_scale.motion_time_scale`.
    """

    def __init__(self, record: Record, wholes: Mapping[int, TrialFit], unit: float) -> None:
        self.record, self.wholes, self.unit = record, wholes, unit
        firsts = [record.first(share) for share in SPLITS]
        self.firsts = [first for first in firsts if first.sum() >= _FEWEST]
        self._fitted: dict[int, list[Fit | None]] = {}
        self._rests: dict[tuple[int, int, int], Fit] = {}

    def ratio(self, one: TrialFit, other: TrialFit) -> Ratio:
        """Cost of the frames that follow by another form over that by one, all splits together.

        NaN where none can be told.
        """
        sums = np.zeros((2, len(self.record.t)))
        pairs = zip(self._fits(one), self._fits(other), strict=True)
        for k, (before, after) in enumerate(pairs):
            if before is None or after is None:
                continue
            rest = ~self.firsts[k]
            level = min(before.level, after.level)
            try:
                both = same_level(self._rest(one, k, before, level), self._rest(other, k, after, level))
            except FitError:
                continue
            sums[:, rest] += [frame_costs(fitted) for fitted in both]
        counted = np.asarray(sums.any(axis=0))
        if not counted.any():
            return math.nan, math.nan, math.nan
        seen = self.record.part(counted)
        return cost_improvement(sums[0, counted], sums[1, counted], seen, unit=self.unit)

    def _fits(self, trial: TrialFit) -> list[Fit | None]:
        """A form fitted to each first part; None where it cannot be."""
        whole = self.wholes[id(trial)].fit

        def fitted(first: NDArray[np.bool_]) -> Fit | None:
            try:
                result = within(whole, first)
            except FitError:
                return None
            return result if result.converged else None

        if id(trial) not in self._fitted:
            self._fitted[id(trial)] = parallel_map(fitted, self.firsts)
        return self._fitted[id(trial)]

    def _rest(self, trial: TrialFit, split: int, fitted: Fit, level: int) -> Fit:
        """The frames after a split, all parameters held."""
        key = id(trial), split, level
        if key not in self._rests:
            self._rests[key] = smoothed_states(fitted, self.record.part(~self.firsts[split]), level)
        return self._rests[key]
