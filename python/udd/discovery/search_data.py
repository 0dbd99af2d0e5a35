"""Data of a search: measurements, their training and held-out frames, and the known model's fits."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.parallel import parallel_map
from udd.errors import FitError
from udd.fitting import Fit, SolveError, checked_units, continuous, fit_record, record_of
from udd.fitting.record import Record
from udd.fitting.thinning import Thinned, thinned
from udd.measurement import Measurement
from udd.models import Model

_SHORTEST = 20  # frames; with fewer the training part determines no model and the rest tests none


@dataclass(frozen=True)
class SearchData:
    """Measurements of a search, their record, and its division into training and held-out frames.

    Attributes
    ----------
    measurement, model
        As for :func:`udd.discover`, held-out measurements last.
    thin : list of Thinned
    record : Record
    train : ndarray (n,) of bool
    order : list of int
        The measurements' numbers in this order.
    held_out : int
        Count of whole held-out measurements.
    split : float
        Time of the first frame that is not for training, s.
    """

    measurement: Measurement | Sequence[Measurement]
    model: Model | Sequence[Model]
    thin: list[Thinned]
    record: Record
    train: NDArray[np.bool_]
    order: list[int]
    held_out: int
    split: float

    @property
    def held_out_numbers(self) -> tuple[int, ...]:
        """Numbers of the whole held-out measurements."""
        return tuple(sorted(self.order[len(self.order) - self.held_out :]))

    @property
    def parts(self) -> tuple[Record, ...]:
        """The training frames and the whole record; with held-out measurements only the first."""
        training = self.record.part(self.train)
        return (training,) if self.held_out else (training, self.record)

    def exchanged(self, share: float) -> SearchData:
        """Return the same data with the last part of each measurement for training."""
        train = ~self.record.first(1.0 - share)
        return replace(self, train=train, split=float(self.record.clock[0]))


def prepared(
    measurement: Any, model: Any, state0: Any, held_out: Iterable[int] | None, share: float
) -> SearchData:
    """Order, thin and divide the measurements; without whole held-out ones a share is for training."""
    order, count = _ordering(measurement, held_out)
    if count:
        measurement, model, state0 = (_ordered(given, order) for given in (measurement, model, state0))
    thin = _thinned(continuous(measurement, model), model)
    measurement = [part.measurement for part in thin]
    if len(measurement) == 1:
        measurement, model, state0 = (_only(given) for given in (measurement, model, state0))
    record = record_of(measurement, model, state0)
    if (n := len(record.t)) < _SHORTEST:
        raise FitError(f"the record has {n} frames; to find and test an effect needs at least {_SHORTEST}")
    first = record.first(share)
    train = np.isin(record.film, range(len(order) - count)) if count else first
    split = float(record.clock[np.flatnonzero(~first)[0]])
    return SearchData(measurement, model, thin, record, train, order, count, split)


def known_model_fits(
    data: SearchData, options: dict[str, Any]
) -> tuple[Fit, Fit, dict[str, tuple[float, float]]]:
    """Fit the known model to both parts; also return priors of parameters that these do not determine."""
    constrained: dict[str, tuple[float, float]] = {}
    options = dict(options)  # a search may ask again with the parts exchanged
    stated_priors = dict(options["priors"] or {})

    def fit(some: Record) -> Fit:
        return fit_record(data.measurement, some, data.model, **options, search=True)

    def fits() -> tuple[Fit, ...]:
        while True:
            options["priors"] = {**constrained, **stated_priors}
            try:
                return tuple(parallel_map(fit, data.parts))
            except SolveError as error:
                more = _near_the_stated(data.model, error.undetermined, options["priors"])
                if not more:
                    raise
                constrained.update(more)

    fitted = checked_units(data.measurement, data.model, options, fits)
    return fitted[0], fitted[-1], constrained


def _near_the_stated(
    model: Model | Sequence[Model], names: Iterable[str], priors: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """Return priors of parameters without one: the given value ± 100 %."""
    result = {}
    for label in sorted(names):
        name, _, film = label.partition("[")
        model_of_film = model if isinstance(model, Model) else model[int(film.rstrip("]") or 0)]
        value = model_of_film.parameters.get(name, 0.0)
        if value and not {label, name} & set(priors):
            result[label] = (value, abs(value))
    return result


def _ordering(
    measurement: Measurement | Sequence[Measurement], held_out: Iterable[int] | None
) -> tuple[list[int], int]:
    """Return the measurements' numbers, with the held-out ones last, and the count of these."""
    number = len(measurement) if isinstance(measurement, (list, tuple)) else 1
    if held_out is None:
        return list(range(number)), 0
    try:
        last = sorted({operator.index(number_given) for number_given in held_out})
    except TypeError:
        raise FitError(
            f"held_out must be a list of the measurements' numbers, as in held_out=[2], not {held_out!r}"
        ) from None
    if not last or not 0 <= last[0] <= last[-1] < number or len(last) == number:
        raise FitError(
            f"held_out must name some of the measurements 0 to {number - 1}, but not all, not {last}"
            if number > 1
            else "held_out needs several measurements; with one, its last part is the held-out data"
        )
    return [k for k in range(number) if k not in last] + last, len(last)


def _ordered(given: Any, order: Sequence[int]) -> Any:
    """Reorder a list for several measurements; return anything else unchanged."""
    return (
        [given[k] for k in order] if isinstance(given, (list, tuple)) and len(given) == len(order) else given
    )


def _only(given: Any) -> Any:
    """Return the entry of a list of one; return anything else unchanged."""
    return given[0] if isinstance(given, (list, tuple)) and len(given) == 1 else given


def _thinned(
    measurement: Measurement | Sequence[Measurement], model: Model | Sequence[Model]
) -> list[Thinned]:
    """Thin measurements that were sampled faster than their motion requires."""
    some: list[Any] = list(measurement) if isinstance(measurement, (list, tuple)) else [measurement]
    if not some or not all(isinstance(part, Measurement) for part in some):
        record_of(measurement, model)  # which raises the error
    return [thinned(part) for part in some]
