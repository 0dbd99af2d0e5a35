"""Bobs of any colour, grey ones too, and two in one film."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import cv2

import udd
from film_for_tests import FPS, HEIGHT, WIDTH, codes, light, write
from udd.cli import main
from udd.errors import TrackError

OVER, PIVOT = 2, (158.0, 61.0)
Colour = tuple[int, int, int]
Bob = tuple[NDArray[np.float64], NDArray[np.float64], Colour]  # u, v [pixels], colour


def swing(bobs: list[Bob], wall: Colour, radius: float = 13.0) -> list[NDArray[np.uint8]]:
    """Bobs on dark rods that hang from the pivot, one below the other, in front of a wall."""
    random, shots = np.random.default_rng(1), []
    for k in range(len(bobs[0][0])):
        image = np.broadcast_to(light(wall), (HEIGHT * OVER, WIDTH * OVER, 3)).copy()
        joint = PIVOT
        for u, v, _ in bobs:
            ends = [[round((OVER * x + 0.5) * 16) for x in point] for point in (joint, (u[k], v[k]))]
            cv2.line(image, *ends, light((60, 60, 62)).tolist(), 2 * OVER, cv2.LINE_8, 4)
            joint = (u[k], v[k])
        for u, v, colour in bobs:
            at = [round((OVER * x + 0.5) * 16) for x in (u[k], v[k])]
            cv2.circle(
                image, at, round((radius * OVER - 0.5) * 16), light(colour).tolist(), -1, cv2.LINE_8, 4
            )
        small = codes(cv2.resize(image, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)).astype(float)
        noisy = small + random.normal(0, 1.5, small.shape)
        shots.append(np.clip(np.round(noisy), 0, 255).astype(np.uint8))
    return shots


def arc(angle: NDArray[np.float64], length: float, about: tuple[NDArray[np.float64] | float, ...] = PIVOT):
    return about[0] + length * np.sin(angle), about[1] + length * np.cos(angle)


def clock(frames: int = 45) -> NDArray[np.float64]:
    return 0.6 * np.cos(2 * np.pi * 0.9 * np.arange(frames) / FPS)


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
