"""Sweeps on threads, processes and a Dask cluster: the same bytes, whoever is killed on the way."""

from __future__ import annotations

import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd
from sweeps_for_tests import (
    command,
    dask_executor,
    disk_spec,
    exponents_spec,
    files,
    flags,
    spawned,
    wait_for,
)
from udd.errors import IncompleteWarning, UddError

xr = pytest.importorskip("xarray", reason="sweeps need the extra 'scale'")
zarr = pytest.importorskip("zarr", reason="sweeps need the extra 'scale'")

Whole = Callable[[udd.SweepSpec], tuple[Any, dict[str, bytes]]]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    """The result of an undisturbed sweep, and the files of its store, computed once for all tests."""
    known: dict[str, tuple[Any, dict[str, bytes]]] = {}

    def get(spec: udd.SweepSpec) -> tuple[Any, dict[str, bytes]]:
        text = spec.to_json()
        if text not in known:
            store = tmp_path_factory.mktemp("whole") / "whole.zarr"
            known[text] = udd.sweep(spec, store=store), files(store)
        return known[text]

    return get


# --- the same bytes, whoever does the work


@pytest.mark.parametrize(
    "executor", [lambda: ThreadPoolExecutor(3), spawned, dask_executor], ids=["threads", "spawn", "dask"]
)
def test_every_executor_gives_the_same_bytes(
    executor: Callable[[], Any], tmp_path: Path, whole: Whole
) -> None:
    with executor() as workers:
        for k, spec in enumerate((disk_spec(), exponents_spec())):
            stored, alone = whole(spec)
            in_memory, spread = udd.sweep(spec), tmp_path / f"spread{k}.zarr"
            assert stored.identical(in_memory)
            assert udd.sweep(spec, workers, store=spread).identical(in_memory)
            assert udd.sweep(spec, workers).identical(in_memory)
            assert files(spread) == alone


def test_a_group_will_do_as_a_store() -> None:
    root = zarr.create_group(zarr.storage.MemoryStore())
    swept = udd.sweep(disk_spec(), store=root.create_group("disk"))
    assert swept.identical(udd.sweep(disk_spec()))
    with pytest.raises(UddError, match="holds other data already"):
        udd.sweep(disk_spec(), store=root)


def test_workers_that_do_not_reach_the_store_are_found_out() -> None:
    """A group in this process's memory: the workers fill copies of it."""
    with spawned() as workers, pytest.raises(UddError, match="must be one that they reach"):
        udd.sweep(disk_spec(), workers, zarr.create_group(zarr.storage.MemoryStore()))


# --- killed, broken, stopped


@pytest.mark.slow
def test_killed_at_any_moment_and_resumed_it_gives_the_same_bytes(tmp_path: Path, whole: Whole) -> None:
    # Runs so short that nearly all of the time goes into writing.
    spec = disk_spec(chunk=2, n=14)
    call, store = command(spec, tmp_path), tmp_path / "killed.zarr"
    chance = random.Random(3)
    landed = []
    for turn in range(5):
        process = subprocess.Popen(call, stderr=subprocess.PIPE)
        # The first two kills are meant for the template.
        begun = flags(store)
        more = chance.randint(1, 25)
        if turn < 2:
            wait_for(store.exists, "a folder", process)
            time.sleep(chance.uniform(0, 0.02))
        else:
            wait_for(lambda begun=begun, more=more: flags(store) >= begun + more, "more flags", process)
            time.sleep(chance.uniform(0, 0.01))
        process.kill()
        process.communicate()
        landed.append(flags(store))
    assert sorted(landed) == landed
    assert landed[-1] < 196  # the last kill came before the end
    assert landed[-1] > landed[2] > 0
    subprocess.run(call, check=True, timeout=120, capture_output=True)
    assert files(store) == whole(spec)[1]


STOPPED = """
import sys, udd, threading, os, signal, time
from concurrent.futures import ThreadPoolExecutor, ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

if __name__ == "__main__":
    kind, text, store = sys.argv[1:]
    pools = {{
        "here": lambda: None,
        "threads": lambda: ThreadPoolExecutor(1),
        "spawn": lambda: ProcessPoolExecutor(1, mp_context=get_context("spawn")),
    }}
    spec = udd.SweepSpec.from_json(text)
    pool = pools[kind]()

    def press():
        while not any(p.is_file() for p in (Path(store) / "done" / "c").rglob("*")):
            time.sleep(0.001)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press, daemon=True).start()
    try:
        udd.sweep(spec, pool, store=store)
    except udd.Interrupted as stopped:
        partial, said = stopped.partial, str(stopped)
    if pool is not None:
        pool.shutdown()
    print(said)
    print((partial["outcome"] == 0).values.sum(), (partial["outcome"] == -1).values.sum())
"""


# Chunks of a few hundredths of a second each.
_CHUNKS = 30
_EXPONENTS = exponents_spec(n=_CHUNKS, t=1000.0, chunk=1)
_DRIVES = {"w": np.linspace(0.5, 5, _CHUNKS)}
_RUNS = udd.SweepSpec("outcome", udd.DLE(1.0), _DRIVES, options={"t": 3e4}, chunk=1)


@pytest.mark.parametrize(
    ("kind", "spec"),
    [("here", _EXPONENTS), ("here", _RUNS), ("threads", _EXPONENTS), ("spawn", _EXPONENTS)],
    ids=["here", "here, runs", "threads", "spawn"],
)
def test_ctrl_c_keeps_what_is_finished_and_cancels_the_rest(
    kind: str, spec: udd.SweepSpec, tmp_path: Path, whole: Whole
) -> None:
    script, store = tmp_path / "stopped.py", tmp_path / "a.zarr"
    script.write_text(STOPPED.replace("{{", "{").replace("}}", "}"))
    call = [sys.executable, str(script), kind, spec.to_json(), str(store)]
    done = subprocess.run(call, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    said, counts = done.stdout.splitlines()
    assert said.endswith("chunks are not finished: stopped by Ctrl-C; the same call goes on from here")
    finished, missing = map(int, counts.split())
    assert finished >= 1
    assert missing >= 1
    assert finished + missing == _CHUNKS
    udd.sweep(spec, store=store)
    assert files(store) == whole(spec)[1]


def test_the_command_stopped_by_ctrl_c_says_so(tmp_path: Path) -> None:
    spec = _EXPONENTS
    call, store = command(spec, tmp_path), tmp_path / "killed.zarr"
    process = subprocess.Popen([*call, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: flags(store) > 2, "flags", process)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "chunks are not finished: stopped by Ctrl-C" in err
    said = json.loads(out)
    assert said["complete"] is False
    assert said["outcomes"]["not_run"] > 0
    assert subprocess.run(call, capture_output=True, timeout=120).returncode == 0


class Sickly(ThreadPoolExecutor):
    """Threads that die of some of their work the first few times: what a cluster does at its worst."""

    def __init__(self, deaths: dict[int, int]) -> None:
        super().__init__(2)
        self.deaths, self.count, self.lock = deaths, 0, threading.Lock()

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        chunk = int(args[0].split("-")[1])
        with self.lock:
            self.count += 1
            if self.deaths.get(chunk, 0) > 0:
                self.deaths[chunk] -= 1
                future: Future[Any] = Future()
                future.set_exception(ConnectionError("the worker is gone"))
                return future
        return super().submit(fn, *args, **kwargs)


def test_a_chunk_whose_worker_died_is_handed_over_again() -> None:
    spec = disk_spec()
    with Sickly({0: 1, 3: 2}) as workers:
        swept = udd.sweep(spec, workers)
        assert workers.count == 12 + 3
    assert swept.identical(udd.sweep(spec))


def test_a_chunk_that_kills_every_worker_is_given_up_and_the_rest_kept() -> None:
    spec = disk_spec()
    whole = udd.sweep(spec)
    said = (
        r"1 of 12 chunks are not finished: chunk 3 failed 3 times \(the worker is gone\); the others are kept"
    )
    with Sickly({3: 99}) as workers, pytest.warns(IncompleteWarning, match=said):
        result = udd.sweep(spec, workers)
    missing = (result["outcome"] == -1).values
    assert missing.sum() == 6
    assert np.isnan(result["final_Y"].values[missing]).all()
    assert result["final_Y"].values[~missing].tobytes() == whole["final_Y"].values[~missing].tobytes()


def test_a_mistake_in_the_work_is_not_taken_for_a_death() -> None:
    class Wrong(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            return super().submit(lambda: [][0])

    with Wrong(1) as workers, pytest.raises(IndexError):
        udd.sweep(disk_spec(), workers)


def test_a_pool_that_breaks_ends_the_sweep_and_another_goes_on(tmp_path: Path, whole: Whole) -> None:
    spec, store = exponents_spec(n=50, chunk=1), tmp_path / "a.zarr"
    pool = spawned()

    def kill() -> None:
        wait_for(lambda: flags(store) > 0, "a flag")
        next(iter(multiprocessing.active_children())).kill()

    killer = threading.Thread(target=kill)
    killer.start()
    with pytest.warns(IncompleteWarning, match=r"the executor takes no more work .*the same call goes on"):
        result = udd.sweep(spec, pool, store)
    killer.join()
    with pytest.raises(BrokenProcessPool):
        pool.submit(int)
    pool.shutdown()
    assert 0 < (result["outcome"] == 0).sum() < 50
    with spawned() as fresh:
        udd.sweep(spec, fresh, store)
    assert files(store) == whole(spec)[1]


class Counted:
    """An executor, and how often it was asked."""

    def __init__(self, executor: Any) -> None:
        self.executor, self.count = executor, 0

    def submit(self, fn: Any, /, *args: Any) -> Future[Any]:
        self.count += 1
        future: Future[Any] = self.executor.submit(fn, *args)
        return future


@pytest.mark.slow
@pytest.mark.parametrize("failures", [3, 0], ids=["dask tries again", "udd tries again"])
def test_a_dask_worker_killed_in_the_middle(failures: int, tmp_path: Path, whole: Whole) -> None:
    """With no failures allowed Dask gives the chunk up at once, and it is handed over again."""
    dask = pytest.importorskip("dask")
    pytest.importorskip("distributed", reason="Dask needs the extra 'scale'")
    spec, store = exponents_spec(n=90, t=4000.0, chunk=3), tmp_path / "a.zarr"
    with dask.config.set({"distributed.scheduler.allowed-failures": failures}), dask_executor() as workers:
        first = next(iter(workers._client.cluster.workers.values())).pid
        killed = []

        def kill() -> None:
            wait_for(lambda: flags(store) > 4, "flags")
            os.kill(first, signal.SIGKILL)
            killed.append(flags(store))

        killer = threading.Thread(target=kill)
        killer.start()
        counted = Counted(workers)
        result = udd.sweep(spec, counted, store)
        killer.join()
    assert killed[0] < 30
    assert counted.count == 30 if failures else counted.count > 30
    alone, bytes_of = whole(spec)
    assert result.identical(alone)
    assert files(store) == bytes_of


def test_the_command_with_a_dask_cluster(tmp_path: Path) -> None:
    spec = disk_spec()
    with dask_executor() as workers:
        address = workers._client.cluster.scheduler_address  # type: ignore[attr-defined]
        call = [*command(spec, tmp_path), "--dask", address]
        done = subprocess.run(call, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0
    # A slow machine says how far it is, nothing else.
    assert all(line.startswith("udd: sweep") for line in done.stderr.splitlines()), done.stderr
    answer = xr.open_zarr(tmp_path / "killed.zarr", consolidated=False, chunks=None)
    assert answer["final_Y"].equals(udd.sweep(spec)["final_Y"])
    finished, ejected = (int((answer["outcome"] == value).sum()) for value in (0, 1))
    assert finished + ejected == 72
    said = f"final_state over W, relaxation.b, Z: {finished} finished, {ejected} ejected\n"
    assert done.stdout.startswith(said)
