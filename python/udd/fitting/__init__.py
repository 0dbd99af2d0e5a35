"""The loop's first half: what the model's numbers are, given measured motion."""

from __future__ import annotations

from .fit import Fit, extend, fit, fit_record, held_cost, information_for, loosened
from .record import Record, record_of

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
