"""Predict and filter motion with all parameters fixed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.errors import FitError
from udd.models import Model

from .estimator_input import FilmParameters
from .problem import Point

if TYPE_CHECKING:
    from .fit_result import Fit
    from .record import Record

Array = NDArray[np.float64]


def predicted(
    models: Sequence[Model],
    sets: Sequence[FilmParameters],
    film: NDArray[np.int64],
    t0: Array,
    states: Array,
    times: Array,
) -> Array:
    """Predict the observations at times (k, h), increasing, after starts (k,), by the models alone.

    Parameters
    ----------
    models : sequence of Model
        One per film, with the same parameters; their values are those of `sets`.
    sets : sequence of FilmParameters
        As a fit's ``point.sets``.
    film : ndarray of int (k,)
        Film of each start.
    t0, states : ndarray (k,), (k, d)
    times : ndarray (k, h)

    Returns
    -------
    ndarray (k, h, m)
        NaN after the point at which the model's solution diverges.
    """

    def run(rows: slice, at: Array) -> Array:
        return _core.predict(models[0], sets, film[rows].tolist(), t0[rows], states[rows], at)

    try:
        return run(slice(None), times)
    except FitError:
        rows = [slice(k, k + 1) for k in range(len(t0))]
        return np.concatenate([_as_far_as_it_runs(partial(run, k), t0[k], times[k]) for k in rows])


def _as_far_as_it_runs(run: Callable[[Array], Array], t0: Array, times: Array) -> Array:
    """Predict a single run, with bisection for the last time that it reaches; NaN after it."""
    half, reached, beyond = times.shape[1], 0, times.shape[1] + 1
    # The observation at the start itself takes no run and gives the number of columns.
    result = np.repeat(run(t0[:, None]), half, axis=1)
    while beyond - reached > 1:
        try:
            result[:, :half] = run(times[:, :half])
            reached = half
        except FitError:
            beyond = half
        half = (reached + beyond) // 2
    result[:, reached:] = np.nan
    return result


def filtered(
    fitted: Fit, record: Record, windows: NDArray[np.int64], diffusion: tuple[float, ...]
) -> tuple[Array, Array, Array]:
    """Filter windows of frames: states at the first and the last frame, covariance of the last.

    All parameters are those of a fit.
    """
    problem = fitted.problem.of_states(record).with_model_error(diffusion)
    fixed = problem.at(Point(record.states, fitted.point.sets))
    return _core.filter(fixed, [(int(a), int(b)) for a, b in windows])
