"""File formats of measurements: a module for each format, and the table that distinguishes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from udd._util.input_files import MemoryLimit
from udd.errors import MeasurementError

from . import hdf5, matlab, numpy_arrays, other_xml, parquet, text, tracker_project, zipped
from .table import Table

__all__ = ["FORMATS", "Format", "Table", "format_of", "is_table"]

Reader = Callable[[bytes, list[str] | None, MemoryLimit], list[Table]]
_OFFICE = bytes.fromhex("d0cf11e0a1b11ae1")  # compound files: Excel's before 2007
HEAD = 4096
"""Bytes at a file's beginning that tell its kind."""


@dataclass(frozen=True)
class Format:
    """A kind of file: how its first bytes or its suffix identify it, and its reader."""

    name: str
    is_so: Callable[[bytes, str], bool]
    read: Reader


def _hdf5(head: bytes, _suffix: str) -> bool:
    return any(head.startswith(hdf5.SIGNATURE, at) for at in (0, 512, 1024, 2048))


def _matlab(head: bytes, suffix: str) -> bool:
    # Version 4 has no signature.
    return suffix == ".mat" or (head.startswith(b"MATLAB ") and b"MAT-file" in head[:128])


def _npz(head: bytes, suffix: str) -> bool:
    return head.startswith(b"PK\3\4") and (suffix == ".npz" or b".npy" in head[:512])


def _old_workbook(_raw: bytes, _given: list[str] | None, _memory: MemoryLimit) -> list[Table]:
    raise MeasurementError("this is an Excel workbook or another old Office file: save its sheet as CSV")


#: The first that fits reads a file; what none of them knows is a text table.
FORMATS = (
    Format("Parquet", lambda head, _suffix: head.startswith(b"PAR1"), parquet.read),
    Format("HDF5", _hdf5, hdf5.read),
    Format("MATLAB", _matlab, matlab.read),
    Format("old workbook", lambda head, _suffix: head.startswith(_OFFICE), _old_workbook),
    Format("NumPy archive", _npz, numpy_arrays.read),
    Format("NumPy array", lambda head, _suffix: head.startswith(b"\x93NUMPY"), numpy_arrays.read_one),
    Format("archive of tables", lambda head, _suffix: head.startswith((b"PK\3\4", b"PK\5\6")), zipped.read),
    *(Format(kind.what, kind.is_so, kind.read) for kind in other_xml.KINDS),
    Format(
        "Tracker project",
        lambda head, suffix: (
            suffix == ".trk" or head.lstrip(b"\xef\xbb\xbf \r\n").startswith((b"<?xml", b"<object"))
        ),
        tracker_project.read,
    ),
)
TEXT = Format("text table", lambda _head, _suffix: True, text.read)


def format_of(head: bytes, suffix: str) -> Format:
    """Return the kind of a file, by its first bytes and its suffix."""
    return next((one for one in FORMATS if one.is_so(head, suffix.lower())), TEXT)


def is_table(head: bytes, suffix: str = "") -> bool:
    """Return True if a file with these first bytes may hold a table, rather than a film."""
    utf16 = head.startswith((b"\xff\xfe", b"\xfe\xff"))
    return format_of(head, suffix) is not TEXT or utf16 or b"\0" not in head
