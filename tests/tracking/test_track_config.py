"""Config files of the tracker, right and wrong ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import numpy as np

import udd
from film_for_tests import FPS, RADIUS, frame, rolling, write
from udd.cli import main
from udd.tracking import TrackError
from udd.tracking.calibration.config import settings

SAMPLE = Path(udd.__file__).parent / "demo" / "sample.mp4"


def test_a_config_reaches_the_tracker_and_options_win(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(3)
    motion = rolling(1.2)
    film = write(tmp_path / "film.mp4", (frame(motion, i / FPS, 0.008, rng) for i in range(30)))
    config = tmp_path / "track.toml"
    config.write_text(f"disk_radius = {2 * RADIUS}\nfps = 50\npivot = [160, 190.5]\nrefine = false\n")
    out = tmp_path / "m.csv"
    argv = ["track", str(film), "--config", str(config), "--disk-radius", str(RADIUS), "--out", str(out)]
    assert main(argv) == 0, capsys.readouterr().err
    meta = udd.read_measurement(out).meta
    assert meta["R"] == RADIUS and meta["fps"] == 50.0
    assert (meta["pivot_u"], meta["pivot_v"], meta["pivot_from"]) == (160.0, 190.5, "given")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("pivto = [1, 2]", "a config has no 'pivto'; it has disk_radius"),
        ("pivot = 3", "pivot must be two numbers of pixels [u, v], not 3"),
        ("pivot = [1, 2, 3]", "pivot must be two numbers"),
        ('pivot = [1, "2"]', "pivot must be two numbers"),
        ('disk_radius = "80 mm"', "disk_radius must be a positive number of metres, not '80 mm'"),
        ("mark_distance = -0.065", "mark_distance must be a positive number of metres, not -0.065"),
        ("fps = true", "fps must be a positive number of frames per second, not True"),
        ("fps = nan", "fps must be a positive number of frames per second, not nan"),
        ("refine = 1", "refine must be true or false, not 1"),
        ("fps = ", "is not TOML"),
    ],
)
def test_a_wrong_config_is_named_in_one_sentence(
    text: str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "track.toml"
    config.write_text(text + "\n")
    with pytest.raises(TrackError) as error:
        udd.track(SAMPLE, config=config)
    assert says in str(error.value) and str(config) in str(error.value) and "\n" not in str(error.value)
    assert main(["track", str(SAMPLE), "--config", str(config)]) == 1
    assert says in capsys.readouterr().err


def test_a_mapping_is_a_config_too_and_a_missing_file_is_said(tmp_path: Path) -> None:
    known: dict[str, Any] = {"fps": 240, "refine": False}
    assert settings(known, fps=None, refine=True) == {"fps": 240.0, "refine": True}
    with pytest.raises(TrackError, match="a config has no 'film'"):
        udd.track(SAMPLE, config={"film": "x"})
    with pytest.raises(TrackError, match="cannot be read"):
        udd.track(SAMPLE, config=tmp_path / "nothing.toml")
