"""NumPy's files, read only if their headers agree with their sizes."""

from __future__ import annotations

import io
import math
import zipfile
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from .input_files import MemoryLimit

MOST = 10_000
"""Entries of an archive."""
_ENTRY, _ARRAY = b"PK\1\2", b"\x93NUMPY"


def opened_zip(raw: bytes, memory: MemoryLimit) -> zipfile.ZipFile:
    """Open a ZIP archive of a reasonable number of entries.

    Raises
    ------
    UddError
        It holds too many: the list alone would take much memory.
    zipfile.BadZipFile
        It is broken.
    """
    if raw.count(_ENTRY) > MOST:
        raise memory.error(f"the archive holds more than {MOST} files")
    return zipfile.ZipFile(io.BytesIO(raw))


def arrays_of(raw: bytes, memory: MemoryLimit) -> dict[str, NDArray[Any]]:
    """Read the arrays of an ``.npz`` archive by their names; nothing is unpickled.

    Raises
    ------
    UddError
        They take more than the limit.
    Exception
        Whatever `zipfile`, `zlib` and NumPy raise if the file is broken.
    """
    with opened_zip(raw, memory) as archive:
        entries = archive.infolist()
        memory.take(sum(entry.file_size for entry in entries))
        arrays = {}
        for entry in entries:
            content = archive.read(entry)  # no more than the size that the entry states
            if content.startswith(_ARRAY):
                arrays[entry.filename.removesuffix(".npy")] = array_of(content)
    return arrays


def array_of(raw: bytes) -> NDArray[Any]:
    """Read the array of an ``.npy`` file.

    Raises
    ------
    ValueError
        The header promises another number of bytes than there are, or Python objects.
    """
    file = io.BytesIO(raw)
    # Version 3 differs in the encoding of fields' names alone.
    read_header = npy.read_array_header_1_0 if npy.read_magic(file) == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read_header(file)
    there = len(raw) - file.tell()
    if not dtype.hasobject and not (dtype.itemsize and math.prod(shape) * dtype.itemsize <= there):
        raise ValueError(
            f"its header promises shape {shape} of {dtype.itemsize} bytes each, not {there} bytes"
        )
    file.seek(0)
    return np.asarray(npy.read_array(file, allow_pickle=False))
