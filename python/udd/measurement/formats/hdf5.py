"""HDF5, and with it MATLAB's files of version 7.3."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from udd.errors import MeasurementError

from .arrays import LARGEST, tables_of
from .numpy_arrays import told
from .table import Table

SIGNATURE = b"\x89HDF\r\n\x1a\n"
READER = str(Path(__file__).with_name("hdf5_process.py"))
PATIENCE = 300  # s


def read(raw: bytes, given: list[str] | None) -> list[Table]:
    """Read data sets, called by their paths; an attribute ``units`` is a column's unit."""
    if find_spec("h5py") is None:
        raise MeasurementError(
            "HDF5 files, and MATLAB's of version 7.3, need the package h5py (pip install 'udd[hdf5]')"
        )
    command = [sys.executable, "-P", READER, str(LARGEST)]
    try:
        answer = subprocess.run(command, input=raw, capture_output=True, timeout=PATIENCE, check=True).stdout
        with np.load(io.BytesIO(answer), allow_pickle=False) as file:
            about = json.loads(file["about"].tobytes())
            arrays = [file[f"a{k}"] for k in range(len(file.files) - 1)]
    except (subprocess.SubprocessError, OSError, ValueError, KeyError, EOFError):
        raise MeasurementError("the HDF5 file cannot be read: it is broken") from None
    if "error" in about:
        raise MeasurementError(f"the HDF5 file cannot be read: {told(about['error'])}")
    by_path = dict(zip(about["paths"], arrays, strict=True))
    units = dict(zip(about["paths"], about["units"], strict=True))
    return tables_of(by_path, given, meta=about["meta"], units=units)
