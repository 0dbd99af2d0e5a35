"""The page of a class, its languages, and the time series."""

from __future__ import annotations

from typing import Any

import pytest

from browser_for_tests import Opened, until

axe = pytest.importorskip("axe_playwright_python.sync_playwright")


def test_a_class_sees_no_film_tab(browser: Any, class_link: str) -> None:
    one = Opened(browser, class_link)
    page = one.go()
    assert page.locator("#to-film").is_hidden()
    page.keyboard.press("f")
    assert page.locator("#film").is_hidden()
    page.click("#export summary")
    assert page.locator("#export-mp4").is_hidden()
    assert page.locator("#export-png").is_visible()
    page.keyboard.press("Escape")
    page.click("#tour-begin")
    assert page.locator("#tour-title").text_content().startswith("1 of 5: ")
    for _ in range(5):
        page.click("#tour-next")
    assert page.locator("#tour").is_hidden()
    assert page.locator("#explore").is_visible()
    assert axe.Axe().run(page).violations_count == 0
    one.context.close()
    assert one.said == []


@pytest.mark.parametrize(("code", "play"), [("nl", "Afspelen"), ("de", "Abspielen")])
def test_a_language_survives_a_reload(opened: Opened, code: str, play: str) -> None:
    page = opened.go("#model=disk&W=0.031&state=0,0.001,0.04,0")
    until(page, "udd.player.at > 60")
    with page.expect_event("load"):
        page.select_option("#language", code)
    for _ in range(2):
        until(page, "globalThis.udd?.stats.frames > 3")
        assert page.evaluate("document.documentElement.lang") == code
        page.evaluate("udd.play(false)")
        assert page.locator("#play").text_content() == play
        assert page.evaluate("udd.home.model.W") == 0.031
        assert page.evaluate("udd.home.state[1]") != 0.001  # it went on from what was shown
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        page.reload()
    until(page, "globalThis.udd?.stats.frames > 3")
    assert axe.Axe().run(page).violations_count == 0


def test_a_browser_s_language_is_taken(browser: Any, link: str) -> None:
    one = Opened(browser, link, locale="de-AT")
    page = one.go()
    assert page.evaluate("document.documentElement.lang") == "de"
    one.context.close()


def test_a_time_series_has_chosen_axes(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.03&state=0,0.001,0.04,0&tab=series")
    until(page, "udd.player.at > 120")
    page.select_option("#series-up", "Z")
    until(page, "udd.series.axes.range[3] > 3.9 && udd.series.axes.range[3] < 8.5")  # cm
    page.select_option("#series-across", "Y")
    until(page, "udd.series.axes.range[0] < 0")
    assert page.evaluate("udd.series.axes.range[1]") < 8.5
    page.select_option("#model", "dle")
    until(page, "udd.player.model.kind === 'dle' && udd.player.at > 30")
    assert page.eval_on_selector_all("#series-up option", "all => all.map((o) => o.value)") == [
        "omega",
        "y",
        "z",
        "beta",
        "friction",
    ]
