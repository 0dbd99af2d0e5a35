"""The process that reads HDF5 for `udd.measurement.formats.hdf5` (h5py).

    python -P hdf5_process.py LARGEST < FILE > ARRAYS

It answers with an ``.npz`` of the data sets and, as JSON in the array ``about``, their paths and units, what
else the file says, or an error. The HDF5 library may crash where a file is broken: no other process ends.
"""

from __future__ import annotations

import io
import json
import sys
from typing import Any

import numpy as np


class Refused(Exception):
    """Why the file is not read."""


def main(largest: int) -> None:
    """Read the standard input, write the standard output."""
    import h5py

    arrays: list[Any] = []
    about: dict[str, Any] = {"paths": [], "units": [], "meta": {}}
    try:
        with h5py.File(io.BytesIO(sys.stdin.buffer.read()), "r") as file:
            for name, value in file.attrs.items():
                if np.size(value) == 1:
                    about["meta"][name] = plain(value)
            file.visititems(lambda path, item: visit(path, item, arrays, about, largest))
    except Exception as error:  # of what a broken file makes h5py raise there is no list
        arrays, about = [], {"error": " ".join(str(error).split()) or type(error).__name__}
    text = np.frombuffer(json.dumps(about).encode(), dtype=np.uint8)
    answer = io.BytesIO()
    np.savez(answer, about=text, **{f"a{k}": array for k, array in enumerate(arrays)})
    sys.stdout.buffer.write(answer.getvalue())


def visit(path: str, item: Any, arrays: list[Any], about: dict[str, Any], largest: int) -> None:
    """Take in a data set of numbers, or a single text."""
    if path.startswith("#") or not hasattr(item, "nbytes"):  # a group; MATLAB's own bookkeeping
        return
    last = path.split("/")[-1]
    if item.nbytes + sum(array.nbytes for array in arrays) > largest:
        raise Refused(f"it unfolds to more than {largest >> 20} MB")
    if item.dtype.kind in "SO":
        if item.size == 1:
            about["meta"][last] = plain(item[()])
    elif "MATLAB_empty" in item.attrs or not (item.dtype.names or item.dtype.kind in "biuf"):
        return
    elif plain(item.attrs.get("MATLAB_class", "")) == "char":
        about["meta"][last] = "".join(map(chr, item[()].reshape(-1)))
    else:
        arrays.append(np.asarray(item[()]))
        about["paths"].append(path)
        about["units"].append(str(plain(item.attrs.get("units", item.attrs.get("unit", "")))))


def plain(value: Any) -> Any:
    """A single value as JSON knows it."""
    first = np.asarray(value).reshape(-1)[0]
    if isinstance(first, np.number | np.bool_):
        return first.item()
    return first.decode("utf-8", "replace") if isinstance(first, bytes) else str(first)


if __name__ == "__main__":
    main(int(sys.argv[1]))
