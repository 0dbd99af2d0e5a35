"""Gyroscope columns of a table: the rate of rotation of a phone on a pendulum."""

from __future__ import annotations

import os

import numpy as np

from udd._util.input_files import LARGEST
from udd.errors import MeasurementError

from .formats.headings import UNITS
from .read import headings_of, read_measurement
from .table import Measurement

RATE = ("Omega",)
_TURNS = 0.1  # share of the largest rate, from which on a pendulum turns
_HELD = 0.2  # s of rest that matter: a pendulum that is let go turns sooner
_PLACES = {"theta", "Y", "Z", "beta", "x", "y"}


def gyroscope_columns(path: str | os.PathLike[str], *, limit: float = LARGEST) -> list[str]:
    """Return the columns whose headings state a rate of turning, such as ``Gyroscope x (rad/s)``."""
    return [one.raw for one in headings_of(path, limit=limit) if one.unit in UNITS["rad/s"]]


def holds_rates_alone(path: str | os.PathLike[str], *, limit: float = LARGEST) -> bool:
    """Return True if a file has rates of turning, and no place or angle of a disk or a pendulum."""
    headings = headings_of(path, limit=limit)
    return (
        any(one.unit in UNITS["rad/s"] for one in headings) and not {one.name for one in headings} & _PLACES
    )


def read_gyroscope(
    path: str | os.PathLike[str], column: str | None = None, *, limit: float = LARGEST, **options: object
) -> Measurement:
    """Read the rate of turning that a gyroscope measured, as the column ``Omega`` in rad/s.

    Parameters
    ----------
    path : path
        A table, or phyphox's zip of tables.
    column : str, optional
        The gyroscope's axis. By default the column that varies most and has both signs, among those whose
        headings state rad/s, deg/s or another rate of turning. A magnitude has one sign.
    limit : float
        See :func:`udd.read_measurement`.
    **options
        Other options of that function.

    Returns
    -------
    Measurement
        ``meta["gyroscope"]`` names the column.

    Raises
    ------
    MeasurementError
        No column is a rate of turning, or the file cannot be read.

    Examples
    --------
    >>> import udd
    >>> udd.measurement.read_gyroscope(udd.examples.path("phone.csv")).meta["gyroscope"]
    'Gyroscope x (rad/s)'
    """
    names = [column] if column else gyroscope_columns(path, limit=limit)
    read = [
        read_measurement(path, {"Omega": name}, limit=limit, **options)  # type: ignore[arg-type]
        for name in names
    ]
    signed = [k for k, one in enumerate(read) if np.nanmin(one.values) < 0.0 < np.nanmax(one.values)]
    if not signed:
        raise MeasurementError(
            f"{path}: no column in rad/s or deg/s has values of both signs; write the unit into the heading, "
            "or name the column"
        )
    best = max(signed, key=lambda k: float(np.nanstd(read[k].values)))
    return read[best].with_meta(gyroscope=names[best])


def starts_to_turn(record: Measurement) -> float | None:
    """Return the time at which a pendulum begins to turn [s]; None if it turns from the beginning.

    Before that time a hand may have held it. Then no law of a pendulum fits the beginning of the record.
    """
    rate = np.abs(record.values[:, 0])
    largest = np.nanmax(rate, initial=0.0)
    turns = np.flatnonzero(rate > _TURNS * largest)
    if turns.size == 0 or record.t[turns[0]] - record.t[0] <= _HELD:
        return None
    return float(np.ceil(100.0 * record.t[turns[0]]) / 100.0)
