"""Films with a rotation tag, as phones write it: they are read upright, and give the same numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import av

import udd
from small_films import shot
from udd.cli import main
from udd.video.reader import Film, Picture


def turned(path: Path, pictures: list[Picture], degrees: int) -> Path:
    """Write the pictures on their side, without loss, with the tag that turns them upright."""
    quarter = degrees // 90
    height, width = np.rot90(pictures[0].y, -quarter).shape
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=25, options={"qp": "0", "preset": "ultrafast"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.set_display_rotation(degrees)
        for picture in pictures:
            planes = [np.rot90(p, -quarter).ravel() for p in (picture.y, picture.u, picture.v)]
            image = np.concatenate(planes).reshape(-1, width)
            out.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="yuv420p")))
        out.mux(stream.encode(None))
    return path


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> list[Picture]:
    film = shot(tmp_path_factory.mktemp("upright") / "film.mp4", 0.8, size=(276, 352))
    return list(Film(film.path).pictures())


@pytest.mark.parametrize("ending", ["mp4", "mov"])
@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_a_rotated_film_is_read_upright(
    ending: str, degrees: int, pictures: list[Picture], tmp_path: Path
) -> None:
    film = Film(turned(tmp_path / f"film.{ending}", pictures, degrees))
    for seen, wanted in zip(film.pictures(), pictures, strict=True):
        for name in ("y", "u", "v"):
            assert np.array_equal(getattr(seen, name), getattr(wanted, name))
    assert film.size == (276, 352)


def test_a_rotated_film_gives_the_same_numbers(pictures: list[Picture], tmp_path: Path) -> None:
    tables = []
    for degrees in (0, 90):
        film = turned(tmp_path / f"{degrees}.mp4", pictures, degrees)
        table = tmp_path / f"{degrees}.csv"
        assert main(["track", str(film), "--fast", "--out", str(table)]) == 0
        tables.append(udd.read_measurement(table))
    assert np.array_equal(tables[0].values, tables[1].values, equal_nan=True)
    assert tables[0].seen.mean() > 0.9
