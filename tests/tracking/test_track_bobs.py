"""Bobs of any colour, grey ones too, and two in one film."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import udd
from bob_films import Colour, arc, clock, swing
from film_for_tests import FPS, write
from udd.cli import main
from udd.errors import TrackError
from udd.measurement import Measurement
from udd.tracking.geometry.turns import count_turns_over_the_top
from udd.tracking.passes.double_pendulum import with_lower_bob

GREY_WALL, WHITE_WALL, WOODEN_WALL = (140, 145, 140), (225, 222, 215), (190, 150, 105)


@pytest.mark.parametrize(
    ("said", "colour", "wall"),
    [
        ("black", (30, 30, 33), GREY_WALL),
        ("white", (228, 226, 220), GREY_WALL),
        ("grey", (90, 92, 95), WHITE_WALL),  # not the grey of the name
        ("grey", (190, 190, 188), GREY_WALL),
        ("wood", (150, 105, 65), GREY_WALL),
        ("wood", (165, 120, 80), WHITE_WALL),
        ("brass", (170, 140, 75), GREY_WALL),
        ((24, 66, 34), (24, 66, 34), WHITE_WALL),  # dark green
        ("black", (30, 30, 33), WOODEN_WALL),
    ],
)
def test_a_pale_bob_is_followed(said: str | Colour, colour: Colour, wall: Colour, tmp_path: Path) -> None:
    theta = clock()
    film = write(tmp_path / "pale.mp4", swing([(*arc(theta, 225.0), colour)], wall))
    m = udd.track(film, bob=said)
    assert m.seen.mean() > 0.97
    off = m["theta"][m.seen] - theta[: len(m)][m.seen]
    assert np.sqrt(np.mean(off**2)) < 2e-3  # 0.3 of a pixel


def test_two_bobs_are_a_double_pendulum(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.arange(60) / FPS
    first, second = 0.5 * np.cos(5.0 * t), 0.7 * np.cos(5.0 * t) + 0.3 * np.sin(11.0 * t)
    upper = arc(first, 125.0)
    lower = arc(second, 105.0, upper)
    film = write(
        tmp_path / "double.mp4", swing([(*upper, (200, 38, 44)), (*lower, (30, 78, 186))], GREY_WALL)
    )
    table, page = tmp_path / "double.csv", tmp_path / "double.html"
    told = ["--out", str(table), "--page", str(page), "--overlay", str(tmp_path / "seen.mp4")]
    assert main(["track", str(film), "--bob", "red,blue", *told]) == 0
    m = udd.read_measurement(table, states=("th1", "th2"))
    assert m.names == ("th1", "th2") and m.seen.mean() > 0.95 and page.stat().st_size > 1e4
    for name, truth, length in (("th1", first, 125.0), ("th2", second, 105.0)):
        off = (m[name] - truth[: len(m)])[m.seen]
        assert length * np.sqrt(np.mean(off**2)) < 0.3  # pixels
        assert 0.5 < np.sqrt(np.mean((off / m["sigma_" + name][m.seen]) ** 2)) < 2
    with pytest.raises(TrackError, match="the bob's path is no circle"):
        udd.track(film, bob="blue")
    with pytest.raises(TrackError, match="no circle"):
        udd.track(film, bob=["blue", "red"])


def test_the_lower_bob_of_a_gentle_double_pendulum_is_refused(tmp_path: Path) -> None:
    t = np.arange(60) / FPS
    first, second = 0.25 * np.cos(5.0 * t), 0.3 * np.cos(5.0 * t) + 0.2 * np.sin(11.0 * t)
    upper = arc(first, 125.0)
    lower = arc(second, 105.0, upper)
    film = write(tmp_path / "gentle.mp4", swing([(*lower, (200, 38, 44))], GREY_WALL))
    with pytest.raises(TrackError, match="the bob's path is no circle"):
        udd.track(film, bob="red")


def test_a_lower_bob_at_another_distance_is_not_the_bob() -> None:
    """A shirt of its colour passed above the pivot, and all later angles were a whole turn off in silence."""
    t = np.arange(60) / FPS
    angle = 0.9 * np.sin(5.0 * t)
    first = 100 * np.exp(0.5j * np.pi) * np.ones(60)
    second = first + 80 * (np.sin(angle) + 1j * np.cos(angle))
    second[20:26], second[26] = np.nan, first[0] - 140j
    column = np.zeros((60, 1))
    upper = Measurement(t, column, column + 1e-3, None, np.array([""] * 60), {}, ["theta"])
    m = with_lower_bob(upper, first, second, 500.0, "film")
    assert not m.seen[20:27].any() and m.flag[26].startswith("lost")
    good = m.seen
    np.testing.assert_allclose(m["th2"][good], angle[good], atol=1e-9)


def test_whole_turns_in_a_gap_are_in_doubt_only_over_the_top() -> None:
    t = np.arange(200) / FPS
    swings, turns = 2.0 * np.sin(4 * t), 6.0 * t
    gap = slice(100, 140)
    for angle, doubtful in ((swings, 0), (turns, 1)):
        wrapped = np.angle(np.exp(1j * angle))
        wrapped[gap] = np.nan
        counted = count_turns_over_the_top(t, wrapped)
        assert len(counted.doubtful) == doubtful
        np.testing.assert_allclose(counted.angle[140:], angle[140:], atol=1e-9)
