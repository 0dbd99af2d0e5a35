"""A folder of numbered pictures is a film."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import cv2

import udd
from small_films import shot
from tracked_errors import errors, rms
from udd.cli import main
from udd.errors import TrackError
from udd.tracking import pictures_at
from udd.video.reader import Film


@pytest.mark.parametrize("ending", ["png", "jpg"])
def test_a_folder_of_pictures_is_tracked(ending: str, tmp_path: Path) -> None:
    film = shot(tmp_path / "run.mp4", 1.2)
    folder = tmp_path / "100%d pictures"
    folder.mkdir()
    for k, picture in enumerate(pictures_at(film.path, range(len(film.t)))):
        cv2.imwrite(str(folder / f"shot{k}.{ending}"), picture[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])
    (folder / "notes.txt").write_text("25 a second")
    table, page = tmp_path / "run.csv", tmp_path / "run.html"
    pivot = f"{film.pivot[0]},{film.pivot[1]}"
    told = ["--fps", "25", "--pivot", pivot, "--out", str(table), "--page", str(page)]
    assert main(["track", str(folder), *told]) == 0
    m = udd.read_measurement(table)
    assert len(m) == len(film.t) and m.seen.all() and page.stat().st_size > 1e4
    assert rms(errors(m, film))[:2].max() < 0.1
    with pytest.raises(TrackError, match="which have no times: give fps"):
        udd.track(folder)


def test_pictures_come_by_number_and_a_broken_one_is_damaged(tmp_path: Path) -> None:
    for k in range(12):
        cv2.imwrite(str(tmp_path / f"a{k}.png"), np.full((20, 30, 3), 20 * k, np.uint8))
    (tmp_path / "a5.png").write_bytes(b"no picture")
    film = Film(tmp_path, fps=10)
    pictures = list(film.pictures())
    assert [p.index for p in pictures] == list(range(12)) and film.broken == 1
    assert [p.damaged for p in pictures] == [k == 5 for k in range(12)]
    level = [float(np.median(p.y)) for k, p in enumerate(pictures) if k != 5]
    assert (np.diff(level) > 0).all() and pictures[11].t == pytest.approx(1.1)
    (tmp_path / "none").mkdir()
    with pytest.raises(TrackError, match="holds no pictures"):
        Film(tmp_path / "none", fps=10)
