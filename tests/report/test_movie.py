"""The film beside the model: the right frames of the film, and disks drawn where the model says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="needs the extra 'track'")
pytest.importorskip("cv2", reason="needs the extra 'track'")

import udd
from udd.report import animation
from udd.report.animation import Panel
from udd.tracking import pictures_at, pictures_between

SIZE, SCALE, PIVOT = (276, 352), 875.0, (138.0, 165.0)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, udd.Measurement]:
    """Twelve seconds of a disk, longer than what a key frame starts, and where it was."""
    path = tmp_path_factory.mktemp("movie") / "disk.mp4"
    t = np.arange(0, 12.1, 0.01)
    run = udd.simulate(udd.Disk(0.042), t, [0.0, 1e-3, 0.03, 0.0])
    film = udd.render(run, path, size=SIZE, scale=SCALE, pivot=PIVOT, noise=0.0, support=0.0)
    place = 65 / 80 * 0.08 * SCALE
    camera = {"px_per_m": SCALE, "pivot_u": PIVOT[0], "pivot_v": PIVOT[1], "lens": [], "R": 0.08}
    marks = [[place * x, place * y] for x, y in ((0, -1), (1, 0), (0, 1), (-1, 0))]
    return path, film.truth.with_meta(**camera, marks_px=marks)


def test_frames_are_found_by_their_time(filmed: tuple[Path, udd.Measurement]) -> None:
    film, _ = filmed
    for rows in ([0, 1, 7], [262, 263, 270, 299]):  # before and behind the second key frame
        # Times that are not quite those of the frames, as a tracker's are not.
        results = list(pictures_between(film, 0.04 * np.array(rows) + 0.003))
        for a, b in zip(results, pictures_at(film, rows), strict=True):
            np.testing.assert_array_equal(a, b)


def test_film_and_model_are_side_by_side(filmed: tuple[Path, udd.Measurement], tmp_path: Path) -> None:
    film, measured = filmed
    rows = slice(255, 295)
    t, seen = measured.t[rows], measured.values[rows]
    panels = [Panel("measured", "#4d4d4d", seen), Panel("the model", "#0072b2", seen)]
    (tmp_path / "both.mp4").write_bytes(animation._mp4(panels, t, measured, film))
    frames = pictures_at(tmp_path / "both.mp4", range(len(t)))
    assert frames[0].shape == (300, 600, 3)
    with pytest.raises(ValueError, match="no frame 40"):
        pictures_at(tmp_path / "both.mp4", [40])
    for frame in frames[::8]:
        # The model is the motion itself here: the red mark is in the same place on both halves.
        left, right = (
            centre_of_red(frame[:, part].astype(float)) for part in (slice(0, 300), slice(300, 600))
        )
        np.testing.assert_allclose(left, right, atol=1.5)  # a streak's middle and a codec's blur


def centre_of_red(picture: np.ndarray) -> np.ndarray:
    red = (picture[..., 0] - picture[..., 1:].max(axis=2)).clip(0)
    red[red < 60] = 0
    orange = picture[..., 1] > 100
    red[orange] = 0
    v, u = np.indices(red.shape)
    return np.array([(red * u).sum(), (red * v).sum()]) / red.sum()


def test_a_disk_that_leaves_stays_where_it_left() -> None:
    away = np.column_stack([np.linspace(0, 0.2, 21), np.zeros(21), np.zeros(21)])
    kept = animation._within(away, 0.08)
    assert len(kept) == 9  # 0.08 m is the edge; what is beyond it by a twentieth is gone
    np.testing.assert_array_equal(animation._padded(kept, 21)[-1], away[8])
