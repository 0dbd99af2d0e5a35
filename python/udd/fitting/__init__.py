"""The loop's first half: what the model's numbers are, given measured motion."""

from __future__ import annotations

from .fit import (
    UNEXPLAINED,
    as_stated,
    checked_units,
    extend,
    fit,
    fit_record,
    ran_away,
    refit,
    released,
    started_at,
    widened,
)
from .model_error_schedule import Goal, at_level, eased, smoothed_states, with_larger_model_error
from .problem import Fit
from .record import Record, record_of
from .solve import filtered, frame_costs, predicted, within

__all__ = [
    "UNEXPLAINED",
    "Fit",
    "Goal",
    "Record",
    "as_stated",
    "at_level",
    "checked_units",
    "eased",
    "extend",
    "filtered",
    "fit",
    "fit_record",
    "frame_costs",
    "predicted",
    "ran_away",
    "record_of",
    "refit",
    "released",
    "smoothed_states",
    "started_at",
    "widened",
    "with_larger_model_error",
    "within",
]
