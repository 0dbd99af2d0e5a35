"""What was measured: a table of times and coordinates, and the files it lives in."""

from __future__ import annotations

from .read import read_measurement
from .table import DISK, PENDULUM, Measurement, MeasurementError, check_length

__all__ = [
    "DISK",
    "PENDULUM",
    "Measurement",
    "MeasurementError",
    "check_length",
    "read_measurement",
]
