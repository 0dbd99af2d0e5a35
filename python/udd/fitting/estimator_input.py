"""Inputs of the core's estimator, which reads them by attribute name: record, point and unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from udd._core import Linearised
    from udd.models import Model

    from .parameters import Free

Array = NDArray[np.float64]


class FilmParameters(NamedTuple):
    """Parameters of one film: the model's values, the camera's values and the clock's error."""

    model: list[float]
    camera: list[float]
    clock: float


@dataclass(frozen=True)
class Observations:
    """A record with its noise.

    Attributes
    ----------
    t, seen, linked, film : ndarray
        As in :class:`.record.Record`.
    information : ndarray (n, m, m)
        Inverse of each frame's noise covariance. It is zero if nothing was observed.
    autocorrelation : list of float (m,)
        Lag-1 autocorrelation of each channel's noise.
    """

    t: Array
    seen: Array
    information: Array
    linked: NDArray[np.bool_]
    film: NDArray[np.int64]
    autocorrelation: list[float]


@dataclass(frozen=True)
class EstimatorInput:
    """A weighted least-squares problem at a point.

    Attributes
    ----------
    model : Model
    observations : Observations
    states : ndarray (n, d)
    films : sequence of FilmParameters
    free : sequence of Free
    diffusion : sequence of float (d,)
        The assumed model error, per square root of a second.
    linear : Linearised, optional
        The linearisation that a solve computed at this point.
    """

    model: Model
    observations: Observations
    states: Array
    films: Sequence[FilmParameters]
    free: Sequence[Free]
    diffusion: Sequence[float]
    linear: Linearised | None = None
