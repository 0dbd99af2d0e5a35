"""What is said of errors holds: light of mixed colours, uneven light, a wobble, frames unlike each other."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import udd
from udd.film import Defects
from udd.film.light import to_light
from udd.film.sprite import MARKS
from udd.tracking.decode import Picture, light_of_codes
from udd.tracking.find import BODY, Sight
from udd.tracking.mixing import mixed
from udd.tracking.noise import _belief
from udd.tracking.shade import evenness

WEIGHT = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


def code(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("mark", MARKS)
def test_a_mix_of_disk_and_mark_has_the_light_of_its_share(mark: tuple[int, int, int]) -> None:
    light = light_of_codes(True)
    white, full = np.full(3, 230 / 255), np.array(mark) / 255
    y, u, v = WEIGHT @ full
    ends = light[230], float(np.interp(255 * y, np.arange(256), light))
    table = mixed(light, *ends, 255 * np.array([u, v]), True)
    for share in (0.1, 0.3, 0.5, 0.8):
        mix = to_light(255 * white) * (1 - share) + to_light(255 * full) * share
        seen = float(np.interp(255 * (WEIGHT[0] @ code(mix)), np.arange(256), table))
        expected = ends[0] + share * (ends[1] - ends[0])
        assert abs(seen - expected) < 0.01 * abs(ends[1] - ends[0])  # 0.06 without; codes are whole numbers
    assert table[255] == light[255]


def test_a_mark_of_unknown_colour_or_as_bright_as_the_disk_keeps_its_light() -> None:
    light = light_of_codes(False)
    for mark, colour in ((200.0, (0.0, 0.0)), (100.0, (np.nan, np.nan))):
        assert mixed(light, 200.0, mark, np.array(colour), False) is light


def lit(slope: float) -> tuple[list[tuple[Picture, Sight]], np.ndarray]:
    """A white disk at many places under light that grows to the right, and that light."""
    rng = np.random.default_rng(0)
    u, v = np.meshgrid(np.arange(240.0), np.arange(200.0))
    shade = 1 + slope * (u / 240 - 0.5)
    light, half = light_of_codes(True), np.full((100, 120), 128, np.uint8)
    seen = []
    for k in range(40):
        centre = complex(rng.uniform(80, 160), rng.uniform(80, 120))
        here = np.abs(u + 1j * v - centre) < 70
        amount = np.where(here, 150 * rng.uniform(0.8, 1.1) * shade, 20)
        codes = np.searchsorted(light, amount) + rng.normal(0, 1, here.shape)
        picture = Picture(k, k / 25, np.clip(codes, 0, 255).astype(np.uint8), half, half)
        seen.append((picture, Sight(centre, rng.uniform(-3, 3), 50.0, 100.0)))
    return seen, shade


def test_uneven_light_is_evened_where_the_disk_comes() -> None:
    seen, shade = lit(0.4)
    even = evenness(seen, np.ones(shade.shape, dtype=bool), BODY, light_of_codes(True))
    assert even is not None
    flat = (even * shade)[60:140, 60:180]
    assert np.ptp(flat) / flat.mean() < 0.01 < 0.1 < np.ptp(shade[60:140, 60:180])


def test_even_light_is_left_alone() -> None:
    seen, shade = lit(0.0)
    assert evenness(seen, np.ones(shade.shape, dtype=bool), BODY, light_of_codes(True)) is None


def test_how_much_frames_differ_is_learned() -> None:
    rng = np.random.default_rng(1)
    spare = np.full(4000, 5)
    alike = rng.chisquare(5, 4000) / 5
    assert _belief(alike / alike.mean(), spare) > 50
    degrees = 12.0  # of the inverse variance: its mean counts as 10 coordinates
    variance = degrees / rng.chisquare(degrees, 4000)
    unlike = variance * rng.chisquare(5, 4000) / 5
    assert 7 < _belief(unlike / unlike.mean(), spare) < 14


def test_a_wobbling_disk_is_measured_as_if_it_did_not(tmp_path: Path) -> None:
    run = udd.simulate(udd.Disk(0.039), np.arange(0, 6, 0.005), [1, 0.02, -0.02, 0.3], dense=True)
    film = udd.render(run, tmp_path / "wobble.mp4", defects=Defects(wobble=math.radians(10)))
    m = udd.track(film.path)
    off = m.values[1:] - film.truth.values[1:]
    off[:, 2] -= 2 * np.pi * np.round(np.median(off[:, 2]) / (2 * np.pi))
    assert np.sqrt(np.nanmean(off[:, :2] ** 2)) < 40e-6  # 0.15 mm where the foreshortening is not undone
    assert np.sqrt(np.nanmean(off[:, 2] ** 2)) < 0.4e-3
