"""Sweeps: what is computed, the spec, and the store."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd
from sweeps_for_tests import DISK, disk_spec, exponents_spec, files
from udd.errors import ModelError, UddError
from udd.simulation.trajectory import integrated

pytest.importorskip("xarray", reason="sweeps need the extra 'scale'")
zarr = pytest.importorskip("zarr", reason="sweeps need the extra 'scale'")

# --- what is computed


def named(answer: Any) -> dict[int, str]:
    """The outcomes' meanings."""
    about = answer["outcome"].attrs
    return dict(zip(about["flag_values"], about["flag_meanings"].split(), strict=True))


def test_exponents_are_those_of_lyapunov_to_the_last_bit() -> None:
    spec = exponents_spec(n=9)
    result = udd.sweep(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", udd.ConvergenceWarning)
        values, errors = udd.lyapunov(spec.axes["w"], t=2000.0, tol=1e-9, with_error=True)
    assert result["value"].values.tobytes() == values.tobytes()
    assert result["standard_error"].values.tobytes() == errors.tobytes()
    assert not result["converged"].any()
    assert (result["outcome"] == 0).all()
    assert result["value"].dims == ("w",)
    assert udd.SweepSpec.from_json(result.attrs["spec"]) == spec
    assert result.attrs["spec_sha256"] == spec.sha256


def test_final_states_are_those_of_simulate_to_the_last_bit() -> None:
    spec = disk_spec()
    result = udd.sweep(spec)
    assert result["outcome"].dims == ("W", "relaxation.b", "Z")
    assert (result["W"].attrs["units"], result["relaxation.b"].attrs["units"]) == ("m/s", "1/m")
    assert (result["Z"].attrs["units"], result["final_Omega"].attrs["units"]) == ("m", "rad/s")
    names = named(result)
    seen = set()
    for index in np.ndindex(spec.shape):
        W, b, Z = (float(values[k]) for values, k in zip(spec.axes.values(), index, strict=True))
        here = result.isel(dict(zip(result["outcome"].dims, index, strict=True)))
        outcome = names[int(here["outcome"])]
        seen.add(outcome)
        model = DISK.with_parameters({"W": W, "relaxation.b": b})
        if Z > 0.08:  # the radius
            assert (outcome, float(here["t_end"]), float(here["final_Z"])) == ("ejected", 0.0, Z)
        else:
            run = integrated(model, [0.0, 2.0], [0.0, 1e-3, Z, 0.0], method="auto")
            assert run.outcome == outcome
            assert [float(here[f"final_{name}"]) for name in model.state_names] == run.state[-1].tolist()
            assert here["t_end"] == run.t[-1]
    assert seen == {"finished", "ejected"}


def test_a_failed_trajectory_is_an_outcome_and_disturbs_no_other() -> None:
    # At 3.9 cm/s the disk leaves the wheels, at 7.1 cm/s from here it does not.
    over = {"W": [0.039, 0.071]}
    options = {"t": 2000.0, "tol": 1e-9}
    result = udd.sweep(udd.SweepSpec("lyapunov", udd.Disk(0.039), over, options=options))
    assert [named(result)[k] for k in result["outcome"].values] == ["ejected", "finished"]
    assert np.isnan(result["value"].values).tolist() == [True, False]
    with pytest.warns(udd.ConvergenceWarning):
        assert udd.lyapunov(udd.Disk(0.071), t=2000.0, tol=1e-9) == result["value"].values[1]


def test_a_solution_that_blows_up_is_an_outcome() -> None:
    # Its rate is beyond the largest number.
    over = {"Omega": [1.0, 1e308]}
    model = udd.Pendulum(0.5, k0=100.0)
    swept = udd.sweep(udd.SweepSpec("outcome", model, over, [1.0, 1.0], {"t": 1.0}))
    assert [named(swept)[k] for k in swept["outcome"].values] == ["finished", "failed"]
    assert np.isnan(swept["t_end"].values).tolist() == [False, True]


def test_a_disk_that_is_nowhere_on_the_wheels_is_not_run() -> None:
    spec = udd.SweepSpec("final_state", DISK, {"Z": [0.08, 0.09, -0.1]}, [0.0, 0.01, 0.0, 0.0], {"t": 1.0})
    result = udd.sweep(spec)
    assert [named(result)[k] for k in result["outcome"].values] == ["ejected"] * 3
    assert result["t_end"].values.tolist() == [0.0] * 3
    assert result["final_Z"].values.tolist() == [0.08, 0.09, -0.1]
    assert result["final_Y"].values.tolist() == [0.01] * 3


@pytest.mark.parametrize("treatment", ["set-valued", "karnopp", "lugre"])
def test_runs_keep_their_friction(treatment: str) -> None:
    """Modes and bristles are left to Runge-Kutta methods, which know them."""
    rod = udd.Pendulum(0.5, k0=0.01).with_effects(udd.effects.coulomb(c=0.3, treatment=treatment))
    result = udd.sweep(udd.SweepSpec("final_state", rod, {"theta": [0.2, 1.0, 2.0]}, options={"t": 9.0}))
    for k, theta in enumerate(result["theta"].values.tolist()):
        start = [0.0, theta, 0.0][: len(rod.state_names)]
        run = udd.simulate(rod, [0.0, 9.0], start, method="auto")
        ends = [float(result[f"final_{name}"].values[k]) for name in rod.state_names]
        assert ends == run.state[-1].tolist()
    # Held, or as good as with bristles.
    assert np.abs(result["final_Omega"].values).min() < 1e-3


def test_exponents_over_two_parameters_and_a_state() -> None:
    over = {"z": [0.01, -1.0], "B": [0.0, 0.2], "w": [1.0, 2.0, 3.0]}
    spec = udd.SweepSpec("lyapunov", udd.DLE(1.0), over, options={"t": 500.0, "tol": 1e-9})
    result = udd.sweep(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", udd.ConvergenceWarning)
        # B = 0 alone, without the terms that it switches off, and beside others: the same bits.
        for index in np.ndindex(spec.shape):
            z, b, w = (float(values[k]) for values, k in zip(spec.axes.values(), index, strict=True))
            alone = udd.lyapunov(udd.DLE(w, b), t=500.0, tol=1e-9, state0=[1.0, 1.0, z])
            assert result["value"].values[index] == alone


def test_spectra_add_up_to_the_divergence() -> None:
    over = {"B": [0.0, 0.1], "w": [1.0, 2.0, 3.0]}
    swept = udd.sweep(udd.SweepSpec("spectrum", udd.DLE(1.0), over, options={"t": 500.0}, chunk=4))
    assert swept["value"].dims == ("B", "w", "number")
    # The tangents' volume shrinks at the rate 1 + B w at every moment; left is the integrator's error.
    off = swept["value"].sum("number") + 1 + swept["B"] * swept["w"]
    assert float(abs(off).max()) < 1e-6


@pytest.mark.parametrize("chunk", [1, 5, 1000])
def test_the_size_of_the_chunks_does_not_change_the_values(chunk: int) -> None:
    for made in (disk_spec, exponents_spec):
        usual, other = udd.sweep(made()), udd.sweep(made(chunk=chunk))
        for name, values in usual.data_vars.items():
            assert values.values.tobytes() == other[name].values.tobytes()


@pytest.mark.parametrize("shape", [(1,), (10,), (3, 1000), (7, 5, 11)])
@pytest.mark.parametrize("chunk", [1, 4, 7, 1024])
def test_chunks_cover_everything_once(shape: tuple[int, ...], chunk: int) -> None:
    from udd.sweeps.chunks import grid_of

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
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1, np.nan]}), "the values of w must be finite"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1, -2, 3]}), "w must not be below 0, not -2"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": ["a"]}), "the values of w must be numbers"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1]}, [1, 2]), "3 components"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1]}, options={"T": 1}), "no option 'T'"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1]}, options={"t": -1}), "t must be above 0"),
        (lambda: udd.SweepSpec("outcome", DLE, {"w": [1]}), "length of the runs, must be given"),
        (lambda: udd.SweepSpec("lyapunov", DLE, {"w": [1]}, chunk=0), "chunk must be a whole number"),
        (lambda: udd.SweepSpec.from_json("[1"), "is not JSON"),
        (lambda: udd.SweepSpec.from_json("[1]"), "must be a table"),
        (lambda: udd.SweepSpec.from_json("{}"), "does not say its quantity"),
        (lambda: udd.SweepSpec.from_json('{"quality": 1}'), "a sweep has no 'quality'"),
        (lambda: udd.SweepSpec.from_dict({**SPECS[0].to_dict(), "over": [{"name": "W"}]}), "from, to and n"),
        (lambda: udd.SweepSpec.from_dict({**SPECS[0].to_dict(), "model": {"kind": "bob"}}), "kind must be"),
        (
            lambda: udd.SweepSpec.from_dict({**SPECS[0].to_dict(), "model": {"kind": "dle"}}),
            "does not say its w",
        ),
        (lambda: udd.sweep("spec.toml"), "needs a udd.SweepSpec"),
        (lambda: udd.sweep(SPECS[0], executor=2), "needs a method submit"),
    ],
)
def test_bad_input_gets_one_clear_sentence(call: Callable[[], object], named: str) -> None:
    with pytest.raises(ModelError, match=named):
        call()


# --- the store


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


# --- the command


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('quantity = "lyapunov', "spec.toml is not TOML: Unterminated string"),
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
