"""Writing on a full disk, and processes that are killed: a file is there whole or not at all."""

from __future__ import annotations

import errno
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import discovered
import udd
from udd._util import atomic_files
from udd._util.atomic_files import write_whole
from udd.cli import main
from udd.errors import UddError

FULL = os.strerror(errno.ENOSPC)
PAGE = 4096


@pytest.fixture(scope="module")
def swing() -> tuple[udd.Measurement, udd.Fit]:
    t = np.arange(0, 20, 0.05)
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.5]).state[:, 1]
    theta = theta + 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    measured = udd.Measurement(t, {"theta": theta})
    return measured, udd.fit(measured, udd.Pendulum(1.0, k0=0.1), free=["k0"])


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """Small disks, by their size in bytes; only root may mount them."""
    made: list[Path] = []

    def mounted(size: int) -> Path:
        folder = tmp_path / f"disk{len(made)}"
        folder.mkdir()
        command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", str(folder)]
        try:
            subprocess.run(command, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError):
            pytest.skip("a small disk cannot be mounted here")
        made.append(folder)
        return folder

    yield mounted
    for folder in made:
        subprocess.run(["umount", "-l", str(folder)], check=True, capture_output=True)


def track(path: Path) -> None:
    """The last step of `udd track --out`."""
    t = np.arange(2000) / 25
    udd.Measurement(t, {"Y": np.sin(t), "Z": np.cos(t), "beta": t}, meta={"W": 0.04}).to_csv(path)


WRITERS: dict[str, Callable[[Path, udd.Fit], object]] = {
    "table.csv": lambda path, _: track(path),
    "fit.npz": lambda path, fit: udd.save(fit, path),
    "report.html": lambda path, _: discovered.nothing().report(path),
    "index.html": lambda path, _: udd.paper.reproduce(path.parent, only=["scales"]),
    "eigenvalues.png": lambda path, _: udd.paper.reproduce(path.parent, only=["eigenvalues"]),
    "film.mp4": lambda path, _: udd.render(
        udd.simulate(udd.Disk(0.039), np.arange(0, 1, 0.005), [9.0, 1e-3, 0.04, 0.0], dense=True), path, rng=1
    ),
}


@pytest.mark.parametrize("name", WRITERS)
def test_on_a_full_disk_a_file_is_refused_by_its_path_and_the_old_one_stays(
    disk: Callable[[int], Path], swing: tuple[udd.Measurement, udd.Fit], name: str
) -> None:
    if name == "film.mp4":
        pytest.importorskip("av")
    folder = disk(2 * PAGE)
    path = folder / name
    old = b"o" * 2 * PAGE
    path.write_bytes(old)
    with pytest.raises(UddError) as error:
        WRITERS[name](path, swing[1])
    assert str(path) in str(error.value) and FULL in str(error.value)
    assert path.read_bytes() == old and os.listdir(folder) == [name]


def test_a_sweep_on_a_full_disk_names_its_store_and_goes_on_elsewhere(
    disk: Callable[[int], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    xr = pytest.importorskip("xarray")
    pytest.importorskip("zarr")
    spec = udd.SweepSpec(
        "outcome", udd.Disk(0.039), {"W": np.linspace(0.03, 0.04, 8)}, [0, 1e-3, 0, 0], {"t": 0.01}, chunk=1
    )
    whole = udd.sweep(spec, store=tmp_path / "whole.zarr")
    text = tmp_path / "spec.json"
    text.write_text(spec.to_json())
    refused = 0
    for pages in (1, 3, 6, 9, 14, 20, 28):
        store = disk(pages * PAGE) / "disk.zarr"
        code = main(["sweep", str(text), "--store", str(store)])
        said = capsys.readouterr().err
        assert (code, said) == (1, f"udd: error: {store} cannot be used for a sweep: {FULL}\n")
        refused += 1
        subprocess.run(["mount", "-o", "remount,size=4m", str(store.parent)], check=True, capture_output=True)
        assert main(["sweep", str(text), "--store", str(store)]) == 0
        capsys.readouterr()
        assert xr.open_zarr(store, consolidated=False)["outcome"].equals(
            xr.open_zarr(tmp_path / "whole.zarr", consolidated=False)["outcome"]
        )
    assert refused == 7 and whole["outcome"].shape == (8,)


def test_two_processes_make_one_store(tmp_path: Path) -> None:
    """The one that comes later waits for the arrays, and then goes on from there."""
    pytest.importorskip("zarr")
    spec = udd.SweepSpec(
        "outcome", udd.Disk(0.039), {"W": np.linspace(0.03, 0.04, 4)}, [0, 1e-3, 0, 0], {"t": 0.01}, chunk=1
    )
    code = (
        "import sys, udd; udd.sweep(udd.SweepSpec.from_json(sys.argv[1]), store=sys.argv[2]); print('whole')"
    )
    store = tmp_path / "both.zarr"
    command = [sys.executable, "-W", "ignore", "-c", code, spec.to_json(), str(store)]
    writers = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(2)]
    said = [process.communicate(timeout=120) for process in writers]
    assert [out.strip() for out, _ in said] == [b"whole"] * 2, said
    assert udd.sweep(spec, store=store).load().identical(udd.sweep(spec))


def test_a_sweep_leaves_the_files_that_another_process_is_writing(tmp_path: Path) -> None:
    """The chunk of the slower process would be lost on its way to its place."""
    pytest.importorskip("zarr")
    spec = udd.SweepSpec("outcome", udd.Disk(0.039), {"W": [0.03]}, [0, 1e-3, 0, 0], {"t": 0.01})
    store = tmp_path / "both.zarr"
    code = (
        "import sys, udd; from udd.sweeps import run_sweep; "
        "run_sweep.here = lambda *_: print('at work', flush=True) or sys.stdin.read(); "
        "udd.sweep(udd.SweepSpec.from_json(sys.argv[1]), store=sys.argv[2])"
    )
    command = [sys.executable, "-W", "ignore", "-c", code, spec.to_json(), str(store)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as slow:
        assert slow.stdout is not None and slow.stdout.readline() == b"at work\n"
        half = store / "outcome" / f"{'0' * 32}.partial"
        half.write_bytes(b"0")
        udd.sweep(spec, store=store)
        assert half.exists()
    udd.sweep(spec, store=store)
    assert slow.returncode == 0 and not half.exists()


def test_a_store_that_another_process_makes_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    zarr = pytest.importorskip("zarr")
    spec = udd.SweepSpec("outcome", udd.Disk(0.039), {"W": [0.03]}, [0, 1e-3, 0, 0], {"t": 0.01})
    make = zarr.create_group

    def second(store: object, **more: object) -> object:
        make(store, **more)  # by the other, meanwhile
        return make(store, **more)

    monkeypatch.setattr(zarr, "create_group", second)
    store = tmp_path / "both.zarr"
    with pytest.raises(UddError) as error:
        udd.sweep(spec, store=store)
    assert str(error.value) == f"{store} is being made by another process: call again when it is there"


def test_a_file_is_on_the_disk_before_it_takes_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def noted(name: str) -> Callable[..., None]:
        call = getattr(os, name)
        return lambda *args: (calls.append(name), call(*args))[1]

    for name in ("fsync", "replace"):
        monkeypatch.setattr(atomic_files.os, name, noted(name))
    write_whole(tmp_path / "file", b"content")
    assert calls[:2] == ["fsync", "replace"]
    assert (tmp_path / "file").read_bytes() == b"content"


@pytest.mark.skipif(os.name != "posix", reason="modes of files as POSIX knows them")
def test_the_umask_holds_and_is_never_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A thread that made a file meanwhile made it for everybody to write."""
    pytest.importorskip("av")
    before = os.umask(0o027)
    try:
        monkeypatch.setattr(os, "umask", lambda _mask: pytest.fail("umask was called"))
        write_whole(tmp_path / "file", b"")
        WRITERS["film.mp4"](tmp_path / "film.mp4", None)  # type: ignore[arg-type]
        monkeypatch.undo()
        modes = [(tmp_path / name).stat().st_mode & 0o777 for name in ("file", "film.mp4")]
    finally:
        os.umask(before)
    assert modes == [0o640, 0o640]


WRITING = """
import sys
from udd._util.atomic_files import write_whole
while True:
    for letter in b"abcdefgh":
        write_whole(sys.argv[1], bytes([letter]) * 3_000_000)
        print(letter, flush=True)
"""


def test_killed_at_any_moment_a_file_is_whole(tmp_path: Path) -> None:
    path, chance = tmp_path / "file", random.Random(5)
    for _ in range(3):
        process = subprocess.Popen([sys.executable, "-c", WRITING, str(path)], stdout=subprocess.PIPE)
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(chance.uniform(0.05, 0.15))
        process.kill()
        process.communicate()
        content = path.read_bytes()
        assert len(content) == 3_000_000 and len(set(content)) == 1
