"""Measurements: tables of times and coordinates, and their files."""

from __future__ import annotations

from udd.errors import MeasurementError

from .gyroscope import read_gyroscope
from .input_signal import InputSignal, input_signals
from .read import read_measurement
from .table import CAMERA_COLUMNS, DISK, PENDULUM, Measurement, check_length

__all__ = [
    "CAMERA_COLUMNS",
    "DISK",
    "PENDULUM",
    "InputSignal",
    "Measurement",
    "MeasurementError",
    "check_length",
    "input_signals",
    "read_gyroscope",
    "read_measurement",
]
