"""The page of a refused film: clicks on its frames become the command that tracks the film."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("axe_playwright_python", reason="the browser's tests are not installed")

from axe_playwright_python.sync_playwright import Axe

from browser_for_tests import SIZES, Opened, until
from clicked_places import edge, marks
from small_films import shot
from udd.cli import main
from udd.film import Defects, Film
from udd.tracking.clicks import read_clicks


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> tuple[Film, Path]:
    folder = tmp_path_factory.mktemp("refused")
    film = shot(folder / "no_red.mp4", 1.0, defects=Defects(mark_strength=(0, 0, 1, 1)))
    assert main(["track", str(film.path), "--page", str(folder / "why.html")]) == 1
    return film, folder / "why.html"


def click(page: Any, film: Film, tool: str, places: list[tuple[float, float]]) -> None:
    """Choose a tool and click on places of the frame, in pixels of the film."""
    page.check(f"input[value={tool}]")
    page.locator(".clicks canvas").evaluate("canvas => canvas.scrollIntoView({ block: 'center' })")
    box = page.locator(".clicks canvas").bounding_box()
    for u, v in places:
        page.mouse.click(
            box["x"] + (u + 0.5) / film.size[0] * box["width"],
            box["y"] + (v + 0.5) / film.size[1] * box["height"],
        )


def option(page: Any, name: str) -> str:
    """The value of an option in the command that the page shows."""
    words = shlex.split(page.locator(".clicks pre code").text_content())
    return words[words.index(name) + 1]


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_clicks_become_a_command(browser: Any, refused: tuple[Film, Path], size: str) -> None:
    film, path = refused
    width, height = SIZES[size]
    with browser.new_context(viewport={"width": width, "height": height}) as context:
        page, said = context.new_page(), []
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(path.as_uri())
        until(page, "document.querySelector('.clicks-note')?.textContent === 'Nothing is clicked yet.'")
        assert page.locator(".clicks > button").is_disabled()
        frame = int(page.locator(".clicks output").text_content().split()[1].rstrip(","))
        wanted = {"marks": marks(film, frame, (2, 3)), "edge": edge(film, frame)}
        click(page, film, "marks", wanted["marks"])
        assert page.locator(".clicks-note").text_content().startswith("Marks need the edge")
        click(page, film, "edge", wanted["edge"])
        click(page, film, "pivot", [film.pivot])
        read = read_clicks(option(page, "--clicks"))
        assert read.frame == frame and read.pivot == pytest.approx(film.pivot, abs=1)
        for name, places in wanted.items():
            for at, place in zip(getattr(read, name), places, strict=True):
                assert at == pytest.approx(place, abs=1)
        page.keyboard.press("ArrowRight")
        moved = read_clicks(option(page, "--clicks")).pivot
        assert moved is not None and read.pivot is not None
        assert moved[0] - read.pivot[0] == pytest.approx(0.5, abs=0.11)
        click(page, film, "region", [(10, 300), (200, 20)])
        assert option(page, "--region") == "10,20,200,300"
        page.get_by_text("Leave this frame out").click()
        page.get_by_label("Frames per second").fill("30,x:240")
        assert page.locator(".clicks-note").text_content().startswith("Frames per second must be")
        page.get_by_label("Frames per second").fill("30,61:240")
        assert (option(page, "--leave-out"), option(page, "--fps")) == (str(frame), "30,61:240")
        assert page.locator(".clicks > button").is_enabled()
        page.get_by_text("Begin again").click()
        assert "--clicks" not in page.locator(".clicks pre code").text_content()
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert [v["id"] for v in Axe().run(page).response["violations"]] == []
        assert said == []


def test_the_page_tracks_the_film_again(opened: Opened, refused: tuple[Film, Path]) -> None:
    film, _ = refused
    page = opened.go()
    page.click("#to-film")
    page.set_input_files("#file", film.path)
    page.fill("#loop-W", "3.9")
    page.click("#go")
    page.wait_for_selector("#refused:not([hidden])")
    assert page.locator("#failed").text_content().startswith("No disk with marks in red")
    assert page.locator("#track-again").is_disabled()
    frame = int(page.locator(".clicks output").text_content().split()[1].rstrip(","))
    click(page, film, "marks", marks(film, frame, (2, 3)))
    assert page.locator("#track-again").is_disabled()
    click(page, film, "edge", edge(film, frame))
    assert Axe().run(page).violations_count == 0
    page.click("#track-again")
    # It was refused because red and orange are missing. Now it is tracked, and a model is fitted.
    until(page, "document.getElementById('stages').textContent.includes('fit')", 90)
    assert "refining the positions" in page.locator("#stages").text_content()
    # A fast fit ends before it is cancelled.
    page.evaluate("document.getElementById('cancel').click()")
    until(page, "document.getElementById('work').hidden")
