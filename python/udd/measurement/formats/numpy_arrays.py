"""NumPy's files: .npz archives of named arrays, and single arrays (.npy)."""

from __future__ import annotations

from udd._util.input_files import MemoryLimit
from udd._util.numpy_files import array_of, arrays_of
from udd.errors import MeasurementError

from .arrays import tables_of
from .table import Table


def read(raw: bytes, given: list[str] | None, memory: MemoryLimit) -> list[Table]:
    """Read arrays; what would have to be unpickled is refused."""
    try:
        arrays = arrays_of(raw, memory)
    except MeasurementError:
        raise
    except Exception as error:  # of what a broken file makes NumPy raise there is no list
        raise MeasurementError(f"the NumPy archive cannot be read: {one_line_message(error)}") from None
    return tables_of(arrays, given, memory=memory)


def read_one(raw: bytes, given: list[str] | None, memory: MemoryLimit) -> list[Table]:
    """Read the array of an .npy file."""
    try:
        array = array_of(raw)
    except Exception as error:
        raise MeasurementError(f"the NumPy array cannot be read: {one_line_message(error)}") from None
    return tables_of({"column": array}, given, memory=memory)


def one_line_message(error: Exception | str) -> str:
    """Return the message of a library on one line, at most 160 characters."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 160 else text[:157] + "..."
