"""Reasons for which films are refused: what was seen in them, and what to try."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import cv2

import udd
from film_for_tests import write
from udd.errors import UddError
from udd.tracking.detection.bob import UsualArea
from udd.tracking.detection.colour_blobs import COLOURS

Picture = NDArray[np.uint8]
FRAMES = 14
PAINTS = {"red": (214, 40, 40), "orange": (245, 140, 20), "blue": (40, 80, 200), "green": (40, 150, 70)}


def room(draw: Callable[[Picture, int], object], light: float = 1.0) -> list[Picture]:
    """A wall with stripes, and something before it."""
    pictures = []
    for k in range(FRAMES):
        wall = np.full((350, 276, 3), 150, np.uint8)
        wall[::40], wall[:, ::50] = 120, 170
        draw(wall, k)
        pictures.append(np.round(light * wall).astype(np.uint8))
    return pictures


def nothing(wall: Picture, k: int) -> None:
    pass


def a_blue_coat(wall: Picture, k: int) -> None:
    wall[100:340, 3 * k : 3 * k + 60] = (60, 90, 180)


def notes_on_the_wall(wall: Picture, k: int) -> None:
    """Patches in all colours in a row, and a plain disk that moves."""
    for j, colour in enumerate(PAINTS.values()):
        wall[20:35, 15 + 60 * j : 30 + 60 * j] = colour
    cv2.circle(wall, (60 + 4 * k, 200), 40, (230, 225, 215), -1)


@pytest.mark.parametrize(
    ("draw", "light", "words"),
    [
        (nothing, 1.0, "no frame has a patch in any of these colours"),
        (nothing, 0.1, "the film is dark"),
        (a_blue_coat, 1.0, "red 0, orange 0, blue 14, green 0; show all of the marks"),
        (notes_on_the_wall, 1.0, "red 14, orange 14, blue 14, green 14, but never as on a disk"),
    ],
)
def test_a_film_without_a_disk_says_what_was_seen(
    draw: Callable[[Picture, int], object], light: float, words: str, tmp_path: Path
) -> None:
    film = write(tmp_path / "film.mp4", room(draw, light))
    with pytest.raises(UddError, match=words) as caught:
        udd.track(film)
    assert len(str(caught.value)) - len(str(tmp_path)) <= 300 and set(PAINTS) == set(COLOURS)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (lambda t: (40 + 60 * t, 100 + 0.02 * t), "path is almost straight"),  # it rolls along a shelf
        (lambda t: (150 - 90 * np.sin(t - 1), 170 - 90 * np.cos(t - 1)), "stays above the centre"),
    ],
)
def test_what_does_not_hang_is_no_pendulum(
    path: Callable[[float], tuple[float, float]], words: str, tmp_path: Path
) -> None:
    def draw(wall: Picture, k: int) -> None:
        at = tuple(round(16 * x) for x in path(k / 12))
        cv2.circle(wall, at, 13 * 16, PAINTS["red"], -1, cv2.LINE_AA, 4)

    film = write(tmp_path / "film.mp4", room(draw) + room(draw)[::-1])
    with pytest.raises(UddError, match=words):
        udd.track(film, bob="red")


def test_the_colour_of_what_moves_is_given(tmp_path: Path) -> None:
    def draw(wall: Picture, k: int) -> None:
        cv2.circle(wall, (60 + 6 * k, 170), 13, (20, 50, 30), -1)

    film = write(tmp_path / "film.mp4", room(draw))
    with pytest.raises(UddError, match=r"no bob of that colour moves .* codes (19|20|21),(49|50|51),3[01]:"):
        udd.track(film, bob="green")


def test_a_bob_that_is_not_used_says_why() -> None:
    """A blurred dot in full view was "not seen, or partly hidden"."""
    usual, small = UsualArea(70, 0.01), UsualArea(70, 0.09)
    assert usual.unlike(68, [70]) == ""
    assert "too small" in usual.unlike(50, [62]) and "too large" in usual.unlike(100, [70])
    # the area of a bob of nine pixels scatters
    assert "too small" in usual.unlike(60, [70]) and "too large" in usual.unlike(82, [70])
    assert small.unlike(60, [70]) == small.unlike(82, [70]) == ""
    assert "too small" in small.unlike(40, [70]) and "too large" in small.unlike(100, [70])
