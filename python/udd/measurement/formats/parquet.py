"""Parquet."""

from __future__ import annotations

from importlib.util import find_spec

from udd._util.input_files import MemoryLimit
from udd.errors import MeasurementError

from . import compiled
from .headings import headings
from .table import Table
from .text import value


def read(raw: bytes, given: list[str] | None, memory: MemoryLimit) -> list[Table]:
    """Read a table; the schema's metadata are about the whole file."""
    if find_spec("pyarrow") is None:
        raise MeasurementError("Parquet files need the package pyarrow (pip install pyarrow)")
    content = compiled.read("parquet", "the Parquet file", raw, memory)
    meta = {key: value(text, memory) for key, text in content.meta.items()}
    names = given if given is not None and len(given) == len(content.names) else content.names
    return [Table(headings(names), content.columns, meta, memory=memory)]
