"""Options of a film, and the list of calibrated items."""

from __future__ import annotations

import inspect
import re
from dataclasses import FrozenInstanceError, fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import udd
from film_for_tests import FPS, RADIUS, frame, rolling, write
from udd.calibration_items import ITEMS, SWITCHES, Calibrate, Estimate, table
from udd.cli import main
from udd.errors import UddError
from udd.tracking import TrackError, TrackOptions
from udd.tracking.calibration.config import read_options, settings

OLD = (
    *("disk_radius", "mark_distance", "fps", "pivot", "refine", "layout", "scale", "region"),
    *("calibrate", "sigma", "apart", "bob", "length", "leave_out", "clicks"),
)


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rng, motion = np.random.default_rng(7), rolling(2.4)
    shots = [frame(motion, k / FPS, 0.008, rng) for k in range(40)]
    return write(tmp_path_factory.mktemp("film") / "f.mp4", shots)


def test_a_signature_has_twelve_parameters_and_takes_all_that_it_took() -> None:
    assert len(inspect.signature(udd.track).parameters) <= 12
    assert tuple(sorted(f.name for f in fields(TrackOptions) if f.init)) == tuple(sorted(OLD))
    missing = Path("none.mp4")
    for name, value in {"mark_distance": 0.06, "region": (0, 0, 9, 9), "apart": (1, 2, 0.1)}.items():
        given: dict[str, Any] = {name: value}
        with pytest.raises(TrackError, match=r"none\.mp4"):
            udd.track(missing, **given)
    with pytest.raises(TypeError, match="zoom"):
        udd.track(missing, **{"zoom": 2})


def test_options_are_read_once_and_do_not_change() -> None:
    options = read_options({"pivot": [275, 310.5], "calibrate": {"lens": False}}, disk_radius=RADIUS)
    assert options.pivot == (275.0, 310.5) and options.calibrate == Calibrate(lens=False)
    assert read_options(options, fps=50.0) == TrackOptions(
        disk_radius=RADIUS, pivot=(275.0, 310.5), calibrate=Calibrate(lens=False), fps=50.0
    )
    with pytest.raises(FrozenInstanceError):
        options.fps = 25.0  # type: ignore[misc]
    with pytest.raises(TrackError, match="pivot must be two numbers of pixels"):
        TrackOptions(pivot=(1.0, float("nan")))


def test_options_and_keywords_measure_the_same(film: Path) -> None:
    one = udd.track(film, disk_radius=RADIUS, refine=False, calibrate={"lens": 0.0})
    other = udd.track(
        film, config=TrackOptions(disk_radius=RADIUS, refine=False, calibrate=Calibrate(lens=0.0))
    )
    assert np.array_equal(one.values, other.values, equal_nan=True) and one.meta == other.meta
    # each row is an item's, and each item has its rows
    rows = list(one.meta["calibration"])
    assert all(sum(item.has(row) for item in ITEMS) == 1 for row in rows)
    assert all(any(item.has(row) for row in rows) for item in ITEMS)
    assert one.meta["calibration"]["lens"] == [0.0, 0.0, "given"]


def test_the_list_is_what_command_and_config_know(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["track", "--help"])
    told = " ".join(capsys.readouterr().out.split())
    for item in SWITCHES:
        assert f"{item.name} [{item.unit}]" in told if item.unit else item.name in told
        assert settings({"calibrate": {item.name: False}})["calibrate"] == Calibrate(**{item.name: False})
        if item.numbers is not None:
            with pytest.raises(TrackError, match=f"{item.name} must be true, false or from"):
                settings({"calibrate": {item.name: item.numbers[1] + 1}})


def test_a_table_is_in_order_and_knows_what_is_not_known() -> None:
    rows = table({"wobble": Estimate(np.nan, np.inf, "no"), "mark 1": Estimate([1.0, np.nan], 0.0, "given")})
    assert list(rows.items()) == [("mark 1", [[1.0, None], 0.0, "given"]), ("wobble", [None, None, "no"])]


def test_a_config_of_tags_or_of_a_bob_stays_one() -> None:
    tags = TrackOptions(layout=[{"at": [0.03, 0.0], "tag": "4x4_50:7", "side": 0.02}])
    assert read_options(tags) is tags
    again = read_options(tags, scale=1500.0)
    assert again.scale == 1500.0 and again.tags == tags.tags and again.layout == tags.layout
    bob = TrackOptions(bob="red", length=1.0)
    assert read_options(bob, length=1.2).length == 1.2 and read_options(bob, length=1.2).layout == bob.layout


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("leave_out", "3,x", "leave_out must be numbers of frames"),
        ("leave_out", [[20, 10]], "leave_out must be numbers of frames"),
        ("leave_out", [1.5], "leave_out must be numbers of frames"),
        ("clicks", {"marks": [[1, 2, 3]]}, "marks must have places u, v"),
        ("clicks", {"mark": [[1, 2]]}, "clicks has no 'mark'"),
        ("clicks", {"points": [[1, 2], [3, 4]]}, "points must be two, with their distance"),
        ("clicks", "frame=1.5", "frame must be the number of a frame"),
        ("clicks", "pivot=1:2:3", "pivot must have places u, v"),
        ("clicks", "pivot", "clicks must be like frame=12"),
        ("clicks", {"marks": [[1, 2]] * 100}, "at most 64 points"),
    ],
)
def test_clicks_and_frames_to_leave_out_are_checked(option: str, value: Any, words: str) -> None:
    with pytest.raises(UddError, match=re.escape(words)) as caught:
        TrackOptions(**{option: value})
    assert len(str(caught.value)) <= 300
