"""Angles that count modulo a turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the equal angle within half a turn of zero."""
    result: NDArray[np.float64] = (angle + np.pi) % (2 * np.pi) - np.pi
    return result
