"""A webcam as the source: time stamps, frame loss, and what goes wrong. No camera is needed."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import av
import cv2

import udd
from film_for_tests import RADIUS, frame, rolling
from udd.cli import main
from udd.errors import UddError
from udd.tracking import TrackError, record

FPS = 30.0


class Webcam:
    """A camera as `cv2.VideoCapture` shows it: frames with its clock's times [ms], then nothing."""

    def __init__(self, shots: list[tuple[float, NDArray[np.uint8]]], there: bool = True) -> None:
        self.shots: Iterator[tuple[float, NDArray[np.uint8]]] = iter(shots)
        self.there, self.released, self.now = there, 0, 0.0

    def isOpened(self) -> bool:
        return self.there

    def read(self) -> tuple[bool, Any]:
        shot = next(self.shots, None)
        if shot is None:
            return False, None
        self.now = shot[0]
        return True, shot[1]

    def get(self, propId: int, /) -> float:
        assert propId == cv2.CAP_PROP_POS_MSEC
        return self.now

    def release(self) -> None:
        self.released += 1


def grey(times: list[float], height: int = 48, width: int = 64) -> list[tuple[float, NDArray[np.uint8]]]:
    return [(t, np.full((height, width, 3), 100, np.uint8)) for t in times]


def stamps(path: Path) -> NDArray[np.float64]:
    with av.open(str(path)) as film:
        return np.array([float(f.pts * f.time_base) for f in film.decode(video=0)])


def test_a_camera_is_recorded_and_tracked_and_its_losses_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rng, motion = np.random.default_rng(5), rolling(2.0)
    wander = 1e-3 * rng.uniform(-2, 2, 60)  # s: no camera keeps its beat
    dropped = {20, 21, 40}
    times = [k / FPS + wander[k] for k in range(60) if k not in dropped]
    camera = Webcam(
        [(1e3 * (700.0 + t), np.ascontiguousarray(frame(motion, t, 0.008, rng)[..., ::-1])) for t in times]
    )
    monkeypatch.setattr(cv2, "VideoCapture", lambda number: camera if number == 3 else None)
    film, table = tmp_path / "film.mp4", tmp_path / "m.csv"
    argv = ["track", "--camera", "3", "--seconds", "2", "--film", str(film), "--disk-radius", str(RADIUS)]
    assert main([*argv, "--pivot", "161.3,190.6", "--fast", "--json", "--out", str(table)]) == 0
    said = json.loads(capsys.readouterr().out)["recording"]
    assert (said["frames"], said["lost"], said["clock"], len(said["gaps_s"])) == (57, 3, "camera", 2)
    np.testing.assert_allclose(said["gaps_s"][0], np.array([times[19], times[20]]) - times[0], atol=2e-5)
    assert camera.released == 1
    # the film has the camera's own times, to half a tick of 1/90000 s
    np.testing.assert_allclose(stamps(film), np.array(times) - times[0], rtol=0, atol=6e-6)
    m = udd.read_measurement(table)
    np.testing.assert_allclose(m.t, np.array(times) - times[0], rtol=0, atol=6e-6)
    truth = np.array([motion.at(t) for t in times])
    assert m.seen.sum() >= 50
    turn = (m["beta"] - truth[:, 2])[m.seen]
    turn -= 2 * np.pi * np.round(np.median(turn) / (2 * np.pi))
    # a frame's time wrong by its wander of 1 ms would be 7 mrad at 7 rad/s; 1 pixel is 16 mrad
    assert np.sqrt(np.mean(turn**2)) < 2e-3
    for k in range(2):  # 1 mm is a pixel; scale and contact are off by a constant and a factor
        design = np.column_stack([np.ones(m.seen.sum()), truth[m.seen, k]])
        rest = m.values[m.seen, k] - design @ np.linalg.lstsq(design, m.values[m.seen, k], rcond=None)[0]
        assert np.sqrt(np.mean(rest**2)) < 1e-4


def test_a_camera_without_a_clock_has_the_computers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arrivals = [5.0 + k / 20 + (0.1 if k > 6 else 0.0) for k in range(15)]
    ticking = iter(arrivals)
    monkeypatch.setattr("udd.video.webcam.time.monotonic", lambda: next(ticking))
    made = record(tmp_path / "x.mp4", camera=Webcam(grey([0.0] * 15)), seconds=0.7)
    assert made.clock == "computer"
    # the last two frames come after the end
    np.testing.assert_allclose(made.t, np.array(arrivals[:13]) - 5.0, atol=1e-12)
    assert made.lost == 2 and made.interval == pytest.approx(0.05)
    assert str(made) == (
        "13 frames in 0.70 s, 20.0 a second by the computer's clock; "
        "2 lost (13.3 %) in one gap, the longest of 150 ms"
    )


def test_repeated_stamps_and_odd_sizes(tmp_path: Path) -> None:
    times = [100.0 + 40 * k for k in range(20)]
    times.insert(10, times[9])  # the same frame twice
    made = record(tmp_path / "x.mov", camera=Webcam(grey(times, 49, 63)), seconds=0.7)
    assert len(made.t) == 18 and made.lost == 0 and str(made).endswith("none was lost")
    with av.open(str(made.path)) as film:
        assert (film.streams.video[0].width, film.streams.video[0].height) == (62, 48)


def test_a_camera_that_stops_is_told_of(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"the camera stopped after 0\.5 of 20 s"):
        record(tmp_path / "x.mp4", camera=Webcam(grey([10.0 + 25 * k for k in range(21)])))


@pytest.mark.parametrize(
    ("camera", "says"),
    [
        (Webcam([], there=False), "the camera cannot be opened"),
        (Webcam(grey([1.0 + 40 * k for k in range(9)])), "gave 9 frames, at least 10 are needed"),
        (
            Webcam([*grey([1.0 + 40 * k for k in range(12)]), *grey([900.0], 24)]),
            r"no colour pictures of one size, but \(24, 64, 3\)",
        ),
    ],
)
def test_a_camera_that_gives_no_film_leaves_nothing(camera: Webcam, says: str, tmp_path: Path) -> None:
    with pytest.raises(TrackError, match=says):
        record(tmp_path / "x.mp4", camera=camera)
    assert camera.released == 1 and list(tmp_path.iterdir()) == []


def test_what_cannot_be_recorded_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UddError, match="seconds must be above 0"):
        record(tmp_path / "x.mp4", camera=Webcam([]), seconds=0)
    with pytest.raises(UddError, match="must end in"):
        record(tmp_path / "x.txt", camera=Webcam([]))
    for argv, says in [
        (["track"], "say which film to track, or --camera"),
        (["track", "x.mp4", "--camera", "0"], "--camera"),
        (["track", "--camera", "0"], "--film"),
        (["track", "x.mp4", "--seconds", "5"], "--seconds"),
        (["track", "x.mp4", "--film", "y.mp4"], "--film"),
    ]:
        assert main(argv) == 1
        assert says in capsys.readouterr().err


class Impatient(Webcam):
    """Somebody presses Ctrl-C when the k-th frame comes."""

    def __init__(self, shots: list[tuple[float, NDArray[np.uint8]]], *presses: int) -> None:
        super().__init__(shots)
        self.count, self.presses = 0, presses

    def read(self) -> tuple[bool, Any]:
        self.count += 1
        for _ in range(self.presses.count(self.count)):
            signal.raise_signal(signal.SIGINT)
        return super().read()


def test_ctrl_c_ends_the_recording_and_keeps_the_film(tmp_path: Path) -> None:
    before = signal.getsignal(signal.SIGINT)
    camera = Impatient(grey([10.0 + 40 * k for k in range(300)]), 40)
    made = record(tmp_path / "x.mp4", camera=camera, seconds=20)
    assert len(made.t) == 39 and len(stamps(made.path)) == 39 and camera.released == 1
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("presses", [(5,), (40, 40)], ids=["too early", "twice"])
def test_ctrl_c_too_early_or_twice_leaves_nothing(presses: tuple[int, ...], tmp_path: Path) -> None:
    camera = Impatient(grey([10.0 + 40 * k for k in range(300)]), *presses)
    with pytest.raises(KeyboardInterrupt):
        record(tmp_path / "x.mp4", camera=camera, seconds=20)
    assert camera.released == 1 and list(tmp_path.iterdir()) == []


def test_the_command_tracks_what_was_recorded_until_ctrl_c(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rng, motion = np.random.default_rng(5), rolling(2.0)
    times = [k / FPS for k in range(45)]
    shots = [(1e3 * (7 + t), np.ascontiguousarray(frame(motion, t, 0.008, rng)[..., ::-1])) for t in times]
    camera = Impatient(shots, 40)
    monkeypatch.setattr(cv2, "VideoCapture", lambda _: camera)
    film, table = tmp_path / "film.mp4", tmp_path / "m.csv"
    argv = ["track", "--camera", "0", "--film", str(film), "--disk-radius", str(RADIUS), "--fast"]
    assert main([*argv, "--pivot", "161.3,190.6", "--out", str(table)]) == 0, capsys.readouterr().err
    assert len(udd.read_measurement(table)) == 39
