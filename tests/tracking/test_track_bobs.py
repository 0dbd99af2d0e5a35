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
from udd.tracking.detection.bob import Background, Blob, BobColour, UsualArea
from udd.tracking.geometry.pose import Pose
from udd.tracking.geometry.turns import count_turns_over_the_top
from udd.tracking.passes.double_pendulum import with_lower_bob
from udd.tracking.passes.frame_loop import PoseSample, Prediction
from udd.tracking.passes.pendulum_bob import Bob, circle
from udd.video.reader import Picture

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


def test_a_lower_bob_at_almost_its_distance_is_not_the_bob() -> None:
    """A piece of a blue shirt, 6 pixels off the circle, was the bob: 1.28 rad off without a flag."""
    t = np.arange(60) / FPS
    angle = 0.9 * np.sin(5.0 * t)
    first = np.full(60, 100.0 + 100.0j)
    second = first + 105 * (np.sin(angle) + 1j * np.cos(angle))
    second += 0.3 * np.random.default_rng(1).normal(size=60)
    second[26] = first[26] + 99
    column = np.zeros((60, 1))
    upper = Measurement(t, column, column + 1e-3, None, np.array([""] * 60), {}, ["theta"])
    m = with_lower_bob(upper, first, second, 590.0, "film")
    assert m.flag[26].startswith("lost") and m.seen.sum() == 59


def test_patches_of_a_shirt_do_not_move_the_pivot() -> None:
    """One patch 250 pixels away moved it by 24 pixels."""
    angle = 0.5 * np.cos(5.0 * np.arange(90) / FPS)
    points = 158 + 61j + 125 * (np.sin(angle) + 1j * np.cos(angle))
    points += 0.2 * np.random.default_rng(1).normal(size=(90, 2)) @ [1, 1j]
    points[:3] = 310 + 17j, 305 + 160j, 20 + 380j
    path = circle(points)
    assert abs(path.centre - (158 + 61j)) < 3 and abs(path.radius - 125) < 3
    assert (np.abs(path.rest[:3]) > 20).all()


def test_the_patch_of_the_bobs_size_near_its_last_place_is_the_bob() -> None:
    """The largest patch of its colour was, such as a stripe of a shirt."""

    def picture(boxes: list[tuple[int, int, int, int]]) -> Picture:
        y, u = np.full((200, 240), 120, np.uint8), np.full((100, 120), 128, np.uint8)
        for row, column, height, width in boxes:
            y[row : row + height, column : column + width] = 80
            u[row // 2 : (row + height) // 2, column // 2 : (column + width) // 2] = 190
        return Picture(0, 0.0, y, u, np.full((100, 120), 128, np.uint8))

    behind = Background(picture([]), 1.0, np.ones((100, 120), dtype=bool), True)
    bob = Bob(behind, BobColour.of((30, 70, 190), np.array([62.0, 0.0]), True), UsualArea(24.0**2, 0.01))
    place = Pose(60.5 + 80.5j, 0.0)
    expected = Prediction(0.04, [PoseSample(0.0, place)], place)
    shirt = [(20 * k, 150, 14, 60) for k in range(6)] + [(120, 150, 24, 25), (160, 150, 24, 25)]
    (seen,) = bob.attempts(lambda _: picture([]), picture([*shirt, (70, 50, 24, 24)]), expected)
    assert isinstance(seen, Blob) and abs(seen.centre - (61.5 + 81.5j)) < 1
    (why,) = bob.attempts(lambda _: picture([]), picture(shirt[:6]), expected)
    assert isinstance(why, str) and "too large" in why
    assert [*bob.attempts(lambda _: picture([]), picture([]), expected)] == ["the bob is not seen"]


@pytest.mark.parametrize("path", [np.linspace(0, 80, 60), 1j * np.linspace(0, 80, 60)])
def test_a_straight_path_is_fitted_by_a_circle_through_all_points(path: np.ndarray) -> None:
    """No three of its points have a circle; that was a ValueError."""
    fitted = circle(100 + 50j + path)
    assert np.isfinite([fitted.centre, fitted.radius]).all()


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
