"""A measurement's inputs: beside its columns, in its files, and in what is made of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import udd
from udd.measurement import InputSignal, Measurement, MeasurementError, read_measurement

RNG = np.random.default_rng(3)
T = np.arange(40) / 25 + 1e-3 * RNG.random(40)
U = RNG.normal(size=40)
FAST = np.sort(RNG.random(90)) * 2 - 0.1  # a clock of its own, from before the first row to after the last
V = RNG.normal(size=90)


def driven() -> Measurement:
    return Measurement(
        T,
        {"theta": np.sin(T)},
        flag=["", "dup", *[""] * 38],
        meta={"source": "bench", "input_units": {"u": "N m"}},
        inputs={"u": U, "v": InputSignal(FAST, V, "zero"), "w": InputSignal([0.5, 0.6], [1.0, 2.0], "cubic")},
    )


def same_inputs(a: Measurement, b: Measurement) -> None:
    assert list(a.inputs) == list(b.inputs)
    for item, other in zip(a.inputs.values(), b.inputs.values(), strict=True):
        assert item.hold == other.hold
        assert np.array_equal(item.t, other.t) and np.array_equal(item.values, other.values)


def test_an_array_is_sampled_at_the_rows_and_a_signal_at_its_own_times() -> None:
    m = driven()
    assert np.array_equal(m.inputs["u"].t, T) and m.inputs["u"].hold == "linear"
    assert np.array_equal(m["u"], U)
    assert np.array_equal(m["v"], m.inputs["v"](T))
    assert "driven by u, v, w" in repr(m) and "driven" not in repr(Measurement(T, np.sin(T)))
    with pytest.raises(ValueError, match="read-only"):
        m.inputs["u"].values[0] = 0.0


def test_rows_slices_and_meta_keep_the_signals_whole() -> None:
    m = driven()
    for part in (m.slice(0.5, 1.0), m.rows(T < 0.5), m.with_meta(W=1), m.rows([3, 4])):
        same_inputs(m, part)
    part = m.slice(0.5, 1.0)
    assert len(part["u"]) == len(part) == len(part.slice(0.5, 1.0))


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize("part", ["all", "slice"])
def test_files_keep_every_bit(tmp_path: Path, kind: str, part: str) -> None:
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    m = driven() if part == "all" else driven().slice(0.3, 1.2)
    path = tmp_path / f"m.{kind}"
    getattr(m, f"to_{kind}")(path)
    back = read_measurement(path)
    same_inputs(m, back)
    assert dict(back.meta) == dict(m.meta) and back.flag.tolist() == m.flag.tolist()
    assert np.array_equal(back.t, m.t) and np.array_equal(back.values, m.values)


def test_the_file_is_a_plain_table(tmp_path: Path) -> None:
    driven().to_csv(tmp_path / "m.csv")
    lines = (tmp_path / "m.csv").read_text().splitlines()
    assert "t,theta,flag,input:u,t:v,input:v,t:w,input:w" in lines
    assert len(lines) == 3 + 1 + 90


def test_to_xarray_has_inputs_with_their_units_and_clocks() -> None:
    pytest.importorskip("xarray")
    labelled = driven().to_xarray()
    assert labelled.u.dims == ("t",) and labelled.u.attrs == {"hold": "linear", "units": "N m"}
    assert labelled.v.dims == ("t_v",) and np.array_equal(labelled.t_v, FAST)


@pytest.mark.parametrize(
    ("inputs", "says"),
    [
        ({"theta": U}, "an input and a column are both called theta"),
        ({"t": U}, "an input and a column are both called t"),
        ({"sigma_theta": U}, "an input and a column are both called sigma_theta"),
        ({"motor torque": U}, "an input's name must be fit for a formula, like u_1, not 'motor torque'"),
        ({"u": U[:-1]}, "the input u: an input needs as many samples as times"),
        ({"u": np.full(40, np.nan)}, "the input u: an input's samples must be a list of finite numbers"),
    ],
)
def test_bad_inputs_are_named_in_one_sentence(inputs: dict[str, np.ndarray], says: str) -> None:
    with pytest.raises(MeasurementError) as error:
        Measurement(T, {"theta": np.sin(T)}, inputs=inputs)
    assert says in str(error.value) and "\n" not in str(error.value)


def test_a_smoothed_measurement_and_a_saved_fit_keep_them(tmp_path: Path) -> None:
    t = np.arange(300) / 50
    theta = 0.5 * np.cos(3 * t) + np.random.default_rng(1).normal(0, 1e-3, t.size)
    m = Measurement(t, {"theta": theta}, sigma=np.full(t.size, 1e-3), inputs={"u": np.sin(t)})
    same_inputs(m, udd.smooth(m))
    fit = udd.fit(m, udd.Pendulum(1.0, k0=0.02), free=["k0"])
    udd.save(fit, tmp_path / "fit.npz")
    again = udd.load(tmp_path / "fit.npz")
    assert isinstance(again, udd.Fit)
    same_inputs(fit.measurement, again.measurement)
