"""What each of several records says of an effect that was found in all of them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from udd._util import chi_squared
from udd.discovery.thresholds import ALPHA
from udd.effects import Effect
from udd.errors import FitError
from udd.fitting import Fit, at_level, released

#: Whether a record wants an effect; one that could not show it if it were there as strong cannot tell.
Answer = Literal["wants it", "does not want it", "cannot tell"]


@dataclass(frozen=True)
class RecordAnswer:
    """What one record says of an effect.

    Attributes
    ----------
    record : int
        Its number among the measurements that were given.
    answer : {"wants it", "does not want it", "cannot tell"}
    parameters, errors : dict of str to float
        The amplitudes fitted to this record, all else common to the records, with standard errors in which
        the scatter counts that the model leaves.
    """

    record: int
    answer: Answer
    parameters: dict[str, float]
    errors: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return dict(vars(self))


def by_record(
    known: Fit, found: Fit, effect: Effect, numbers: Sequence[int]
) -> tuple[list[RecordAnswer], float]:
    """Fit the amplitudes of an effect to each record apart, and test each against zero (Wald).

    Everything else stays common to the records and is refitted beside them. A record that does not want the
    effect could have shown it: were it there as strong as in the mean of the others, chance would hide it in
    less than one case in a thousand.

    Parameters
    ----------
    known, found : Fit
        Of the same records, without what was found and with it.
    effect : Effect
        One of those that `found` has and `known` lacks.
    numbers : sequence of int
        By which the user calls each record.

    Returns
    -------
    answers : list of RecordAnswer
        None where there is but one record, where the effect is a curve without amplitudes, or where it cannot
        be fitted so.
    chi2 : float
        Of the fit with amplitudes for each record, held as tightly as `known`; infinite where there is none.
    """
    films = np.unique(found.record.film).tolist()
    names = {p: f"{effect.name}.{p}" for p in effect.amplitudes if f"{effect.name}.{p}" in found.parameters}
    if len(films) < 2 or not names:
        return [], np.inf
    apart = [
        replace(f, name=f"{f.name}[{film}]", film=film)
        for f in found.problem.free
        if f.name in names.values()
        for film in films
    ]
    common = [f for f in found.problem.free if f.name not in names.values()]
    try:
        # `released` keeps what it does not know: the common amplitudes must go.
        each = released(replace(found, problem=replace(found.problem, free=tuple(common))), [*common, *apart])
        level = min(known.level, each.level)
        compared = at_level(each, level)
        inflation = compared.inflation(at_level(known, level))
    except FitError:
        return [], np.inf
    order = list(each.parameters)
    result = []
    blocks = {film: [order.index(f"{name}[{film}]") for name in names.values()] for film in films}
    values = np.array(list(each.parameters.values()))
    covariance = inflation * each.covariance
    for film, own in blocks.items():
        information = np.linalg.pinv(covariance[np.ix_(own, own)])
        # What the others have, each by its own weight.
        rest = [other for other in films if other != film]
        weights = [np.linalg.pinv(covariance[np.ix_(blocks[o], blocks[o])]) for o in rest]
        pull = sum(w @ values[blocks[o]] for w, o in zip(weights, rest, strict=True))
        mean = np.linalg.pinv(sum(weights)) @ pull
        limit = chi_squared.isf(ALPHA, len(own))
        answer: Answer = "cannot tell"
        if values[own] @ information @ values[own] > limit:
            answer = "wants it"
        elif mean @ information @ mean > 4 * limit:
            answer = "does not want it"
        errors = np.sqrt(np.diag(covariance)[own])
        result.append(
            RecordAnswer(
                numbers[film],
                answer,
                dict(zip(names, values[own].tolist(), strict=True)),
                dict(zip(names, errors.tolist(), strict=True)),
            )
        )
    return result, compared.chi2


def sentence(title: str, answers: Sequence[RecordAnswer]) -> str:
    """Which of the records want an effect, in words."""
    wants = [a.record for a in answers if a.answer == "wants it"]
    silent = [a.record for a in answers if a.answer == "cannot tell"]
    unsure = f"; {_records(silent)} cannot tell" if silent else ""
    if len(wants) + len(silent) == len(answers) or len(wants) != 1:
        return f"{title}: wanted by {len(wants)} of {len(answers)} records{unsure}."
    return f"{title}: only {_records(wants)} wants it{unsure}."


def belief(effects: Sequence[tuple[str, Sequence[RecordAnswer]]]) -> str:
    """What several records together say of what was found, and apart from it what only some of them want.

    Parameters
    ----------
    effects : sequence of (str, list of RecordAnswer)
        Titles, and what each record says.
    """
    shared = [title for title, answers in effects if not contested(answers)]
    told = " and ".join(shared) if shared else "none of what was found"
    apart = [sentence(title, answers) for title, answers in effects if contested(answers)]
    said = [
        f"What we would believe of all records: {told}.",
        *(["Apart from that:"] if apart else []),
        *apart,
    ]
    return " ".join(said) if effects else ""


def _records(numbers: Sequence[int]) -> str:
    *most, last = map(str, numbers)
    return f"record{'s' if most else ''} {', '.join(most) + ' and ' if most else ''}{last}"


def contested(answers: Sequence[RecordAnswer]) -> bool:
    """Whether some record wants an effect that another one, which could show it, does not."""
    return any(a.answer == "does not want it" for a in answers)
