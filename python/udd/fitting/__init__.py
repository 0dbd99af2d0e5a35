"""The loop's first half: what the model's numbers are, given measured motion."""

from __future__ import annotations

from .fit import extend, fit, fit_record
from .problem import Fit, data_of
from .record import Record, record_of
from .solve import filtered, held_cost, loosened, predicted

__all__ = [
    "Fit",
    "Record",
    "data_of",
    "extend",
    "filtered",
    "fit",
    "fit_record",
    "held_cost",
    "loosened",
    "predicted",
    "record_of",
]
