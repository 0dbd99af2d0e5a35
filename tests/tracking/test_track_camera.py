"""Films by cameras that move, zoom or change their exposure, and films of more than the disk."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import udd
from small_films import SMALL, shot
from tracked_errors import errors, rms
from udd.errors import UddError
from udd.film import Defects
from udd.measurement import read_measurement
from udd.tracking import pictures_at, pixels
from udd.tracking.correction import Correction
from udd.tracking.detection.background import Background
from udd.tracking.detection.camera_motion import CameraMotion
from udd.video.reader import Picture, light_of_codes

COLOURS = ((200, 38, 44), (240, 134, 36), (30, 78, 186), (34, 138, 62))
MARKS = [{"at": [0.0, 0.06], "colour": "purple"}, {"at": [0.02, -0.055], "colour": "cyan"}]


@pytest.mark.parametrize(
    ("defects", "said"),
    [
        ({"shake": 8.0}, "the camera moved"),
        ({"bumps": ((1.5, 9.3, -5.4), (2.5, 0.0, 0.0))}, "the camera moved"),
        ({"zooms": ((1.5, 1.25),)}, "the camera zoomed, by 25 %"),
        ({"gains": ((1.5, 0.7), (2.5, 1.0))}, "the light of the pictures changes"),
    ],
)
def test_what_the_camera_does_is_undone_and_reported(defects: Any, said: str, tmp_path: Path) -> None:
    film = shot(tmp_path / "moved.mp4", defects=Defects(**defects))
    with pytest.warns(UserWarning, match=said):
        m = udd.track(film.path)
    e = rms(errors(m, film))
    # a steady camera: 0.02 mm and 0.3 mrad; the motion is known to 0.02 pixels of 1.1 mm, about its mean
    assert e[0] < 0.07 and e[1] < 0.07 and e[2] < 3 and m.seen.mean() > 0.96
    m.to_csv(tmp_path / "moved.csv")
    back = read_measurement(tmp_path / "moved.csv")
    # drawn upon the film as it was measured, the marks lie on the marks
    where, row = pixels(back), int(np.flatnonzero(back.seen)[-3])
    picture = pictures_at(film.path, [row], back)[0].astype(int)
    red, blue = (picture[tuple(np.round(where.marks[row, k][::-1]).astype(int))] for k in (0, 2))
    assert red[0] > 2 * red[2] and blue[2] > 1.5 * blue[0]


@pytest.mark.parametrize("defects", [{"hands": ((1.0, 1.6),)}, {"walkers": ((1.2, 2.2), (2.4, 0.6))}])
def test_a_steady_camera_is_left_alone(defects: Any, tmp_path: Path) -> None:
    film = shot(tmp_path / "steady.mp4", defects=Defects(**defects))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        m = udd.track(film.path)
    assert "camera_u" not in m.quality and "camera_moved_px" not in m.meta
    e = rms(errors(m, film))
    assert e[0] < 0.05 and e[1] < 0.05 and e[2] < 1 and m.seen.mean() > 0.8


@pytest.mark.parametrize("size", [0.5, 1.0, 1.6])
def test_a_picture_of_the_device_is_not_tracked(size: float, tmp_path: Path) -> None:
    view: Any = {"size": (560, 400), "scale": 875.0, "pivot": (400.0, 200.0)}
    film = shot(tmp_path / "poster.mp4", 2.4, defects=Defects(poster=size), **view)
    m = udd.track(film.path)
    e = rms(errors(m, film))
    assert e[0] < 0.05 and e[1] < 0.05 and e[2] < 1 and m.seen.all()


def bookshelf(width: int, height: int) -> np.ndarray:
    """Books in all colours, most of them larger than a mark, with pale labels."""
    random = np.random.default_rng(5)
    wall = np.full((height, width, 3), 70.0)
    for top in range(0, height, 60):
        left = 0
        while left < width:
            wide = int(random.integers(8, 18))
            wall[top + 4 : top + 59, left : left + wide] = random.integers(30, 235, 3)
            wall[top + 20 : top + 30, left + 2 : left + wide - 2] = random.integers(180, 250, 3)
            left += wide
    return wall


def test_books_in_the_colours_of_the_marks_are_not_marks(tmp_path: Path) -> None:
    """The fourteen largest patches of each colour were books, so that the film was refused."""
    film = shot(tmp_path / "books.mp4", background=bookshelf(*SMALL), defects=Defects(shake=2.0))
    with pytest.warns(UserWarning, match="the camera moved"):
        m = udd.track(film.path)
    e = rms(errors(m, film))
    assert m.seen.mean() > 0.97 and e[0] < 0.1 and e[1] < 0.1 and e[2] < 2


def test_a_mirrored_film_is_turned_around(tmp_path: Path) -> None:
    film = shot(tmp_path / "selfie.mp4", defects=Defects(mirrored=True))
    with pytest.warns(UserWarning, match="mirrored"):
        m = udd.track(film.path, pivot=(SMALL[0] - 1 - film.pivot[0], film.pivot[1]))
    e = rms(errors(m, film))
    assert e[0] < 0.05 and e[1] < 0.05 and e[2] < 1 and m.seen.all()
    assert m.meta["mirrored"] and float(m.meta["pivot_u"]) == pytest.approx(film.pivot[0], abs=1e-6)


def test_what_never_moves_is_refused_if_something_else_does(tmp_path: Path) -> None:
    """Four squares on the wall, and a disk of two marks."""
    wall = np.full((SMALL[1], SMALL[0], 3), 150.0)
    for (du, dv), colour in zip(((0, -30), (30, 0), (0, 30), (-30, 0)), COLOURS, strict=True):
        wall[300 + dv - 7 : 300 + dv + 7, 50 + du - 7 : 50 + du + 7] = colour
    film = shot(tmp_path / "wall.mp4", background=wall, layout=MARKS)
    with pytest.raises(UddError, match="never moves, but something else does"):
        udd.track(film.path)
    # said, the disk's own marks are tracked
    e = rms(errors(udd.track(film.path, layout=MARKS, pivot=film.pivot), film))
    assert e[0] < 0.2 and e[1] < 0.2


def test_a_disk_at_rest_is_measured(tmp_path: Path) -> None:
    class Rest:
        t = np.arange(0, 2.4, 0.01)
        state = np.tile([0.0, 0.001, -0.02, 0.4], (240, 1))

    film = udd.render(Rest(), tmp_path / "rest.mp4", size=SMALL)
    m = udd.track(film.path, pivot=film.pivot)
    assert np.nanmax(np.abs(errors(m, film)[:, :2])) < 0.2


@pytest.mark.parametrize(
    ("view", "defects", "limit"),
    [
        ({"size": (118, 150)}, {}, 0.1),  # a disk of 60 pixels
        ({"size": (320, 240)}, {}, 0.1),
        ({}, {"gains": ((0.0, 0.12),)}, 0.05),
    ],
)
def test_small_and_dim_films_are_measured(view: Any, defects: Any, limit: float, tmp_path: Path) -> None:
    """They were refused, as having no scale, even if the scale was given."""
    film = shot(tmp_path / "small.mp4", defects=Defects(**defects), **view)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        m = udd.track(film.path)
    e = rms(errors(m, film))
    assert e[0] < limit and e[1] < limit and m.seen.all()


def test_a_camera_rests_between_bumps() -> None:
    n, middle = 60, 100 + 80j
    shift = np.where(np.arange(n) < 30, 0, 9.3 - 5.4j) + 0.01 * np.random.default_rng(1).normal(size=n)
    sigma = np.full((n, 3), 1e-3) * [5.0, 5.0, 0.05]
    bumped = CameraMotion(np.ones(n, complex), shift, np.ones(n), sigma, middle)
    assert not bumped.steady
    assert np.array_equal(np.flatnonzero(~bumped.resting), [28, 29, 30, 31])
    at = np.full(n, middle)
    place = np.array([np.hypot(*cause[:, :2].T) for cause in bumped.errors(at)])
    assert place[:, 10].max() == pytest.approx(5e-3) and place[:, 30].max() > 7e-3  # only a view that changes
    held = CameraMotion(np.ones(n, complex), 2.0 * np.sin(np.arange(n)) + 0j, np.ones(n), sigma, middle)
    assert not held.resting.any()


def test_a_resting_camera_has_its_mean_view() -> None:
    rng, n, middle = np.random.default_rng(2), 120, 100 + 80j
    place = np.where(np.arange(n) < 50, 0, 9.3 - 5.4j)
    noise = 0.01 * (rng.normal(size=n) + 1j * rng.normal(size=n))
    sigma = np.full((n, 3), 1e-2) * [1, 1, 0.01]
    bumped = CameraMotion(np.ones(n, complex), place + noise, np.ones(n), sigma, middle).rested()
    assert np.ptp(bumped.shift[:50]) == 0 and np.ptp(bumped.shift[50:]) == 0
    assert abs(bumped.shift[60] - (9.3 - 5.4j)) < 0.005
    assert bumped.sigma[60, 0] == pytest.approx(0.01, rel=0.3)
    sway = 2.0 * np.sin(np.arange(n) / 4) + 0j
    hand = CameraMotion(np.ones(n, complex), sway, np.ones(n), sigma, middle)
    assert np.allclose(hand.rested().shift, sway, atol=1e-12)


def test_unknown_first_views_are_those_of_the_first_known() -> None:
    shift = np.array([np.nan, np.nan, 3, np.nan, 5]) + 0j
    gain, sigma = np.array([np.nan, np.nan, 0.6, 0.6, np.nan]), np.full((5, 3), 1e-3)
    motion = CameraMotion(np.ones(5, complex), shift, gain, sigma, 100 + 80j)
    correction = motion.correction(Correction())
    assert correction.shift.tolist() == [3, 3, 3, 3, 5]
    assert correction.gain.tolist() == [0.6] * 5  # a resting camera may have a view without its light


def test_a_picture_without_points_shows_no_motion() -> None:
    grey = np.full((60, 80), 128, np.uint8)
    background = Background(grey, light_of_codes(False))
    assert not len(background.points)
    chroma = np.full((30, 40), 128, np.uint8)
    assert not background.learned([Picture(k, k / 25, grey, chroma, chroma) for k in range(5)])


def test_a_plain_wall_shows_a_zoom(tmp_path: Path) -> None:
    grey = np.full((350, 276, 3), 150.0)
    grey[:, :, 0] += np.linspace(0, 25, 276)[None] + 6 * np.sin(np.arange(350) / 9)[:, None]
    film = shot(tmp_path / "plain.mp4", background=grey, support=0.4, defects=Defects(zooms=((1.5, 1.25),)))
    with pytest.warns(UserWarning, match="the camera zoomed, by 25 %"):
        m = udd.track(film.path)
    assert m.seen.mean() > 0.96
