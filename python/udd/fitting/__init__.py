"""The loop's first half: what the model's numbers are, given measured motion."""

from __future__ import annotations

from .fit import extend, fit, fit_record
from .problem import Fit
from .record import Record, record_of
from .solve import held_cost, information_for, loosened

__all__ = [
    "Fit",
    "Record",
    "extend",
    "fit",
    "fit_record",
    "held_cost",
    "information_for",
    "loosened",
    "record_of",
]
