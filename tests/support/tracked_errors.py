"""Errors of a tracked film against the run that it shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import udd
from udd.film import Film


def errors(m: udd.Measurement, film: Film) -> NDArray[np.float64]:
    """Errors in mm, mm, mrad; beta but for whole turns."""
    row = np.abs(m.t[:, None] - film.t[None, :]).argmin(axis=1)
    e = m.values - film.state[row, 1:]
    e[:, 2] -= 2 * np.pi * np.round(np.nanmedian(e[:, 2]) / (2 * np.pi))
    return np.asarray(1e3 * e)


def rms(e: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(np.nanmean(e**2, axis=0)))
