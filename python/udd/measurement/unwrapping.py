"""Angles that a record keeps within one turn, made continuous."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .table import Measurement

_TURN = 2 * np.pi
_ROUNDING = 0.02  # rad by which the numbers of a table may exceed one turn


def unwrapped(measurement: Measurement, angles: Collection[str] = ()) -> Measurement:
    """Make the angles of a measurement continuous that are within one turn and jump.

    An angle with a range of more than a turn is continuous already, and stays as it is: fast rotation across
    a gap may truly move it by more than half a turn.

    Parameters
    ----------
    measurement : Measurement
    angles : collection of str
        Columns that are angles, in addition to those of :attr:`Measurement.angles`.

    Returns
    -------
    Measurement
        The same object if no angle jumps.
    """
    values = measurement.values
    for k in _wrapped(measurement):
        if measurement.names[k] in {*measurement.angles, *angles}:
            values = values.copy() if values is measurement.values else values
            values[:, k] = _continuous(values[:, k], measurement.seen)
    return measurement if values is measurement.values else replace(measurement, values=values)


def wrapped_columns(measurement: Measurement) -> tuple[str, ...]:
    """Return the columns that look like angles within one turn: they jump by nearly a turn."""
    return tuple(measurement.names[k] for k in _wrapped(measurement))


def _wrapped(measurement: Measurement) -> Iterator[int]:
    return (k for k, column in enumerate(measurement.values.T) if _jumps(column[measurement.seen]))


def _jumps(angle: NDArray[np.float64]) -> bool:
    """Return True if an angle lies within one turn and moves by more than half of it between two rows."""
    good = angle[np.isfinite(angle)]
    if len(good) < 2 or np.ptp(good) > _TURN + _ROUNDING:
        return False
    return bool(np.abs(np.diff(good)).max() > np.pi)


def _continuous(angle: NDArray[np.float64], seen: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Unwrap an angle; rows that are not usable follow the last one before them that is."""
    rows = np.flatnonzero(np.isfinite(angle) & seen)
    result = angle.copy()
    result[rows] = np.unwrap(angle[rows])
    rest = np.flatnonzero(np.isfinite(angle) & ~seen)
    before = rows[np.maximum(np.searchsorted(rows, rest) - 1, 0)]
    result[rest] -= _TURN * np.round((angle[rest] - result[before]) / _TURN)
    return result
