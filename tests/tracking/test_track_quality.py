"""Quality columns of a tracked film, and that every reader takes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import tracked
import udd
from film_for_tests import FPS, PIVOT, RADIUS, REACH, SCALE, frame, rolling, write
from udd.measurement import Measurement, MeasurementError, read_measurement
from udd.measurement.table import QUALITY
from udd.tracking.passes.frame_quality import missing_before

EXPOSURE = 0.008


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measurement:
    """A film in which a hand hides one mark in frame 20, two in frame 25, and frame 30 is black."""
    rng, motion = np.random.default_rng(7), rolling(2.4)
    shots = [frame(motion, i / FPS, EXPOSURE, rng) for i in range(55)]
    shots[30][:] = 16
    for k, hidden in ((20, 1), (25, 2)):
        y, z, beta = motion.at(k / FPS)
        for quarter in range(hidden):
            a = beta + quarter * np.pi / 2
            u, v = PIVOT[0] + SCALE * (y + REACH * np.sin(a)), PIVOT[1] - SCALE * (z + REACH * np.cos(a))
            shots[k][int(v) - 20 : int(v) + 20, int(u) - 20 : int(u) + 20] = (228, 228, 220)
    return tracked.track(write(tmp_path_factory.mktemp("film") / "q.mp4", shots), disk_radius=RADIUS)


def test_every_frame_says_how_it_came_about(measured: Measurement) -> None:
    q = measured.quality
    assert tuple(q) == QUALITY
    assert q["marks"][20] == 3 and q["marks"][25] == 2 and q["marks"][30] == 0
    assert q["method"][30] == "none" and measured.flag[30].startswith("black")
    assert measured.flag[25] == "degraded: 2 marks only" and measured.seen[25]
    held = q["marks"] > 0
    assert np.isin(q["method"][held], ["fast", "refined"]).all() and (q["method"] == "refined").mean() > 0.9
    assert np.isnan(q["residual_px"][30]) and np.isnan(q["blur_px"][30]) and q["complete"][30] == 0
    # grain of 1.5 codes on 60 edge pixels: 0.01 pixel; twenty times that is a mark that is none
    assert np.nanmedian(q["residual_px"]) < 0.2
    whole = q["marks"] == 4
    assert np.all(q["complete"][20] < 0.8) and np.median(q["complete"][whole]) > 0.8


def test_blur_is_the_length_of_the_streaks(measured: Measurement) -> None:
    motion, h = rolling(2.4), 1e-3
    ends = np.array([[motion.at(t + s * h) for t in measured.t] for s in (-1, 1)])
    rate = (ends[1] - ends[0]) / (2 * h)
    path = EXPOSURE * SCALE * (np.hypot(rate[:, 0], rate[:, 1]) + REACH * np.abs(rate[:, 2]))
    held = np.flatnonzero(measured.quality["marks"] >= 3)[2:-2]
    # the exposure is known to a quarter (see test_track), the rate better
    assert measured.quality["blur_px"][held] == pytest.approx(path[held], rel=0.3, abs=0.5)


def test_files_with_and_without_these_columns(measured: Measurement, tmp_path: Path) -> None:
    full, bare = tmp_path / "full.csv", tmp_path / "bare.csv"
    measured.to_csv(full)
    Measurement(
        measured.t,
        measured.values,
        measured.sigma,
        measured.rho,
        measured.flag,
        measured.meta,
        measured.names,
    ).to_csv(bare)
    a, b = read_measurement(full), read_measurement(bare)
    assert np.array_equal(a.values, b.values, equal_nan=True) and a.seen.tolist() == b.seen.tolist()
    assert b.quality == {}
    for name, column in measured.quality.items():
        assert np.array_equal(a.quality[name], column, equal_nan=name != "method")
    assert a["marks"].dtype == np.int64
    part = a.rows(a.quality["marks"] == 4)
    assert set(part.quality["marks"]) == {4} and len(part.quality["method"]) == len(part)
    assert udd.smooth(a).quality["method"].tolist() == a.quality["method"].tolist()
    pytest.importorskip("pyarrow", reason="needs pyarrow")
    measured.to_parquet(tmp_path / "m.parquet")
    c = read_measurement(tmp_path / "m.parquet")
    assert c.quality["method"].tolist() == a.quality["method"].tolist()
    assert np.array_equal(c.quality["residual_px"], a.quality["residual_px"], equal_nan=True)


def test_both_kinds_of_file_give_the_same_fit(measured: Measurement, tmp_path: Path) -> None:
    full = tmp_path / "full.csv"
    measured.to_csv(full)
    lines = full.read_text(encoding="utf-8").splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("t,"))
    cut = lines[:head]
    keep = [k for k, name in enumerate(lines[head].split(",")) if name not in QUALITY]
    cut += [",".join(line.split(",")[k] for k in keep) for line in lines[head:]]
    (tmp_path / "bare.csv").write_text("\n".join(cut) + "\n", encoding="utf-8")
    fits = [udd.fit(read_measurement(tmp_path / f"{n}.csv"), udd.Disk(0.012)) for n in ("full", "bare")]
    assert fits[0].parameters == fits[1].parameters


def test_somebody_elses_column_of_that_name_is_passed_over(tmp_path: Path) -> None:
    rows = "\n".join(f"{k / 25},{np.sin(k)},good,by eye" for k in range(20))
    (tmp_path / "own.csv").write_text(f"t,theta,marks,method\n{rows}\n")
    assert read_measurement(tmp_path / "own.csv").quality == {}


def test_columns_of_another_length_are_refused() -> None:
    t = np.arange(12) / 25
    with pytest.raises(MeasurementError, match=r"marks has shape \(3,\), expected \(12,\)"):
        Measurement(t, {"theta": np.sin(t)}, quality={"marks": [4, 4, 4]})


def test_a_gap_is_one_against_its_surroundings() -> None:
    usual = np.arange(40) / 25.0
    assert missing_before(np.delete(usual, [10, 11, 20])) == [0] * 10 + [2] + [0] * 7 + [1] + [0] * 18
    slower = np.concatenate([usual, usual[-1] + np.arange(1, 30) / 12.5])  # a dark room halves the rate
    # at the change the median still knows the old rate only, over half its width
    assert sum(missing_before(slower)) <= 5
