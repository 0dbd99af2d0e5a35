"""The verdict: what is said of a record, from what was found and what stays open."""

from __future__ import annotations

from collections.abc import Sequence

from udd.discovery.validation.by_record import contested
from udd.effects.user_defined import is_spline
from udd.fitting import Fit
from udd.fitting.diagnostics import readings

from .results import AddedEffect


def verdict_of(
    found: Sequence[AddedEffect], final: Fit, unconfirmed: bool, open_form: bool, stopped: bool
) -> str:
    """The first that holds of these, from what is least to what is most sure.

    Parameters
    ----------
    found : sequence of AddedEffect
    final : Fit
        With them, of all data.
    unconfirmed : bool
        Whether something was found in the first part that free runs over the rest do not confirm.
    open_form : bool
        Whether another form explains as much, or what is left or the known model's misfit is no noise.
    stopped : bool
        Whether the search had no more time.
    """
    if not found and unconfirmed:
        return "fits the first part, not confirmed"
    if open_form or _is_no_law(found, final):
        return "effect present, form not identified"
    if found:
        return "effect identified"
    return "search not finished" if stopped else "nothing missing"


def _is_no_law(found: Sequence[AddedEffect], final: Fit) -> bool:
    """Whether something found is wanted by some records only, has no formula, or may be a sensor's."""
    return (
        any(contested(f.by_record) for f in found)
        or any(is_spline(f.effect) or f.like_a_drift(final.model) for f in found)
        # A sensor that reads in coarse steps makes curves, too.
        or (any(f.curve is not None for f in found) and any(one.coarse for one in readings(final)))
    )
