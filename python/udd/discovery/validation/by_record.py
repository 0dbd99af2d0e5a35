"""Evidence of each of several records for an effect that was found in all of them together."""

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

#: Answer of a record: the effect is significant in it; or it is not, but would be; or one of the same
#: strength could not be detected.
Answer = Literal["wants it", "does not want it", "cannot tell"]


@dataclass(frozen=True)
class RecordAnswer:
    """Evidence of one record for an effect.

    Attributes
    ----------
    record : int
        Number of the record among the given measurements.
    answer : {"wants it", "does not want it", "cannot tell"}
    parameters, errors : dict of str to float
        Amplitudes fitted to this record, everything else common to the records. The standard errors include
        the model's remaining scatter.
    """

    record: int
    answer: Answer
    parameters: dict[str, float]
    errors: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """Return the answer as JSON-ready values."""
        return dict(vars(self))


def by_record(
    before: Fit, after: Fit, effect: Effect, numbers: Sequence[int]
) -> tuple[list[RecordAnswer], float]:
    """Fit the amplitudes of an effect to each record separately, and test each against zero (Wald).

    Everything else stays common to the records and is refitted with them. The answer is negative only if the
    record could show the effect: at the mean strength in the other records, chance would hide it with a
    probability below 0.1 %.

    Return the answers, with the user's number of each record, and chi2 with separate amplitudes at the model
    error of `before`. There is no answer, and chi2 is infinite, if there is only one record, if the effect is
    a curve without amplitudes, or if the fit fails.
    """
    films = np.unique(after.record.film).tolist()
    names = {p: f"{effect.name}.{p}" for p in effect.amplitudes if f"{effect.name}.{p}" in after.parameters}
    if len(films) < 2 or not names:
        return [], np.inf
    separate = [
        replace(f, name=f"{f.name}[{film}]", film=film)
        for f in after.problem.free
        if f.name in names.values()
        for film in films
    ]
    common = [f for f in after.problem.free if f.name not in names.values()]
    try:
        # `released` keeps unknown parameters: the common amplitudes must be removed.
        each = released(
            replace(after, problem=replace(after.problem, free=tuple(common))), [*common, *separate]
        )
        level = min(before.level, each.level)
        compared = at_level(each, level)
        inflation = compared.inflation(at_level(before, level))
    except FitError:
        return [], np.inf
    order = list(each.parameters)
    result = []
    blocks = {film: [order.index(f"{name}[{film}]") for name in names.values()] for film in films}
    values = np.array(list(each.parameters.values()))
    covariance = inflation * each.covariance
    for film, indices in blocks.items():
        information = np.linalg.pinv(covariance[np.ix_(indices, indices)])
        # Weighted mean of the amplitudes in the other records.
        rest = [other for other in films if other != film]
        weights = [np.linalg.pinv(covariance[np.ix_(blocks[o], blocks[o])]) for o in rest]
        pull = sum(w @ values[blocks[o]] for w, o in zip(weights, rest, strict=True))
        mean = np.linalg.pinv(sum(weights)) @ pull
        limit = chi_squared.isf(ALPHA, len(indices))
        answer: Answer = "cannot tell"
        if values[indices] @ information @ values[indices] > limit:
            answer = "wants it"
        elif mean @ information @ mean > 4 * limit:
            answer = "does not want it"
        errors = np.sqrt(np.diag(covariance)[indices])
        result.append(
            RecordAnswer(
                numbers[film],
                answer,
                dict(zip(names, values[indices].tolist(), strict=True)),
                dict(zip(names, errors.tolist(), strict=True)),
            )
        )
    return result, compared.chi2


def sentence(title: str, answers: Sequence[RecordAnswer]) -> str:
    """Summarise in which of the records an effect is significant."""
    wants = [a.record for a in answers if a.answer == "wants it"]
    silent = [a.record for a in answers if a.answer == "cannot tell"]
    unsure = f"; {_records(silent)} cannot show it" if silent else ""
    if len(wants) + len(silent) == len(answers) or len(wants) != 1:
        return f"{title}: significant in {len(wants)} of {len(answers)} records{unsure}."
    return f"{title}: significant only in {_records(wants)}{unsure}."


def belief(effects: Sequence[tuple[str, Sequence[RecordAnswer]]]) -> str:
    """Summarise which effects, by their titles, all records support, and which only some of them do."""
    shared = [title for title, answers in effects if not contested(answers)]
    supported = " and ".join(shared) if shared else "none of the effects found"
    contested_effects = [sentence(title, answers) for title, answers in effects if contested(answers)]
    said = [
        f"Supported by all records: {supported}.",
        *(["Not by all:"] if contested_effects else []),
        *contested_effects,
    ]
    return " ".join(said) if effects else ""


def _records(numbers: Sequence[int]) -> str:
    *most, last = map(str, numbers)
    return f"record{'s' if most else ''} {', '.join(most) + ' and ' if most else ''}{last}"


def contested(answers: Sequence[RecordAnswer]) -> bool:
    """Return True if an effect is significant in some record but absent from another that could show it."""
    return any(a.answer == "does not want it" for a in answers)
