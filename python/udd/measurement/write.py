"""Writing a measurement to a file, whole or not at all."""

from __future__ import annotations

import io
import json
import math
import os
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.atomic_files import write_whole
from udd.errors import MeasurementError

from .table import Measurement


def to_csv(m: Measurement, path: str | os.PathLike[str]) -> None:
    """Write `m` as CSV: ``# key = value`` lines, a header, one row per frame."""
    table = numbers(m)
    flagged = bool((m.flag != "").any())

    words = {name: column.tolist() for name, column in m.quality.items() if column.dtype.kind not in "iuf"}

    lines = [f"# {key} = {_text(key, value)}" for key, value in m.meta.items()]
    lines.append(",".join([*table, *words, *(["flag"] if flagged else [])]))
    for i, row in enumerate(zip(*(column.tolist() for column in table.values()), strict=True)):
        # repr: the shortest text that reads back exactly
        cells = ["" if math.isnan(x) else repr(x) for x in row]
        cells += [_cell(str(column[i])) for column in words.values()]
        if flagged:
            cells.append(_cell(str(m.flag[i])))
        lines.append(",".join(cells))
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
    schema = {key: _text(key, value) for key, value in m.meta.items()}
    buffer = io.BytesIO()
    pq.write_table(pa.table(columns, metadata=schema), buffer)
    write_whole(path, buffer.getvalue())


def numbers(m: Measurement) -> dict[str, NDArray[Any]]:
    """The numeric columns of the file, by name and in order."""
    table = {"t": m.t} | {name: m.values[:, k] for k, name in enumerate(m.names)}
    if m.sigma is not None:
        table |= {f"sigma_{name}": m.sigma[:, k] for k, name in enumerate(m.names)}
    if m.rho is not None:
        table |= {f"rho_{a}{b}": m.rho[:, k] for k, (a, b) in enumerate(m.pairs)}
    table |= {name: column for name, column in m.quality.items() if column.dtype.kind in "iuf"}
    return table


def _text(key: str, value: Any) -> str:
    """A value of `meta` on one line, such that reading gives it back."""
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
