"""Printed sheets: true to scale, and read by the tracker with the layout next to them."""

from __future__ import annotations

import re
import tomllib
import zlib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import cv2

import udd
from udd.cli import main
from udd.errors import UddError
from udd.markers.tags import dictionary, read_tags
from udd.report.sheet import PAPERS, write_sheet
from udd.tracking.calibration.config import settings

MM = 72 / 25.4  # points


def drawing(pdf: Path) -> tuple[tuple[float, float], str]:
    """The page's size [mm], and the commands that draw on it."""
    raw = pdf.read_bytes()
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", raw)
    assert box is not None
    parts = [
        zlib.decompress(p)
        for p in re.findall(rb"FlateDecode[^>]*>>\s*stream\r?\n(.*?)\r?\nendstream", raw, re.S)
    ]
    return (float(box[1]) / MM, float(box[2]) / MM), max(parts, key=len).decode("latin-1")


def squares(commands: str) -> list[tuple[float, float, float]]:
    """Middle and side [mm] of filled squares."""
    out = []
    number = r"(-?[\d.]+)"
    path = rf"{number} {number} m\n{number} {number} l\n{number} {number} l\n{number} {number} l\nh\n"
    for result in re.findall(path, commands):
        at = np.array(result, float).reshape(4, 2) / MM
        if np.isclose(np.ptp(at[:, 0]), np.ptp(at[:, 1]), atol=1e-3):
            out.append((*at.mean(axis=0), float(np.ptp(at[:, 0]))))
    return out


@pytest.mark.parametrize("paper", list(PAPERS))
def test_marks_are_printed_at_true_scale(paper: str, tmp_path: Path) -> None:
    assert (
        main(["sheet", "marks", "--radius", "0.08", "--paper", paper, "--out", str(tmp_path / "m.pdf")]) == 0
    )
    size, commands = drawing(tmp_path / "m.pdf")
    assert size == pytest.approx(PAPERS[paper], abs=0.05)
    marks = np.array([s for s in squares(commands) if s[2] > 5])
    assert len(marks) == 4 and marks[:, 2] == pytest.approx(16.0, abs=0.01)
    middle = marks[:, :2].mean(axis=0)
    assert np.hypot(*(marks[:, :2] - middle).T) == pytest.approx(65.0, abs=0.01)
    for code in udd.markers.layout.NAMED["red"]:
        assert f"{code / 255:.3f}"[:4] in commands
    options = settings(tmp_path / "m.toml")
    assert options["disk_radius"] == 0.08 and options["mark_distance"] == 0.065


def test_tags_are_read_where_the_layout_has_them(tmp_path: Path) -> None:
    pdf, config = write_sheet("tags", tmp_path / "tags.pdf", radius=0.06)
    (width, height), commands = drawing(pdf)
    scale = 5  # pixels per mm
    picture = np.full((round(height * scale), round(width * scale)), 255, np.uint8)
    for u, v, side in squares(commands):
        low, high = np.array([u, height - v]) * scale - side * scale / 2, np.array([u, height - v]) * scale
        first, last = np.round(low).astype(int), np.round(high + side * scale / 2).astype(int)
        picture[first[1] : last[1], first[0] : last[0]] = 0
    tags = read_tags(tomllib.loads(config.read_text())["layout"])
    corners, numbers, _ = cv2.aruco.ArucoDetector(dictionary("4x4_50")).detectMarkers(picture)
    seen = {int(n): c[0] @ [1, 1j] / scale for n, c in zip(numbers.ravel(), corners, strict=True)}
    assert sorted(seen) == [0, 1, 2, 3]
    middle = np.mean([c.mean() for c in seen.values()])
    for tag in tags:
        off = seen[tag.number] - middle - 1e3 * tag.corners
        assert np.abs(off).max() < 0.4  # mm: two pixels


def test_sheets_that_cannot_be(tmp_path: Path) -> None:
    for given, why in (
        ({"radius": 0.12}, "does not fit on A4 .*say paper='A3'"),
        ({"radius": 80.0}, "is it in m?"),
        ({"paper": "A9"}, "one of A4, A3, letter"),
    ):
        with pytest.raises(UddError, match=why):
            write_sheet("marks", tmp_path / "m.pdf", **given)
    assert not list(tmp_path.iterdir())
