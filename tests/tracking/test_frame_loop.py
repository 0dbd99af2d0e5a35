"""The loop over the frames, and what makes it fast: parts of pictures, one run for two rounds, reduction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import cv2

import udd
from small_films import shot
from udd.tracking.correction import Correction
from udd.tracking.detection import background as still
from udd.tracking.geometry.pose import Pose
from udd.tracking.passes.frame_loop import PoseSample, Prediction, Target, follow
from udd.video.reader import Box, Film, Picture


def wall(height: int, width: int) -> np.ndarray[Any, np.dtype[np.uint8]]:
    rough = np.random.default_rng(1).integers(40, 200, (height // 12, width // 12), dtype=np.uint8)
    return np.asarray(cv2.resize(rough, (width, height), interpolation=cv2.INTER_CUBIC), np.uint8)


class Spot(Target[complex, tuple[str, complex | None]]):
    """A bright pixel; the second attempt finds what the first overlooks."""

    def __init__(self) -> None:
        self.tried: list[str] = []
        self.boxes: list[Box | None] = []

    def box(self, poses: Sequence[Pose], shape: tuple[int, ...]) -> Box | None:
        return (0, 8, 0, 8)

    def surroundings(self, pose: Pose) -> tuple[Any, int, float]:
        return np.array([pose.centre]), 6, 0.0

    def attempts(
        self, corrected: Any, picture: Picture, expected: Prediction | None
    ) -> Iterator[complex | str]:
        for name, level in (("bright", 150), ("pale", 90)):
            self.tried.append(name)
            at = np.argwhere(picture.y > level)
            yield complex(at[0][1], at[0][0]) if len(at) == 1 else f"no {name} pixel"

    def sample(self, seen: complex, expected: Prediction | None, t: float) -> PoseSample:
        return PoseSample(t, Pose(seen, 0.0))

    def row(self, t: float, flag: str, seen: complex | None) -> tuple[str, complex | None]:
        return flag, seen


def test_a_frame_is_a_list_of_attempts() -> None:
    places, levels = [4, 10, 16, 16, 22, 28], [200, 200, 200, 200, 100, 60]
    pictures = []
    for k, (column, level) in enumerate(zip(places, levels, strict=True)):
        light = np.uint8(2 * column)  # changes by more than a copy may
        y = np.tile(np.arange(32, dtype=np.uint8), (32, 1)) + light
        y[10, column] = level
        chroma = np.full((16, 16), 128, np.uint8)
        pictures.append(Picture(k, k / 25, y, chroma, chroma))
    asked: list[Box | None] = []

    def corrected(picture: Picture, box: Box | None) -> Picture:
        asked.append(box)
        return picture

    spot = Spot()
    film: Any = SimpleNamespace(uncorrected=lambda: iter(pictures), corrected=corrected)
    (rows,) = follow(film, [spot], lambda picture, pose: None)
    assert [seen for _, seen in rows] == [4 + 10j, 10 + 10j, 16 + 10j, None, 22 + 10j, None]
    assert [flag[:14].rstrip() for flag, _ in rows] == ["", "", "", "dup: the frame", "", "lost: no pale"]
    assert spot.tried == ["bright"] * 4 + ["pale", "bright", "pale"]
    assert asked == [None] + [(0, 8, 0, 8)] * 5  # without a prediction all of the picture


def test_a_part_of_a_picture_is_corrected_as_the_whole() -> None:
    y = wall(120, 160)
    raw = Picture(0, 0.0, y, y[::2, ::2].copy(), y[1::2, 1::2].copy())
    gain = np.array([0.8])
    moved = Correction(0, False, np.array([1.01 + 0.02j]), np.array([3.3 - 2.1j]), gain)
    whole, part = moved(raw), moved(raw, (20, 80, 40, 100))
    for name, step in (("y", 1), ("u", 2), ("v", 2)):
        box = slice(20 // step, 80 // step), slice(40 // step, 100 // step)
        a, b = getattr(whole, name).astype(int), getattr(part, name).astype(int)
        assert np.abs(a[box] - b[box]).max() <= 3 and np.abs(a - b).max() > 30
    outside = moved(raw, (0, 120, 160, 160))  # the disk has left the picture
    assert (outside.u == moved(raw, (0, 0, 0, 0)).u).all()
    turned = replace(moved, turns=1)
    assert (turned(raw, (20, 80, 40, 100)).y == turned(raw).y).all()


@pytest.mark.parametrize(("reduction", "coarseness"), [(1, 1), (2, 1), (3, 1), (1, 2), (1, 3), (2, 2)])
def test_the_background_of_a_large_picture_is_followed_in_a_reduced_one(
    reduction: int, coarseness: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = (600, 720)
    monkeypatch.setattr(still, "LARGE", 0.99 * 600 * 720 / reduction**2)
    monkeypatch.setattr(still, "SMALL", 0.98 * 600 * 720 / (reduction * coarseness) ** 2)
    first = wall(*size)
    factor, shift = 1.002 * np.exp(0.003j), 5.3 - 3.7j
    view = np.array([[factor.real, -factor.imag, shift.real], [factor.imag, factor.real, shift.imag]])
    then = np.asarray(cv2.warpAffine(first, view, size[::-1], borderMode=cv2.BORDER_REPLICATE), np.uint8)
    chroma = np.full((2, 2), 128, np.uint8)
    background = still.Background(first, np.arange(256.0))
    assert (background.reduction, background.coarseness) == (reduction, coarseness)
    motion = background.follow([Picture(k, k / 25, y, chroma, chroma) for k, y in enumerate((first, then))])
    # both are against the mean of the two views
    for at in (100 + 80j, 600 + 500j):
        there = motion.factor[1] * (at - motion.shift[0]) / motion.factor[0] + motion.shift[1]
        assert abs(there - (factor * at + shift)) < 0.05 * reduction


def test_streaks_are_refined_twice_in_one_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    film = shot(tmp_path / "fast.mp4", 1.0, (14, 0.03, -0.02, 0.3), exposure=0.035)
    runs, original = [], Film.uncorrected
    monkeypatch.setattr(Film, "uncorrected", lambda *a: runs.append(1) or original(*a))
    m = udd.track(film.path)
    assert np.nanmax(m.quality["blur_px"]) > 25 and (m.quality["method"] == "refined").mean() > 0.5
    assert len(runs) == 3  # survey, first pass, second pass
