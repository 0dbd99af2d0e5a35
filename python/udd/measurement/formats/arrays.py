"""Arrays under names, as MATLAB, NumPy and HDF5 keep them, to tables."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.input_files import MemoryLimit
from udd.errors import MeasurementError

from .headings import Heading, headings
from .table import Table


def tables_of(
    arrays: Mapping[str, Any],
    given: list[str] | None = None,
    *,
    meta: Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
    memory: MemoryLimit | None = None,
) -> list[Table]:
    """One table for each length of columns.

    A matrix gives a column ``name_1``, ``name_2`` ... for each of the quantities along its shorter side; a
    single number and a text are about the whole file. The last part of a name like ``run/theta`` suffices.

    Raises
    ------
    MeasurementError
        There is no array of numbers, or they take more than the limit.
    """
    memory = memory or MemoryLimit(error=MeasurementError)
    about: dict[str, Any] = dict(meta or {})
    columns: dict[str, NDArray[np.float64]] = {}
    stated: dict[str, str] = {}
    for name, content in arrays.items():
        array = np.asarray(content)
        if array.dtype.kind == "U" and array.size == 1:
            about[_last(name)] = str(array.reshape(-1)[0])
        elif array.dtype.kind in "biuf" and array.size == 1:
            about[_last(name)] = array.reshape(-1)[0].item()
        elif array.dtype.names:
            columns |= {
                f"{name}.{part}": column
                for part in array.dtype.names
                if (column := np.asarray(array[part]).squeeze()).ndim == 1 and column.dtype.kind in "biuf"
            }
        elif array.dtype.kind in "biuf" and array.size and array.squeeze().ndim <= 2:
            array_columns = _columns(name, array.squeeze())
            columns |= array_columns
            stated |= dict.fromkeys(array_columns, (units or {}).get(name, ""))
    if not columns:
        raise MeasurementError("the file holds no arrays of numbers")
    by_length: dict[int, dict[str, NDArray[Any]]] = {}
    for name, column in columns.items():
        by_length.setdefault(len(column), {})[name] = column
    tables = []
    for same_length in by_length.values():
        named = [
            replace(heading, raw=name, unit=stated.get(name) or heading.unit)
            for name, heading in zip(
                same_length, headings([_last(name) for name in same_length]), strict=True
            )
        ]
        memory.take(sum(8 * column.size for column in same_length.values() if column.dtype != np.float64))
        whole: list[Any] = [np.asarray(column, dtype=np.float64) for column in same_length.values()]
        tables.append(Table(named, whole, about, memory=memory))
    return [_named(tables, given)] if given is not None else tables


def _last(name: str) -> str:
    return re.split(r"[./]", name)[-1]


def _columns(name: str, array: NDArray[Any]) -> dict[str, NDArray[Any]]:
    if array.ndim == 1:
        return {name: array}
    rows = array if array.shape[0] >= array.shape[1] else array.T
    return {f"{name}_{k + 1}": rows[:, k] for k in range(rows.shape[1])}


def _named(tables: list[Table], given: list[str]) -> Table:
    """Return the table with as many columns as the given names."""
    for table in tables:
        if len(table.columns) == len(given):
            return replace(table, headings=[Heading(name, name) for name in given])
    headings = ", ".join(tables[0].raw_headings)
    raise MeasurementError(f"columns gives {len(given)} names, but the file has {headings}")
