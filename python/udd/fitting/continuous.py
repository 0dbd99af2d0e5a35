"""Measurements as a fit needs them: with continuous angles, and times that are not rounded."""

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
    """Make angles continuous and a rounded clock steady, of one measurement or of several.

    The model, one for all or one each, says which columns are angles. A column that jumps by a turn without
    being an angle of the model is reported, and not changed. Any other object is returned as it is: a fit
    refuses it.
    """
    if isinstance(measurement, Measurement):
        if isinstance(model, Sequence):
            model = next(iter(model), None)
        result = steady(unwrapped(measurement, angles_of(model)))
        left = wrapped_columns(result)
        if left and isinstance(model, FormulaModel):
            warnings.warn(
                f"{left[0]} jumps by a turn, as an angle within one turn does, but is no angle of the model: "
                f'its jumps count as motion. If it is an angle, say angles=["{left[0]}"] in udd.Model.',
                stacklevel=outside(),
            )
        return result
    if not isinstance(measurement, (list, tuple)):
        return measurement
    models = model if isinstance(model, Sequence) else [model] * len(measurement)
    if len(models) != len(measurement):
        return measurement
    return [continuous(one, own) for one, own in zip(measurement, models, strict=True)]


def steady(measurement: Measurement) -> Measurement:
    """Undo the rounding of times of a constant rate; inputs that were sampled with the rows go with them."""
    clock = steady_clock(measurement.t)
    if clock is None:
        return measurement
    t = clock.all_at(measurement.t)
    inputs = {
        name: replace(signal, t=t) if measurement.on_rows(name) else signal
        for name, signal in measurement.inputs.items()
    }
    return replace(measurement, t=t, inputs=inputs, meta={**measurement.meta, "clock": clock.text})
