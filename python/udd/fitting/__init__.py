"""The loop's first half: what the model's numbers are, given measured motion."""

from __future__ import annotations

from .annealing import at_level, held, loosened
from .fit import extend, fit, fit_record, refit, widened
from .problem import Fit, data_of
from .record import Record, record_of
from .solve import filtered, frame_costs, predicted, within

__all__ = [
    "Fit",
    "Record",
    "at_level",
    "data_of",
    "extend",
    "filtered",
    "fit",
    "fit_record",
    "frame_costs",
    "held",
    "loosened",
    "predicted",
    "record_of",
    "refit",
    "widened",
    "within",
]
