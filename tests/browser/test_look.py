"""The looks of the page: dark, projector, phone; what a reload keeps; what is said of links."""

from __future__ import annotations

from typing import Any

import pytest

from browser_for_tests import Opened, until

axe = pytest.importorskip("axe_playwright_python.sync_playwright")


def test_the_panel_shows_the_equations_with_the_numbers_of_the_moment(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.03&state=0,0.001,0.04,0")
    page.click("#tab-what")
    until(page, "document.getElementById('equations').textContent.includes('dZ/dT')")
    before = page.locator("#equations").text_content()
    page.wait_for_timeout(600)
    assert page.locator("#equations").text_content() != before
    assert page.evaluate("document.querySelector('.what img').naturalWidth") > 100


def test_dark_and_projector_are_kept_over_a_reload(opened: Opened) -> None:
    page = opened.go()
    page.click("#dark")
    page.click("#projector")
    page.reload()
    until(page, "globalThis.udd?.stats.frames > 3")
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    assert page.evaluate("document.body.classList.contains('projector')")
    # Large enough to read: its height was 45 px.
    page.click("#tab-diagram")
    until(page, "document.getElementById('diagram').clientHeight > 120")
    assert axe.Axe().run(page).violations_count == 0


INKED = """(id) => {
  const canvas = document.getElementById(id);
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  const colours = new Set();
  for (let k = 0; k < data.length; k += 4) colours.add(data[k] << 16 | data[k + 1] << 8 | data[k + 2]);
  return colours.size;
}"""


@pytest.mark.parametrize(
    ("tab", "canvas"), [("section", "section"), ("section", "return"), ("diagram", "exponent")]
)
def test_a_map_is_drawn_again_in_other_colours(opened: Opened, tab: str, canvas: str) -> None:
    page = opened.go(f"#model=dle&w=3.9&state=1,1,0.01&tab={tab}")
    until(page, "udd.sections.points.length > 0 || udd.diagram.exponents")
    page.evaluate("udd.play(false)")
    for _ in range(2):
        page.wait_for_timeout(200)
        assert page.evaluate(INKED, canvas) > 3
        page.click("#dark")
    opened.said.clear()  # the browser remarks that the test reads pixels


def test_the_axes_of_a_projector_are_labelled_without_overlap(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.03&state=0,0.001,0.04,0&tab=series")
    page.click("#projector")
    page.wait_for_timeout(2000)  # the axes grow with the motion
    boxes = page.evaluate("udd.phase.boxes")
    assert len(boxes) >= 5  # three names, and numbers
    for k, (left, top, right, bottom) in enumerate(boxes):
        assert left >= 0 and right <= page.evaluate("udd.phase.width")
        for other in boxes[:k]:
            assert right < other[0] or left > other[2] or bottom <= other[1] or top >= other[3]
    numbers = """async (range) => {
      const { ticks } = await import("/static/plot.js");
      return ticks(...range).map(([, text]) => text);
    }"""
    assert page.evaluate(numbers, [-8.5, 8.5, 2.6]) == ["−5", "0", "5"]
    assert page.evaluate(numbers, [0, 22, 11]) == [str(k) for k in range(0, 23, 2)]


def test_a_phone_shows_the_disk_play_and_the_drive_at_once_and_scrolls(browser: Any, link: str) -> None:
    one = Opened(browser, link, "phone")
    page = one.go()
    for part in ("#disk", "#play", "#drive input[type=range]"):
        box = page.locator(part).bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] <= 844
    page.click("#tour-begin")
    # Nothing stays covered; the page may still grow after the first scroll.
    bottom, top = (f"document.querySelector('{part}').getBoundingClientRect()" for part in ("#maps", "#tour"))
    until(page, f"scrollTo(0, 1e6), {bottom}.bottom <= {top}.top")
    # A step shows what it speaks of: the balance, then the section.
    for tab in ("energy", "section"):
        page.click("#tour-next")
        until(page, f"document.querySelector('#tab-{tab}').getBoundingClientRect().top >= 0")
        until(page, f"document.querySelector('#pane-{tab} canvas').getBoundingClientRect().top < 500")
        # The balance's legend grows with its first numbers; its whole curve must stay above the tour's box.
        if tab == "energy":
            until(page, f"document.querySelector('#energy').getBoundingClientRect().bottom <= {top}.top")
    page.click("#tour-end")
    page.evaluate("scrollTo(0, 0)")
    assert page.locator("#plane").is_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.eval_on_selector("#phase", "e => getComputedStyle(e).touchAction") == "pan-y"
    assert axe.Axe().run(page).violations_count == 0
    one.context.close()


def test_a_number_far_beyond_its_range_in_a_link_is_changed_and_said(opened: Opened) -> None:
    page = opened.go("#model=disk&W=50&state=0,0.001,0.04,0")
    assert "W = 5000 cm/s was changed to 14 cm/s" in page.locator("#toast").text_content()


def test_a_run_is_copied_without_the_token_and_opened_again(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.031&state=0,0.001,0.04,0")
    page.click("#open")
    page.fill("#open-link", "http://else.where/?token=x#model=dle&w=3.5&state=1,1,0")
    page.click("#open-go")
    until(page, "udd.home.model.w === 3.5")


def test_an_ended_run_s_button_starts_it_again(opened: Opened) -> None:
    page = opened.go()
    page.select_option("#preset", "ejected")
    until(page, "!document.getElementById('over').hidden")
    assert page.locator("#play").text_content() == "Start again"
    page.click("#play")
    until(page, "document.getElementById('over').hidden")


def test_a_diagram_has_first_pixels_soon_and_is_kept(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.03")
    page.wait_for_timeout(3000)  # a reader looks around first; meanwhile the server's process gets ready
    page.click("#tab-diagram")
    until(page, "udd.diagram.found !== null", 2)  # 0.3 s with eight processes on two cores, 3.2 s before
    until(page, "!udd.diagram.working", 60)
    generation = page.evaluate("udd.diagram.kept.size")
    assert generation == 1
    page.click("#tab-section")
    page.click("#tab-diagram")
    assert page.evaluate("udd.diagram.working") is False


def test_the_tour_has_six_steps_with_aims_and_questions(opened: Opened) -> None:
    page = opened.go()
    page.click("#tour-begin")
    for k in range(6):
        assert page.locator("#tour-title").text_content().startswith(f"{k + 1} of 6: ")
        assert page.locator("#tour-question").text_content().endswith("?")
        assert page.locator("#tour button:visible").count() == (2 if k == 5 else 3)
        # The box covers nothing of the stage.
        tour, stage = (page.locator(part).bounding_box() for part in ("#tour", "#stage"))
        assert stage is None or tour["x"] + tour["width"] <= stage["x"]
        if k == 3:
            assert page.is_checked("#twin")
        page.click("#tour-next")
    assert page.locator("#tour").is_hidden() and page.locator("#film").is_visible()


def test_the_film_tab_is_kept_over_a_reload(opened: Opened) -> None:
    page = opened.go()
    page.click("#to-film")
    page.reload()
    until(page, "globalThis.udd && !document.getElementById('film').hidden")
