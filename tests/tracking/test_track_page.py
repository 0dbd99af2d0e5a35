"""The page about a tracked film: all of it there, standing alone, and the same each time."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import tracked
import udd
from clicked_places import edge, marks
from small_films import shot
from tracked_errors import errors, rms
from udd.cli import main
from udd.errors import UddError
from udd.film import Defects, Film
from udd.report.tracking import calibration, chosen
from udd.tracking import page
from udd.tracking.metric.rolling_check import health
from udd.tracking.tracking_result import Tracking


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = udd.simulate(udd.Disk(0.039), np.arange(0, 4, 0.005), [1, 0.02, -0.02, 0.3], dense=True)
    wrong = Defects(dropped=(30,), repeated=(50,), black=(70,))
    path = tmp_path_factory.mktemp("page") / "run.mp4"
    return udd.render(run, path, size=(276, 350), defects=wrong).path


@pytest.fixture(scope="module")
def tracking(film: Path) -> Tracking:
    return tracked.track_disk(film)


def test_the_page_holds_all_and_stands_alone(film: Path, tracking: Tracking, tmp_path: Path) -> None:
    page(film, tracking, tmp_path / "page.html", command="udd track run.mp4 --page page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>") and "97 of 99 frames" in text
    for said in ("Positions", "The camera and the device", "How each frame did", "Does it roll?", "±"):
        assert said in text
    for item in tracking.measurement.meta["calibration"]:
        assert f'<th scope="row">{item}</th>' in text
    for flag in (
        "dup: the frame repeats",
        "black: the frame shows nothing",
        "gap: 1 frame is missing before",
    ):
        assert flag in text
    images = re.findall(r'<img src="data:image/(?:png|jpeg);base64,[^"]{1000,}" alt="([^"]+)"', text)
    # frames with why, then motion, quality, map, rolling
    assert len(images) == len(chosen(tracking.measurement)) + 4 and any("black" in alt for alt in images)
    assert "http" not in text and "<script" not in text and str(film.parent) not in text
    page(film, tracking, tmp_path / "again.html", command="udd track run.mp4 --page page.html")
    assert (tmp_path / "again.html").read_bytes() == (tmp_path / "page.html").read_bytes()


def test_values_are_told_to_their_errors(tracking: Tracking) -> None:
    rows = {row["name"]: row for row in calibration(tracking.measurement)}
    scale = tracking.measurement.meta["calibration"]["scale"]
    assert float(rows["scale"]["value"]) == pytest.approx(scale[0], abs=0.1 * scale[1])
    assert len(rows["scale"]["value"]) <= 8 and rows["exposure"]["unit"] == "ms"


def test_a_table_read_back_makes_a_page_too(film: Path, tracking: Tracking, tmp_path: Path) -> None:
    tracking.measurement.to_csv(tmp_path / "m.csv")
    page(film, udd.read_measurement(tmp_path / "m.csv"), tmp_path / "page.html")
    assert "by the place of the middle" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_the_command_writes_it(film: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "page.html"
    argv = ["track", str(film), "--fast", "--page", str(out), "--out", str(tmp_path / "m.csv")]
    assert main(argv) == 0, capsys.readouterr().err
    text = out.read_text(encoding="utf-8")
    assert "udd track run.mp4 --fast --page page.html" in text
    assert "udd track film --page" not in text
    assert main(["track", str(film.parent), "--page", str(out), "--out", str(tmp_path)]) == 1
    assert "--page is for one film" in capsys.readouterr().err


def test_what_is_left_of_rolling_is_noise_here_and_shows_a_wrong_clock(tracking: Tracking) -> None:
    m = tracking.measurement
    fine = health(m)
    assert fine is not None and 0.2 < fine.rms / fine.noise < 3  # the model is the maker's own
    # a disk that slips sideways by 5 mm/s in one direction of turning
    slip = 0.005 * np.cumsum(np.gradient(m.t) * (np.nan_to_num(np.gradient(m["beta"], m.t)) > 0))
    values = m.values.copy()
    values[:, 0] += slip
    worse = health(udd.Measurement(m.t, values, m.sigma, m.rho, m.flag, m.meta, m.names))
    assert worse is not None and worse.rms > 5 * fine.rms


def test_what_is_no_film_has_no_page(tmp_path: Path, film: Path) -> None:
    t = np.arange(30) / 25
    with pytest.raises(UddError, match="was not tracked in a film"):
        page(film, udd.Measurement(t, {"theta": np.sin(t)}), tmp_path / "page.html")
    assert list(tmp_path.iterdir()) == []


def clicked(film: Film, frame: int) -> str:
    """The text of clicks on the blue and the green mark, and on the disk's edge."""
    points = [("mark", marks(film, frame, (2, 3))), ("edge", edge(film, frame))]
    places = [f"{name}={u:.1f}:{v:.1f}" for name, some in points for u, v in some]
    return ",".join([f"frame={frame}", *places])


def test_a_refused_film_leaves_a_page_and_clicks_track_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    film = shot(tmp_path / "no_red.mp4", 2.0, defects=Defects(mark_strength=(0, 0, 1, 1)))
    page, table = tmp_path / "no_red-refused.html", tmp_path / "a.csv"
    assert main(["track", str(film.path), "--out", str(table)]) == 1
    said = capsys.readouterr().err
    assert "no disk with marks in red, orange, blue and green" in said and f"written: {page}" in said
    html = page.read_text(encoding="utf-8")
    assert "no disk with marks in red" in html and html.count('<img src="data:image/jpeg') == 6
    cells = re.findall(r"<t[dh][^>]*>([^<]*)</t[dh]>", html)
    counts = {name: cells[cells.index(name) + 1] for name in ("red", "orange", "blue", "green")}
    assert counts["red"].startswith("0 of") and not counts["blue"].startswith("0 of")
    data = json.loads(re.findall(r'class="clicks-data">(.*)</script>', html)[0])
    assert data["command"] == f"udd track {film.path} --out {table}" and len(data["frames"]) == 8
    frame = data["frames"][0]["index"]
    assert (
        main([*shlex.split(data["command"]), "--clicks", clicked(film, frame), "--leave-out", "10-12"][1:])
        == 0
    )
    m = udd.read_measurement(table)
    e = errors(m, film)
    e[:, 2] -= np.nanmedian(e[:, 2])  # beta counts from the blue mark
    assert m.seen.sum() > 40 and (rms(e) < (0.2, 0.2, 4)).all()
    assert [k for k, flag in enumerate(m.flag) if flag.startswith("omitted")] == [10, 11, 12]


@pytest.mark.parametrize("command", ["fit", "discover"])
def test_a_film_refused_on_the_way_to_a_fit_leaves_its_page(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    film = shot(tmp_path / "no_red.mp4", 1.0, defects=Defects(mark_strength=(0, 0, 1, 1)))
    assert main([command, str(film.path), "--W", "0.039", "--R", "0.08"]) == 1
    said = capsys.readouterr().err
    assert "no disk with marks in red" in said and "written: no_red-refused.html" in said
    html = (tmp_path / "no_red-refused.html").read_text(encoding="utf-8")
    data = json.loads(re.findall(r'class="clicks-data">(.*)</script>', html)[0])
    assert data["command"] == f"udd track {film.path} --out no_red.csv --disk-radius 0.08"
    (tmp_path / "why.html").touch()
    assert main([command, str(tmp_path / "why.html"), "--W", "0.039"]) == 1  # a table: no page
    assert not (tmp_path / "why-refused.html").exists()


def test_a_wrong_option_leaves_no_page(tmp_path: Path) -> None:
    page = tmp_path / "why.html"
    assert main(["track", str(tmp_path / "none.mp4"), "--page", str(page)]) == 1
    assert not page.exists()
