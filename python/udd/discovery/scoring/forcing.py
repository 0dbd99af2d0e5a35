"""Score of arbitrary forcings, from the flow's response to them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.one_line import OneLine
from udd.fitting import Fit
from udd.models.profile import Coordinate

from .coordinates import Slot
from .coordinates import coordinate as named

Array = NDArray[np.float64]

_COLUMNS = 240  # scored at a time, to limit the memory for a long record


@dataclass(frozen=True, repr=False)
class Score(OneLine):
    """Score of the amplitudes of one group of columns.

    With everything else optimal, chi2 decreases by ``2 gradient . c - c . information c`` if the amplitudes
    are c; both in units of the fit's own scatter. `alone` is the information on each amplitude with all free
    parameters fixed.
    """

    gradient: Array
    information: Array
    alone: Array


@dataclass(frozen=True, eq=False)
class Responses:
    """Response of the fitted motion to forcings, at a few places of every link between frames.

    Attributes
    ----------
    t : ndarray (n, q)
    states, rates : ndarray (n, q, d)
        States there, and their rates of change by the fitted model.
    response : ndarray (n, q, d, d)
        ``[i, q, :, m]`` is the change of the state at frame i + 1 by a unit forcing of the m-th equation
        there.
    linked : ndarray of bool (n,)
        Between frames that are not linked there is no motion.
    films : tuple of ndarray of bool (n,)
        Links of each film.
    """

    fit: Fit
    t: Array
    states: Array
    rates: Array
    response: Array
    linked: NDArray[np.bool_]
    films: tuple[NDArray[np.bool_], ...]

    def along(self, coordinate: Coordinate) -> Array:
        """Return a coordinate's values, (n, q)."""
        return self._of_films(coordinate, lambda c, film: c.of(self.t[film], self.states[film]))

    def speed(self, coordinate: Coordinate) -> Array:
        """Return a coordinate's rate of change, (n, q)."""
        return self._of_films(coordinate, lambda c, film: c.rate(self.states[film], self.rates[film]))

    def _of_films(
        self, coordinate: Coordinate, value: Callable[[Coordinate, NDArray[np.bool_]], Array]
    ) -> Array:
        """Evaluate the coordinate for each film's own drive."""
        result = np.zeros(self.t.shape)
        for model, film in zip(self.fit.models, self.films, strict=True):
            result[film] = value(named(model, coordinate.name), film)
        return result

    def columns(self, slot: Slot, value: Array, rate: Array) -> Array:
        """Compute the change of the state at a link's end by forcings (n, q, k) and rates, (n, d, k)."""
        unit, none = np.ones(self.t.shape), np.zeros(self.t.shape)
        result: Array = np.zeros((len(self.t), self.states.shape[-1], value.shape[-1]))
        for strengths, part in (((unit, none), value), ((none, unit), rate)):
            forcing = np.zeros(self.states.shape)
            for model, film in zip(self.fit.models, self.films, strict=True):
                forcing[film] = slot.forcing(model, self.states[film], *(s[film] for s in strengths))
            if forcing.any():
                # one product of matrices per frame: (d, q) with (q, k)
                acting = np.einsum("iqdm,iqm->iqd", self.response, forcing)
                result += np.swapaxes(acting, 1, 2) @ part
        return result


def responses(fit: Fit) -> Responses:
    """Compute the response of a fitted motion to forcings."""
    linked = fit.record.linked
    t, states, response = _core.responses(replace(fit.problem.at(fit.point), free=()))
    # Between frames that are not linked there is no motion; any state will do there.
    t = np.where(linked[:, None], t, fit.record.t[:-1, None])
    states = np.where(linked[:, None, None], states, fit.states[:-1, None])
    films = tuple(fit.record.film[:-1] == k for k in range(len(fit.models)))
    rates = np.zeros(states.shape)
    for model, film in zip(fit.models, films, strict=True):
        rates[film] = model.rates(t[film], states[film])
    return Responses(fit, t, states, rates, response, linked, films)


def score_forcings(fit: Fit, columns: Iterable[Array], parameters_fixed: bool = False) -> list[Score]:
    """Score groups of columns, each as if it were alone, with the free parameters refitted or fixed.

    A group, (n - 1, d, k), is the change of the state at every link's end with each amplitude.
    """
    problem = fit.problem.at(fit.point)
    if parameters_fixed:
        problem = replace(problem, free=())
    scatter = max(fit.scatter, 1.0)
    scores: list[Score] = []
    for some in _batches(columns):
        sizes = [c.shape[-1] for c in some]
        at_end = np.ascontiguousarray(np.concatenate(some, axis=-1))
        gradient, information, alone = _core.score_columns(problem, at_end, sizes)
        first, square = 0, 0
        for k in sizes:
            block = information[square : square + k * k].reshape(k, k) / scatter
            part = slice(first, first + k)
            scores.append(Score(gradient[part] / scatter, (block + block.T) / 2, alone[part] / scatter))
            first, square = first + k, square + k * k
    return scores


def _batches(columns: Iterable[Array]) -> Iterator[list[Array]]:
    batch: list[Array] = []
    for column in columns:
        if batch and sum(c.shape[-1] for c in batch) + column.shape[-1] > _COLUMNS:
            yield batch
            batch = []
        batch.append(column)
    if batch:
        yield batch
