"""Which files are read as films."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

pytest.importorskip("av")

import udd
from udd.video.reader import Film, TrackError


@pytest.mark.parametrize(
    "content",
    [
        "ffconcat version 1.0\nfile film.mp4\n",
        "#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\nfilm.mp4\n#EXT-X-ENDLIST\n",
    ],
)
def test_a_list_of_other_films_is_none(tmp_path: Path, content: str) -> None:
    """The list of ffconcat gave the frames of the other file."""
    shutil.copy(Path(udd.__file__).parent / "demo" / "sample.mp4", tmp_path / "film.mp4")
    assert Film(tmp_path / "film.mp4").packets == 1500
    (tmp_path / "list.mp4").write_text(content)
    with pytest.raises(TrackError, match="is not a film that can be decoded"):
        Film(tmp_path / "list.mp4")
