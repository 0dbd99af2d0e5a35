"""Confirmation of an effect on data that were not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from udd._util import chi_squared
from udd._util.parallel import parallel_map
from udd.discovery.thresholds import ALPHA, Confirmation
from udd.fitting import Fit, Record, at_level, smoothed_states, within

from .held_out_errors import Ratio, block_numbers, cost_improvement

Array = NDArray[np.float64]

#: Expected decrease in chi2 at which an effect is detected with 95 % power.
_INFORMATIVE_CHI2 = 24.0
_STRETCH = 3.0  # s; long compared with the time needed to estimate a block's start

#: Fits of the same data, without an effect and with it.
Pair = tuple[Fit, Fit]


def confirmed_by(
    part: Pair, whole: Pair, rest: Record, names: Sequence[str], unit: float
) -> tuple[Ratio, Confirmation | None]:
    """Test an effect on held-out data: by their cost, a further decrease in chi2, or halves of the record.

    An effect is confirmed by the first of three tests that it passes. First, with all parameters fixed, the
    held-out frames cost significantly less. Second, chi2 decreases significantly further when these frames
    are fitted too; this test is stronger, because the parameters' errors do not count. Third, if the held-out
    frames carry too little information on the effect, each half of the record (alternate blocks) decreases
    chi2 further than the other half alone. With whole held-out records, only the first test applies.

    Return the ratio of the costs of the held-out frames `rest`, with its 95 % interval, and the first test
    that the effect passes: ``"held"``, ``"fitted"`` or ``"halves"``. `names` are the parameters that the
    effect adds; a curve has none.
    """
    ratio = held_out_ratio(*part, rest, unit)
    if ratio[2] < 1.0:
        return ratio, "held"
    if part[0] is whole[0]:
        return ratio, None  # no fit may use the rest
    if ratio[0] < 1.0 and _held_out_chi2_falls(part, whole):
        return ratio, "fitted"
    silent = names and _expected(part[1], whole, names) < _INFORMATIVE_CHI2
    return ratio, "halves" if silent and _split_half_test(whole, unit) else None


def same_level(first: Fit, second: Fit) -> Pair:
    """Bring two fits of the same data to the same model error."""
    level = min(first.level, second.level)
    return at_level(first, level), at_level(second, level)


def held_out_ratio(before: Fit, after: Fit, rest: Record, unit: float) -> Ratio:
    """Compute the cost ratio of frames that were not fitted, after over before, all parameters fixed."""
    level = min(before.level, after.level)
    costs = same_level(smoothed_states(before, rest, level), smoothed_states(after, rest, level))
    return cost_improvement(costs[0].frame_costs, costs[1].frame_costs, rest, unit=unit)


def _held_out_chi2_falls(part: Pair, whole: Pair) -> bool:
    """Return True if chi2 decreases further once the remaining frames are fitted too."""
    before, after = whole
    part_before, part_after = (at_level(fit, after.level) for fit in part)
    further = (before.chi2 - after.chi2) - (part_before.chi2 - part_after.chi2)
    return bool(chi_squared.sf(further / after.inflation(before), 1) < ALPHA)


def _expected(part: Fit, whole: Pair, names: Sequence[str]) -> float:
    """Compute the expected further decrease, from the information on the effect in those frames."""
    before, after = whole

    def information(fit: Fit) -> Array:
        indices = [list(fit.parameters).index(name) for name in names]
        covariance = fit.covariance[np.ix_(indices, indices)]
        result: Array = np.asarray(np.linalg.pinv(covariance, hermitian=True), dtype=np.float64)
        return result

    size = np.array([part.parameters[name] for name in names])
    return float(size @ (information(after) - information(part)) @ size / after.inflation(before))


def _split_half_test(whole: Pair, unit: float) -> bool:
    """Return True if each half of the record, in alternate blocks, confirms the effect after the other."""
    even = block_numbers(whole[0].record, _STRETCH * unit) % 2 == 0
    return all(
        _held_out_chi2_falls(same_level(*parallel_map(partial(within, frames=half), whole)), whole)
        for half in (even, ~even)
    )
