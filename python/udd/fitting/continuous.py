"""Measurements with continuous angles, as a fit needs them: the model says which columns are angles."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

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
    """Make the angles continuous of one measurement, or of several, with one model for all or one each.

    What is no measurement is returned as it is: a fit refuses it. A column that jumps by a turn without being
    an angle of the model is reported, and not changed.
    """
    if isinstance(measurement, Measurement):
        if isinstance(model, Sequence):
            model = next(iter(model), None)
        result = unwrapped(measurement, angles_of(model))
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
