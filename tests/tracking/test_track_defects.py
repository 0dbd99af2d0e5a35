"""The tracker on films with one defect each, made by `udd.render`, the truth beside."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import udd
from small_films import SMALL, shot
from tracked_errors import errors, rms
from udd.cli import main
from udd.errors import IncompleteWarning, UddError
from udd.film import Defects
from udd.film.motion import motion_of, then_falling
from udd.markers.layout import BODY
from udd.tracking import overlay, pictures_at
from udd.tracking.detection.colour_blobs import COLOURS, Blobs, squares
from udd.tracking.metric.pixels_to_metres import left_the_wheels
from udd.video import reader


def test_a_rolling_shutter_is_found_and_undone(tmp_path: Path) -> None:
    film = shot(tmp_path / "rolling.mp4", defects=Defects(readout=0.8))
    m = udd.track(film.path)
    # 0.8 of 40 ms; without it the marks disagree by up to 30 mm
    assert float(m.meta["readout"]) == pytest.approx(0.032, rel=0.03)
    e = rms(errors(m, film))
    assert m.seen.mean() > 0.98
    assert e[0] < 0.2 and e[1] < 0.2 and e[2] < 3  # the limits at twice this resolution


def test_a_film_of_which_no_frame_is_measured_is_told(
    tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # the page of a refused film is written there
    film = shot(tmp_path / "brief.mp4", 0.84, (0, 0.001, 0.04, 0), rng=5, defects=Defects(readout=0.8))
    assert main(["fit", str(film.path), "--W", "0.05"]) == 1
    said = capsys.readouterr().err
    assert "no usable row" in said and "in 21 of 21 frames: lost: fewer than two marks agree" in said


def test_a_camera_that_stands_aside_is_found_and_undone(tmp_path: Path) -> None:
    film = shot(tmp_path / "aside.mp4", defects=Defects(off_axis=(math.radians(15), 0.0)))
    m = udd.track(film.path)
    e = rms(errors(m, film))
    # untreated, lengths across are 3.4 % short: 1 mm of 30
    assert m.meta["lens"] and e[0] < 0.25 and e[1] < 0.25 and e[2] < 4
    assert float(m.meta["drive_seen"]) == pytest.approx(0.039, rel=3e-3)


def test_after_the_disk_has_left_nothing_is_invented(tmp_path: Path) -> None:
    t = np.arange(0, 12, 0.005)
    with pytest.warns(IncompleteWarning, match="left the wheels"):
        whole = udd.simulate(udd.Disk(0.039), t, [-1.7928, 0.029293, 0.025831, -0.8413])
    assert whole.outcome == "ejected"
    with pytest.warns(IncompleteWarning, match="left the wheels"):
        run = udd.simulate(udd.Disk(0.039), t, whole.state[-600], dense=True)  # the last 3 s of it
    film = udd.render(run, tmp_path / "gone.mp4", size=SMALL, defects=Defects(after=1.5))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # so short a run need not tell where the contact is
        m = udd.track(film.path, pivot=film.pivot)
    last = int(np.flatnonzero(film.held)[-1])
    assert not film.held[-1] and m.seen[: last - 1].all()
    assert not m.seen[last + 1 :].any()
    assert all(flag.startswith("gone") for flag in m.flag[last + 1 :])


@pytest.mark.parametrize("start", [(-1.7928, 0.029293, 0.025831, -0.8413), (2.4, -0.01, 0.04, 0.3)])
@pytest.mark.parametrize("fps", [25, 60, 240])
def test_a_falling_disk_is_gone_from_its_first_frame_on(fps: int, start: tuple[float, ...]) -> None:
    with pytest.warns(IncompleteWarning, match="left the wheels"):
        run = udd.simulate(udd.Disk(0.039), np.arange(0, 30, 0.005), start, dense=True)
    end, random = float(run.t[-1]), np.random.default_rng(1)
    falling = then_falling(motion_of(run), end)
    for phase in (0.1, 0.5, 0.9):  # of the last frame before the disk is lost, and what of it is seen then
        for shown in (fps // 12, fps // 8, fps):
            t = np.arange(-2.0 + (phase - 1) / fps, (12.0 - phase) / fps, 1 / fps) + end
            on = t <= end
            values = falling(t)[:, 1:] + random.normal(0, 2e-5, (len(t), 3))
            values[np.flatnonzero(~on)[shown:]] = np.nan
            gone = left_the_wheels(t, values, 0.08, 1e-5, 0.039j)
            assert gone[~on].all() and gone[on].sum() <= 1
            assert not left_the_wheels(t[on], values[on], 0.08, 1e-5, 0.039j).any()


def test_dropped_repeated_and_black_frames(tmp_path: Path) -> None:
    wrong = Defects(dropped=(30, 31), repeated=(50, 51), black=(70,))
    film = shot(tmp_path / "frames.mp4", defects=wrong)
    m = udd.track(film.path)
    assert len(m) == len(film.t) and np.allclose(m.t, film.t, atol=1e-4)
    said = {round(t * 25): flag for t, flag in zip(m.t, m.flag, strict=True) if flag}
    assert {k: flag[:3] for k, flag in said.items()} == {32: "gap", 50: "dup", 51: "dup", 70: "bla"}
    assert said[32] == "gap: 2 frames are missing before" and m.seen[30]  # the row of frame 32
    assert rms(errors(m, film))[:2].max() < 0.1


def test_three_marks_do_and_the_user_is_told(tmp_path: Path) -> None:
    film = shot(tmp_path / "three.mp4", defects=Defects(mark_strength=(1, 1, 1, 0)))
    with pytest.warns(UserWarning, match="no green mark"):
        m = udd.track(film.path)
    e = errors(m, film)
    assert m.seen.mean() > 0.95 and rms(e)[:2].max() < 0.15
    overlay(film.path, m, tmp_path / "seen.mp4")
    plain, drawn = (pictures_at(p, [20])[0].astype(int) for p in (film.path, tmp_path / "seen.mp4"))
    assert np.abs(plain - drawn).max() > 100  # something is drawn, and most is not touched
    assert np.median(np.abs(plain - drawn)) < 4


@pytest.mark.parametrize("missing", [None, 0, 1, 2, 3])
def test_squares_of_blobs_with_and_without_a_mark(missing: int | None) -> None:
    centre, angle, reach = 140 + 170j, 0.7, 60.0
    at = centre + reach * BODY * np.exp(1j * angle)
    stray = np.array([20 + 30j, 250 + 40j])  # of every colour
    patches = [
        Blobs(stray if k == missing else np.append(stray, at[k]), np.full(2 if k == missing else 3, 200.0))
        for k in range(len(COLOURS))
    ]
    result = squares(patches, missing)
    assert result and abs(result[0][1].centre - centre) < 1e-9
    assert result[0][1].angle == pytest.approx(angle) and result[0][1].reach == pytest.approx(reach)


def test_slow_motion_headers_can_be_overruled(tmp_path: Path) -> None:
    film = shot(tmp_path / "slow.mp4", seconds=1.0)
    pictures = list(reader.Film(film.path, fps=240).pictures())
    assert [p.t for p in pictures] == [k / 240 for k in range(len(film.t))]
    with pytest.raises(UddError, match="fps must be positive"):
        reader.Film(film.path, fps=0)


def test_hurt_files_neither_hang_nor_crash(tmp_path: Path) -> None:
    whole = shot(tmp_path / "whole.mp4", seconds=1.0).path.read_bytes()
    rng = np.random.default_rng(3)
    for k in range(6):
        data = bytearray(whole)
        if k < 2:
            data = data[: len(data) * (k + 1) // 3]
        else:
            for place in rng.integers(0, len(data), 200):
                data[place] ^= 1 << int(rng.integers(8))
        path = tmp_path / f"{k}.mp4"
        path.write_bytes(bytes(data))
        try:
            film = reader.Film(path)
            count = sum(p.y.size > 0 for p in film.pictures())
        except UddError as error:
            assert "\n" not in str(error)
        else:
            assert count <= 30


def test_a_silent_decoder_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = shot(tmp_path / "whole.mp4", seconds=1.0).path
    monkeypatch.setattr(reader, "PATIENCE", 0.001)  # no process starts so fast
    with pytest.raises(UddError, match="can be decoded"):
        reader.Film(path)


def test_defects_that_make_no_sense(tmp_path: Path) -> None:
    for bad in ({"readout": 2}, {"off_axis": (1, 2, 3)}, {"mark_strength": (1, 1, 1, 2)}, {"clutter": -1}):
        with pytest.raises(UddError, match=next(iter(bad))):
            Defects(**bad)  # type: ignore[arg-type]
    assert repr(Defects(clutter=3)) == "Defects(clutter=3)"
    with pytest.raises(UddError, match="mp4v has frames at even times"):
        shot(tmp_path / "x.mp4", seconds=1.0, codec="mp4v", defects=Defects(dropped=(3,)))


def test_a_folder_of_films(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shot(tmp_path / "a.mp4", seconds=2.0)
    (tmp_path / "b.mp4").write_bytes(b"no film")
    assert main(["track", str(tmp_path), "--out", str(tmp_path / "tables"), "--fast"]) == 1
    said = capsys.readouterr().out
    assert "a.mp4: 50 of 50 frames usable" in said and "b.mp4 is not a film" in said
    assert (tmp_path / "tables" / "a.csv").is_file() and not (tmp_path / "tables" / "b.csv").exists()


def test_a_disk_that_leaps_inward_at_its_edge_has_gone() -> None:
    """Thrown off, it may cover the contact again; farther in, a leap is a matter of its own."""
    t = np.arange(0, 4, 0.04)
    away = 0.04 + 0.039 * 0.9 * (t - t[-1]) + 0.0398  # m, up to its edge as fast as it can roll
    for k, gone in ((len(t) - 3, True), (len(t) // 2, False)):
        leapt = np.where(np.arange(len(t)) < k, away, away - 0.008)
        result = left_the_wheels(t, np.column_stack([0 * t, leapt, 0 * t]), 0.08, 1e-5)
        assert list(result) == list(gone & (np.arange(len(t)) >= k))
