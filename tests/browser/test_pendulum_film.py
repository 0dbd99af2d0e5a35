"""A film of a pendulum goes in; its motion, a fit and the report come out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("axe_playwright_python", reason="the browser's tests are not installed")

from axe_playwright_python.sync_playwright import Axe

from bob_films import arc, swing
from browser_for_tests import Opened, until
from film_for_tests import FPS, HEIGHT, WIDTH, write

LENGTH = 0.25  # m


def angle(t: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(0.25 * np.exp(-0.03 * t) * np.cos(np.sqrt(9.81 / LENGTH) * t))


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    theta = angle(np.arange(350) / FPS)
    shots = swing([(*arc(theta, 900 * LENGTH), (190, 35, 40))], (140, 145, 140))
    return Path(write(tmp_path_factory.mktemp("bob") / "clock.mp4", shots))


def test_a_pendulum_is_tracked_and_fitted(opened: Opened, film: Path, tmp_path: Path) -> None:
    page = opened.go()
    page.click("#to-film")
    assert page.locator("#bob-box").is_hidden()
    page.set_input_files("#file", film)
    assert page.locator("#why").text_content().startswith("Say the drive speed W first")
    page.select_option("#loop-bob", label="a pendulum, its bob red")
    assert page.locator("#why").text_content().startswith("Say the length of the pendulum first")
    page.fill("#loop-length", str(100 * LENGTH))
    assert page.locator("#why").text_content() == ""
    assert Axe().run(page).violations_count == 0
    page.screenshot(path=tmp_path / "asked.png")
    page.click("#go")
    until(page, "document.getElementById('frame-said').textContent.startsWith('frame')", 60)
    page.screenshot(path=tmp_path / "tracking.png")
    ended = "!document.getElementById('found').hidden || document.getElementById('failed').textContent"
    until(page, ended, 180)
    assert page.locator("#failed").text_content() == ""
    assert "measurement.csv" in page.locator("#files").inner_html()
    assert Axe().run(page).violations_count == 0
    page.screenshot(path=tmp_path / "fitted.png", full_page=True)


def test_two_bobs_are_tracked(opened: Opened, tmp_path: Path) -> None:
    t = np.arange(60) / FPS
    upper = arc(0.5 * np.cos(5.0 * t), 125.0)
    lower = arc(0.7 * np.cos(5.0 * t) + 0.3 * np.sin(11.0 * t), 105.0, upper)
    bobs = [(*upper, (190, 35, 40)), (*lower, (30, 78, 186))]
    page = opened.go()
    page.click("#to-film")
    page.set_input_files("#file", write(tmp_path / "double.mp4", swing(bobs, (140, 145, 140))))
    assert page.locator("#loop-lower").is_hidden()
    page.select_option("#loop-bob", "red")
    assert page.locator("#loop-layout").is_hidden()
    page.select_option("#loop-lower", "green")
    page.fill("#loop-length", "30")
    page.click("#go")
    page.wait_for_selector("#refused:not([hidden])")
    page.check("#refused input[value=bob]")
    frame = int(page.locator("#refused .clicks output").text_content().split()[1].rstrip(","))
    click_bob(page, upper[0][frame], upper[1][frame])
    assert page.locator("#refused .clicks-note").text_content().startswith("Click the lower bob too")
    click_bob(page, lower[0][frame], lower[1][frame])
    page.click("#track-again")
    until(page, "document.getElementById('stages').textContent.includes('fit')", 120)
    page.evaluate("document.getElementById('cancel').click()")
    until(page, "document.getElementById('work').hidden")


def click_bob(page: Any, u: float, v: float) -> None:
    """Click on a place of the frame of a refused film, in pixels."""
    page.locator("#refused canvas").evaluate("canvas => canvas.scrollIntoView({ block: 'center' })")
    box = page.locator("#refused canvas").bounding_box()
    page.mouse.click(
        box["x"] + (u + 0.5) / WIDTH * box["width"], box["y"] + (v + 0.5) / HEIGHT * box["height"]
    )


def test_a_click_shows_the_bob(opened: Opened, film: Path) -> None:
    page = opened.go()
    page.click("#to-film")
    page.set_input_files("#file", film)
    page.select_option("#loop-bob", "blue")
    page.fill("#loop-length", str(100 * LENGTH))
    page.click("#go")
    page.wait_for_selector("#refused:not([hidden])", timeout=60000)
    labels = page.locator("#refused .clicks label").all_text_contents()
    assert " Pivot" in labels and " Contact" not in labels
    page.check("#refused input[value=bob]")
    frame = int(page.locator("#refused .clicks output").text_content().split()[1].rstrip(","))
    u, v = (float(x[0]) for x in arc(angle(np.array([frame / FPS])), 900 * LENGTH))
    click_bob(page, u, v)
    page.click("#track-again")
    until(page, "document.getElementById('frame-said').textContent.startsWith('frame')", 60)
    page.click("#cancel")
