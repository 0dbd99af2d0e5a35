"""A film of a disk with printed tags goes in, with the layout that was printed."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("axe_playwright_python", reason="the browser's tests are not installed")

from axe_playwright_python.sync_playwright import Axe

from browser_for_tests import Opened, until
from small_films import shot
from udd.report.sheet import write_sheet


def test_a_disk_with_tags_is_tracked(opened: Opened, tmp_path: Path) -> None:
    _, config = write_sheet("tags", tmp_path / "tags.pdf", radius=0.08)
    layout = tomllib.loads(config.read_text(encoding="utf-8"))["layout"]
    film = shot(tmp_path / "tags.mp4", 3.0, layout=layout, exposure=0.002)
    page = opened.go()
    page.click("#to-film")
    assert page.locator("#loop-layout").is_hidden()
    page.set_input_files("#file", film.path)
    page.fill("#loop-W", "3.9")
    page.set_input_files("#loop-layout", config)
    assert Axe().run(page).violations_count == 0
    page.click("#go")
    until(page, "document.getElementById('stages').textContent.includes('fit')", 120)
    page.evaluate("document.getElementById('cancel').click()")
    until(page, "document.getElementById('work').hidden")
