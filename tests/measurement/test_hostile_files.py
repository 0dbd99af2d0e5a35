"""Files made to read others, to unfold without end, or to keep a reader busy: refused in one sentence."""

from __future__ import annotations

import io
import json
import os
import struct
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import udd
from udd._util.input_files import MemoryLimit
from udd._util.tables import read
from udd.errors import UddError
from udd.measurement import MeasurementError, read_measurement
from udd.measurement.formats import compiled
from udd.measurement.formats.headings import headings

SECRET = b"root:x:0:0:the words of another file\n"
LIMIT = 10e6
ROWS = 3_000_000  # numbers, of more bytes than the limit


def put(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def hdf5(path: Path, kind: str, secret: Path) -> Path:
    """A measurement in which `theta` lies in another file."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["t"] = np.arange(len(SECRET)) / 25
        if kind == "external storage":
            file.create_dataset("theta", (len(SECRET),), "u1", external=[(str(secret), 0, len(SECRET))])
        elif kind == "virtual":
            layout = h5py.VirtualLayout((len(SECRET),), "u1")
            layout[:] = h5py.VirtualSource(str(secret), "theta", (len(SECRET),))
            file.create_virtual_dataset("theta", layout)
        elif kind == "external link":
            file["theta"] = h5py.ExternalLink(str(secret), "/theta")
        else:
            file["group/theta"] = h5py.SoftLink("/t")
    return path


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("external storage", "theta"),
        ("virtual", "theta"),
        ("external link", "theta"),
        ("soft link", "group/theta"),
    ],
)
def test_an_hdf5_file_that_refers_to_others_is_refused_by_name(tmp_path: Path, kind: str, name: str) -> None:
    h5py = pytest.importorskip("h5py")
    secret = tmp_path / "secret"
    if kind == "external storage":
        secret.write_bytes(SECRET)
    else:
        with h5py.File(secret, "w") as file:
            file["theta"] = np.frombuffer(SECRET, np.uint8)
    with pytest.raises(MeasurementError, match=f"'{name}' is .*{kind}.*copy the data into the file") as error:
        read_measurement(hdf5(tmp_path / "evil.h5", kind, secret))
    assert len(str(error.value)) < 300 + len(str(tmp_path))


@pytest.mark.skipif(sys.platform != "linux", reason="limits of a process as Linux knows them")
def test_the_reader_process_can_open_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the checks of links, too, the kernel refuses."""
    secret = put(tmp_path, "secret", SECRET)
    evil = hdf5(tmp_path / "evil.h5", "external storage", secret)
    source = Path(compiled.READER).read_text()
    unchecked = source.replace("plan.get_external_count() > 0", "False")
    assert unchecked != source
    for script, there in ((unchecked, False), (unchecked.replace("        confine(limit)\n", ""), True)):
        monkeypatch.setattr(compiled, "READER", str(put(tmp_path, "reader.py", script)))
        try:
            content = compiled.read(
                "hdf5", "the file", evil.read_bytes(), MemoryLimit(LIMIT, MeasurementError)
            )
            seen = bytes(np.asarray(content.columns[-1]).astype(np.uint8))
        except MeasurementError:
            seen = b""
        assert (seen == SECRET) == there


def test_groups_deep_within_each_other_are_refused(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "deep.h5"
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(1000):
            group = group.create_group("g")
        group["theta"] = np.arange(20.0)
    start = time.perf_counter()
    with pytest.raises(MeasurementError, match="groups lie more than 32 deep"):
        read_measurement(path)
    assert time.perf_counter() - start < 20  # it took 7 s on a free machine, and 60 s with 3000


def test_a_group_that_holds_itself_is_read_once(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "ring.h5"
    with h5py.File(path, "w") as file:
        file["run/t"], file["run/theta"] = np.arange(20.0), np.arange(20.0)
        file["run/again"] = file["run"]
    assert len(read_measurement(path)) == 20


def npz(**arrays: object) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def npy_of_nothing() -> bytes:
    """A header that promises more than there is."""
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({10**12},), }}"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head) + 1) + head.encode() + b"\n"


def zipped(name: str, content: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, content)
    return buffer.getvalue()


def mat() -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, {"t": np.zeros(ROWS), "theta": np.zeros(ROWS)}, do_compression=True)
    return buffer.getvalue()


def parquet(words: bool = False) -> bytes:
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    cells = pa.array(np.zeros(ROWS))
    if words:
        cells = pa.DictionaryArray.from_arrays(np.zeros(ROWS // 10, np.int32), ["x" * 1000]).cast("string")
    buffer = io.BytesIO()
    pq.write_table(pa.table({"t": cells}), buffer)
    return buffer.getvalue()


def empty_hdf5() -> bytes:
    h5py = pytest.importorskip("h5py")
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file.create_dataset("theta", (ROWS,), "u1", chunks=(1 << 20,), compression="gzip")
    return buffer.getvalue()


def xml(content: str) -> bytes:
    panel = '<object class="org.opensourcephysics.cabrillo.tracker.TrackerPanel">'
    return f"{panel}{content}</object>".encode()


UNFOLDING: dict[str, Callable[[], bytes]] = {
    "text.csv": lambda: b"a,b\n" + b"1,2\n" * 600_000,
    "words.csv": lambda: (
        b"t,theta,flag\n" + b"".join(b"%d,1,\n" % k for k in range(20_000)) + b"99999,1," + b"x" * 199
    ),
    "head.csv": lambda: b"# a = [" + b"[]," * 60_000 + b"[]]\nt,theta\n0,1\n",
    "text.zip": lambda: zipped("a.csv", b"t,theta\n" + b"1,2\n" * 5_000_000),
    "project.trz": lambda: zipped("a.trk", xml("<a/>" * 100_000)),
    "project.trk": lambda: xml("<a/>" * 100_000),
    "run.npz": lambda: npz(t=np.zeros(ROWS), theta=np.zeros(ROWS)),
    "bytes.npz": lambda: npz(t=np.zeros(ROWS, np.uint8), theta=np.zeros(ROWS, np.uint8)),
    "run.mat": mat,
    "run.parquet": parquet,
    "words.parquet": lambda: parquet(words=True),
    "run.h5": empty_hdf5,
}
MEASURE = """
import json, resource, sys
import udd
from udd.measurement import read_measurement
def peak(who): return resource.getrusage(who).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
before = peak(resource.RUSAGE_SELF)
said = []
for path in sys.argv[2:]:
    try:
        said.append(repr(read_measurement(path, limit=float(sys.argv[1]))))
    except udd.UddError as error:
        said.append(str(error))
print(json.dumps([said, peak(resource.RUSAGE_SELF) - before, peak(resource.RUSAGE_CHILDREN)]))
"""


def measured(limit: float, *paths: Path) -> tuple[list[str], int, int]:
    """Read the files; return the answers, and the peak of memory in bytes, here and in reader processes."""
    command = [sys.executable, "-W", "ignore", "-c", MEASURE, str(limit), *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    said, here, there = json.loads(done.stdout)
    return said, here, there


@pytest.mark.skipif(sys.platform == "win32", reason="peaks of memory as POSIX knows them")
def test_what_unfolds_to_more_than_the_limit_is_refused_before_it_is_there(tmp_path: Path) -> None:
    paths = [put(tmp_path, name, make()) for name, make in UNFOLDING.items()]
    said, here, there = measured(LIMIT, *paths)
    for path, words in zip(paths, said, strict=True):
        assert words.startswith(f"{path}: ")
        assert words.endswith("the data take more than the limit of 10 MB (limit=1e8 allows more)"), words
    # Reading them took 1.1 GB here before there was a limit.
    assert here < 12 * max(path.stat().st_size for path in paths) + 60e6
    assert there < 300e6


def test_a_limit_can_be_raised_and_lowered(tmp_path: Path) -> None:
    path = put(tmp_path, "run.csv", "t,theta\n" + "".join(f"{k / 25},0.1\n" for k in range(1000)))
    assert len(read_measurement(path)) == 1000
    assert len(read_measurement(path, limit=1e5)) == 1000
    with pytest.raises(MeasurementError, match=r"the limit of 20 kB \(limit=2e5 allows more\)"):
        read_measurement(path, limit=20_000)
    for odd in (0, -1, float("nan"), float("inf"), "1e9", True):
        with pytest.raises(MeasurementError, match="limit must be a positive number of bytes"):
            read_measurement(path, limit=odd)  # type: ignore[arg-type]


@pytest.mark.skipif(sys.platform == "win32", reason="peaks of memory as POSIX knows them")
def test_a_text_table_takes_at_most_twelve_times_its_size(tmp_path: Path) -> None:
    short = put(tmp_path, "short.csv", "t,theta\n" + "".join(f"{k},{k % 7}\n" for k in range(400_000)))
    wide = put(tmp_path, "wide.csv", "a,b,c\n" + "1,2,3\n" * 500_000)
    words = put(tmp_path, "words.csv", "t,theta,w,v\n" + "".join(f"{k},1,ab,cd\n" for k in range(200_000)))
    for path, says in ((short, "400000 rows"), (wide, "no column t"), (words, "200000 rows")):
        (said,), here, _ = measured(1e9, path)
        assert says in said
        assert here < 12 * path.stat().st_size, (path.name, here / path.stat().st_size)


def test_a_declared_size_counts(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="cannot be read: its header promises"):
        read_measurement(put(tmp_path, "a.npy", npy_of_nothing()))
    many = io.BytesIO()
    with zipfile.ZipFile(many, "w") as archive:
        for k in range(12_000):
            archive.writestr(f"{k}.csv", b"")
    with pytest.raises(MeasurementError, match="holds more than 10000 files"):
        read_measurement(put(tmp_path, "a.zip", many.getvalue()))
    with pytest.raises(MeasurementError, match=r"line 2 is longer than 1\.05 MB"):
        read_measurement(put(tmp_path, "a.csv", "t,theta\n" + "1," * 700_000))
    rows = "".join(f"{k},1,\n" for k in range(99))
    with pytest.raises(MeasurementError, match="a text in column flag has 5000 characters, more than 200"):
        read_measurement(put(tmp_path, "b.csv", f"t,theta,flag\n{rows}100,1,{'x' * 5000}\n"))
    with pytest.raises(MeasurementError, match="holds XML entities"):
        read_measurement(put(tmp_path, "a.trk", '<!DOCTYPE a [<!ENTITY b "c">]><object>&b;</object>'))
    hidden = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><object>&b;</object>'.encode("utf-16")
    with pytest.raises(MeasurementError, match="holds XML entities"):
        read_measurement(put(tmp_path, "b.trk", hidden))


def test_saved_results_have_the_limit(tmp_path: Path) -> None:
    path = put(tmp_path, "fit.npz", npz(tree=np.frombuffer(b"{}", np.uint8), a0=np.zeros(ROWS)))
    with pytest.raises(UddError, match=r"fit\.npz: the data take more than the limit of 10 MB"):
        udd.load(path, limit=LIMIT)
    path = put(tmp_path, "tree.npz", npz(tree=np.frombuffer(b"[" + b"[]," * 80_000 + b"[]]", np.uint8)))
    with pytest.raises(UddError, match="the limit of 10 MB"):
        udd.load(path, limit=LIMIT)
    with pytest.raises(UddError, match=r"tree\.npz is not a whole file"):
        udd.load(path)


def test_dotted_names_of_toml_are_not_copied_for_each_dot(tmp_path: Path) -> None:
    """A name of 20,000 parts took 1.5 GB and 9 s."""
    for name in (
        "a" + ".a" * 20_000,
        "[b" + " . b" * 20_000 + "]\nc",
        '"a"' + ".'a'" * 20_000,
        "x = {a" + ".a" * 99 + " = 1}\nd",
    ):
        path = put(tmp_path, "spec.toml", f"{name} = 1\n")
        start = time.perf_counter()
        with pytest.raises(UddError, match=r"spec\.toml has names of more than 16 parts"):
            udd.SweepSpec.read(path)
        assert time.perf_counter() - start < 1
    harmless = (
        "# "
        + "e.g. a. b. c. " * 30
        + "\na.b.c = 1\nd = ["
        + "0.1, " * 100
        + "]\ne = '"
        + "x. y. " * 30
        + "'\n"
    )
    assert read(put(tmp_path, "fine.toml", harmless), toml=True)["a"] == {"b": {"c": 1}}
    large = put(tmp_path, "large.toml", "".join(f"[a{k}]\n" for k in range(2000)))
    with pytest.raises(UddError, match=r"large\.toml: the data take more than the limit of 10 MB"):
        udd.SweepSpec.read(large, limit=LIMIT)
    large = put(tmp_path, "large.json", "[" + "[]," * 50_000 + "[]]")
    with pytest.raises(UddError, match=r"large\.json: the data take more than the limit of 10 MB"):
        udd.SweepSpec.read(large, limit=LIMIT)


READERS: dict[str, Callable[[Path], object]] = {
    "measurement": read_measurement,
    "result": udd.load,
    "spec": udd.SweepSpec.read,
    "config": lambda path: udd.track(path.with_suffix(".mp4"), config=path),
    "film": udd.track,
    "command": lambda path: command("fit", str(path), "--W", "0"),
    "model": lambda path: command("fit", str(path.with_suffix(".csv")), "--model", str(path)),
}


def command(*arguments: str) -> None:
    """Raise what the command says."""
    done = subprocess.run(
        [sys.executable, "-m", "udd", *arguments], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 1
    raise UddError(done.stderr)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_only_regular_files_are_read(tmp_path: Path, name: str, kind: str) -> None:
    if name in ("film", "config"):
        pytest.importorskip("av")
    path = tmp_path / "pipe"
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    put(tmp_path, "pipe.csv", "t,x\n0,1\n")
    put(tmp_path, "pipe.mp4", b"\0")
    with pytest.raises(UddError, match="is a device or a pipe, not a regular file") as error:
        READERS[name](path)
    assert "pipe" in str(error.value).partition(":")[2] + str(error.value).partition(":")[0]


@pytest.mark.parametrize("mark", ["[", "(", "{", "_{", "[ ", "[" + " " * 9 + "(", " ", "_ ", "a b "])
def test_headings_are_read_in_linear_time(mark: str) -> None:
    """16,000 brackets took 7.3 s."""
    cell = "t" + mark * (100_000 // len(mark)) + "x"
    start = time.perf_counter()
    headings([cell, "theta"])
    assert time.perf_counter() - start < 2
    start = time.perf_counter()
    assert len(headings(["t_ms"] * 20_000)) == 20_000
    assert time.perf_counter() - start < 2
