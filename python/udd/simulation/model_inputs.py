"""The signals that a run's inputs follow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd.errors import MeasurementError, ModelError
from udd.measurement import InputSignal, input_signals
from udd.models import Model
from udd.models.formula_model import FormulaModel

__all__ = ["driven"]

M = TypeVar("M", bound=Model)
_ROUNDING = 1e-9  # of a signal's length, by which a run may go on beyond it


def driven(model: M, times: NDArray[np.float64], inputs: Mapping[str, InputSignal | ArrayLike] | None) -> M:
    """Return the model with the signals of its inputs, which must cover the whole run.

    Parameters
    ----------
    model : Model
        The model with inputs.
    times : ndarray, shape (n,)
        Times of the run; the first and the last suffice. Samples without times belong to these times.
    inputs : mapping of str to InputSignal or array_like, or None
        Signals by name. None leaves the model as it is.

    Raises
    ------
    ModelError
        Inputs that the model does not have, or a signal that does not last as long as the run.
    """
    if inputs is None:
        return model
    if not isinstance(model, FormulaModel):
        raise ModelError(f"a {type(model).__name__} has no inputs; a udd.Model(..., inputs=[...]) has")
    if not isinstance(inputs, Mapping):
        raise ModelError(f"inputs must be a table of names and signals, not {inputs!r}")
    try:
        signals = input_signals(inputs, times)
    except MeasurementError as error:
        raise ModelError(str(error)) from None
    for name, signal in signals.items():
        slack = _ROUNDING * float(np.ptp(signal.span))
        if lacks := signal.lacks(float(times[0]), float(times[-1]), slack, "run"):
            raise ModelError(f"the input {name} {lacks}")
    return model.with_inputs(signals)
