"""The score of forcings of any form, from the flow's response to them."""

from __future__ import annotations

from collections.abc import Sequence
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

_COLUMNS = 240  # scored at a time: what a long record takes in memory


@dataclass(frozen=True, repr=False)
class Score(OneLine):
    """What the score says of the amplitudes of one group of columns.

    Everything else optimal, chi2 falls by ``2 gradient . c - c . information c`` when they take the values c;
    both in units of the fit's own scatter.
    Taken `alone` is the information on each amplitude were all free parameters known.
    """

    gradient: Array
    information: Array
    alone: Array


@dataclass(frozen=True, eq=False)
class Responses:
    """How the fitted motion answers to forcings, at a few places of every link between frames.

    Attributes
    ----------
    t : ndarray (n, q)
    states, rates : ndarray (n, q, d)
        The states there and how fast they change, by the fitted model.
    response : ndarray (n, q, d, d)
        ``[i, q, :, m]`` is what a unit forcing of the m-th equation there adds to the state at frame i + 1.
    linked : ndarray of bool (n,)
        Where frames are not linked there is no motion between them.
    films : tuple of ndarray of bool (n,)
        Which links each film holds.
    """

    fit: Fit
    t: Array
    states: Array
    rates: Array
    response: Array
    linked: NDArray[np.bool_]
    films: tuple[NDArray[np.bool_], ...]

    def along(self, coordinate: Coordinate) -> Array:
        """A coordinate's values, (n, q)."""
        result = np.zeros(self.t.shape)
        for own, film in self._of_films(coordinate):
            result[film] = own.of(self.t[film], self.states[film])
        return result

    def speed(self, coordinate: Coordinate) -> Array:
        """How fast a coordinate changes, (n, q)."""
        result = np.zeros(self.t.shape)
        for own, film in self._of_films(coordinate):
            result[film] = own.rate(self.states[film], self.rates[film])
        return result

    def _of_films(self, coordinate: Coordinate) -> list[tuple[Coordinate, NDArray[np.bool_]]]:
        """The coordinate as each film's own drive makes it, and which links the film holds."""
        films = zip(self.fit.models, self.films, strict=True)
        return [(named(model, coordinate.name), film) for model, film in films]

    def columns(self, slot: Slot, value: Array, rate: Array) -> Array:
        """What forcings (n, q, k), changing at these rates, add to the state at a link's end, (n, d, k)."""
        one, none = np.ones(self.t.shape), np.zeros(self.t.shape)
        result: Array = np.zeros((len(self.t), self.states.shape[-1], value.shape[-1]))
        for strengths, part in (((one, none), value), ((none, one), rate)):
            own = np.zeros(self.states.shape)
            for model, film in zip(self.fit.models, self.films, strict=True):
                own[film] = slot.forcing(model, self.states[film], *(s[film] for s in strengths))
            if own.any():
                # One product of matrices per frame: (d, q) with (q, k).
                acting = np.einsum("iqdm,iqm->iqd", self.response, own)
                result += np.swapaxes(acting, 1, 2) @ part
        return result


def responses(fit: Fit) -> Responses:
    """How a fitted motion answers to forcings."""
    linked = fit.record.linked
    t, states, response = _core.responses(replace(fit.problem.at(fit.point), free=()))
    # Between frames that are not linked nothing moves; any state will do there.
    t = np.where(linked[:, None], t, fit.record.t[:-1, None])
    states = np.where(linked[:, None, None], states, fit.states[:-1, None])
    films = tuple(fit.record.film[:-1] == k for k in range(len(fit.models)))
    rates = np.zeros(states.shape)
    for own, film in zip(fit.models, films, strict=True):
        rates[film] = own.rates(t[film], states[film])
    return Responses(fit, t, states, rates, response, linked, films)


def score_forcings(fit: Fit, columns: Sequence[Array], known: bool = False) -> list[Score]:
    """Score groups of columns, each as if it were alone.

    Parameters
    ----------
    fit : Fit
    columns : sequence of ndarray (n - 1, d, k)
        What each amplitude adds to the state at every link's end.
    known : bool
        Whether the free parameters are taken as known instead of refitted.
    """
    problem = fit.problem.at(fit.point)
    if known:
        problem = replace(problem, free=())
    scatter = max(fit.scatter, 1.0)
    scores: list[Score] = []
    for some in _batches(columns):
        sizes = [c.shape[-1] for c in some]
        at_end = np.ascontiguousarray(np.concatenate(some, axis=-1))
        gradient, information, alone = _core.score_columns(problem, at_end, sizes)
        own, square = 0, 0
        for k in sizes:
            block = information[square : square + k * k].reshape(k, k) / scatter
            part = slice(own, own + k)
            scores.append(Score(gradient[part] / scatter, (block + block.T) / 2, alone[part] / scatter))
            own, square = own + k, square + k * k
    return scores


def _batches(columns: Sequence[Array]) -> list[list[Array]]:
    batches: list[list[Array]] = []
    for one in columns:
        if not batches or sum(c.shape[-1] for c in batches[-1]) + one.shape[-1] > _COLUMNS:
            batches.append([])
        batches[-1].append(one)
    return batches
