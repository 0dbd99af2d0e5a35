"""Part of a record between two times."""

from __future__ import annotations

from udd.errors import MeasurementError

from .table import Measurement


def between(record: Measurement, begin: float | None = None, end: float | None = None) -> Measurement:
    """Return the rows of a record from `begin` to `end`, both included [s]; None is its beginning or its end.

    Raises
    ------
    MeasurementError
        Fewer than two rows lie in between.
    """
    first, last = float(record.t[0]), float(record.t[-1])
    begin, end = first if begin is None else begin, last if end is None else end
    inside = (record.t >= begin) & (record.t <= end)
    if inside.sum() < 2:
        raise MeasurementError(
            f"the part from {begin:.4g} to {end:.4g} s has fewer than two rows; the record's times go from "
            f"{first:.4g} to {last:.4g} s"
        )
    return record if inside.all() else record.rows(inside)
