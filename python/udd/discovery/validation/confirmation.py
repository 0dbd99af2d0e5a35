"""Confirmation of an effect on data that were not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from udd._util import chi_squared
from udd._util.parallel import parallel_map
from udd.discovery.thresholds import ALPHA, Confirmation
from udd.fitting import Fit, Record, at_level, frame_costs, smoothed_states, within

from .held_out_errors import Ratio, block_numbers, cost_improvement

Array = NDArray[np.float64]

#: The fall of chi2 that is expected of frames which show an effect; of so much chance hides one in twenty.
_INFORMATIVE_CHI2 = 24.0
_STRETCH = 3.0  # s; long beside what it takes to find a stretch's own start

#: Fits of the same data, without an effect and with it.
Pair = tuple[Fit, Fit]


def confirmed_by(
    part: Pair, whole: Pair, rest: Record, names: Sequence[str], unit: float
) -> tuple[Ratio, Confirmation | None]:
    """Test an effect on held-out data: by their cost, by a further fall of chi2, or by halves of the record.

    An effect is confirmed by the first of three tests that it passes. With all parameters fixed, the held-out
    frames cost significantly less. Or chi2 falls significantly further when these frames are fitted too; this
    test is stronger, because the parameters' errors do not count. Or, if the held-out frames carry too little
    information on the effect, each half of the record (alternate blocks) lowers chi2 further than the other
    half alone. Of whole records that no fit sees their cost alone counts.

    Parameters
    ----------
    part, whole : pair of Fit
        Without the effect and with it: of the part that the effect was found in, and of all data.
    rest : Record
        The frames of the whole that the part lacks.
    names : sequence of str
        The parameters that came in with the effect; none where it is a curve.
    unit : float
        See :func:`udd.fitting.time_scale.motion_time_scale`.

    Returns
    -------
    ratio : tuple of float
        Cost of `rest` with the effect over cost without it, all parameters held, with its 95 % interval.
    witness : str or None
        What bears it out, the first that does: the cost of the frames that were ``"held"``, these
        ``"fitted"`` too, or the ``"halves"`` of the record.
    """
    ratio = held_out_ratio(*part, rest, unit)
    if ratio[2] < 1.0:
        return ratio, "held"
    if part[0] is whole[0]:
        return ratio, None  # no fit may see the rest
    if ratio[0] < 1.0 and _held_out_chi2_falls(part, whole):
        return ratio, "fitted"
    silent = names and _expected(part[1], whole, names) < _INFORMATIVE_CHI2
    return ratio, "halves" if silent and _split_half_test(whole, unit) else None


def same_level(one: Fit, other: Fit) -> Pair:
    """Two fits of the same data, held equally tightly."""
    level = min(one.level, other.level)
    return at_level(one, level), at_level(other, level)


def held_out_ratio(before: Fit, after: Fit, rest: Record, unit: float) -> Ratio:
    """Cost of frames that were not fitted after over before, all parameters held."""
    level = min(before.level, after.level)
    costs = same_level(smoothed_states(before, rest, level), smoothed_states(after, rest, level))
    return cost_improvement(frame_costs(costs[0]), frame_costs(costs[1]), rest, unit=unit)


def _held_out_chi2_falls(part: Pair, whole: Pair) -> bool:
    """Whether chi2 falls further once the remaining frames are fitted too."""
    before, after = whole
    one, other = (at_level(fit, after.level) for fit in part)
    further = (before.chi2 - after.chi2) - (one.chi2 - other.chi2)
    return bool(chi_squared.sf(further / after.inflation(before), 1) < ALPHA)


def _expected(part: Fit, whole: Pair, names: Sequence[str]) -> float:
    """By how much it should fall further, from what those frames add to the information on the effect."""
    before, after = whole

    def information(fit: Fit) -> Array:
        own = [list(fit.parameters).index(name) for name in names]
        return _inverse(fit.covariance[np.ix_(own, own)])

    size = np.array([part.parameters[name] for name in names])
    return float(size @ (information(after) - information(part)) @ size / after.inflation(before))


def _inverse(covariance: Array) -> Array:
    """The inverse; of a covariance without one that of what it does tell."""
    try:
        result: Array = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    except np.linalg.LinAlgError:
        result = np.asarray(np.linalg.pinv(covariance, hermitian=True), dtype=np.float64)
    return result


def _split_half_test(whole: Pair, unit: float) -> bool:
    """Whether either half of the record, in alternate stretches, wants the effect beside the other."""
    even = block_numbers(whole[0].record, _STRETCH * unit) % 2 == 0
    return all(
        _held_out_chi2_falls(same_level(*parallel_map(partial(within, frames=half), whole)), whole)
        for half in (even, ~even)
    )
