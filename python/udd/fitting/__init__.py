"""Estimate a model's parameters and states from measured motion.

The files, in the order of a fit: `record` prepares measurements; `problem` adds a model, free parameters and
the start; `minimum` calls the core once; `model_error_schedule` repeats that with smaller model errors; and
`noise_estimation` estimates the noise on the way. The result is a `Fit`; `refits` continue from its end.
"""

from __future__ import annotations

from .continuous import continuous
from .fit import fit, fit_record, options_of
from .fit_result import Fit, minimise
from .minimum import SolveError
from .model_error_schedule import Goal, far_off, solve
from .prediction import filtered, predicted
from .record import Record, record_of
from .refits import (
    as_stated,
    at_level,
    beyond_schedule,
    eased,
    extend,
    most_probable,
    refit,
    released,
    released_anew,
    smoothed_states,
    started_at,
    widened,
    with_larger_model_error,
    within,
)
from .units import UNEXPLAINED, checked_units, ran_away

__all__ = [
    "UNEXPLAINED",
    "Fit",
    "Goal",
    "Record",
    "SolveError",
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
    "minimise",
    "most_probable",
    "options_of",
    "predicted",
    "ran_away",
    "record_of",
    "refit",
    "released",
    "released_anew",
    "smoothed_states",
    "solve",
    "started_at",
    "widened",
    "with_larger_model_error",
    "within",
]
