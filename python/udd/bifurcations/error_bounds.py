"""Bounds of the errors of what is solved for: by less accurate runs, and by roundoff."""

from __future__ import annotations

from typing import Any

import numpy as np

from .flow_map import Floats

__all__ = ["COARSE", "SURE", "rounding_of", "scatter"]

COARSE = 100.0  # factor by which the runs that measure the error are less accurate
SURE = 2.0  # Ratio of a bound to the largest scatter.


def rounding_of(value: Any) -> Any:
    """Return how far rounding may move a value, or several."""
    return 8.0 * float(np.finfo(float).eps) * np.abs(value)


def scatter(distances: Floats, samples: Floats, degree: int) -> tuple[Floats, Floats]:
    """Return how far samples (n, ...) lie from polynomials at most, and the coefficients, highest first."""
    powers = np.vander(distances, degree + 1)
    fitted = np.asarray(np.linalg.lstsq(powers, np.nan_to_num(samples), rcond=None)[0], dtype=np.float64)
    return np.abs(powers @ fitted - samples).max(axis=0), fitted
