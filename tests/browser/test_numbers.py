"""Numbers that are typed: read with a point or a comma, or marked; none is changed without a word."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from browser_for_tests import Opened, until

DRIVE = "#drive .number"
DISK = "#model=disk&W=0.03&state=0,0.001,0.04,0"


def typed(page: Any, field: str, text: str) -> None:
    page.locator(field).fill("")
    page.locator(field).type(text)
    page.keyboard.press("Tab")


def marked(page: Any) -> list[str]:
    return [note.text_content() for note in page.locator(".wrong").all()]


@pytest.mark.parametrize(
    ("text", "value", "shown"),
    [
        ("3,9", 0.039, "3.90"),
        ("3.9", 0.039, "3.90"),
        (" 0,042e2 ", 0.042, "4.20"),
        ("3,1234", 0.031234, "3.1234"),
        (",5", 0.005, "0.50"),
        ("0", 0, "0.00"),
    ],
)
def test_the_drive_is_read_with_a_point_or_a_comma(
    opened: Opened, text: str, value: float, shown: str
) -> None:
    page = opened.go(DISK)
    typed(page, DRIVE, text)
    assert page.evaluate("udd.home.model.W") == value
    assert page.locator(DRIVE).input_value() == shown
    assert marked(page) == []


@pytest.mark.parametrize(
    "text", ["39", "14,01", "-1", "fast", "", "1,2,3", "1.234,5", "0x10", "1e999", "3;9"]
)
def test_a_drive_that_cannot_be_used_is_marked_and_kept(opened: Opened, text: str) -> None:
    page = opened.go(DISK)
    typed(page, DRIVE, text)
    assert page.evaluate("udd.home.model.W") == 0.03
    assert page.locator(DRIVE).input_value() == text
    assert page.locator(DRIVE).get_attribute("aria-invalid") == "true"
    (said,) = marked(page)
    assert text in said
    typed(page, DRIVE, "4")
    assert page.evaluate("udd.home.model.W") == 0.04
    assert marked(page) == []
    assert page.locator(DRIVE).get_attribute("aria-invalid") is None


def test_the_arrow_keys_step_a_number(opened: Opened) -> None:
    page = opened.go(DISK)
    page.locator(DRIVE).focus()
    page.keyboard.press("ArrowUp")
    assert page.evaluate("udd.home.model.W") == 0.0301
    page.keyboard.press("ArrowDown")
    assert page.evaluate("udd.home.model.W") == 0.03


def test_the_arrow_keys_say_where_the_drive_ends(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.1399&state=0,0.001,0.04,0")
    page.locator("h1").click()
    page.keyboard.press("Shift+ArrowRight")
    assert page.evaluate("udd.home.model.W") == 0.14
    assert page.locator("#toast").text_content() == "The drive's slider ends at 14.00 cm/s."


def test_every_slider_has_a_field_that_reads_a_comma(opened: Opened) -> None:
    for link in (DISK, "#model=dle&w=3.9&B=0&state=1,1,0.01"):
        page = opened.go(link)
        page.evaluate("document.getElementById('more').open = true")
        for about in page.evaluate("udd.about(udd.home.model.kind).parameters"):
            middle = round((about["least"] + about["most"]) / 2 * about["scale"], 3)
            field = f".slider:has(#p-{about['name']}) .number"
            typed(page, field, str(middle).replace(".", ","))
            now = page.evaluate("(name) => udd.home.model[name]", about["name"])
            assert now == pytest.approx(middle / about["scale"], rel=1e-11)


def test_an_effect_and_a_start_are_read_with_a_comma_or_marked(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.03&effect=quadratic_drag:c=0.0004&state=0,0.001,0.04,0")
    page.evaluate("for (const d of document.querySelectorAll('#panel details')) d.open = true")
    typed(page, "#effects .number", "0,0005")
    assert page.evaluate("udd.home.model.effects[0].c") == 0.0005
    typed(page, "#effects .number", "-1")
    assert page.evaluate("udd.home.model.effects[0].c") == 0.0005
    assert "not -1" in marked(page)[0]
    typed(page, "#effects .number", "1e-4")
    before = page.evaluate("udd.home.state")
    typed(page, "#start label:nth-child(2) .number", "0,1.")
    page.click("#start-here")
    assert page.evaluate("udd.home.state") == before
    assert "is not a number" in marked(page)[0]
    page.click("#restart")
    typed(page, "#start label:nth-child(2) .number", "0,2")
    exact = page.evaluate("udd.home.state")
    page.click("#start-here")
    assert page.evaluate("udd.home.state") == [exact[0], 0.002, *exact[2:]]


def test_the_numbers_of_a_film_are_marked_before_it_is_sent(opened: Opened, tmp_path: Path) -> None:
    page = opened.go()
    page.click("#to-film")
    page.set_input_files("#file", {"name": "a.csv", "mimeType": "", "buffer": b"t,Y,Z,beta\n1,2,3,4\n"})
    until(page, "!document.getElementById('columns').hidden")
    page.fill("#loop-W", "4,2 cm/s")
    page.click("#go")
    assert "is not a number" in marked(page)[0]
    assert page.locator("#ask").is_visible()
    page.fill("#loop-W", "4,2")
    with page.expect_request("**/api/jobs/film*") as asked:
        page.click("#go")
    assert "W=0.042&" in asked.value.url


@pytest.mark.parametrize(
    ("fragment", "words"),
    [
        ("#model=disk&W=fast&state=0,0.001,0.04,0", "“fast” is not a number (W)"),
        ("#model=disk&W=0x10&state=0,0.001,0.04,0", "“0x10” is not a number (W)"),
        ("#model=disk&W=0.03&state=0,0,001,0.04,0", "needs 4 numbers"),
        ("#model=disk&W=0.03&effect=relaxation:b=x&state=0,0.001,0.04,0", "(relaxation b)"),
        ("#model=disc&W=0.03&state=0,0.001,0.04,0", "names no model"),
        ("#model=disk&W=0.03&state=0,0.001,0.04,0&speed=3", "The speed 3 is not offered"),
    ],
)
def test_a_link_that_cannot_be_read_says_so(opened: Opened, fragment: str, words: str) -> None:
    page = opened.go(fragment)
    assert words in page.locator("#toast").text_content()


def test_a_link_may_hold_a_comma_and_numbers_beyond_the_sliders(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0,25&R=0.08&state=0,0.001,0.04,0")
    assert page.evaluate("udd.home.model.W") == 0.25
    assert page.locator(DRIVE).input_value() == "25.00"


@pytest.mark.nightly  # tests/app/test_app_budgets.py asks the server for the same
def test_a_run_that_takes_too_much_says_so_on_the_stage(opened: Opened) -> None:
    page = opened.page
    page.goto(opened.link + "#model=disk&W=0.03&k0=10000000&state=0,0.001,0.04,0")
    until(page, "document.getElementById('clock').textContent === 'computing…'", 30)
    page.wait_for_selector("#over:not([hidden])", timeout=120_000)
    assert "more than 10 s of computing" in page.locator("#over-text").text_content()
    page.evaluate("document.getElementById('more').open = true")
    typed(page, "#parameters .slider:nth-child(3) .number", "0,01")
    page.wait_for_selector("#over", state="hidden")
    until(page, "udd.player.at > 10")


def test_a_number_with_many_digits_is_rounded_for_the_eye_only(opened: Opened) -> None:
    page = opened.go("#model=disk&W=0.04199979431&effect=relaxation:b=5.999963826&state=2,0.02,-0.02,0")
    field = page.locator("#effects .number")
    assert (page.input_value(DRIVE), field.input_value()) == ("4.2", "6")
    assert field.get_attribute("title") == "5.999963826"
    field.focus()
    field.dispatch_event("change")
    assert page.evaluate("[udd.home.model.W, udd.home.model.effects[0].b]") == [0.04199979431, 5.999963826]
    page.click("#tab-what")
    until(page, "document.getElementById('equations').textContent.includes('W_c = W − b W Z')")
