"""Clicks by hand: patches found about them, the questions and the window, what comes of it in the tracker."""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from matplotlib.backend_bases import CloseEvent, KeyEvent, MouseEvent
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import udd
from film_for_tests import FPS, PIVOT, Motion, frame, write
from test_track_layouts import THREE, Marks, shot
from tracked_errors import errors, rms
from udd.calibration_items import Calibrate
from udd.cli import main
from udd.film import Defects
from udd.film import Film as Made
from udd.markers.layout import Layout, read_layout
from udd.tracking import Film, TrackError
from udd.tracking.calibration.config import settings
from udd.tracking.calibration.config_writer import write_config
from udd.tracking.calibration.rim import Rim
from udd.tracking.calibration.scale import scale
from udd.tracking.detection.survey import survey
from udd.tracking.manual.circle import circle
from udd.tracking.manual.patches import CLICK, REFINED, patch
from udd.tracking.manual.questions import ClickSession
from udd.tracking.manual.still_frames import still_frames
from udd.tracking.manual.window import Window
from udd.tracking.options import Sigma, TrackOptions
from udd.video.reader import Picture

APART = float(np.hypot(0.05, 0.095))  # m, of the first two marks
MISSES = 1.5  # pixels by which a hand misses in each direction
Complexes = np.ndarray[Any, np.dtype[np.complex128]]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return shot(tmp_path_factory.mktemp("click") / "three.mp4", THREE, 2.0, defects=Defects(clutter=4))


@pytest.fixture(scope="module")
def frames(made: Made) -> list[Picture]:
    return still_frames(survey(Film(made.path)))


def places(made: Made, marks: Marks, index: int) -> tuple[complex, Complexes]:
    """Where the disk's centre and the marks are in a frame [pixels]."""
    _, y, z, beta = made.state[index]
    centre = complex(made.pivot[0] + made.scale * y, made.pivot[1] - made.scale * z)
    at = np.array([complex(m["at"][0], -m["at"][1]) for m in marks])
    return centre, centre + made.scale * at * np.exp(1j * beta)


def hand(seed: int) -> Callable[[complex], complex]:
    rng = np.random.default_rng(seed)
    return lambda z: complex(z) + complex(*rng.normal(0, MISSES, 2))


def answer(clicks: ClickSession, made: Made, index: int, near: Callable[[complex], complex]) -> None:
    """Say everything by hand, as a person would who misses a little."""
    centre, marks = places(made, THREE, index)
    while not clicks.done:
        if clicks.question == "pivot":
            clicks.press(near(complex(*made.pivot)))
        elif clicks.question == "marks":
            for z in marks:
                clicks.press(near(z))
        elif clicks.question == "ruler":
            clicks.press(clicks.answers.marks[0].centre + 1)
            clicks.press(clicks.answers.marks[1].centre - 1j)
        elif clicks.question == "rim":
            for angle in (0.3, 1.6, 2.9, 4.1, 5.4):
                clicks.press(near(centre + made.scale * made.radius * np.exp(1j * angle)))
        asked = clicks.question
        clicks.accept()
        assert clicks.question != asked, clicks.remark


def test_a_click_is_refined_to_its_patch(made: Made) -> None:
    film, near = Film(made.path), hand(1)
    off, refined = [], 0
    for picture in film.pictures():
        if picture.index % 4:
            continue
        for z, mark in zip(places(made, THREE, picture.index)[1], THREE, strict=True):
            spot = patch(picture, near(z), film.full_range)
            if spot is None:
                continue  # behind the support
            refined += spot.refined
            if spot.refined:
                off.append(abs(spot.centre - z))
                # the colour, by its direction: the layout's own one
                own = read_layout(THREE).colours[THREE.index(mark)]
                said = Layout((0j, 1 + 0j), (own, spot.colour)).chroma
                unit = said / np.hypot(*said.T)[:, None]
                assert unit[0] @ unit[1] > 0.98
    assert refined > 20
    # marks of 16 pixels in colours of half the resolution
    assert np.sqrt(np.mean(np.square(off)) / 2) < REFINED and max(off) < 4 * REFINED


def test_what_is_hidden_or_grey_is_not_refined(made: Made) -> None:
    picture = next(iter(Film(made.path).pictures()))
    centre, marks = places(made, THREE, 0)
    assert patch(picture, 0.9 * centre + 0.1 * marks[0], False) is None  # bare disk
    z = complex(marks[0])
    r, c = round(z.imag), round(z.real)
    y, u, v = picture.y.copy(), picture.u.copy(), picture.v.copy()
    y[r + 3 :, c - 20 : c + 20], u[(r + 3) // 2 :, c // 2 - 10 : c // 2 + 10] = (
        30,
        128,
    )  # a black bar before it
    v[(r + 3) // 2 :, c // 2 - 10 : c // 2 + 10] = 128
    covered = Picture(0, 0.0, y, u, v)
    spot = patch(covered, z - 1j, False)
    assert spot is not None and not spot.refined and spot.centre == z - 1j and spot.sigma == CLICK
    assert patch(covered, complex(-50, 3), False) is None


def test_a_circle_through_clicks() -> None:
    turn = np.exp(1j * np.array([0.2, 1.9, 4.0]))
    fitted = circle(100 + 80j + 70 * turn, 1.5)
    assert fitted is not None and abs(fitted.centre - (100 + 80j)) < 1e-9 and abs(fitted.radius - 70) < 1e-9
    rng, errors, sigma = np.random.default_rng(2), [], 0.0
    angles = np.exp(2j * np.pi * np.arange(6) / 6)
    for _ in range(300):
        again = circle(70 * angles + rng.normal(0, 1, 6) + 1j * rng.normal(0, 1, 6), 1.0)
        assert again is not None
        errors.append((again.centre.real, again.centre.imag, again.radius - 70))
        sigma = again.centre_sigma
    spread = np.std(errors, axis=0)
    assert np.allclose(spread[:2], sigma, rtol=0.15) and abs(spread[2] / again.radius_sigma - 1) < 0.15
    assert circle(np.array([0, 1 + 1j, 2 + 2j]) * 30, 1.5) is None  # on a line
    assert circle(70 * np.exp(1j * np.array([0, 0.1, 0.2])), 1.5) is None  # on a short arc
    assert circle(np.full(3, 5 + 5j), 1.5) is None


def test_a_calm_and_open_frame_is_shown(made: Made, frames: list[Picture]) -> None:
    rates = np.abs(made.state[[p.index for p in frames], 0])
    assert rates[0] < np.median(np.abs(made.state[:, 0]))
    assert len({p.index // 3 for p in frames}) == len(frames)


def test_questions_are_answered_one_after_the_other(made: Made, frames: list[Picture]) -> None:
    clicks = ClickSession(frames[0], False, {}, APART)
    centre, marks = places(made, THREE, frames[0].index)
    assert (
        clicks.question == "pivot" and "wheels" in clicks.sentence and "found from the motion" in clicks.hint
    )
    clicks.press(complex(-40, 3))
    assert clicks.remark == "That is outside the picture."
    clicks.press(10 + 10j)
    clicks.press(12 + 12j)
    assert clicks.answers.pivot == 12 + 12j  # the last one counts
    clicks.undo()
    assert clicks.answers.pivot == 10 + 10j
    clicks.accept()
    assert clicks.show(frames[1]) and clicks.show(frames[0])  # nothing of the disk is clicked yet
    clicks.press(0.9 * centre + 0.1 * marks[0])
    assert "no colour" in clicks.remark and not clicks.answers.marks
    clicks.press(complex(marks[0]))
    clicks.accept()
    assert clicks.question == "marks" and "One mark is not enough" in clicks.remark
    clicks.press(complex(marks[0]) + 2)
    assert clicks.remark == "That mark is clicked already." and len(clicks.answers.marks) == 1
    assert not clicks.show(frames[1]) and "Backspace" in clicks.remark
    clicks.press(complex(marks[1]))
    clicks.press(complex(marks[2]))
    clicks.accept()
    assert clicks.question == "ruler" and f"{APART:g} m" in clicks.sentence
    clicks.press(complex(marks[0]) + 1)
    clicks.press(complex(marks[0]) + 8)
    assert "too near" in clicks.remark
    clicks.accept()
    assert "One point is clicked" in clicks.remark
    clicks.press(complex(marks[1]))
    clicks.press(complex(marks[2]))
    assert "Two points are all" in clicks.remark and clicks.ends == (1, 2)
    clicks.accept()
    for n, why in enumerate(["where the disk's centre is", "", "fix no circle: click a third"]):
        clicks.accept()
        assert clicks.question == ("rim" if n != 1 else "region") and why in clicks.remark
        if n == 1:
            clicks.undo()  # the centre alone would do, as there is a scale
        clicks.press(centre + 1j * n)
    clicks.press(centre + 2j)
    clicks.accept()
    assert "fix no circle" in clicks.remark
    while clicks.answers.rim:
        clicks.undo()
    for turn in (1, 1j, -1):
        clicks.press(centre + 20 * turn)
    clicks.accept()
    assert "lies outside the edge" in clicks.remark
    for _ in range(3):
        clicks.undo()
    for turn in (1, 1j, -1):
        clicks.press(centre + made.scale * made.radius * turn)
    clicks.accept()
    assert clicks.question == "region"
    clicks.press(200 + 250j)
    clicks.release(20 + 30j)
    clicks.accept()
    assert clicks.question == "end"
    clicks.accept()
    assert clicks.done and clicks.sentence == ""
    said = clicks.config()
    assert said["region"] == [20.0, 30.0, 200.0, 250.0] and said["apart"] == [1, 2, APART]
    assert said["calibrate"] == {"pivot": True, "scale": True}
    while clicks.question != "pivot" or clicks.answers.pivot is not None:
        clicks.undo()


def test_what_is_known_is_not_asked_for(frames: list[Picture]) -> None:
    known: dict[str, Any] = {"pivot": [1.0, 2.0], "layout": THREE, "region": [0, 0, 200, 200], "fps": 25}
    clicks = ClickSession(frames[0], False, known)
    assert clicks.question == "end"
    clicks.accept()
    assert clicks.config() == known
    skipped = ClickSession(frames[0], False, {})
    while not skipped.done:
        skipped.accept()
    assert skipped.config() == {}
    with pytest.raises(TrackError, match="distance and scale both say"):
        ClickSession(frames[0], False, {"scale": 900}, 0.1)
    with pytest.raises(TrackError, match="of a pendulum the bob's colour"):
        ClickSession(frames[0], False, {"bob": "red"})


def test_marks_that_look_the_same_turned_are_refused(made: Made, frames: list[Picture]) -> None:
    picture = frames[0]
    u, v = np.full_like(picture.u, 128), np.full_like(picture.v, 128)
    for c in (40, 80):
        u[50:58, c : c + 8], v[50:58, c : c + 8] = 100, 200
    clicks = ClickSession(Picture(0, 0.0, np.full_like(picture.y, 180), u, v), False, {"pivot": [1, 1]})
    clicks.press(87 + 107j)
    clicks.press(167 + 107j)
    clicks.accept()
    assert clicks.remark == "The marks look the same when the disk is turned; use another colour."


class Person:
    """Presses in a window whose canvas nobody sees."""

    def __init__(self, window: Window) -> None:
        self.window, self.canvas = window, window.figure.canvas
        self.canvas.draw()

    def mouse(self, name: str, z: complex, button: int = 1) -> None:
        x, y = self.window.shown.axes.transData.transform((z.real, z.imag))
        event = MouseEvent(name, self.canvas, x, y, button)  # type: ignore[arg-type]
        self.canvas.callbacks.process(name, event)

    def click(self, z: complex) -> None:
        self.mouse("motion_notify_event", z)
        self.mouse("button_press_event", z)
        self.mouse("button_release_event", z)

    def key(self, key: str) -> None:
        self.canvas.callbacks.process("key_press_event", KeyEvent("key_press_event", self.canvas, key))


def opened(frames: list[Picture], **more: Any) -> Person:
    figure = Figure(figsize=(11, 8.6))
    FigureCanvasAgg(figure)
    return Person(Window(figure, frames, ClickSession(frames[0], False, {}, **more)))


def test_the_window_hands_on_what_is_pressed(made: Made, frames: list[Picture]) -> None:
    person = opened(frames)
    window, clicks = person.window, person.window.clicks
    shown = window.shown
    assert "wheels hold it" in shown.asked.get_text() and "Esc: leave" in shown.keys.get_text()
    person.key("right")
    assert clicks.picture is frames[1] and f"2 of {len(frames)}" in shown.keys.get_text()
    person.key("left")
    person.mouse("button_press_event", 30 + 30j, button=3)
    assert clicks.answers.pivot is None
    person.canvas.toolbar = MagicMock(mode="zoom rect")
    person.click(30 + 30j)
    assert clicks.answers.pivot is None  # the toolbar has the mouse
    person.canvas.toolbar = None
    person.click(complex(*made.pivot))
    assert clicks.answers.pivot == pytest.approx(complex(*made.pivot))
    assert shown.loupe.get_xlim() == pytest.approx((made.pivot[0] - 20, made.pivot[0] + 20))
    person.key("backspace")
    assert clicks.answers.pivot is None
    person.key(" ")
    centre, marks = places(made, THREE, frames[0].index)
    for z in marks:
        person.click(complex(z))
    person.click(complex(marks[0]))
    assert shown.remark_text.get_text() == "That mark is clicked already."
    assert [t.get_text() for t in shown.list.texts][2:8:2] == ["mark 1", "mark 2", "mark 3"]
    person.key("enter")
    for turn in (1, 1j, -1):
        person.click(centre + made.scale * made.radius * turn)
    person.key("enter")
    person.mouse("button_press_event", 20 + 30j)
    person.mouse("button_release_event", 250 + 300j)
    assert [round(z.real) for z in clicks.answers.region] == [20, 250]
    window.figure.canvas.draw()
    person.key("enter")
    person.key("q")  # no key of this window
    person.key("enter")
    assert clicks.done and not window.left
    at = clicks.config()["layout"]
    true = np.array([m["at"] for m in THREE])
    # half a pixel of 875 to the metre for marks, a pixel for the edge that was clicked on a pixel
    assert np.abs(np.array([m["at"] for m in at]) - true).max() < 2e-3


def test_the_window_can_be_left(frames: list[Picture]) -> None:
    person = opened(frames)
    person.key("escape")
    assert person.window.left
    person = opened(frames)
    person.canvas.callbacks.process("close_event", CloseEvent("close_event", person.canvas))
    assert person.window.left


@pytest.fixture
def sat(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Callable[[Window], None]]]:
    """A person at the window of `udd.tracking.click`."""
    module = importlib.import_module("udd.tracking.manual.click")
    does: list[Callable[[Window], None]] = []
    windows: list[Window] = []

    def figure() -> Figure:
        made = Figure(figsize=module.SIZE)
        FigureCanvasAgg(made)
        return made

    def window(*args: Any) -> Window:
        windows.append(Window(*args))
        return windows[-1]

    monkeypatch.setattr(module, "_figure", figure)
    monkeypatch.setattr(module, "Window", window)
    monkeypatch.setattr(module, "_wait", lambda _figure, _title: does[0](windows[-1]))
    yield does


def by(made: Made, seed: int) -> Callable[[Window], None]:
    return lambda w: answer(w.clicks, made, w.clicks.picture.index, hand(seed))


def test_what_the_search_does_not_find_is_tracked_by_clicks(
    made: Made, sat: list[Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # three marks in places that nobody said: the automatic search knows the paper's own
    with pytest.raises(TrackError, match="no disk with marks"):
        udd.track(made.path)
    sat.append(by(made, 5))
    config, table = tmp_path / "disk.toml", tmp_path / "m.csv"
    argv = ["track", str(made.path), "--click", str(config), "--distance", str(APART), "--out", str(table)]
    assert main([*argv, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["config"] == str(config) and data["clicked"]["apart"] == [1, 2, APART]
    text = config.read_text(encoding="utf-8")
    assert text.startswith("# Clicked in three.mp4") and "[[layout]]" in text
    m = udd.read_measurement(table)
    known = udd.track(made.path, layout=THREE)
    assert m.seen.mean() >= known.seen.mean() - 0.02
    # twice what tracking with the true layout gives: the clicks' 1.5 pixels are 1.7 mm, a mark's 20 mrad
    off = rms(errors(m, made))
    assert np.all(off < 2 * rms(errors(known, made))) and np.all(off < (0.06, 0.06, 1.0))
    said = m.meta["calibration"]
    assert said["pivot"][2] == "rolling constraint" and said["scale"][2] == "distance of two marks"
    assert abs(said["scale"][0] - made.scale) < 3 * said["scale"][1]
    again = udd.track(made.path, config=config)
    assert np.array_equal(again.values, m.values, equal_nan=True) or np.allclose(
        again.values, m.values, atol=1e-9, equal_nan=True
    )


def test_without_a_distance_the_radius_sets_the_scale(made: Made, sat: list[Any]) -> None:
    sat.append(by(made, 6))
    known = udd.tracking.click(made.path, config={"disk_radius": 0.08})
    assert known["disk_radius"] == 0.08 and "apart" not in known
    m = udd.track(made.path, config=known)
    value, sigma, how = m.meta["calibration"]["scale"]
    assert how.startswith("rim") and abs(value - made.scale) < 3 * sigma and sigma < 0.01 * value
    # 0.4 % of 40 mm
    assert np.all(rms(errors(m, made)) < (0.2, 0.2, 1.0))


def test_leaving_writes_nothing(
    made: Made, sat: list[Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def leave(window: Window) -> None:
        window.left = True

    sat.append(leave)
    assert main(["track", str(made.path), "--click", str(tmp_path / "disk.toml")]) == 1
    said = capsys.readouterr().err
    assert "left before all was answered; nothing is written" in said and said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_failure_after_the_clicks_says_where_they_are(
    made: Made, sat: list[Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def skip(window: Window) -> None:
        while not window.clicks.done:
            window.clicks.accept()

    sat.append(skip)
    config = tmp_path / "disk.toml"
    argv = ["track", str(made.path), "--click", str(config), "--out", str(tmp_path / "m.csv")]
    assert main([*argv, "--disk-radius", "0.08"]) == 1
    said = capsys.readouterr().err
    assert "no disk with marks" in said and f"what was clicked is written: {config}" in said
    assert settings(config) == {"disk_radius": 0.08}


def test_clicks_that_cannot_be(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    film, new, old = str(made.path), str(tmp_path / "new.toml"), tmp_path / "old.toml"
    old.write_text("fps = 25\n")
    (tmp_path / "films").mkdir()
    for argv, why in (
        ([film, "--distance", "0.1"], "--distance is an option of --click"),
        (["--camera", "0", "--film", str(tmp_path / "f.mp4"), "--click", new], "record it first"),
        ([str(tmp_path / "films"), "--click", new], "for one film, not for a folder"),
        ([film, "--click", new, "--bob", "red"], "--click is for a disk"),
        ([film, "--click", str(old)], "is there already"),
        ([film, "--click", str(tmp_path / "no" / "new.toml")], "there is no folder"),
        ([film, "--click", str(tmp_path)], "is a folder"),
        ([film, "--click", new, "--distance", "-1"], "distance must be a positive number"),
        ([film, "--click", new, "--distance", "0.1", "--scale", "900"], "distance and scale both say"),
        ([film, "--click", new, "--config", new], "cannot be read"),
        ([str(tmp_path / "none.mp4"), "--click", new], "there is no such file"),
        ([film, "--click", new], "no window can be opened to click in"),  # tests have no screen
    ):
        assert main(["track", *argv]) == 1, argv
        said = capsys.readouterr().err
        assert why in said and said.count("\n") == 1, said
    assert old.read_text() == "fps = 25\n" and sorted(p.name for p in tmp_path.iterdir()) == [
        "films",
        "old.toml",
    ]


def test_a_config_is_written_as_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "disk.toml"
    known: dict[str, Any] = {
        "calibrate": {"lens": False, "readout": 0.02},
        "disk_radius": np.float64(0.08),
        "fps": 240,
        "pivot": (275, 310.5),
        "refine": False,
        "layout": THREE,
        "sigma": {"pivot": 3.0, "layout": 1e-3},
        "apart": [1, 2, 0.107],
    }
    write_config(path, known, comment='Two lines,\nwith "quotes"')
    assert path.read_text().startswith('# Two lines,\n# with "quotes"\n')
    assert settings(path) == settings(known)
    write_config(path, known, comment="bell\x07, half a letter \udce4")
    assert path.read_text().startswith("# bell?, half a letter ?\n") and settings(path) == settings(known)
    tags = {"layout": [{"tag": "4x4_50:7", "at": [0.0, 0.0], "side": 0.03}]}
    write_config(path, tags)
    assert settings(path) == settings(tags)
    for wrong, why in (
        ({"pivto": [1, 2]}, "a config has no 'pivto'"),
        ({"sigma": {"pivot": -1}}, "pivot must be a standard error in pixels, not -1"),
        ({"sigma": {"lens": 1}}, "sigma has no 'lens'; it has pivot, scale, layout"),
        ({"sigma": 3}, "sigma must be a table"),
        ({"apart": [1, 1, 0.1]}, "apart must be the numbers of two marks"),
        ({"apart": [1, 2, "x"]}, "apart must be the numbers of two marks"),
        ({"layout": read_layout(THREE)}, "layout must be a table, or a list of them"),
    ):
        with pytest.raises(TrackError, match=re.escape(why)):
            write_config(path, wrong)
    assert settings(path) == settings(tags)  # as it was
    with pytest.raises(udd.UddError, match="there is no folder"):
        write_config(tmp_path / "no" / "disk.toml", {})


def test_what_has_an_error_must_be_said() -> None:
    with pytest.raises(TrackError, match="how well pivot is known, but pivot is not given"):
        TrackOptions(sigma=Sigma(pivot=1.0))
    with pytest.raises(TrackError, match="how well layout is known, but layout is not given"):
        TrackOptions(sigma=Sigma(layout=1.0))
    with pytest.raises(TrackError, match="there is no mark 5: there are 4"):
        TrackOptions(apart=(1, 5, 0.1))


def test_a_scale_that_is_said_with_an_error_is_a_beginning() -> None:
    layout = read_layout(THREE)
    places = 1000 * layout.reach * layout.unit
    rim = Rim(0j, 80.0, 0.05, 0.05, 1000)

    def scaled(shown: Rim | None = rim, **said: Any) -> Any:
        return scale(places, shown, TrackOptions(layout=layout, **said))

    given = scaled(scale=990.0)
    assert (given.value, given.sigma, given.origin) == (990.0, 0.0, "given")
    # exact to 4.4 pixels per metre by the rim, 10 by hand: weights of 5 to 1
    loose = Sigma(scale=10.0, layout=0.001)
    both = scaled(scale=990.0, sigma=loose)
    assert 1000 > both.value > 997 and both.sigma < 4.4 and both.origin == "rim, and given"
    alone = scaled(None, scale=990.0, sigma=loose)
    assert (alone.value, alone.sigma, alone.origin) == (990.0, 10.0, "given")  # the film does not tell
    kept = scaled(scale=990.0, sigma=loose, calibrate=Calibrate(scale=False))
    assert (kept.value, kept.sigma) == (990.0, 10.0)
    with pytest.warns(UserWarning, match=r"the film shows 1000\.0 pixels per metre"):
        assert scaled(scale=700.0, sigma=loose).value == pytest.approx(1000, rel=1e-3)
    apart = float(abs(places[0] - places[1])) / 1000
    measured = scaled(apart=(1, 2, apart), scale=990.0, sigma=loose)
    assert measured.origin == "distance of two marks" and measured.value == pytest.approx(1000, rel=1e-3)


def test_a_pivot_that_is_said_with_an_error_is_a_beginning(made: Made, tmp_path: Path) -> None:
    off = [made.pivot[0] + 2.0, made.pivot[1] - 2.0]
    m = udd.track(made.path, layout=THREE, pivot=off, sigma={"pivot": 3.0}, refine=False)
    at, sigma, how = m.meta["calibration"]["pivot"]
    assert how == "rolling constraint" and np.hypot(*np.subtract(at, made.pivot)) < 0.1 and sigma < 0.1
    with pytest.warns(UserWarning, match="the contact of the motion is used"):
        udd.track(made.path, layout=THREE, pivot=[200.0, 90.0], sigma={"pivot": 2.0}, refine=False)
    # a disk at rest says nothing of where it would turn
    t = np.array([-1.0, 9.0])
    still = Motion(t, np.tile([0.02, 0.02, 0.8], (2, 1)))
    rng = np.random.default_rng(3)
    film = write(tmp_path / "still.mp4", (frame(still, k / FPS, 0.008, rng) for k in range(30)))
    rest = udd.track(film, pivot=PIVOT, sigma={"pivot": 2.0}).meta["calibration"]["pivot"]
    assert rest[0] == pytest.approx(PIVOT) and rest[1] == pytest.approx(2.0) and rest[2] == "given"
