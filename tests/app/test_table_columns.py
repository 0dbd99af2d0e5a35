"""A table that a visitor drops: its columns are guessed in three languages, and read as chosen."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

import udd
from udd.app import worker
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
    found = look(table(tmp_path, head, T, SWING, T))
    assert [column["guess"] for column in found["columns"]] == guesses
    assert found["rows"] == 80 and len(found["columns"][0]["cells"]) == 6


def test_a_disk_is_guessed(tmp_path: Path) -> None:
    found = look(table(tmp_path, "Zeit;Y;Höhe;Drehwinkel", T, 0.01 * SWING, 0.01 * SWING, SWING))
    assert [column["guess"] for column in found["columns"]] == ["t", "Y", "Z", "beta"]


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
