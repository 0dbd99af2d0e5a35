"""NumPy's files: .npz archives of named arrays, and single arrays (.npy)."""

from __future__ import annotations

import io

import numpy as np

from udd.errors import MeasurementError

from .arrays import LARGEST, tables_of
from .table import Table


def read(raw: bytes, given: list[str] | None) -> list[Table]:
    """Read arrays; what would have to be unpickled is refused."""
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as file:
            if sum(info.file_size for info in file.zip.infolist()) > LARGEST:
                raise MeasurementError("the archive unfolds to more than 1 GB")
            arrays = {name: file[name] for name in file.files}
    except MeasurementError:
        raise
    except Exception as error:  # of what a broken file makes NumPy raise there is no list
        raise MeasurementError(f"the NumPy archive cannot be read: {told(error)}") from None
    return tables_of(arrays, given)


def read_one(raw: bytes, given: list[str] | None) -> list[Table]:
    """Read the array of an .npy file."""
    try:
        array = np.load(io.BytesIO(raw), allow_pickle=False)
    except Exception as error:
        raise MeasurementError(f"the NumPy array cannot be read: {told(error)}") from None
    return tables_of({"column": array}, given)


def told(error: Exception | str) -> str:
    """What a library says, on one line and no longer than that."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 160 else text[:157] + "..."
