"""A film goes in, a verdict comes out, in the browser."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import udd
from browser_for_tests import Opened, until

SAMPLE = Path(udd.__file__).parent / "demo" / "sample.mp4"


# test_a_driven_pendulum_goes_from_its_table_to_the_verdict and test_the_demonstration ask for the two halves.
@pytest.mark.nightly
def test_the_sample_film_is_uploaded_to_its_verdict(opened: Opened) -> None:
    page = opened.go()
    page.click("#to-film")
    page.set_input_files("#file", SAMPLE)
    page.fill("#loop-W", "4.2")
    page.click("#go")
    until(page, "document.getElementById('progress').value > 0.2", 300)
    # The marks are drawn on the frames: red where the first one is.
    assert page.locator("#frame-said").text_content().startswith("frame ")
    page.wait_for_selector("#found:not([hidden])", timeout=900_000)
    assert page.locator("#verdict").text_content() == "effect identified"
    said = re.search(r"b = ([\d.]+)\(([\d.]+)\)", page.locator("#added").text_content())
    assert said is not None
    b, error = float(said[1]), float(said[2]) / 10 ** len(said[1].partition(".")[2])
    # The film was made with b = 6; a chance of one in 16000 leads beyond four standard errors.
    assert abs(b - 6.0) < 4 * error < 0.04
    until(page, "document.querySelector('#movie video').readyState >= 2")
    page.click("#downloads summary")
    with page.expect_download() as report:
        page.click("#files a >> nth=0")
    assert "The wheels lift the disk less" in Path(report.value.path()).read_text()
    frame = page.frame_locator("#report")
    assert "effect identified" in frame.locator(".kicker").text_content()
    page.click("#explore-fit")
    until(page, "udd.player.at > 30")
    assert page.evaluate("udd.home.model.effects[0].name") == "relaxation"


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("noise.mp4", b"\0\1\2\3" * 5000, "not a film that can be decoded"),
        ("cut.mp4", SAMPLE.read_bytes()[:300_000], "cut off"),
        ("words.csv", b"a,b,c\n1,2,3\n", "Say which columns are t and"),
        ("empty.csv", b"", "The file is empty"),
    ],
)
def test_a_bad_file_is_answered_with_one_sentence(
    opened: Opened, name: str, content: bytes, words: str
) -> None:
    page = opened.go()
    page.click("#to-film")
    page.fill("#loop-W", "4.2")
    page.set_input_files("#file", {"name": name, "mimeType": "", "buffer": content})
    if name.endswith("mp4"):
        page.click("#go")
    elif name == "words.csv":  # its columns are asked for instead
        until(page, "document.getElementById('why').textContent !== 'The table is being read.'")
        page.click("#go")
    until(page, "document.getElementById('failed').textContent !== ''", 120)
    said = page.locator("#failed").text_content()
    assert words in said
    assert said.count(". ") == 0
    if name == "empty.csv":  # the browser notes that it was refused
        assert all("400" in line for line in opened.said)
        opened.said.clear()


def test_a_huge_file_is_not_even_sent(opened: Opened, tmp_path: Path) -> None:
    page = opened.go()
    page.click("#to-film")
    huge = tmp_path / "huge.mp4"
    with huge.open("wb") as file:
        file.truncate(400 << 20)
    page.set_input_files("#file", huge)
    assert page.locator("#failed").text_content() == "The file is larger than 300 MB."


def test_a_job_is_cancelled(opened: Opened) -> None:
    page = opened.go()
    page.click("#to-film")
    page.click("#sample")
    until(page, "document.getElementById('stages').textContent.includes('film')")
    page.click("#cancel")
    until(page, "document.getElementById('failed').textContent === 'Cancelled.'")
