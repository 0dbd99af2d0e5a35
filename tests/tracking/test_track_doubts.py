"""Gravity, drive, clock and turns of a film, and its doubts."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import av

import udd
import udd.tracking
from small_films import shot
from tracked_errors import errors, rms
from udd.cli import main
from udd.errors import UddError
from udd.film import Defects
from udd.film.defects import real_times
from udd.tracking.geometry.contact_point import pivot
from udd.tracking.geometry.intervals import usual_interval
from udd.tracking.geometry.turns import count_turns
from udd.tracking.metric.apparent_gravity import apparent_gravity
from udd.tracking.metric.film_clock import _rational, slow_parts
from udd.video.reader import Film, real_time, time_of

SCALE, DRIVE = 875.0, 0.039
Array = np.ndarray[Any, Any]


def noise(n: int, seed: int) -> tuple[Array, Array]:
    """Noise of a small film: pixels, and rad."""
    random = np.random.default_rng(seed)
    return 0.02 * (random.normal(size=n) + 1j * random.normal(size=n)), 3e-4 * random.normal(size=n)


def seen(t: Array, seed: int) -> tuple[Array, Array, Array]:
    """Centre [pixels] and angle as they are seen at these times, and the states."""
    run = udd.simulate(udd.Disk(DRIVE), t, [1.0, 0.02, -0.02, 0.3])
    off, turned = noise(len(t), seed)
    return SCALE * (run.state[:, 1] - 1j * run.state[:, 2]) + off, run.state[:, 3] + turned, run.state


@pytest.mark.parametrize("slower", [1.0, 8.0])
def test_gravity_shows_the_clock_and_the_orientation(slower: float) -> None:
    t = np.arange(0, 9, 1 / 60)
    _, angle, state = seen(t, 1)
    for turn in (1, 1j, -1):
        place = (state[:, 1] + 1j * state[:, 2]) * turn
        gravity = apparent_gravity(slower * t, np.column_stack([place.real, place.imag, angle]), 0.08)
        assert gravity is not None and gravity.is_known
        assert gravity.slower == pytest.approx(slower, rel=0.05)  # a tenth makes a doubt
        assert abs(np.angle(1j * gravity.value / turn)) < 0.05


def test_turns_are_counted_across_gaps_or_in_doubt() -> None:
    """Over 0.6 to 0.8 s the mean of the rates about a gap is wrong in a fifth of the cases."""
    t = np.arange(0, 20, 0.04)
    centre, angle, state = seen(t, 0)
    random, doubtful = np.random.default_rng(1), 0
    for gap in (10, 15, 15, 15, 20, 20):
        k = int(random.integers(20, len(t) - gap - 20))
        place, turned = centre.copy(), angle.copy()
        place[k : k + gap], turned[k : k + gap] = complex(np.nan, np.nan), np.nan
        turned[k + gap :] += 2 * np.pi * random.integers(-2, 3)
        result = count_turns(t, place, turned, 0j, complex(0, -DRIVE * SCALE), 57.0)
        assert len(result.doubtful) or abs(result.angle[-1] - state[-1, 3]) < 0.01
        doubtful += len(result.doubtful) > 0
    assert doubtful < 3


@pytest.mark.parametrize(("swing", "determined"), [(0.008, False), (0.2, True)])
def test_steady_rotation_does_not_determine_the_contact(swing: float, determined: bool) -> None:
    t, fine = np.arange(0, 8, 0.04), np.arange(0, 8, 0.0004)
    turned = np.exp(-1j * (1.6 * fine + swing * np.sin(2.2 * fine)))
    swept = np.concatenate([[0], np.cumsum((turned[1:] + turned[:-1]) / 2 * 0.0004)])
    angle = 1.6 * t + swing * np.sin(2.2 * t)
    centre = (SCALE * 0.0244 - 1j * DRIVE * SCALE * np.interp(t, fine, swept)) * np.exp(1j * angle)
    off, wrong = noise(len(t), 0)
    result = pivot(t, centre + off, angle + wrong, np.ones(len(t), dtype=bool), 57.0)
    assert (result is not None) == determined


def test_a_fall_at_the_end_of_a_short_film_does_not_hide_the_contact() -> None:
    """One window of three had the fall, and the common fit of all three determined no contact."""
    t = np.arange(0, 3.6, 0.04)
    centre, angle, _ = seen(t, 1)
    centre[24:30], angle[24:30] = complex(np.nan, np.nan), np.nan
    centre[-5:] += 4.9j * SCALE * (t[-5:] - t[-6]) ** 2
    result = pivot(t, centre, angle, np.isfinite(angle), 57.0)
    assert result is not None and abs(result.place) < 0.5  # pixels


CLOCKS = [
    (),
    ((2.0, 8.0), (8.0, 1.0)),
    ((0.0, 8.0), (8.0, 1.0)),
    ((3.0, 4.0),),
    ((2.0, 0.8), (6.0, 1.0)),
    ((0.0, 0.8), (6.0, 1.0)),
    ((2.3, 0.9), (6.1, 1.0)),
]


@pytest.mark.parametrize("clock", CLOCKS)
def test_slow_parts_are_seen_by_the_drive(clock: Any) -> None:
    stamps = np.arange(0, 10, 1 / 30)
    centre, angle, _ = seen(real_times(stamps, clock), 1)
    parts = slow_parts(stamps, centre + 100 + 200j, angle, 0.08, SCALE)
    wanted = [*([(0.0, 1.0)] if clock and clock[0][0] else []), *clock]
    assert [p.factor for p in parts] == pytest.approx([factor for _, factor in wanted], rel=0.005)
    assert all(abs(p.first / 30 - begin) < 0.07 for p, (begin, _) in zip(parts, wanted, strict=True))


@pytest.mark.parametrize(
    ("seconds", "missing", "seed"),
    [
        (10, [40, 77, 78, 120, 160], 1),  # the stamps, which are even, are off by 0.17 s
        (10, np.floor(np.arange(1, 300, 2.5)).astype(int)[:110], 1),  # every second or third; by 3.7 s
        # Nine different clocks in ten gaps of one to four frames; by 0.6 s.
        (12, [31, 60, 61, 95, 128, 129, 130, 170, 200, 201, 202, 203, 241, 270, 271, 300, 333, 334], 3),
    ],
)
def test_missing_frames_are_seen_by_the_drive(seconds: int, missing: Any, seed: int) -> None:
    taken = np.delete(np.arange(0, seconds, 1 / 30), missing)
    centre, angle, _ = seen(taken, seed)
    stamps = np.arange(len(taken)) / 30
    parts = slow_parts(stamps, centre + 100 + 200j, angle, 0.08, SCALE)
    slower = tuple((float(stamps[part.first]), part.factor) for part in parts)
    again = np.array([real_time(float(stamp), slower) for stamp in stamps])
    assert len(parts) > 2 and np.abs(again - taken).max() < 0.04


def test_a_hand_hides_no_missing_frames() -> None:
    """Before this, all frames of such a film were taken as even: 12 mm off, in silence."""
    taken = np.delete(np.arange(0, 8, 1 / 30), [20, 41, 42, 80, 111, 150, 190])
    centre, angle, _ = seen(taken, 2)
    centre[95:112], angle[95:112] = np.nan, np.nan
    angle[112:] += 2 * np.pi  # turns across the gap are not counted yet
    stamps = np.arange(len(taken)) / 30
    parts = slow_parts(stamps, centre + 100 + 200j, angle, 0.08, SCALE)
    slower = tuple((float(stamps[part.first]), part.factor) for part in parts)
    again = np.array([real_time(float(stamp), slower) for stamp in stamps])
    before, after = again[:95] - taken[:95], again[112:] - taken[112:]
    # how many frames are missing behind the hand, the drive does not show
    assert np.abs(before).max() < 0.005 and np.ptp(after) < 0.005 and abs(after[0]) < 0.04


def test_a_film_mostly_in_slow_motion_has_no_gaps() -> None:
    t = np.concatenate([np.arange(0, 2, 1 / 30), np.arange(2, 4, 1 / 240), np.arange(4, 6, 1 / 30)])
    assert usual_interval(t) == pytest.approx(1 / 30)
    assert usual_interval(np.delete(np.arange(300) / 30, [5, 60, 61])) == pytest.approx(1 / 30)
    centre, angle, _ = seen(t, 1)
    contact = pivot(t, centre, angle, np.ones(len(t), dtype=bool), 57.0)
    assert contact is not None and abs(contact.place) < 0.3  # pixels
    assert len(count_turns(t, centre, angle, contact.place, contact.drive, 57.0).doubtful) == 0


@pytest.mark.parametrize(
    ("factor", "sigma", "expected"),
    [
        (8.095, 1e-3, 8.0),  # a phone's slow motion, whose ends lie between frames
        (0.123, 1e-4, 0.125),
        (0.8003, 2e-4, 0.8),
        (0.8043, 2e-4, 0.8043),
        (1.03, 1e-3, 1.0),
    ],
)
def test_a_factor_near_a_whole_number_is_one(factor: float, sigma: float, expected: float) -> None:
    assert _rational(factor, sigma) == expected


def test_the_release_of_a_disk_that_falls_is_no_slow_part() -> None:
    """The drive of that step was a clock 27 times too slow, and the times after it were wrong."""
    stamps = np.arange(0, 4, 1 / 30)
    centre, angle, _ = seen(stamps, 1)
    for part in (0.05, 0.1, 0.2, 0.4):  # of the drive that the step of the release shows
        before = np.sqrt((1 - part) * DRIVE / 30 / 4.9)  # seconds of fall in that step
        fallen = np.maximum(stamps - stamps[-4] + before, 0.0)
        falling = centre + 4.9j * SCALE * np.where(np.arange(len(stamps)) < len(stamps) - 4, 0, fallen) ** 2
        assert slow_parts(stamps, falling + 100 + 200j, angle, 0.08, SCALE) == []


@pytest.mark.parametrize("kind", ["even", "step", "swaying"])
def test_a_drive_that_varies_is_no_clock(kind: str) -> None:
    t, fine = np.arange(0, 10, 1 / 30), np.arange(0, 10, 1e-4)
    spin = 1.7 * np.sin(1.1 * fine) + 0.9 * np.sin(2.3 * fine + 1)
    drive = (
        DRIVE
        * {
            "even": np.ones(len(fine)),
            "step": np.where(fine < 4, 1, 1.25),
            "swaying": 1 + 0.1 * np.sin(9 * fine),
        }[kind]
    )
    angle = np.concatenate([[0.0], np.cumsum(spin)[:-1] * 1e-4])
    turned = np.exp(-1j * angle)
    swept = np.concatenate([[0.0], np.cumsum(drive * turned)[:-1] * 1e-4])
    centre = SCALE * (0.02 - 1j * swept) / turned
    off, wrong = noise(len(t), 0)
    place = np.interp(t, fine, centre.real) + 1j * np.interp(t, fine, centre.imag) + off
    assert slow_parts(t, place + 100 + 200j, np.interp(t, fine, angle) + wrong, 0.08, SCALE) == []


def test_a_film_that_is_slow_in_the_middle(tmp_path: Path) -> None:
    film = shot(tmp_path / "slow.mp4", 7.0, fps=30.0, defects=Defects(clock=((1.6, 8.0), (4.8, 1.0))))
    with pytest.warns(UserWarning, match="slows down by a factor of 1 .* 8 .* from frame 4[789] on"):
        m = udd.track(film.path)
    assert np.abs(m.t - film.t).max() < 0.05
    assert float(m.meta["drive_seen"]) == pytest.approx(DRIVE, rel=0.02) and "clock" in m.meta


@pytest.mark.parametrize("turns", [1, 2])
def test_a_film_that_is_turned_is_turned_upright(turns: int, tmp_path: Path) -> None:
    film = shot(tmp_path / "turned.mp4", defects=Defects(turned=turns))
    with pytest.warns(UserWarning, match="upside down" if turns == 2 else "on its side"):
        m = udd.track(film.path)
    e = rms(errors(m, film))
    assert e[0] < 0.05 and e[1] < 0.05 and e[2] < 1 and m.meta["turned"] == turns
    assert float(m.meta["pivot_u"]) == pytest.approx(film.pivot[0], abs=0.3)


def test_a_hand_costs_no_turn(tmp_path: Path) -> None:
    film = shot(tmp_path / "hand.mp4", 5.0, defects=Defects(hands=((3.0, 3.9),)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        m = udd.track(film.path)
    e, late = errors(m, film), m.t > 4.1
    assert m.seen[late].all() and (np.abs(e[late, 2]).max() < 5 or (m.flag[late] != "").all())
    assert not any(flag.startswith("dup") for flag in m.flag)  # nothing is a copy


def test_a_wrong_clock_is_a_doubt_and_an_exit_code(tmp_path: Path, capsys: Any) -> None:
    film, table = shot(tmp_path / "fast.mp4", 6.0), tmp_path / "m.csv"
    assert main(["track", str(film.path), "--fps", "100", "--out", str(table)]) == 3
    assert "times too long" in capsys.readouterr().err
    back = udd.read_measurement(table)
    assert "gravity is" in back.meta["doubts"][0] and float(back.meta["gravity_seen"]) > 100
    udd.tracking.page(film.path, back, tmp_path / "page.html")
    assert "times too long" in (tmp_path / "page.html").read_text(encoding="utf-8")
    assert main(["track", str(film.path), "--out", str(table)]) == 0


def test_rates_in_pieces(tmp_path: Path) -> None:
    film, rates = shot(tmp_path / "pieces.mp4", 1.0), ((0, 30.0), (2, 240.0))
    wanted = [0, 1 / 30, 2 / 30, 2 / 30 + 1 / 240]
    assert [time_of(k, rates) for k in range(4)] == pytest.approx(wanted)
    assert [p.t for p in Film(film.path, fps=rates).pictures()][:4] == pytest.approx(wanted)
    for bad in ([(1, 30)], [(0, 30), (0, 20)], [(0, -1)], "fast", [(0, float("inf"))], []):
        with pytest.raises(UddError, match="fps must be positive"):
            Film(film.path, fps=bad)  # type: ignore[arg-type]


def test_the_tag_of_slow_motion_is_read(tmp_path: Path) -> None:
    film, tagged = shot(tmp_path / "plain.mp4", 1.0), str(tmp_path / "tag.mp4")
    options = {"movflags": "use_metadata_tags"}
    with av.open(str(film.path)) as source, av.open(tagged, "w", options=options) as target:
        target.metadata["com.android.capture.fps"] = "200.0"
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(source.streams.video[0]):
            if packet.dts is not None:
                packet.stream = stream
                target.mux(packet)
    said = Film(tagged)
    assert said.fps == 200 and "com.android.capture.fps" in said.clock_text
    assert [p.t for p in said.pictures()][:3] == pytest.approx([0, 1 / 200, 2 / 200])


def test_frames_outside_the_edit_list_are_not_missing(tmp_path: Path) -> None:
    data = bytearray(shot(tmp_path / "whole.mp4", 2.0).path.read_bytes())
    at = data.find(b"elst") + 12
    data[at : at + 8] = struct.pack(">II", 1000, 6400)  # 1 s from 0.5 s on, at 12800 ticks in a second
    (tmp_path / "trimmed.mp4").write_bytes(data)
    trimmed = Film(tmp_path / "trimmed.mp4")
    assert trimmed.promised == trimmed.packets == sum(1 for _ in trimmed.pictures())
    assert 24 <= trimmed.promised <= 26
