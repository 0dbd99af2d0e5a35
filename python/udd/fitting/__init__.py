"""Estimate a model's parameters and states from measured motion."""

from __future__ import annotations

from .continuous import continuous
from .fit import (
    UNEXPLAINED,
    as_stated,
    checked_units,
    extend,
    fit,
    fit_record,
    most_probable,
    options_of,
    ran_away,
    refit,
    released,
    released_anew,
    started_at,
    widened,
)
from .model_error_schedule import (
    Goal,
    at_level,
    beyond_schedule,
    eased,
    far_off,
    smoothed_states,
    with_larger_model_error,
)
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
    "beyond_schedule",
    "checked_units",
    "continuous",
    "eased",
    "extend",
    "far_off",
    "filtered",
    "fit",
    "fit_record",
    "frame_costs",
    "most_probable",
    "options_of",
    "predicted",
    "ran_away",
    "record_of",
    "refit",
    "released",
    "released_anew",
    "smoothed_states",
    "started_at",
    "widened",
    "with_larger_model_error",
    "within",
]
