"""The circle through points that were clicked on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

UNSURE = 0.1  # of the radius: a centre known no better is not taken


@dataclass(frozen=True)
class Circle:
    """Centre (u + iv) and radius with standard errors, all in pixels; the centre's is of each coordinate."""

    centre: complex
    radius: float
    centre_sigma: float
    radius_sigma: float


def circle(points: NDArray[np.complex128], sigma: float) -> Circle | None:
    """Fit a circle to three points or more, each with the error `sigma` [pixels]; None if undetermined."""
    z = np.asarray(points, dtype=np.complex128)
    middle = z.mean()
    off = z - middle
    if len(z) < 3 or np.abs(off).max() < 2 * sigma:
        return None
    design = np.column_stack([2 * off.real, 2 * off.imag, np.ones(len(z))])
    (a, b, c), _, rank, _ = np.linalg.lstsq(design, np.abs(off) ** 2, rcond=1e-6)
    square = c + a**2 + b**2
    if rank < 3 or not square > 0:
        return None
    centre, radius = complex(a, b), float(np.sqrt(square))
    arms = (off - centre) / np.abs(off - centre)
    slopes = np.column_stack([arms.real, arms.imag, np.ones(len(z))])
    values, vectors = np.linalg.eigh(slopes.T @ slopes)
    if values[0] < 1e-9:
        return None
    spread = sigma**2 * np.diag((vectors / values) @ vectors.T)
    centre_sigma = float(np.sqrt(spread[:2].mean()))
    if centre_sigma > UNSURE * radius:
        return None
    return Circle(complex(middle + centre), radius, centre_sigma, float(np.sqrt(spread[2])))
