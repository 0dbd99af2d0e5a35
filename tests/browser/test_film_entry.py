"""Questions before a file is sent: the drive speed, and the columns of a table."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

import udd
from browser_for_tests import Opened, until

axe = pytest.importorskip("axe_playwright_python.sync_playwright")
SAMPLE = Path(udd.__file__).parent / "demo" / "sample.mp4"


def why(opened: Opened) -> str:
    return str(opened.page.locator("#why").text_content())


def test_the_drive_is_asked_for_before_a_film_is_sent(opened: Opened) -> None:
    page = opened.go()
    page.click("#to-film")
    assert why(opened) == "Choose a file first."
    page.set_input_files("#file", SAMPLE)
    assert why(opened).startswith("Say the drive speed W first")
    page.click("#go")
    assert page.locator("#failed").text_content().startswith("Say the drive speed W first")
    assert page.locator("#work").is_hidden()
    page.click("#wheel-box summary")
    page.fill("#loop-wheel", "3")
    page.fill("#loop-rpm", "13,37")
    assert page.input_value("#loop-W") == "4.2"
    assert why(opened) == ""


def test_columns_are_guessed_and_chosen(opened: Opened) -> None:
    page = opened.go()
    page.click("#to-film")
    rows = "".join(f"{k / 50:.2f};{20 * (-1) ** k};{k}\n".replace(".", ",") for k in range(60))
    table = ("Tijd;Uitwijking;Aantal\n" + rows).encode()
    page.set_input_files("#file", {"name": "slinger.csv", "mimeType": "text/csv", "buffer": table})
    until(page, "!document.getElementById('columns').hidden")
    chosen = page.eval_on_selector_all("#column-table select:not([hidden])", "all => all.map(s => s.value)")
    assert chosen == ["t", "theta", "", "s", "deg"]
    assert why(opened).startswith("Say the length of the pendulum first")
    page.fill("#loop-length", "65")
    assert why(opened) == ""
    page.select_option("#column-table tr >> nth=1 >> select >> nth=1", "")
    assert why(opened).startswith("Say which columns are")


def test_a_phone_needs_a_length_alone(opened: Opened) -> None:
    page = opened.go()
    page.click("#to-film")
    page.set_input_files("#file", udd.examples.path("phone.csv"))
    until(page, "!document.getElementById('columns').hidden")
    assert page.eval_on_selector_all("#column-table select", "all => all.map(s => s.value)")[:4] == [
        "t",
        "Omega",
        "",
        "",
    ]
    assert why(opened).startswith("Say the length")
    page.fill("#loop-length", "0.8")
    assert why(opened) == "Length of the pendulum is 0.8 in centimetres. Was it measured in metres?"
    assert "waiting" not in page.get_attribute("#go", "class")
    page.fill("#loop-length", "80")
    assert why(opened) == ""


def test_the_part_before_a_pendulum_swings_is_proposed_to_be_left_out(opened: Opened) -> None:
    page = opened.go()
    page.click("#to-film")
    rate = [0.0] * 100 + [math.sin(k / 20) for k in range(200)]
    rows = "".join(f"{k / 50:.2f},{x:.4f}\n" for k, x in enumerate(rate))
    buffer = ("Time (s),Gyroscope x (rad/s)\n" + rows).encode()
    page.set_input_files("#file", {"name": "phone.csv", "mimeType": "text/csv", "buffer": buffer})
    until(page, "!document.getElementById('columns').hidden")
    assert 2.0 < float(page.input_value("#loop-begin")) < 2.3
    assert page.locator("#begin-said").text_content().startswith("The pendulum hardly turns before 2.")
    page.set_input_files("#file", udd.examples.path("phone.csv"))
    until(page, "document.getElementById('begin-said').textContent === ''")
    assert page.input_value("#loop-begin") == ""


def test_a_driven_pendulum_goes_from_its_table_to_the_verdict(opened: Opened) -> None:
    page = opened.go()
    page.click("#to-film")
    page.set_input_files("#file", udd.examples.path("driven.csv"))
    until(page, "!document.getElementById('columns').hidden")
    chosen = page.eval_on_selector_all("#column-table select", "all => all.map(s => s.value)")
    assert chosen == ["t", "theta", "input", "s", "rad", ""]
    assert why(opened).startswith("Say the length of the pendulum first")
    page.fill("#loop-length", "70")
    assert why(opened) == ""
    page.click("#go")
    page.wait_for_selector("#found:not([hidden])", timeout=300_000)
    assert page.locator("#verdict").text_content() == "effect identified"
    assert "|Ω|" in page.locator("#added").text_content() or "abs(Ω)" in page.locator("#added").text_content()
    rows = page.eval_on_selector_all(
        "#constants tr", "all => all.map(r => r.cells[0].textContent + r.cells[2].textContent)"
    )
    assert any(re.fullmatch(r"gain[34]\.\d+\(\d+\)", row) for row in rows)
    assert any(re.fullmatch(r"length0\.\d+\(\d+\) m", row) for row in rows)
    assert page.locator("#figures small").first.text_content().startswith("of the motion's spread, after ")
    assert page.locator("#movie .panels").count() == 0  # the picture has a legend
    assert axe.Axe().run(page).violations_count == 0
    # A disk's input is the drive itself: its unit is asked for, and W is not.
    page.click("#another")
    disk = "a;b;c;d;e\n" + "".join(f"{k / 50:.2f};{k % 7};{k % 5};{k};{30 + k % 3}\n" for k in range(60))
    page.set_input_files("#file", {"name": "d.csv", "mimeType": "text/csv", "buffer": disk.encode()})
    until(
        page,
        "document.querySelector('#column-table th').textContent === 'a'",
    )
    for k, role in enumerate(["t", "Y", "Z", "beta", "input"]):
        page.select_option(f"#column-table tr >> nth=1 >> select >> nth={k}", role)
    assert why(opened).startswith("Choose the unit of the drive speed")
    page.select_option("#column-table tr >> nth=2 >> select >> nth=4", "cm/s")
    assert why(opened) == ""
