"""States along an orbit, for those who look at it without a word to the user."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from udd.errors import StiffnessWarning, UddError
from udd.models import Model

from .trajectory import integrated

__all__ = ["states_along"]

_Floats = NDArray[np.float64]


def states_along(
    model: Model, span: float, samples: int, start: _Floats, rtol: float, atol: float
) -> _Floats | None:
    """States (samples, dim) at equal times over `span` from a state (dim,); None if the run ends before."""
    times = np.linspace(0.0, span, samples)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StiffnessWarning)
        try:
            run = integrated(model, times, start, rtol=rtol, atol=atol, method="auto")
        except UddError:
            return None
    return run.state if run.outcome == "finished" else None
