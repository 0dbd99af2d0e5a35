"""A batch of runs, as the core reads it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from udd.models.base import Model


@dataclass(frozen=True)
class Batch:
    """Runs of one model from many states or with many values of its parameters, on several threads.

    Attributes
    ----------
    model : Model
        Model of all runs.
    values : ndarray (n or 1, p)
        Values of the parameters. There is a row for each run, or a single row for all.
    starts : ndarray (n or 1, d)
        Initial states. There is a row for each run, or a single row for all.
    rtol, atol : float
        Tolerances of the runs.
    threads : int
        Number of threads. 0 means one per core.
    progress : callable, optional
        Called with the number of runs that are done.
    max_step : float
        The longest step.
    """

    model: Model
    values: NDArray[np.float64]
    starts: NDArray[np.float64]
    rtol: float
    atol: float
    threads: int = 1
    progress: Callable[[int], object] | None = None
    max_step: float = math.inf


class RunOptions(TypedDict, total=False):
    """Keyword arguments of all functions that run many orbits.

    Attributes
    ----------
    rtol, atol : float
        Tolerances of the runs.
    max_step : float, optional
        The longest step; by default only the error limits it.
    threads : int, optional
        By default one per core. No result depends on it.
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. By default a
        bar shows after 2 s in a terminal or a notebook.
    partial : bool
        After Ctrl-C return what there is, with a warning, instead of raising it with the exception.
    """

    rtol: float
    atol: float
    max_step: float | None
    threads: int | None
    progress: bool | Callable[[str], object] | None
    partial: bool


RUN_OPTIONS: RunOptions = {
    "rtol": 1e-9,
    "atol": 1e-12,
    "max_step": None,
    "threads": None,
    "progress": None,
    "partial": False,
}
