"""MATLAB's files up to version 7; those of version 7.3 are HDF5."""

from __future__ import annotations

from udd._util.input_files import MemoryLimit

from . import compiled
from .arrays import tables_of
from .table import Table


def read(raw: bytes, given: list[str] | None, memory: MemoryLimit) -> list[Table]:
    """Read variables; the fields of a structure are called ``name.field``."""
    content = compiled.read("matlab", "the MATLAB file", raw, memory)
    return tables_of(dict(zip(content.names, content.columns, strict=True)), given, meta=content.meta)
