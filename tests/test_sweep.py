"""Sweeps: the same bytes whoever does the work, however it is cut, and whatever is killed on the way."""

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
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd
from udd.errors import IncompleteWarning, ModelError, UddError

xr = pytest.importorskip("xarray", reason="sweeps need the extra 'scale'")
zarr = pytest.importorskip("zarr", reason="sweeps need the extra 'scale'")

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


# --- what is computed


def test_exponents_are_those_of_lyapunov_to_the_last_bit() -> None:
    spec = exponents_spec(n=9)
    found = udd.sweep(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", udd.ConvergenceWarning)
        values, errors = udd.lyapunov(spec.axes["w"], t=2000.0, tol=1e-9, with_error=True)
    assert found["value"].values.tobytes() == values.tobytes()
    assert found["standard_error"].values.tobytes() == errors.tobytes()
    assert not found["converged"].any()
    assert (found["outcome"] == 1).all()
    assert found["value"].dims == ("w",)
    assert udd.SweepSpec.from_json(found.attrs["spec"]) == spec
    assert found.attrs["spec_sha256"] == spec.sha256


def test_final_states_are_those_of_simulate_to_the_last_bit() -> None:
    spec = disk_spec()
    found = udd.sweep(spec)
    assert found["outcome"].dims == ("W", "relaxation.b", "Z")
    assert (found["W"].attrs["units"], found["relaxation.b"].attrs["units"]) == ("m/s", "1/m")
    assert (found["Z"].attrs["units"], found["final_Omega"].attrs["units"]) == ("m", "rad/s")
    names = found["outcome"].attrs["flag_meanings"].split()
    seen = set()
    for index in np.ndindex(spec.shape):
        W, b, Z = (float(values[k]) for values, k in zip(spec.axes.values(), index, strict=True))
        here = found.isel(dict(zip(found["outcome"].dims, index, strict=True)))
        outcome = names[int(here["outcome"])]
        seen.add(outcome)
        model = DISK.with_parameters({"W": W, "relaxation.b": b})
        if outcome == "start_outside":
            assert Z > 0.0799
            assert np.isnan(here["final_Y"])
            assert np.isnan(here["t_end"])
        else:
            run = udd.simulate(model, [0.0, 2.0], [0.0, 1e-3, Z, 0.0])
            assert run.outcome == outcome
            assert [float(here[f"final_{name}"]) for name in model.state_names] == run.state[-1].tolist()
            assert here["t_end"] == run.t[-1]
    assert seen == {"finished", "ejected", "start_outside"}


def test_a_failed_trajectory_is_an_outcome_and_disturbs_no_other() -> None:
    # At 3.9 cm/s the disk leaves the wheels, at 7.1 cm/s from here it does not.
    over = {"W": [0.039, 0.071]}
    options = {"t": 2000.0, "tol": 1e-9}
    found = udd.sweep(udd.SweepSpec("lyapunov", udd.Disk(0.039), over, options=options))
    assert found["outcome"].values.tolist() == [2, 1]
    assert np.isnan(found["value"].values).tolist() == [True, False]
    with pytest.warns(udd.ConvergenceWarning):
        assert udd.lyapunov(udd.Disk(0.071), t=2000.0, tol=1e-9) == found["value"].values[1]


def test_a_solution_that_blows_up_is_an_outcome() -> None:
    # Its rate is beyond the largest number.
    over = {"Omega": [1.0, 1e308]}
    model = udd.Pendulum(0.5, k0=100.0)
    found = udd.sweep(udd.SweepSpec("outcome", model, over, [1.0, 1.0], {"t": 1.0}))
    assert found["outcome"].values.tolist() == [1, 3]
    assert np.isnan(found["t_end"].values).tolist() == [False, True]


def test_exponents_over_two_parameters_and_a_state() -> None:
    over = {"z": [0.01, -1.0], "B": [0.0, 0.2], "w": [1.0, 2.0, 3.0]}
    spec = udd.SweepSpec("lyapunov", udd.DLE(1.0), over, options={"t": 500.0, "tol": 1e-9})
    found = udd.sweep(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", udd.ConvergenceWarning)
        for index in np.ndindex(spec.shape):
            z, b, w = (float(values[k]) for values, k in zip(spec.axes.values(), index, strict=True))
            alone = udd.lyapunov(udd.DLE(w, b), t=500.0, tol=1e-9, state0=[1.0, 1.0, z])
            assert found["value"].values[index] == alone


@pytest.mark.parametrize("chunk", [1, 5, 1000])
def test_the_size_of_the_chunks_does_not_change_the_values(chunk: int) -> None:
    for made in (disk_spec, exponents_spec):
        usual, other = udd.sweep(made()), udd.sweep(made(chunk=chunk))
        for name, values in usual.data_vars.items():
            assert values.values.tobytes() == other[name].values.tobytes()


@pytest.mark.parametrize("shape", [(1,), (10,), (3, 1000), (7, 5, 11)])
@pytest.mark.parametrize("chunk", [1, 4, 7, 1024])
def test_chunks_cover_everything_once(shape: tuple[int, ...], chunk: int) -> None:
    from udd.sweeping.parts import grid_of

    over = {name: np.arange(n) + 1.0 for name, n in zip("wBz", shape, strict=False)}
    grid = grid_of(udd.SweepSpec("outcome", udd.DLE(1.0), over, options={"t": 1.0}, chunk=chunk))
    count = np.zeros(shape, dtype=int)
    for k in range(len(grid)):
        assert count[grid.region(k)].size <= chunk
        count[grid.region(k)] += 1
    assert (count == 1).all()


# --- the spec


SPECS = [
    disk_spec(),
    exponents_spec(),
    udd.SweepSpec(
        "outcome",
        udd.Disk(0.05, edge="ignore", effects=[udd.effects.slip(c=0.1)]),
        {"slip.c": [0.3, 0.1, 0.2]},
        options={"t": 1},
    ),
    udd.SweepSpec("lyapunov", udd.Pendulum(0.5, k0=0.05), {"theta": np.geomspace(0.1, 1, 5)}),
]


@pytest.mark.parametrize("spec", SPECS, ids=repr)
def test_a_spec_comes_back_from_json(spec: udd.SweepSpec) -> None:
    again = udd.SweepSpec.from_json(spec.to_json())
    assert again == spec
    assert hash(again) == hash(spec)
    assert again.to_json() == spec.to_json()
    assert again.model == spec.model
    for name, values in spec.axes.items():
        assert again.axes[name].tobytes() == values.tobytes()
    assert udd.SweepSpec.from_dict(json.loads(json.dumps(spec.to_dict(), sort_keys=True))) == spec


def test_specs_that_differ_have_other_hashes() -> None:
    w, B = [1.0, 2.0], [0.1, 0.2]
    specs = [
        udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": w, "B": B}),
        udd.SweepSpec("lyapunov", udd.DLE(1.0), {"B": B, "w": w}),
        udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": w}),
        udd.SweepSpec("lyapunov", udd.DLE(1.0, 0.1), {"w": w}),
        udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": w}, options={"tol": 0.1}),
        udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": w}, [1.0, 1.0, 1.0]),
        udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": w}, chunk=2),
        udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": [1.0, 2.0 + 1e-15]}),
    ]
    assert len({spec.sha256 for spec in specs}) == len(set(specs)) == len(specs)
    assert udd.SweepSpec("lyapunov", udd.DLE(1), {"w": np.array([1, 2])}) == specs[2]


def test_a_spec_in_toml(tmp_path: Path) -> None:
    path = tmp_path / "spec.toml"
    path.write_text(
        """
        quantity = "final_state"
        state0 = [0, 0.001, 0, 0]
        chunk = 7
        model = {kind = "disk", W = 0.039, effects = [{name = "relaxation", b = 2.0}]}
        [over]
        W = {from = 0.02, to = 0.06, n = 6}
        "relaxation.b" = [0, 5]
        Z = {from = -0.07, to = 0.09, n = 6}
        [options]
        t = 2
        """
    )
    assert udd.SweepSpec.read(path) == disk_spec()


def test_the_values_of_a_spec_cannot_be_changed_behind_its_back() -> None:
    values = np.array([1.0, 2.0])
    spec = udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": values})
    before = spec.sha256
    values[0] = 3.0
    assert spec.axes["w"].tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        spec.axes["w"][0] = 3.0
    assert udd.SweepSpec.from_json(spec.to_json()).sha256 == before


DLE = udd.DLE(1.0)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: udd.SweepSpec("speed", DLE, {"w": [1]}), "quantity must be one of lyapunov"),
        (lambda: udd.SweepSpec("lyapunov", 1.0, {"w": [1]}), "a model is needed"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {}), "one to three axes"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"W": [1]}), "nothing of this model is called 'W'"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": []}), "w must be a list of at least one"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1, np.nan]}), "values of w must be finite"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1, -2, 3]}), "w must not be below 0, not -2"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": ["a"]}), "values of w must be numbers"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1]}, [1, 2]), "3 components"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1]}, options={"T": 1}), "no option 'T'"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1]}, options={"t": -1}), "t must be above 0"),
        (lambda: udd.SweepSpec("outcome", DLE, {"w": [1]}), "length of the runs, must be given"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1]}, chunk=0), "chunk must be a whole number"),
        (lambda: udd.SweepSpec.from_json("[1"), "not in JSON"),
        (lambda: udd.SweepSpec.from_json("[1]"), "must be a table"),
        (lambda: udd.SweepSpec.from_json("{}"), "does not say its quantity"),
        (lambda: udd.SweepSpec.from_json('{"quality": 1}'), "a sweep has no 'quality'"),
        (lambda: udd.SweepSpec.from_dict({**SPECS[0].to_dict(), "over": [{"name": "W"}]}), "from, to and n"),
        (lambda: udd.SweepSpec.from_dict({**SPECS[0].to_dict(), "model": {"kind": "bob"}}), "kind must be"),
        (lambda: udd.SweepSpec.from_dict({**SPECS[0].to_dict(), "model": {"kind": "dle"}}), "value of w"),
        (lambda: udd.sweep("spec.toml"), "needs a udd.SweepSpec"),
        (lambda: udd.sweep(SPECS[0], executor=2), "needs a method submit"),
    ],
)
def test_bad_input_gets_one_clear_sentence(call: Callable[[], object], named: str) -> None:
    with pytest.raises(ModelError, match=named):
        call()


# --- the same bytes, whoever does the work


@contextmanager
def dask_executor() -> Iterator[Executor]:
    distributed = pytest.importorskip("distributed", reason="Dask needs the extra 'scale'")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client.get_executor()


def spawned() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"))


@pytest.mark.parametrize(
    "executor", [lambda: ThreadPoolExecutor(3), spawned, dask_executor], ids=["threads", "spawn", "dask"]
)
def test_every_executor_gives_the_same_bytes(executor: Callable[[], Any], tmp_path: Path) -> None:
    with executor() as workers:
        for k, spec in enumerate((disk_spec(), exponents_spec())):
            alone, spread = tmp_path / f"alone{k}.zarr", tmp_path / f"spread{k}.zarr"
            in_memory = udd.sweep(spec)
            assert udd.sweep(spec, store=alone).identical(in_memory)
            assert udd.sweep(spec, workers, store=spread).identical(in_memory)
            assert udd.sweep(spec, workers).identical(in_memory)
            assert files(spread) == files(alone)


def test_a_group_will_do_as_a_store() -> None:
    root = zarr.create_group(zarr.storage.MemoryStore())
    found = udd.sweep(disk_spec(), store=root.create_group("disk"))
    assert found.identical(udd.sweep(disk_spec()))
    with pytest.raises(UddError, match="holds other data already"):
        udd.sweep(disk_spec(), store=root)


def test_workers_that_do_not_reach_the_store_are_found_out() -> None:
    """A group in this process's memory: the workers fill copies of it."""
    with spawned() as workers, pytest.raises(UddError, match="must be one that they reach"):
        udd.sweep(disk_spec(), workers, zarr.create_group(zarr.storage.MemoryStore()))


# --- killed, broken, stopped


def command(spec: udd.SweepSpec, folder: Path) -> list[str]:
    path = folder / "spec.json"
    path.write_text(spec.to_json())
    return [sys.executable, "-m", "udd", "sweep", str(path), "--store", str(folder / "killed.zarr")]


def test_killed_at_any_moment_and_resumed_it_gives_the_same_bytes(tmp_path: Path) -> None:
    # Runs so short that nearly all of the time goes into writing.
    spec = disk_spec(chunk=2, n=14)
    udd.sweep(spec, store=tmp_path / "whole.zarr")
    call, store = command(spec, tmp_path), tmp_path / "killed.zarr"
    chance = random.Random(3)
    landed = []
    for turn in range(7):
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
    assert files(store) == files(tmp_path / "whole.zarr")


def test_a_chunk_without_its_flag_is_computed_again(tmp_path: Path) -> None:
    """As after a kill between the two on a store that writes in place: half of the chunk is there."""
    spec, store = disk_spec(), tmp_path / "a.zarr"
    udd.sweep(spec, store=store)
    whole = files(store)
    (store / "done/c/2/1/0").unlink()
    half = store / "final_Y/c/2/1/0"
    half.write_bytes(half.read_bytes()[:20])
    (store / f"final_Y/c/2/1/{'0' * 32}.partial").write_bytes(b"0")
    udd.sweep(spec, store=store)
    assert files(store) == whole


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    spec, store = disk_spec(), tmp_path / "a.zarr"
    udd.sweep(spec, store=store)
    before = {path: path.stat().st_mtime_ns for path in store.rglob("*")}
    again = udd.sweep(spec, store=store)
    assert {path: path.stat().st_mtime_ns for path in store.rglob("*")} == before
    assert again.identical(udd.sweep(spec))


def test_another_sweep_in_the_store_is_refused(tmp_path: Path) -> None:
    store = tmp_path / "a.zarr"
    udd.sweep(disk_spec(), store=store)
    before = files(store)
    with pytest.raises(
        UddError, match=r"a\.zarr holds another sweep \(.{12}, not .{12}\): take another place"
    ):
        udd.sweep(disk_spec(chunk=8), store=store)
    assert files(store) == before


@pytest.mark.parametrize("foreign", ["letters.txt", "zarr.json"])
def test_a_folder_with_other_things_is_refused(foreign: str, tmp_path: Path) -> None:
    if foreign == "zarr.json":
        zarr.create_group(zarr.storage.LocalStore(tmp_path)).create_array("mine", shape=(3,), dtype="f8")
    else:
        (tmp_path / foreign).write_text("mine")
    before = files(tmp_path)
    with pytest.raises(UddError, match=r"holds other (things|data) already"):
        udd.sweep(disk_spec(), store=tmp_path)
    assert files(tmp_path) == before


def test_a_file_is_no_store(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("mine")
    with pytest.raises(UddError, match="cannot be used for a sweep: Not a directory"):
        udd.sweep(disk_spec(), store=path)
    assert path.read_text() == "mine"


STOPPED = """
import sys, udd, threading, os, signal, warnings, time
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
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = udd.sweep(spec, pool, store=store)
    if pool is not None:
        pool.shutdown()
    print([w.category.__name__ for w in said], str(said[0].message), said[0].message.interrupted)
    print((found["outcome"] == 1).values.sum(), (found["outcome"] == 0).values.sum())
"""


@pytest.mark.parametrize("kind", ["here", "threads", "spawn"])
def test_ctrl_c_keeps_what_is_finished_and_cancels_the_rest(kind: str, tmp_path: Path) -> None:
    # 60 chunks of a few hundredths of a second each.
    spec = exponents_spec(n=60, t=1000.0, chunk=1)
    script, store = tmp_path / "stopped.py", tmp_path / "a.zarr"
    script.write_text(STOPPED.replace("{{", "{").replace("}}", "}"))
    call = [sys.executable, str(script), kind, spec.to_json(), str(store)]
    done = subprocess.run(call, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    said, counts = done.stdout.splitlines()
    assert said.startswith("['IncompleteWarning'] ")
    assert "chunks are not finished: stopped by Ctrl-C; the same call goes on from here True" in said
    finished, missing = map(int, counts.split())
    assert finished >= 1
    assert missing >= 1
    assert finished + missing == 60
    udd.sweep(spec, store=store)
    udd.sweep(spec, store=tmp_path / "whole.zarr")
    assert files(store) == files(tmp_path / "whole.zarr")


def test_the_command_stopped_by_ctrl_c_says_so(tmp_path: Path) -> None:
    spec = exponents_spec(n=60, t=1000.0, chunk=1)
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
        found = udd.sweep(spec, workers)
        assert workers.count == 12 + 3
    assert found.identical(udd.sweep(spec))


def test_a_chunk_that_kills_every_worker_is_given_up_and_the_rest_kept() -> None:
    spec = disk_spec()
    whole = udd.sweep(spec)
    said = (
        r"1 of 12 chunks are not finished: chunk 3 failed 3 times \(the worker is gone\); the others are kept"
    )
    with Sickly({3: 99}) as workers, pytest.warns(IncompleteWarning, match=said):
        found = udd.sweep(spec, workers)
    missing = (found["outcome"] == 0).values
    assert missing.sum() == 6
    assert np.isnan(found["final_Y"].values[missing]).all()
    assert found["final_Y"].values[~missing].tobytes() == whole["final_Y"].values[~missing].tobytes()


def test_a_mistake_in_the_work_is_not_taken_for_a_death() -> None:
    class Wrong(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            return super().submit(lambda: [][0])

    with Wrong(1) as workers, pytest.raises(IndexError):
        udd.sweep(disk_spec(), workers)


def test_a_pool_that_breaks_ends_the_sweep_and_another_goes_on(tmp_path: Path) -> None:
    spec, store = exponents_spec(n=50, chunk=1), tmp_path / "a.zarr"
    pool = spawned()

    def kill() -> None:
        wait_for(lambda: flags(store) > 0, "a flag")
        next(iter(multiprocessing.active_children())).kill()

    killer = threading.Thread(target=kill)
    killer.start()
    with pytest.warns(IncompleteWarning, match=r"the executor takes no more work .*the same call goes on"):
        found = udd.sweep(spec, pool, store)
    killer.join()
    with pytest.raises(BrokenProcessPool):
        pool.submit(int)
    pool.shutdown()
    assert 0 < (found["outcome"] == 1).sum() < 50
    with spawned() as fresh:
        udd.sweep(spec, fresh, store)
    udd.sweep(spec, store=tmp_path / "whole.zarr")
    assert files(store) == files(tmp_path / "whole.zarr")


class Counted:
    """An executor, and how often it was asked."""

    def __init__(self, executor: Any) -> None:
        self.executor, self.count = executor, 0

    def submit(self, fn: Any, /, *args: Any) -> Future[Any]:
        self.count += 1
        future: Future[Any] = self.executor.submit(fn, *args)
        return future


@pytest.mark.parametrize("failures", [3, 0], ids=["dask tries again", "udd tries again"])
def test_a_dask_worker_killed_in_the_middle(failures: int, tmp_path: Path) -> None:
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
        found = udd.sweep(spec, counted, store)
        killer.join()
    assert killed[0] < 30
    assert counted.count == 30 if failures else counted.count > 30
    assert found.identical(udd.sweep(spec))
    udd.sweep(spec, store=tmp_path / "whole.zarr")
    assert files(store) == files(tmp_path / "whole.zarr")


# --- the command


def test_the_command_with_a_dask_cluster(tmp_path: Path) -> None:
    spec = disk_spec()
    with dask_executor() as workers:
        address = workers._client.cluster.scheduler_address  # type: ignore[attr-defined]
        call = [*command(spec, tmp_path), "--dask", address]
        done = subprocess.run(call, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("final_state over W, relaxation.b, Z: ")
    assert "start outside" in done.stdout
    found = xr.open_zarr(tmp_path / "killed.zarr", consolidated=False, chunks=None)
    assert found["final_Y"].equals(udd.sweep(spec)["final_Y"])


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('quantity = "lyapunov', "spec.toml: Unterminated string"),
        ('quantity = "lyapunov"\nmodel = 1\nover = 1', "spec.toml: over must be a table"),
        (None, "spec.toml cannot be read: No such file or directory"),
    ],
)
def test_a_bad_spec_file_gets_one_clear_sentence(
    text: str | None, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from udd.cli import main

    path = tmp_path / "spec.toml"
    if text is not None:
        path.write_text(text)
    assert main(["sweep", str(path), "--store", str(tmp_path / "a.zarr")]) == 1
    err = capsys.readouterr().err
    assert named in err
    assert err.startswith("udd: error: ")
    assert err.count("\n") == 1
    assert not (tmp_path / "a.zarr").exists()
