"""Usual time between frames of a film whose clock may change."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

AROUND = 9  # intervals whose median is the usual one there
PART = 0.9  # share of the intervals that are at most so long
SLOWER = 1.5  # factor from which on a part has another clock


def usual_interval(t: NDArray[np.float64]) -> float:
    """Return the usual time between frames [s].

    If much of a film is in slow motion, its frames are close in real time. Then the interval of the other
    part is the usual one, so that its frames are no gaps.

    Parameters
    ----------
    t : ndarray (n,)
        Times of two or more frames, s.
    """
    steps = np.diff(t)
    usual = float(np.median(steps))
    slow = float(np.quantile(median_filter(steps, AROUND, mode="nearest"), PART))
    return slow if slow > SLOWER * usual else usual
