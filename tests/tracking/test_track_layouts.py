"""Other disks than the paper's: any coloured marks, printed tags; and a plain pendulum. Truth beside."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import cv2

import udd
from film_for_tests import FPS, swinging, write
from tracked_errors import errors, rms
from udd.cli import main
from udd.film import Defects, Film
from udd.markers.layout import read_layout
from udd.tracking import TrackError, overlay, pictures_at, pixels
from udd.tracking.calibration.config import settings

SMALL = (276, 350)  # pixels: half of the paper's, 878 per metre
Marks = list[dict[str, Any]]
THREE: Marks = [
    {"at": [0.0, 0.06], "colour": "red"},
    {"at": [0.05, -0.035], "colour": "blue"},
    {"at": [-0.055, -0.02], "colour": [34, 138, 62]},
]
REPEATED: Marks = [
    {"at": [0.0, 0.06], "colour": "red"},
    {"at": [0.06, 0.0], "colour": "red"},
    {"at": [-0.04, -0.045], "colour": "red"},
    {"at": [-0.06, 0.01], "colour": "blue"},
]
TWO: Marks = [{"at": [0.0, 0.06], "colour": "magenta"}, {"at": [0.0, -0.06], "colour": "green"}]
TAGS: Marks = [
    {"tag": f"4x4_50:{k}", "at": [0.048 * math.sin(a), 0.048 * math.cos(a)], "side": 0.036}
    for k, a in enumerate(np.arange(4) * math.pi / 2)
]


def shot(path: Path, layout: Marks, seconds: float = 3.0, **more: Any) -> Film:
    run = udd.simulate(udd.Disk(0.039), np.arange(0, seconds, 0.005), [1, 0.02, -0.02, 0.3], dense=True)
    return udd.render(run, path, size=SMALL, layout=layout, **more)


@pytest.mark.parametrize(
    ("layout", "most", "lost"),
    [
        # the limits are twice what films of 3 s with other starts gave; a pixel is 1.1 mm
        (THREE, (0.06, 0.06, 0.8), 0.05),
        (REPEATED, (0.05, 0.05, 0.6), 0.03),
        (TWO, (0.3, 0.3, 5.0), 0.10),  # hidden in part, two marks leave nothing over to tell by
    ],
    ids=["three", "one colour three times", "two"],
)
def test_any_coloured_marks(layout: Marks, most: tuple[float, ...], lost: float, tmp_path: Path) -> None:
    film = shot(tmp_path / "marks.mp4", layout, defects=Defects(clutter=4))
    m = udd.track(film.path, layout=layout)
    assert m.seen.mean() >= 1 - lost
    assert np.all(rms(errors(m, film)) < most)
    # three marks and their layout set the scale: a mark's place to 0.02 pixel of 52
    assert float(m.meta["px_per_m"]) == pytest.approx(film.scale, rel=2e-3)
    assert m.quality["marks"].max() == len(layout)
    assert len(m.meta["calibration"]["mark 1"]) == 3


def test_printed_tags(tmp_path: Path) -> None:
    film = shot(tmp_path / "tags.mp4", TAGS, exposure=0.002)
    m = udd.track(film.path, layout=TAGS)
    assert m.seen.mean() > 0.95
    # edges of 100 pixels each to about 0.03 pixel, four tags: 0.01 mm; five times that for the codec
    assert np.all(rms(errors(m, film)) < (0.05, 0.05, 1.0))
    assert set(m.quality["marks"]) <= {0, 4, 8, 12, 16} and set(m.quality["method"]) <= {"fast", "none"}
    overlay(film.path, m, tmp_path / "seen.mp4")
    (seen,) = pictures_at(tmp_path / "seen.mp4", [20])
    # a frame has two rings about each of the 16 corners, the centre and the contact
    assert len(udd.plot.overlay(seen, pixels(m), 20).lines) == 2 * 16 + 2


def test_what_is_said_is_not_looked_for(tmp_path: Path) -> None:
    film = shot(tmp_path / "said.mp4", THREE, 2.0)
    config = tmp_path / "disk.toml"
    marks = "".join(
        f"[[layout]]\nat = {m['at']}\ncolour = {m['colour']!r}\n".replace("'", '"') for m in THREE
    )
    config.write_text(
        f"scale = 880\nregion = [10, 20, 270, 300]\npivot = [138.0, 165.0]\n"
        f"[calibrate]\nlayout = false\nlens = false\ntilt = false\nreadout = false\nexposure = 0.01\n{marks}"
    )
    m = udd.track(film.path, config=config)
    said = m.meta["calibration"]
    for item in ("mark 1", "scale", "lens", "tilt across", "shear", "readout", "exposure", "pivot"):
        assert said[item][1:] == [0.0, "given"], item
    assert said["scale"][0] == 880 and said["exposure"][0] == 0.01 and said["readout"][0] == 0
    assert said["pivot"][0] == [138.0, 165.0]
    assert said["W"][2] == "rolling constraint" and abs(said["W"][0] / 0.039 - 1) < 0.02
    # the marks stand to each other just as the layout says
    at = np.array([said[f"mark {k}"][0] for k in (1, 2, 3)])
    sides = [
        np.abs(np.hypot(*(z - np.roll(z, 1, axis=0)).T)) for z in (at, np.array([m["at"] for m in THREE]))
    ]
    assert np.ptp(sides[0] / sides[1]) < 1e-9
    result = udd.track(film.path, layout=THREE).meta["calibration"]
    for item in ("mark 1", "scale", "exposure", "pivot", "W"):
        assert result[item][1] is not None and result[item][1] > 0, item
    assert abs(result["exposure"][0] - 0.01) < 4 * result["exposure"][1] + 1e-3


def test_nothing_outside_the_region_is_looked_at(tmp_path: Path) -> None:
    film = shot(tmp_path / "region.mp4", THREE, 1.2)
    with pytest.raises(TrackError, match="no disk with marks in the layout's colours was found"):
        udd.track(film.path, layout=THREE, region=(0, 200, 270, 349))
    with pytest.raises(TrackError, match="lies outside the picture of 276 x 350"):
        udd.track(film.path, layout=THREE, region=(900, 900, 950, 950))


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ([THREE[0]], "list of two marks or more"),
        ([{"at": [0, 1]}, THREE[0]], "mark 1 must say at = [y, z] and colour"),
        ([THREE[0], {"at": [0, "x"], "colour": "red"}], "at of mark 2 must be two numbers"),
        ([THREE[0], {"at": [0.05, 0], "colour": "mauve"}], "colour of mark 2 must be one of red, orange"),
        ([THREE[0], {"at": [0.05, 0], "colour": [1, 2, 999]}], "from 0 to 255"),
        ([THREE[0], {"at": [0.05, 0], "colour": [90, 90, 92]}], "mark 2 has no colour"),
        ([THREE[0], {"at": [0.0, 0.06], "colour": "blue"}], "in the same place"),
        ([THREE[0], {"at": [0.0, -0.06], "colour": "red"}], "look the same when the disk is turned"),
        ([{"tag": "4x4_50:50", "at": [0, 0], "side": 0.03}], "has tags 0 to 49, not 50"),
        ([{"tag": "9x9:1", "at": [0, 0], "side": 0.03}], "no dictionary '9x9'"),
        ([{"tag": "4x4_50:1", "at": [0, 0]}], "must say tag, at = [y, z] and side"),
        ([{"tag": "4x4_50:1", "at": [0, 0], "side": -1}], "side of mark 1 must be a positive"),
        ([TAGS[0], TAGS[0]], "a tag occurs twice"),
    ],
)
def test_layouts_that_cannot_be(said: Any, why: str) -> None:
    with pytest.raises(TrackError, match=re.escape(why)) as error:
        settings({"layout": said})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({"calibrate": {"zoom": True}}, "calibrate has no 'zoom'; it has layout"),
        ({"calibrate": {"tilt": 0.1}}, "tilt must be true or false, not 0.1"),
        ({"calibrate": {"exposure": 4}}, "exposure must be true, false or from 0 to 0.1 s, not 4"),
        ({"calibrate": True}, "calibrate must be a table"),
        ({"region": [0, 0, 5]}, "region must be four numbers"),
        ({"region": [9, 0, 5, 8]}, "growing"),
        ({"scale": 0}, "scale must be a positive number of pixels per metre, not 0"),
        ({"bob": "pink"}, "bob must be one of red"),
        ({"bob": ["red", "red"]}, "two bobs need two colours"),
    ],
)
def test_settings_that_cannot_be(said: dict[str, Any], why: str) -> None:
    with pytest.raises(TrackError, match=re.escape(why)):
        settings(said)


def test_contradictions_are_named(tmp_path: Path) -> None:
    film = tmp_path / "none.mp4"  # refused before it is looked at
    with pytest.raises(TrackError, match="scale is not to be found in the film, so it must be given"):
        udd.track(film, calibrate={"scale": False})
    with pytest.raises(TrackError, match="mark_distance is of the standard marks"):
        udd.track(film, layout=THREE, mark_distance=0.06)
    with pytest.raises(TrackError, match="length is a pendulum's"):
        udd.track(film, length=0.8)
    with pytest.raises(TrackError, match="layout: not for a pendulum"):
        udd.track(film, bob="red", layout=THREE)


def test_places_are_right_and_up() -> None:
    layout = read_layout(THREE)
    assert layout.places[1] == complex(0.05, 0.035)  # v down
    assert abs(layout.unit).max() == 1


@pytest.fixture(scope="module")
def clock() -> Callable[[float], float]:
    run = udd.simulate(udd.Pendulum(0.8, k0=0.05), np.arange(0, 6, 0.002), [0, 0.55])
    return lambda t: float(np.interp(t + 0.1, run.t, run.state[:, 1]))


def test_a_plain_pendulum(clock: Callable[[float], float], tmp_path: Path) -> None:
    rng, exposure = np.random.default_rng(1), 0.012
    shots = [swinging(clock, k / FPS, exposure, rng) for k in range(100)]
    shots[40][:] = 0
    shots[60] = shots[59].copy()
    film = write(tmp_path / "bob.mp4", shots)
    table = tmp_path / "bob.csv"
    assert main(["track", str(film), "--bob", "red", "--length", "0.8", "--out", str(table)]) == 0
    m = udd.read_measurement(table)
    assert m.kind == "pendulum" and m.sigma is not None
    assert m.flag[40].startswith("black") and m.flag[60].startswith("dup") and m.seen.sum() == 98
    e = (m["theta"] - np.array([clock(t) for t in m.t]))[m.seen]
    # colours have half the resolution: a tenth of a pixel of 230 is 0.4 mrad
    assert np.sqrt(np.mean(e**2)) < 0.5e-3
    assert 0.6 < np.sqrt(np.mean((e / m.sigma[m.seen, 0]) ** 2)) < 1.6
    assert float(m.meta["exposure"]) == pytest.approx(exposure, rel=0.2)
    # an arc of 30 degrees each side: 5 standard errors
    at, sigma, _ = m.meta["calibration"]["pivot"]
    assert np.hypot(at[0] - 158.3, at[1] - 61.7) < 5 * sigma < 1.5
    assert float(m.meta["px_per_m"]) == pytest.approx(230 / 0.8, rel=5e-3)
    where = pixels(m)
    assert np.nanmax(np.hypot(*(where.centre - where.pivot).T)) == pytest.approx(230, rel=5e-3)
    overlay(film, m, tmp_path / "seen.mp4")
    fit = udd.fit(m, udd.Pendulum(0.8, k0=0.02), free=["k0", "length"])
    assert fit.parameters["length"] == pytest.approx(0.8, rel=0.01)  # 4 s of swinging


def test_a_pendulum_that_is_not_there(clock: Callable[[float], float], tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    film = write(tmp_path / "bob.mp4", [swinging(clock, k / FPS, 0.0, rng) for k in range(30)])
    with pytest.raises(TrackError, match="no bob of that colour moves"):
        udd.track(film, bob="blue")


def test_a_bob_that_grows_in_the_light_is_not_lost(clock: Callable[[float], float], tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    sizes = [13 * (1 + 0.08 * clock(k / FPS)) for k in range(60)]  # its area by 8 % each side
    shots = [swinging(clock, k / FPS, 0.0, rng, radius=size) for k, size in enumerate(sizes)]
    film, table = write(tmp_path / "bob.mp4", shots), tmp_path / "bob.csv"
    assert main(["track", str(film), "--bob", "200,38,44", "--out", str(table)]) == 0
    m = udd.read_measurement(table)
    assert m.seen.mean() > 0.97
    assert np.nanstd(m["theta"] - np.array([clock(t) for t in m.t])) < 1e-3


def test_a_path_that_is_no_circle_is_refused(clock: Callable[[float], float], tmp_path: Path) -> None:
    """The lower bob of a double pendulum has such a path."""
    rng = np.random.default_rng(4)
    long = [200 + 30 * np.sin(0.9 * k) for k in range(60)]
    shots = [swinging(clock, k / FPS, 0.0, rng, long=each) for k, each in enumerate(long)]
    with pytest.raises(TrackError, match="the bob's path is no circle"):
        udd.track(write(tmp_path / "bob.mp4", shots), bob="red")


def test_a_pendulum_filmed_by_hand(clock: Callable[[float], float], tmp_path: Path) -> None:
    """Its background has nothing but a patch to hold on to in `swinging`, so there is more of it here."""
    rng, wall = np.random.default_rng(5), np.random.default_rng(6)
    spots = wall.uniform([10, 10], [310, 50], (30, 2)).round().astype(int)
    moved = [(4 * np.sin(0.31 * k), 3 * np.sin(0.23 * k + 1)) for k in range(60)]
    shots = []
    for k, (du, dv) in enumerate(moved):
        picture = swinging(clock, k / FPS, 0.0, rng)
        for u, v in spots:
            picture[v - 3 : v + 3, u - 3 : u + 3] = 40
        view = np.array([[1, 0, du], [0, 1, dv]])
        shots.append(cv2.warpAffine(picture, view, picture.shape[1::-1], borderMode=cv2.BORDER_REPLICATE))
    with pytest.warns(UserWarning, match="the camera moved"):
        m = udd.track(write(tmp_path / "hand.mp4", shots), bob="red")
    off = m["theta"] - np.array([clock(t) for t in m.t])
    assert m.seen.mean() > 0.9 and np.nanstd(off) < 1.5e-3  # a pixel is 4.3 mrad
