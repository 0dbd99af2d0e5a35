"""The process in which compiled libraries read a file for `udd.measurement.formats.compiled`.

    python -P compiled_process.py KIND LIMIT < FILE > COLUMNS

KIND is ``hdf5``, ``matlab`` or ``parquet``; LIMIT is the number of bytes that the columns may take. These
libraries may crash, follow links to other files, or unfold a small file without end. Here they can open no
file: the content comes through a pipe, and after the imports no descriptor is left. Memory and CPU time are
limited, too.

The answer is a sequence of columns. A column of numbers is a line of JSON with ``name``, ``unit`` and
``shape``, and then the numbers (float64). A column of texts is a line with ``words``, a number of bytes, and
then a JSON list. A table in pieces begins with a line of ``names``; the `name` of a piece is then the number
of its column. The last line holds ``meta``, or ``error``, or ``exceeded``. Run as a script, this imports
nothing of the package.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import json
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

CPU_SECONDS = 200
DEEPEST = 32  # groups within each other
MOST = 20_000  # objects of a file
ENCODINGS = (
    "ascii",
    "latin-1",
    "utf-8",
    "utf-16",
    "utf-16-le",
    "utf-16-be",
    "utf-32",
    "utf-32-le",
    "utf-32-be",
)
BATCH = 1 << 14  # rows of a table that are unpacked at a time
LONGEST = 1 << 16  # characters of a text about the whole file

Libraries = dict[str, Any]


class Refused(Exception):
    """Error with the reason for not reading a file."""


class Exceeded(Exception):
    """The columns take more than the limit."""


class Output:
    """The answer, sent column by column; `left` bytes may still be sent."""

    def __init__(self, limit: int) -> None:
        self.left = limit
        self.meta: dict[str, Any] = {}
        self.numbers: dict[str, Any] = {}

    def check(self, size: int) -> None:
        """Refuse what takes more bytes than are left."""
        if size > self.left:
            raise Exceeded

    def value(self, name: str, content: Any, unit: str = "") -> None:
        """Send an array of numbers; keep a single number or text as one about the whole file."""
        try:
            array = np.asarray(content)
        except ValueError:  # rows of different lengths
            return
        kind = array.dtype.kind
        if kind == "U" and array.size == 1:
            self.meta[last(name)] = str(array.reshape(-1)[0])[:LONGEST]
        elif kind in "biuf" and array.size == 1:
            self.numbers[last(name)] = plain(array)
        elif array.dtype.names:
            for part in array.dtype.names:
                column = np.asarray(array[part]).squeeze()
                if column.ndim == 1 and column.dtype.kind in "biuf":
                    self.column(f"{name}.{part}", column)
        elif kind in "biuf" and array.size and array.squeeze().ndim <= 2:
            self.column(name, array.squeeze(), unit)

    def column(self, name: str | int, array: Any, unit: str = "") -> None:
        """Send numbers."""
        self.check(8 * array.size)
        self.left -= 8 * array.size
        self.put({"name": name, "unit": unit, "shape": array.shape})
        if array.size:
            self.write(np.ascontiguousarray(array, dtype=np.float64).data.cast("B"))

    def words(self, name: int, cells: list[str]) -> None:
        """Send texts."""
        size = sum(map(sys.getsizeof, cells)) + 8 * len(cells)
        self.check(size)
        self.left -= size
        text = json.dumps(cells).encode()
        self.put({"name": name, "words": len(text)})
        self.write(text)

    def put(self, said: dict[str, Any]) -> None:
        """Send a line."""
        self.write(json.dumps(said).encode() + b"\n")

    def write(self, data: Any) -> None:
        """Send every byte."""
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(1, rest) :]


def main(kind: str, limit: int) -> None:
    """Read the standard input, write the standard output."""
    load, read = KINDS[kind]
    out = Output(limit)
    try:
        libraries = load()
        for name in ENCODINGS:  # Python reads them from files
            codecs.lookup(name)
        raw = sys.stdin.buffer.read()
        confine(limit)
        read(raw, libraries, out)
        out.put({"meta": {**out.meta, **out.numbers}})
    except (Exceeded, MemoryError):
        out.put({"exceeded": True})
    except Exception as error:  # of what a broken file makes a library raise there is no list
        out.put({"error": " ".join(str(error).split())[:1000] or type(error).__name__})


def confine(limit: int) -> None:
    """Give up all that reading bytes in memory does not need: files, processes, more memory or time."""
    try:
        import resource
    except ImportError:  # Windows
        return
    wanted = {
        resource.RLIMIT_CPU: CPU_SECONDS,
        resource.RLIMIT_NOFILE: 0,
        resource.RLIMIT_NPROC: 0,
        resource.RLIMIT_FSIZE: 0,
        resource.RLIMIT_CORE: 0,
    }
    with contextlib.suppress(OSError, ValueError), open("/proc/self/statm", "rb") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
        wanted[resource.RLIMIT_AS] = mapped + limit + limit // 2 + (64 << 20)
    for what, most in wanted.items():
        with contextlib.suppress(OSError, ValueError):  # less is allowed already
            resource.setrlimit(what, (most, most))


def load_hdf5() -> Libraries:
    """Import h5py; filters that the library would load from files are off."""
    os.environ["HDF5_PLUGIN_PRELOAD"] = "::"
    import h5py

    return {"h5py": h5py}


def read_hdf5(raw: bytes, libraries: Libraries, out: Output) -> None:
    """Send data sets by their paths, once all are known to lie in the file itself."""
    h5py = libraries["h5py"]
    with h5py.File(io.BytesIO(raw), "r") as file:
        for name, value in file.attrs.items():
            if np.size(value) == 1:
                out.meta[name] = plain(value)
        for path, item in list(data_sets(h5py, file)):
            data_set(path, item, out)


def data_sets(h5py: Any, file: Any) -> Iterator[tuple[str, Any]]:
    """Yield the data sets of a file by their paths, in the order of names, each once.

    Raises
    ------
    Refused
        A link leads elsewhere, a data set is stored elsewhere, or groups lie too deep within each other.
    """
    seen, waiting = set(), [("", file.id)]
    while waiting:
        path, item = waiting.pop()
        info = h5py.h5o.get_info(item)
        if (info.fileno, info.addr) in seen:
            continue
        seen.add((info.fileno, info.addr))
        if len(seen) > MOST:
            raise Refused(f"it holds more than {MOST} groups and data sets")
        if isinstance(item, h5py.h5d.DatasetID):
            yield path, inside(path, item, h5py)
        elif isinstance(item, h5py.h5g.GroupID):
            if path.count("/") >= DEEPEST:
                raise Refused(f"its groups lie more than {DEEPEST} deep within each other")
            for name in sorted(item, reverse=True):
                below = f"{path}/{name.decode('utf-8', 'replace')}".lstrip("/")
                if below.startswith("#"):  # MATLAB's own bookkeeping
                    continue
                kind = item.links.get_info(name).type
                if kind != h5py.h5l.TYPE_HARD:
                    what = {h5py.h5l.TYPE_SOFT: "soft", h5py.h5l.TYPE_EXTERNAL: "external"}
                    raise Refused(f"{short(below)!r} is a {what.get(kind, 'foreign')} link: {COPY}")
                waiting.append((below, h5py.h5o.open(item, name)))


COPY = "copy the data into the file itself"


def inside(path: str, item: Any, h5py: Any) -> Any:
    """Return the data set, if its numbers are stored in the file itself."""
    plan = item.get_create_plist()
    if plan.get_external_count() > 0:
        raise Refused(f"{short(path)!r} is stored in another file (external storage): {COPY}")
    if plan.get_layout() == h5py.h5d.VIRTUAL:
        raise Refused(f"{short(path)!r} is a virtual data set, of parts of other files: {COPY}")
    return h5py.Dataset(item)


def data_set(path: str, item: Any, out: Output) -> None:
    """Send a data set of numbers, or keep a single text."""
    if item.shape is None:
        return
    kind = item.dtype.kind
    if kind in "SO":
        if item.size == 1:
            out.meta[last(path)] = plain(item[()])
        return
    if "MATLAB_empty" in item.attrs or not (item.dtype.names or kind in "biuf"):
        return
    if plain(item.attrs.get("MATLAB_class", "")) == "char":
        if item.size <= LONGEST:
            out.meta[last(path)] = "".join(map(chr, item[()].reshape(-1)))
        return
    if sum(n != 1 for n in item.shape) > 2:
        return  # no table
    out.check(max(8 * item.size, item.nbytes))
    unit = str(plain(item.attrs.get("units", item.attrs.get("unit", ""))))
    out.value(path, item[()], unit)


def load_matlab() -> Libraries:
    """Import SciPy's reader."""
    from scipy.io import loadmat

    return {"loadmat": loadmat}


def read_matlab(raw: bytes, libraries: Libraries, out: Output) -> None:
    """Send variables; fields of structures are called ``name.field``."""
    for name, value in flat(libraries["loadmat"](io.BytesIO(raw), simplify_cells=True), ""):
        out.value(name, value)


def flat(content: dict[str, Any], above: str) -> Iterator[tuple[str, Any]]:
    """Variables and fields by their names."""
    for name, value in content.items():
        if name.startswith("__"):
            continue
        if isinstance(value, dict):
            yield from flat(value, f"{above}{name}.")
        else:
            yield above + name, value


def load_parquet() -> Libraries:
    """Import pyarrow, which starts no thread and takes memory from the system."""
    os.environ |= {"OMP_NUM_THREADS": "1", "ARROW_DEFAULT_MEMORY_POOL": "system"}
    import pyarrow
    import pyarrow.parquet

    return {"pa": pyarrow, "pq": pyarrow.parquet}


def read_parquet(raw: bytes, libraries: Libraries, out: Output) -> None:
    """Send columns; the schema's metadata are about the whole file."""
    file, pa = libraries["pq"].ParquetFile(io.BytesIO(raw), pre_buffer=False), libraries["pa"]
    out.check(8 * file.metadata.num_rows * file.metadata.num_columns)
    schema = file.schema_arrow
    for key, value in (schema.metadata or {}).items():
        if key not in (b"pandas", b"ARROW:schema"):
            out.meta[key.decode()] = value.decode()
    out.put({"names": schema.names})
    for batch in file.iter_batches(BATCH, use_threads=False):
        for k in range(batch.num_columns):
            parquet_column(k, batch.column(k), pa, out)


def parquet_column(k: int, column: Any, pa: Any, out: Output) -> None:
    """Send cells of a column as numbers, NaN where one is empty, or else as texts."""
    if pa.types.is_dictionary(column.type):
        column = column.cast(column.type.value_type)
    if pa.types.is_boolean(column.type):
        column = column.cast(pa.int8())
    if pa.types.is_null(column.type):
        column = column.cast(pa.float64())
    if pa.types.is_integer(column.type) or pa.types.is_floating(column.type):
        out.column(k, column.to_numpy(zero_copy_only=False))
        return
    if pa.types.is_timestamp(column.type):  # in UTC if it has a zone: the zones lie in files
        column = column.cast(pa.timestamp(column.type.unit))
    if pa.types.is_temporal(column.type):
        column = column.cast(pa.string())
    out.words(k, ["" if cell is None else str(cell) for cell in column.to_pylist()])


def last(path: str) -> str:
    """Return the last part of a name as ``run/theta`` or ``run.theta``."""
    return path.replace(".", "/").rsplit("/", 1)[-1]


def short(path: str) -> str:
    """Shorten a path to fit into a sentence."""
    return path if len(path) <= 80 else f"{path[:77]}..."


def plain(value: Any) -> Any:
    """Return a single value as a JSON value."""
    first = np.asarray(value).reshape(-1)[0]
    if isinstance(first, np.number | np.bool_):
        number = first.item()
        # JSON has no longer floats.
        return float(number) if isinstance(number, np.floating) else number
    text = first.decode("utf-8", "replace") if isinstance(first, bytes) else str(first)
    return text[:LONGEST]


Kind = tuple[Callable[[], Libraries], Callable[[bytes, Libraries, Output], None]]
KINDS: dict[str, Kind] = {
    "hdf5": (load_hdf5, read_hdf5),
    "matlab": (load_matlab, read_matlab),
    "parquet": (load_parquet, read_parquet),
}

if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
