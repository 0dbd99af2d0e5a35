"""Results saved and read back: the same to the bit, and nothing but a sentence for what is no such file."""

from __future__ import annotations

import io
import json
import random
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import discovered
import udd


@pytest.fixture(scope="module")
def swing() -> tuple[udd.Measurement, udd.Fit]:
    t = np.arange(0, 20, 0.05)
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.5]).state[:, 1]
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    measured = udd.Measurement(t, {"theta": theta + noise}, meta={"source": "made"})
    return measured, udd.fit(measured, udd.Pendulum(1.0, k0=0.1))


def back(result: Any, folder: Path) -> Any:
    udd.save(result, folder / "result.npz")
    return udd.load(folder / "result.npz")


def test_a_fit_comes_back_to_the_bit(swing: tuple[udd.Measurement, udd.Fit], tmp_path: Path) -> None:
    measured, fit = swing
    again = back(fit, tmp_path)
    assert again.summary() == fit.summary()
    assert (again.parameters, again.errors, again.model) == (fit.parameters, fit.errors, fit.model)
    assert again.to_dict() == fit.to_dict()
    for name in ("covariance", "states", "state_covariance", "misfit", "misfit_variance", "defect"):
        np.testing.assert_array_equal(getattr(again, name), getattr(fit, name))
    np.testing.assert_array_equal(again.residuals, fit.residuals)
    item, other = (udd.forecast(measured, f, 2.0, members=20) for f in (fit, again))
    np.testing.assert_array_equal(item.members, other.members)
    # Shared objects stay shared, and loaded arrays are read-only.
    assert again.problem.models[0] is not None and again.problem.record is again.record
    assert again.measurement.meta == {"source": "made"} and not again.measurement.t.flags.writeable


def test_a_fit_of_a_model_of_ones_own_comes_back(tmp_path: Path) -> None:
    model = udd.Model(["x", "v"], {"x": "v", "v": "-k*x - c*v"}, {"k": 2.0, "c": 0.1})
    t = np.arange(0, 15, 0.05)
    x = udd.simulate(model, t, [1.0, 0.0]).state[:, 0]
    measured = udd.Measurement(t, {"x": x + 1e-3 * np.random.default_rng(4).standard_normal(len(t))})
    fit = udd.fit(measured, model)
    assert back(fit, tmp_path).summary() == fit.summary()


@pytest.mark.parametrize(
    ("known", "name", "value", "start"),
    [
        (udd.Pendulum(1.0), "k0", -0.02, [0.0, 0.3]),
        (udd.Disk(0.001), "W", -0.005, [0.0, 0.0, -0.04, 0.5]),
        (udd.Disk(0.001), "k1", -0.02, [0.0, 0.0, -0.04, 0.5]),
    ],
)
def test_a_fit_outside_the_physical_ranges_comes_back(
    known: udd.Model, name: str, value: float, start: list[float], tmp_path: Path
) -> None:
    """The friction of a motion that grows is negative; so is a drive that was wired the other way round."""
    t, columns = np.arange(0, 4, 0.05), len(known.state_names) - 1
    beyond = known.with_parameters({"k0": -0.1, name: value})
    seen = udd.simulate(beyond, t, start).state[:, 1:]
    noise = 1e-4 * np.random.default_rng(1).standard_normal((len(t), columns))
    options = {"free": [name], "camera": False, "priors": {name: (0.0, 0.1)}}
    fit = udd.fit(udd.Measurement(t, seen + noise), known.with_parameters({"k0": -0.1}), **options)  # type: ignore[arg-type]
    assert fit.parameters[name] < 0
    again = back(fit, tmp_path)
    assert again.model == fit.model and again.summary() == fit.summary()


def same(one: udd.Discovery, other: udd.Discovery) -> None:
    assert repr(one) == repr(other)
    assert one._repr_html_() == other._repr_html_()
    assert json.dumps(one.to_dict()) == json.dumps(other.to_dict())
    assert one.fit.summary() == other.fit.summary()
    assert [len(scan) for scan in one.scans] == [len(scan) for scan in other.scans]


@pytest.mark.parametrize("find", [discovered.nothing, discovered.pendulum, discovered.disk])
def test_a_discovery_comes_back_with_its_report(find: Any, tmp_path: Path) -> None:
    actual = find()
    again = back(actual, tmp_path)
    same(actual, again)
    assert (again.fit is again.baseline) == (actual.fit is actual.baseline)
    pages = []
    for name, result in (("one", actual), ("other", again)):
        result.report(tmp_path / f"{name}.html")
        pages.append((tmp_path / f"{name}.html").read_text())
    assert pages[0] == pages[1]


def test_what_is_no_result_is_refused(swing: tuple[udd.Measurement, udd.Fit], tmp_path: Path) -> None:
    whole = tmp_path / "fit.npz"
    udd.save(swing[1], whole)
    content = whole.read_bytes()
    with pytest.raises(udd.UddError, match="a Fit or a Discovery can be saved, not Measurement"):
        udd.save(swing[0], whole)  # type: ignore[arg-type]
    with pytest.raises(udd.UddError, match="there is no folder"):
        udd.save(swing[1], tmp_path / "no" / "fit.npz")
    assert whole.read_bytes() == content and len(list(tmp_path.iterdir())) == 1
    with pytest.raises(udd.UddError, match=r"nothing\.npz cannot be read"):
        udd.load(tmp_path / "nothing.npz")
    foreign = io.BytesIO()
    np.savez(foreign, x=np.arange(3))
    pickled = io.BytesIO()
    np.savez(pickled, tree=np.array([{}], dtype=object))
    open_bracket = io.BytesIO()  # in an array's header
    with zipfile.ZipFile(io.BytesIO(content)) as files, zipfile.ZipFile(open_bracket, "w") as result:
        for name in files.namelist():
            part = files.read(name)
            result.writestr(name, part.replace(b"}", b"(", 1) if name == "a0.npy" else part)
    other = tmp_path / "other.npz"
    wrongs = (foreign, pickled, open_bracket)
    for wrong in (b"", b"no zip", content[:-1], content[1:], *(item.getvalue() for item in wrongs)):
        other.write_bytes(wrong)
        with pytest.raises(udd.UddError, match=r"other\.npz is not a whole file of udd\.save$"):
            udd.load(other)
    for length in range(0, len(content), len(content) // 40):
        other.write_bytes(content[:length])
        with pytest.raises(udd.UddError, match="is not a whole file"):
            udd.load(other)
    chance = random.Random(2)
    for _ in range(60):
        damaged = bytearray(content)
        damaged[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        other.write_bytes(damaged)
        try:
            udd.load(other)  # some bits of a zip's head mean nothing
        except udd.UddError as error:
            assert "\n" not in str(error)


def test_a_tree_that_was_tampered_with_makes_no_other_types(
    swing: tuple[udd.Measurement, udd.Fit], tmp_path: Path
) -> None:
    path = tmp_path / "fit.npz"
    udd.save(swing[1], path)
    with np.load(path) as file:
        parts = {name: file[name] for name in file.files}
    tree = json.loads(parts["tree"].tobytes())

    def written(**changed: Any) -> None:
        text = json.dumps({**tree, **changed}).encode()
        np.savez(path, **{**parts, "tree": np.frombuffer(text, np.uint8)})

    written()
    assert udd.load(path).summary() == swing[1].summary()
    written(format="udd result 99")
    with pytest.raises(udd.UddError, match="another format: 'udd result 99'"):
        udd.load(path)
    deep: Any = []
    for _ in range(900):
        deep = [deep]
    for odd in (
        *([], None, 3, [3], [{}], [{"type": "os.system", "fields": {}}], [{"type": "Fit", "fields": {}}]),
        *([{"object": 0}], [{"type": "Free", "fields": {"name": {"object": 5}}}]),
        [{"type": "Noise", "fields": deep}],
        *([*tree["objects"][:-1], {"model": 3}], [{"model": {"kind": "no such"}}], tree["objects"][:1]),
    ):
        written(objects=odd)
        with pytest.raises(udd.UddError) as error:
            udd.load(path)
        assert "\n" not in str(error.value) and len(str(error.value)) < 400
