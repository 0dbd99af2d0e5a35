"""Writing a measurement to a file, whole or not at all."""

from __future__ import annotations

import io
import json
import math
import os
from importlib import import_module
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.atomic_files import write_whole
from udd.errors import MeasurementError

from .table import Measurement


def to_csv(m: Measurement, path: str | os.PathLike[str]) -> None:
    """Write `m` as CSV: ``# key = value`` lines, a header, one row per frame.

    An input is a column ``input:NAME``. An input with its own clock has a column ``t:NAME``, too, and may
    continue below the last frame.
    """
    table = numbers(m)
    words = {name: column.tolist() for name, column in m.quality.items() if column.dtype.kind not in "iuf"}
    if (m.flag != "").any():
        words["flag"] = m.flag.tolist()
    driven = inputs(m)

    lines = [f"# {key} = {_text(key, value)}" for key, value in header(m).items()]
    lines.append(",".join([*table, *words, *driven]))
    # repr: the shortest text that reads back exactly
    columns = [["" if math.isnan(x) else repr(x) for x in column.tolist()] for column in table.values()]
    columns += [[_cell(str(said)) for said in column] for column in words.values()]
    columns += [[repr(x) for x in column.tolist()] for column in driven.values()]
    lines += [",".join(cells) for cells in zip_longest(*columns, fillvalue="")]
    write_whole(path, ("\n".join(lines) + "\n").encode())


def to_parquet(m: Measurement, path: str | os.PathLike[str]) -> None:
    """Write `m` as Parquet; the header lines become the schema's metadata."""
    try:
        pa, pq = import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        raise MeasurementError("Parquet files need the package pyarrow (pip install pyarrow)") from None
    columns: dict[str, Any] = dict(numbers(m))
    columns |= {name: column.tolist() for name, column in m.quality.items() if column.dtype.kind not in "iuf"}
    columns["flag"] = [str(x) for x in m.flag]
    columns |= inputs(m)
    longest = max(map(len, columns.values()))
    columns = {
        name: column if len(column) == longest else [*column, *[None] * (longest - len(column))]
        for name, column in columns.items()
    }
    schema = {key: _text(key, value) for key, value in header(m).items()}
    buffer = io.BytesIO()
    pq.write_table(pa.table(columns, metadata=schema), buffer)
    write_whole(path, buffer.getvalue())


def numbers(m: Measurement) -> dict[str, NDArray[Any]]:
    """Return the numeric columns of the file, by name and in order."""
    table = {"t": m.t} | {name: m.values[:, k] for k, name in enumerate(m.names)}
    if m.sigma is not None:
        table |= {f"sigma_{name}": m.sigma[:, k] for k, name in enumerate(m.names)}
    if m.rho is not None:
        table |= {f"rho_{a}{b}": m.rho[:, k] for k, (a, b) in enumerate(m.pairs)}
    table |= {name: column for name, column in m.quality.items() if column.dtype.kind in "iuf"}
    return table


def inputs(m: Measurement) -> dict[str, NDArray[np.float64]]:
    """Return the columns of the inputs; an input's own times come before it."""
    columns = {}
    for name, signal in m.inputs.items():
        if not m.on_rows(name):
            columns[f"t:{name}"] = signal.t
        columns[f"input:{name}"] = signal.values
    return columns


def header(m: Measurement) -> dict[str, Any]:
    """Return the entries above the table: `meta`, and the interpolation of each input."""
    holds = {"input_hold": {name: signal.hold for name, signal in m.inputs.items()}} if m.inputs else {}
    return {**m.meta, **holds}


def _text(key: str, value: Any) -> str:
    """Write a value of `meta` on one line, so that reading restores it."""
    if any(c in key for c in "=\n\r#"):
        raise MeasurementError(
            f"the header key {key!r} holds a character that the file format does not allow"
        )
    value = value.item() if isinstance(value, np.generic) else value
    value = value.tolist() if isinstance(value, np.ndarray) else value
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        try:
            json.loads(value)
        except ValueError:
            if value == value.strip() and value.isprintable() and value:
                return value
    try:
        return json.dumps(value)
    except TypeError:
        raise MeasurementError(
            f"the header value of {key} cannot be written: {type(value).__name__}"
        ) from None


def _cell(text: str) -> str:
    if any(c in text for c in ',"\n\r'):
        return '"' + text.replace('"', '""').replace("\n", " ").replace("\r", " ") + '"'
    return text
