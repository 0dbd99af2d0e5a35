"""HDF5, and with it MATLAB's files of version 7.3."""

from __future__ import annotations

import io
from importlib import import_module
from typing import Any

import numpy as np

from udd.errors import MeasurementError

from .arrays import LARGEST, tables_of
from .numpy_arrays import told
from .table import Table

SIGNATURE = b"\x89HDF\r\n\x1a\n"


def read(raw: bytes, given: list[str] | None) -> list[Table]:
    """Read data sets, called by their paths; an attribute ``units`` is a column's unit."""
    try:
        h5py = import_module("h5py")
    except ImportError:
        raise MeasurementError(
            "HDF5 files, and MATLAB's of version 7.3, need the package h5py (pip install 'udd[hdf5]')"
        ) from None
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    meta: dict[str, Any] = {}

    def visit(path: str, item: Any) -> None:
        if path.startswith("#") or not isinstance(item, h5py.Dataset):  # MATLAB's own bookkeeping
            return
        if "MATLAB_empty" in item.attrs or not (item.dtype.names or item.dtype.kind in "biufSO"):
            return
        if item.dtype.kind in "SO" and item.size != 1:
            return
        if item.nbytes + sum(np.asarray(array).nbytes for array in arrays.values()) > LARGEST:
            raise MeasurementError("the file unfolds to more than 1 GB")
        if _text(item.attrs.get("MATLAB_class")) == "char":
            meta[path.split("/")[-1]] = "".join(map(chr, item[()].reshape(-1)))
        elif item.dtype.kind in "SO":
            meta[path.split("/")[-1]] = _text(np.asarray(item[()]).reshape(-1)[0])
        else:
            arrays[path] = item[()]
            units[path] = _text(item.attrs.get("units", item.attrs.get("unit", "")))

    try:
        with h5py.File(io.BytesIO(raw), "r") as file:
            meta |= {name: _plain(value) for name, value in file.attrs.items() if np.size(value) == 1}
            file.visititems(visit)
    except MeasurementError:
        raise
    except Exception as error:  # of what a broken file makes h5py raise there is no list
        raise MeasurementError(f"the HDF5 file cannot be read: {told(error)}") from None
    return tables_of(arrays, given, meta=meta, units=units)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _plain(value: Any) -> Any:
    value = np.asarray(value).reshape(-1)[0]
    return value.item() if isinstance(value, np.number | np.bool_) else _text(value)
