"""Sweeps for the tests, and who does their work."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd

DISK = udd.Disk(0.039, effects=[udd.effects.relaxation(b=2.0)])


def disk_spec(chunk: int = 7, n: int = 6) -> udd.SweepSpec:
    """Ends of short runs of the disk: some leave the wheels, some start outside."""
    over = {"W": np.linspace(0.02, 0.06, n), "relaxation.b": [0.0, 5.0], "Z": np.linspace(-0.07, 0.09, n)}
    return udd.SweepSpec("final_state", DISK, over, [0.0, 1e-3, 0.0, 0.0], {"t": 2.0}, chunk)


def exponents_spec(n: int = 24, t: float = 2000.0, chunk: int = 5) -> udd.SweepSpec:
    options = {"t": t, "tol": 1e-9}
    return udd.SweepSpec(
        "lyapunov", udd.DLE(1.0), {"w": np.linspace(0.5, 5, n)}, options=options, chunk=chunk
    )


def files(folder: Path) -> dict[str, bytes]:
    """Every file of a store."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def flags(folder: Path) -> int:
    """How many chunks are finished."""
    return sum(p.is_file() and p.suffix != ".partial" for p in (folder / "done" / "c").rglob("*"))


def wait_for(met: Callable[[], bool], what: str, process: subprocess.Popen[Any] | None = None) -> None:
    end = time.monotonic() + 60
    while not met():
        assert time.monotonic() < end, f"waited in vain for {what}"
        assert process is None or process.poll() is None, f"ended before {what}: {process.communicate()}"
        time.sleep(0.0005)


@contextmanager
def dask_executor() -> Iterator[Executor]:
    distributed = pytest.importorskip("distributed", reason="Dask needs the extra 'scale'")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client.get_executor()


def spawned() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"))


def command(spec: udd.SweepSpec, folder: Path) -> list[str]:
    path = folder / "spec.json"
    path.write_text(spec.to_json())
    return [sys.executable, "-m", "udd", "sweep", str(path), "--store", str(folder / "killed.zarr")]
