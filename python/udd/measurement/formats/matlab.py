"""MATLAB's files up to version 7; those of version 7.3 are HDF5."""

from __future__ import annotations

import io
from typing import Any

from udd.errors import MeasurementError

from .arrays import tables_of
from .numpy_arrays import told
from .table import Table


def read(raw: bytes, given: list[str] | None) -> list[Table]:
    """Read variables; the fields of a structure are called ``name.field``."""
    from scipy.io import loadmat

    try:
        content = loadmat(io.BytesIO(raw), simplify_cells=True)
    except Exception as error:  # of what a broken file makes SciPy raise there is no list
        raise MeasurementError(f"the MATLAB file cannot be read: {told(error)}") from None
    return tables_of(_flat(content, ""), given)


def _flat(content: dict[str, Any], above: str) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in content.items():
        if name.startswith("__"):
            continue
        flat |= _flat(value, f"{above}{name}.") if isinstance(value, dict) else {above + name: value}
    return flat
