"""HDF5, and with it MATLAB's files of version 7.3."""

from __future__ import annotations

from importlib.util import find_spec

from udd._util.input_files import MemoryLimit
from udd.errors import MeasurementError

from . import compiled
from .arrays import tables_of
from .table import Table

SIGNATURE = b"\x89HDF\r\n\x1a\n"


def read(raw: bytes, given: list[str] | None, memory: MemoryLimit) -> list[Table]:
    """Read data sets, called by their paths; an attribute ``units`` is a column's unit."""
    if find_spec("h5py") is None:
        raise MeasurementError(
            "HDF5 files, and MATLAB's of version 7.3, need the package h5py (pip install 'udd[hdf5]')"
        )
    content = compiled.read("hdf5", "the HDF5 file", raw, memory)
    columns = dict(zip(content.names, content.columns, strict=True))
    return tables_of(columns, given, meta=content.meta, units=content.units)
