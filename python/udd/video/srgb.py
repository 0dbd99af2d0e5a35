"""The sRGB curve (IEC 61966-2-1) between codes and amounts of light, both from 0 to 1."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def light_of(code: NDArray[Any]) -> NDArray[Any]:
    """Amounts of light of codes."""
    return np.asarray(np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4))


def code_of(light: NDArray[Any]) -> NDArray[Any]:
    """Codes of amounts of light."""
    return np.asarray(np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055))
