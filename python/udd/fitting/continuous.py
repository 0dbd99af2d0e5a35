"""Prepare measurements for a fit: continuous angles, and times without rounding."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from udd._util.steady_clock import steady_clock
from udd.errors import outside
from udd.measurement import Measurement
from udd.measurement.unwrapping import unwrapped, wrapped_columns
from udd.models import Model
from udd.models.formula_model import FormulaModel


def angles_of(model: Any) -> tuple[str, ...]:
    """Return the columns that are angles to a model; none if it is no model."""
    if isinstance(model, FormulaModel):
        return model.turning
    return model.angles if isinstance(model, Model) else ()


def continuous(measurement: Any, model: Any) -> Any:
    """Make angles continuous and a rounded clock steady, for one measurement or for several.

    The model (one for all, or one for each) says which columns are angles. A column that jumps by a turn but
    is no angle of the model is reported and not changed. Any other object is returned as it is: a fit refuses
    it.
    """
    if isinstance(measurement, (list, tuple)):
        models = model if isinstance(model, Sequence) else [model] * len(measurement)
        if len(models) != len(measurement):
            return measurement
        return [continuous(part, each) for part, each in zip(measurement, models, strict=True)]
    if not isinstance(measurement, Measurement):
        return measurement
    if isinstance(model, Sequence):
        model = next(iter(model), None)
    result = steady(unwrapped(measurement, angles_of(model)))
    jumping = wrapped_columns(result)
    if jumping and isinstance(model, FormulaModel):
        warnings.warn(
            f"{jumping[0]} jumps by a turn, as an angle does, but is no angle of the model: the jumps count "
            f'as motion. If it is an angle, pass angles=["{jumping[0]}"] to udd.Model.',
            stacklevel=outside(),
        )
    return result


def steady(measurement: Measurement) -> Measurement:
    """Undo the rounding of times of a constant rate, for the rows and for inputs sampled with them."""
    clock = steady_clock(measurement.t)
    if clock is None:
        return measurement
    t = clock.all_at(measurement.t)
    inputs = {
        name: replace(signal, t=t) if measurement.on_rows(name) else signal
        for name, signal in measurement.inputs.items()
    }
    return replace(measurement, t=t, inputs=inputs, meta={**measurement.meta, "clock": clock.text})
