"""Verdict on a record, from the added effects and the open questions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from udd.discovery.scoring.candidate import changes_with_time, is_driven
from udd.discovery.validation.by_record import contested
from udd.discovery.validation.held_out_errors import Ratio
from udd.effects.user_defined import is_spline
from udd.fitting import Fit
from udd.fitting.diagnostics import readings

from .natural_zero import shift_ranges
from .results import AddedEffect
from .thresholds import EVIDENCE_MARGIN
from .trial_fits import wald

_SIZE = 0.98  # ratio of held-out errors below which a gain has a size
_DETERMINED = 3.0  # standard errors
_PERIODS = 2.0  # periods of a wave, below which a frequency scan does not start


def verdict_of(
    added: Sequence[AddedEffect], unconfirmed: bool, doubts: Sequence[str], open_form: bool, stopped: bool
) -> str:
    """Return the first verdict that holds, from the least to the most certain.

    A form is open if another one explains as much, or if the misfit that remains is not noise. An effect is
    unconfirmed if it passed in the training part, but free runs over the rest do not confirm it. If even then
    the model clearly lacks something, an effect is present.
    """
    if not added and unconfirmed and not open_form:
        return "fits the first part, not confirmed"
    if open_form or doubts:
        return "effect present, form not identified"
    if added:
        return "effect identified"
    return "search not finished" if stopped else "nothing missing"


def doubts_of(added: Sequence[AddedEffect], final: Fit, ratio: Ratio, held_out: int) -> list[str]:
    """List reasons against naming the form of the added effects, in sentences.

    `ratio` is the held-out error of free runs after over before; `held_out` counts the held-out numbers.
    """
    result = []
    for effect in added:
        if contested(effect.by_record):
            result.append(f"Only some of the records support {effect.title}.")
        if effect.like_a_drift(final.model):
            result.append(f"{effect.title} may be the drift of a sensor's zero.")
        # Without this, friction with a power of 1.2 in a pendulum is identified as friction that settles with
        # time. A driven disk does not settle.
        if changes_with_time(effect.effect) and not is_driven(final.model):
            result.append(
                f"{effect.title}: as a swing decays, the effects of time and of amplitude are confounded."
            )
        # Without this, a cubic term and a wave of 1.2 periods are identified for one that saturates.
        if _periods(effect, final) < _PERIODS:
            result.append(f"{effect.title}: the record contains fewer than two of its periods.")
        elif not effect.is_law:
            written = "" if is_spline(effect.effect) else ", written as a formula"
            result.append(f"{effect.title} is a curve{written}: no law of one term.")
        elif open_constants := undetermined(effect, final):
            result.append(f"{effect.title}: the data do not determine {', '.join(open_constants)}.")
    # A sensor that reads in coarse steps causes spurious curves, too.
    if any(effect.curve is not None for effect in added) and any(effect.coarse for effect in readings(final)):
        result.append("A sensor reads in coarse steps, and such errors make curves too.")
    # Without this a friction over 1 + (Omega/s)^2 is identified as one that saturates with the speed.
    if added and not final.doubts.tight:
        result.append("The model still needs a random force: something else is missing.")
    if added and not has_size(ratio) and not any(_predicts(effect.ratio, held_out) for effect in added):
        result.append("Held-out data gain less than 2 %, and less than 10 nats.")
    return result


def _periods(added: AddedEffect, final: Fit) -> float:
    """Return the number of a wave's periods in the longest record; infinity for other effects."""
    film, t = final.record.film, final.record.t
    longest = max(float(np.ptp(t[film == number])) for number in np.unique(film))
    frequencies = [added.parameters[p.name] for p in added.effect.spec.parameters if p.role == "frequency"]
    return min((abs(f) * longest for f in frequencies), default=np.inf)


def has_size(ratio: Ratio) -> bool:
    """Return True if held-out errors decrease significantly, and by at least 2 %."""
    return ratio[2] < 1.0 and ratio[0] <= _SIZE


def _predicts(cost: Ratio, held_out: int) -> bool:
    """Return True if the held-out frames become significantly more probable, by at least 10 nats."""
    return cost[2] < 1.0 and held_out * (1.0 / max(cost[0], 1e-300) - 1.0) / 2 >= EVIDENCE_MARGIN


def undetermined(added: AddedEffect, final: Fit) -> list[str]:
    """Return constants of an effect that the data do not determine.

    A constant with a natural zero must be more than three standard errors from it. Amplitudes that belong
    together, such as those of a sine and a cosine, count as one. A place or a phase has no natural zero:
    three standard errors must be less than half the range of its coordinate. The errors are those before a
    missing effect inflates them.
    """
    order = list(final.parameters)
    result = []
    amplitudes = [p for p in added.effect.amplitudes if f"{added.effect.name}.{p}" in order]
    groups = [amplitudes, *([p] for p in added.errors if p not in amplitudes)]
    ranges = shift_ranges(added.effect, final)
    for group in filter(None, groups):
        names = [f"{added.effect.name}.{p}" for p in group]
        if group[0] in ranges:
            row = order.index(names[0])
            error = np.sqrt(final.covariance[row, row]) / final.widened
            is_determined = _DETERMINED * error < ranges[group[0]] / 2
        else:
            is_determined = wald(final, names) * final.widened**2 >= _DETERMINED**2
        result += [] if is_determined else group
    return result
