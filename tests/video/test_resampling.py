"""Resampled pictures lie where the map says, by any fraction of a pixel."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the tracker's extra is not installed")

from udd.tracking.correction import Correction
from udd.video import resampling
from udd.video.reader import Picture
from udd.video.resampling import resampled

PERIOD = 20.0  # pixels of a wave


def wave(shift: float) -> np.ndarray:
    return np.tile(128 + 90 * np.sin(2 * np.pi * (np.arange(240) + shift) / PERIOD), (40, 1))


def phase(row: np.ndarray) -> float:
    """Displacement of a row of a wave [pixels]."""
    x = np.arange(60, 180)
    return float(
        np.angle((row[60:180] - row[60:180].mean()) @ np.exp(-2j * np.pi * x / PERIOD)) * PERIOD / 2 / np.pi
    )


@pytest.mark.parametrize("shift", [0.1, 0.3, 0.33, 0.45, 3.7, 5.0])
def test_a_picture_is_moved_by_what_is_asked(shift: float) -> None:
    moved = resampled(wave(0.0), np.array([[1.0, 0.0, shift], [0.0, 1.0, 0.0]]))
    off = phase(moved[20]) - phase(wave(shift)[20])
    assert abs(off) < 1e-3  # OpenCV's cubic: 0.04 at 0.3
    plane = np.rint(wave(0.0)).astype(np.uint8)
    grey = np.full((20, 120), 128, np.uint8)
    steady = Correction(factor=np.ones(1, complex), shift=np.array([shift + 0j]))(
        Picture(0, 0.0, plane, grey, grey)
    )
    assert abs(phase(steady.y[20].astype(float)) - phase(wave(shift)[20])) < 6e-3  # codes are whole numbers


def test_whole_pixels_change_nothing_else() -> None:
    picture = np.random.default_rng(1).random((30, 40, 3)).astype(np.float32)
    moved = resampled(picture, np.array([[1.0, 0.0, 3.0], [0.0, 1.0, -2.0]]))
    assert np.array_equal(moved[2:, :-3], picture[:-2, 3:])
    assert np.array_equal(moved[0], moved[1])  # beyond the edge its value


def test_a_large_picture_is_resampled_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.random.default_rng(1).integers(0, 256, (90, 130, 3)).astype(np.float32)
    view = np.array([[1.01, -0.03, 4.3], [0.03, 1.01, -2.7]])
    whole = resampled(picture, view)
    monkeypatch.setattr(resampling, "PART", 130 * 11)
    assert np.abs(resampled(picture, view) - whole).max() < 0.05  # of codes that jump by 255
    part = resampled(picture, view + np.column_stack([np.zeros((2, 2)), view[:, :2] @ [40, 20]]), (30, 25))
    assert np.abs(part - whole[20:45, 40:70]).max() < 0.05
    assert resampled(picture, view, (0, 5)).shape == (5, 0, 3)
    codes = resampled(picture.astype(np.uint8), view)
    assert codes.dtype == np.uint8 and (codes == np.clip(np.rint(resampled(picture, view)), 0, 255)).all()
