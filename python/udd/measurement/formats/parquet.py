"""Parquet."""

from __future__ import annotations

import io
from importlib import import_module
from typing import Any

import numpy as np

from udd.errors import MeasurementError

from .headings import headings
from .numpy_arrays import told
from .table import Table
from .text import value


def read(raw: bytes, given: list[str] | None) -> list[Table]:
    """Read a table; the schema's metadata are about the whole file."""
    try:
        pq = import_module("pyarrow.parquet")
    except ImportError:
        raise MeasurementError("Parquet files need the package pyarrow (pip install pyarrow)") from None
    try:
        table = pq.read_table(io.BytesIO(raw))
        stored = table.schema.metadata or {}
        cells = [table.column(k).to_pylist() for k in range(table.num_columns)]
        meta = {
            k.decode(): value(v.decode()) for k, v in stored.items() if k not in (b"pandas", b"ARROW:schema")
        }
    except Exception as error:  # ArrowInvalid, OSError, and what else a broken file makes it raise
        raise MeasurementError(f"the Parquet file cannot be read ({told(error)})") from None
    names = given if given is not None and len(given) == len(cells) else table.column_names
    return [Table(headings(names), [_column(column) for column in cells], meta)]


def _column(cells: list[Any]) -> Any:
    if all(cell is None or isinstance(cell, int | float) for cell in cells):
        return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)
    return ["" if cell is None else str(cell) for cell in cells]
