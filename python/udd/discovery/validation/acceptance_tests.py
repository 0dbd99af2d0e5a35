"""Acceptance tests of an effect on data that were not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from udd._util import chi_squared
from udd._util.parallel import parallel_map
from udd.discovery.thresholds import ALPHA, Confirmation
from udd.fitting import Fit, Record, at_level, frame_costs, smoothed_states, within

from .held_out_errors import Ratio, cost_improvement, stretches

Array = NDArray[np.float64]

#: The fall of chi2 that is expected of frames which show an effect; of so much chance hides one in twenty.
_TELLING = 24.0
_STRETCH = 3.0  # s; long beside what it takes to find a stretch's own start

#: Fits of the same data, without an effect and with it.
Pair = tuple[Fit, Fit]


def confirmed_by(
    part: Pair, whole: Pair, rest: Record, names: Sequence[str], unit: float
) -> tuple[Ratio, Confirmation | None]:
    """Whether data that were not fitted want an effect too, and how much less they cost with it.

    They do where they cost less beyond doubt, all parameters held; or where chi2 falls further once they are
    fitted too, which tells more than that cost, in which the parameters' errors count. Where they could not
    show the effect, because only the first part moves the disk that way, chi2 must fall further with each
    half of the record, in alternate stretches, than with the other half alone.

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
    if ratio[0] < 1.0 and _falls_further(part, whole):
        return ratio, "fitted"
    silent = names and _expected(part[1], whole, names) < _TELLING
    return ratio, "halves" if silent and _crosswise(whole, unit) else None


def same_level(one: Fit, other: Fit) -> Pair:
    """Two fits of the same data, held equally tightly."""
    level = min(one.level, other.level)
    return at_level(one, level), at_level(other, level)


def held_out_ratio(before: Fit, after: Fit, rest: Record, unit: float) -> Ratio:
    """Cost of frames that were not fitted after over before, all parameters held."""
    level = min(before.level, after.level)
    costs = same_level(smoothed_states(before, rest, level), smoothed_states(after, rest, level))
    return cost_improvement(frame_costs(costs[0]), frame_costs(costs[1]), rest, unit=unit)


def _falls_further(part: Pair, whole: Pair) -> bool:
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


def _crosswise(whole: Pair, unit: float) -> bool:
    """Whether either half of the record, in alternate stretches, wants the effect beside the other."""
    even = stretches(whole[0].record, _STRETCH * unit) % 2 == 0
    return all(
        _falls_further(same_level(*parallel_map(partial(within, frames=half), whole)), whole)
        for half in (even, ~even)
    )
