"""A table that a visitor drops: its columns are guessed in three languages, and read as chosen."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import udd
from udd.app import worker
from udd.app.driven_models import TORQUE, driven_model
from udd.app.table_columns import look, measurement_of
from udd.errors import UddError

T = np.arange(80) / 40
SWING = 20 * np.cos(3 * T)


def table(folder: Path, head: str, *columns: np.ndarray, name: str = "table.csv") -> Path:
    lines = [head, *(";".join(f"{x:.5f}" for x in row) for row in zip(*columns, strict=True))]
    path = folder / name
    path.write_text("\n".join(lines).replace(".", ","), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("head", "guesses"),
    [
        ("Zeit;Winkel;Nummer", ["t", "theta", ""]),
        ("tijd (s);hoek;x", ["t", "theta", ""]),
        ("Seconds;Displacement angle [deg];y", ["t", "theta", ""]),
        ("Zeit;Winkelgeschwindigkeit;Nummer", ["t", "Omega", ""]),
        ("a;b;c", ["", "", ""]),
    ],
)
def test_columns_are_guessed(head: str, guesses: list[str], tmp_path: Path) -> None:
    result = look(table(tmp_path, head, T, SWING, T))
    assert [column["guess"] for column in result["columns"]] == guesses
    assert result["rows"] == 80 and len(result["columns"][0]["cells"]) == 6


def test_a_disk_is_guessed(tmp_path: Path) -> None:
    result = look(table(tmp_path, "Zeit;Y;Höhe;Drehwinkel", T, 0.01 * SWING, 0.01 * SWING, SWING))
    assert [column["guess"] for column in result["columns"]] == ["t", "Y", "Z", "beta"]


def test_a_camera_s_axes_with_an_orientation_are_a_disk(tmp_path: Path) -> None:
    result = look(table(tmp_path, "tijd (s);x (cm);y (cm);draaihoek (graden)", T, SWING, SWING, SWING))
    assert [column["guess"] for column in result["columns"]] == ["t", "Y", "Z", "beta"]
    assert [column["unit"] for column in result["columns"]] == ["s", "cm", "cm", "graden"]
    assert result["kind"] == ""  # the page then takes the columns as guessed
    assert look(table(tmp_path, "t;x;y", T, SWING, SWING))["kind"] == "pendulum"


def test_a_choice_with_units_is_read(tmp_path: Path) -> None:
    path = table(tmp_path, "a;b;c", 1000 * T, SWING, T)
    m = measurement_of(path, [["t", "a", "ms"], ["theta", "b", "deg"]], {})
    np.testing.assert_allclose(m.t, T, atol=1e-9)
    np.testing.assert_allclose(m["theta"], np.radians(SWING), atol=1e-6)
    for choice, words in (
        ([["t", "a", "s"]], "choose t with theta"),
        ([["theta", "a", "rad"], ["theta", "b", "rad"]], "two columns"),
        ([["q", "a", "rad"]], "no column is a q"),
        ([["t", "a", "furlong"], ["theta", "b", "rad"]], "no unit of t"),
        ([["t", "a"]], "cannot be read"),
        (["t"], "cannot be read"),
    ):
        with pytest.raises(UddError, match=words):
            measurement_of(path, choice, {})


@pytest.mark.parametrize(
    ("head", "guesses"),
    [
        ("Zeit;Auslenkung x;Drehmoment", ["t", "theta", "input"]),
        ("tijd;positie (rad);koppel (Nm)", ["t", "theta", "input"]),
        ("Time;Angle;Motor voltage", ["t", "theta", "input"]),
        ("t;theta;torque", ["t", "theta", "input"]),
        ("Zeit;Strom;Spannung", ["t", "", ""]),  # no motion
    ],
)
def test_an_input_is_guessed(head: str, guesses: list[str], tmp_path: Path) -> None:
    seen = look(table(tmp_path, head, T, np.radians(SWING), SWING))
    assert [column["guess"] for column in seen["columns"]] == guesses


def test_a_pendulum_with_a_measured_torque_is_fitted() -> None:
    choice = [["t", "time (s)", "s"], ["theta", "position (rad)", "rad"], ["input", "torque (N m)", ""]]
    m = measurement_of(udd.examples.path("driven.csv"), choice, {})
    assert m.names == ("theta",) and tuple(m.inputs) == (TORQUE,)
    fit = udd.fit(m, driven_model(m, 0.7, 0.08))
    # The table was made with 12 sin(theta) and 4 times the torque.
    assert 9.81 / fit.parameters["length"] == pytest.approx(12.0, rel=0.1)
    assert fit.parameters["gain"] == pytest.approx(4.0, rel=0.1)


def test_a_disk_with_a_measured_drive_is_read_and_fitted(tmp_path: Path) -> None:
    t = np.arange(0.0, 8.0, 0.02)
    drive = udd.InputSignal(t, 0.03 + 0.01 * np.sin(t))
    model = udd.driven_disk(0.08, k0=0.012, k1=0.103, k2=0.055)
    run = udd.simulate(model, t, [0.0, 0.001, 0.04, 0.0], inputs={"W": drive, "W_rate": drive.rate()})
    motion = run.state[:, 1:] + np.random.default_rng(1).normal(0.0, 1e-4, (len(t), 3))
    head = "Zeit;rechts;Höhe;Drehwinkel;Antrieb"
    path = table(tmp_path, head, t, 100 * motion[:, 0], 100 * motion[:, 1], motion[:, 2], 1000 * drive.values)
    lengths = [[role, name, unit] for role, name, unit in zip(
        ("t", "Y", "Z", "beta"), head.split(";"), ("s", "cm", "cm", "rad"), strict=False
    )]  # fmt: skip
    with pytest.raises(UddError, match="unit of the input"):
        measurement_of(path, [*lengths, ["input", "Antrieb", ""]], {})
    m = measurement_of(path, [*lengths, ["input", "Antrieb", "mm/s"]], {})
    np.testing.assert_allclose(m.inputs["W"].values, drive.values, atol=1e-7)
    fit = udd.fit(m, driven_model(m, None, 0.08))
    assert abs(fit.parameters["k0"] - 0.012) < 5 * fit.errors["k0"] < 0.005


def test_a_phone_s_zip_goes_through(tmp_path: Path) -> None:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        file.writestr("Gyroscope.csv", udd.examples.path("phone.csv").read_text())
        file.writestr("meta/device.csv", "property,value\nmodel,phone\n")
    path = tmp_path / "upload.csv"
    path.write_bytes(packed.getvalue())
    assert look(path)["kind"] == "gyroscope"
    m = measurement_of(path, [], {})
    assert m.names == ("Omega",) and m.meta["gyroscope"] == "Gyroscope x (rad/s)"


def test_what_was_measured_is_kept_when_a_job_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    worker.OUT.mkdir()
    table(tmp_path, "t;theta", T, np.radians(SWING), name="upload.csv")
    with pytest.raises(UddError, match="length in cm"):
        worker._loop({"file": "upload.csv", "film": False}, lambda _message: None)
    assert worker._kept() == [{"name": "measurement.csv", "title": "The measured motion"}]


def test_a_held_beginning_is_seen_and_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rate = np.where(T < 0.5, 0.0, np.sin(3 * (T - 0.5)))
    path = table(tmp_path, "Zeit (s);Gyroskop x (rad/s)", T, rate, name="upload.csv")
    begin = look(path)["begin"]
    assert 0.5 < begin < 0.6
    monkeypatch.chdir(tmp_path)
    worker.OUT.mkdir()
    asked = {"file": "upload.csv", "film": False, "begin": begin, "end": 1.5}
    with pytest.raises(UddError, match="length in cm"):
        worker._loop(asked, lambda _message: None)
    kept = udd.read_measurement(worker.OUT / "measurement.csv", {"Omega": "Omega"})
    assert begin <= kept.t[0] < begin + 0.03 and 1.47 < kept.t[-1] <= 1.5


def test_a_fault_of_the_program_is_called_so(tmp_path: Path) -> None:
    code = (
        "from udd.app import worker\n"
        "def broken(asked, tell): raise IndexError('inside')\n"
        "worker.JOBS['loop'] = broken\n"
        "worker.main()"
    )
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, stdin=pipe, stdout=pipe, text=True
    ) as job:
        assert job.stdin is not None and job.stdout is not None
        job.stdin.write('{"kind": "loop"}\n')
        job.stdin.flush()  # and left open: the process ends with its input
        said = json.loads(job.stdout.readline())
    assert said["error"].startswith("A fault of the program ended the job (IndexError).")
