"""The page stands alone, says what was found in words, and is written whole or not at all."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
import pytest

import discovered
import udd
from udd import _core
from udd.discovery.discover import _title
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.term_library import waves
from udd.errors import UddError
from udd.fitting.innovations import innovations
from udd.fitting.parameter_meanings import meaning
from udd.report import runs, tables
from udd.report import wording as words
from udd.report.discovery_report import head as head_of
from udd.report.loose_fit import loosest

_VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """A page: its tags, nested as they are, and its text."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.text: list[str] = []
        self.feed(source)
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> was never opened"
        assert self.open.pop() == tag, f"</{tag}> closes something else"

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.text.append(data)

    @property
    def words(self) -> str:
        return " ".join("".join(self.text).split())

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attrs for name, attrs in self.tags if name == tag]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("pages")
    results = {"disk": discovered.disk(), "nothing": discovered.nothing(), "pendulum": discovered.pendulum()}
    for name, result in results.items():
        result.report(folder / f"{name}.html", command=f"udd discover {name}.csv <&>")
    return {name: (folder / f"{name}.html").read_text(encoding="utf-8") for name in results}


@pytest.mark.parametrize("name", ["disk", "nothing", "pendulum"])
def test_the_page_stands_alone(pages: dict[str, str], name: str) -> None:
    source = pages[name]
    page = Page(source)
    assert not page.all("script") + page.all("link") + page.all("iframe")
    for tag, attrs in page.tags:
        for key in ("src", "href", "srcset", "data", "poster"):
            assert (attrs.get(key) or "data:").startswith(("data:", "#")), (tag, key)
    style = re.search(r"<style>(.*?)</style>", source, re.S)
    assert style is not None
    assert "url(" not in style[1]
    assert "@import" not in style[1]
    assert len(source) < 6e6  # a page that mail takes


@pytest.mark.parametrize("name", ["disk", "nothing", "pendulum"])
def test_the_page_can_be_read_aloud(pages: dict[str, str], name: str) -> None:
    page = Page(pages[name])
    assert page.all("html") == [{"lang": "en"}]
    assert len(page.all("h1")) == len(page.all("main")) == len(page.all("title")) == 1
    assert all(image.get("alt") for image in page.all("img"))
    assert len({image["src"] for image in page.all("img")}) == len(page.all("img")) >= 7
    assert len(page.all("figcaption")) == len(page.all("figure"))
    assert "<&>" in page.words  # what came from outside is text, not markup


@pytest.mark.parametrize(
    ("ratio", "witness", "told"),
    [
        ((0.9, 0.85, 0.95), "held", "interval 0.85 to 0.95)."),
        ((0.99, 0.97, 1.01), "fitted", "in a fit that includes them, χ² decreased"),
        ((1.005, 1.001, 1.008), "halves", "cut into two halves"),
        ((0.99, 0.97, 1.01), "halves", "cut into two halves"),
    ],
)
def test_the_held_out_frames_are_described(
    ratio: tuple[float, float, float], witness: Literal["held", "fitted", "halves"], told: str
) -> None:
    (effect,) = discovered.disk().effects
    assert told in words.confirmed_by(replace(effect, ratio=ratio, witness=witness))


def test_an_effect_has_words_and_numbers(pages: dict[str, str]) -> None:
    result, text = discovered.disk(), Page(pages["disk"]).words
    (effect,) = result.effects
    assert effect.effect.meaning[1:] in text
    assert words.with_error(effect.parameters["b"], effect.errors["b"]) in text
    for h in result.error_before.horizons:
        assert words.length(result.error_after.at(h)[0], "m") in text
    else_ = text[text.rindex("Alternatives") : text.rindex("Limits of these data")]
    assert "Slip c Z" in else_
    assert "film a second drive" in text
    assert "camera turned clockwise" in text
    assert udd.effects.relaxation().title in text


def test_the_page_follows_the_reader(pages: dict[str, str]) -> None:
    """The sections: motion, errors, residuals, added effect, alternatives, limits, numbers, command."""
    heads = re.findall(r"<h2>(.*?)</h2>", pages["disk"])
    assert heads == [
        "The measured motion",
        "The error, before and after",
        "Where the known model fails",
        "The added effect, and why",
        "Alternatives",
        "Limits of these data",
        "The numbers",
        "To do it again",
    ]
    text = Page(pages["disk"]).words
    assert "a disk of radius 8 cm that two wheels lift at 4.2 cm/s (as stated): 499 frames" in text
    assert f"numpy {np.__version__}" in text


def test_whiteness_before_and_after_is_told(pages: dict[str, str]) -> None:
    result = discovered.disk()
    before, after = innovations(result.baseline), innovations(result.fit)
    rows = tables.whiteness([before, after])
    assert [row["square"] for row in rows[::2]] == [f"{x:.3g}" for x in before.chi2]
    text = Page(pages["disk"]).words
    for row in rows:
        assert f"{row['model']}{row['square']}{row['largest']}" in text  # cell by cell


@pytest.mark.parametrize("name", ["disk", "nothing", "pendulum"])
def test_the_motion_moves(pages: dict[str, str], name: str) -> None:
    """The moving drawing turns what was measured as it was measured, at half its speed."""
    results = {"disk": discovered.disk, "nothing": discovered.nothing, "pendulum": discovered.pendulum}
    result = results[name]()
    drawn = [i for i in Page(pages[name]).all("img") if (i["alt"] or "").startswith("A moving picture")]
    assert len(drawn) == 1
    uri = drawn[0]["src"] or ""
    drawing = ElementTree.fromstring(base64.b64decode(uri.partition("base64,")[2]))
    moves = drawing.findall(".//{*}animateTransform")
    turns = [m for m in moves if m.attrib["type"] == "rotate"]
    panels = 1 + 1 + bool(result.effects)
    assert len(turns) == panels
    times, seen, _ = runs.side_by_side(result, 6.0 if name != "pendulum" else 12.0)
    assert {m.attrib["dur"] for m in moves} == {f"{2 * (times[-1] - times[0]):g}s"}
    angle = np.degrees(seen[:, -1] if name != "pendulum" else -seen[:, 0])
    shown = np.array([float(x) for x in turns[0].attrib["values"].split(";")])
    there = np.isfinite(angle)
    np.testing.assert_allclose(shown[there], angle[there], atol=0.06)  # a decimal of a degree


def test_the_command_that_does_it_again() -> None:
    discovery = discovered.pendulum()
    assert words.command(discovery, "my swing.csv") == (
        "udd discover 'my swing.csv' --pendulum 0.6 --k0 0.01 --report report.html"
    )
    assert words.command(discovered.disk(), "a.csv") == "udd discover a.csv --W 0.042 --report report.html"
    assert words.command(discovery, None) is None


def test_noise_that_no_measurement_stated_is_not_said_to_be_stated(pages: dict[str, str]) -> None:
    assert discovered.pendulum().measurement.sigma is None
    assert "assumed beforehand" in Page(pages["pendulum"]).words
    assert "the measurement said" not in Page(pages["pendulum"]).words
    m = discovered.pendulum().measurement.slice(0, 10)
    stated = udd.Measurement(m.t, {"theta": m["theta"]}, np.full((len(m), 1), 2e-3))
    fit = udd.fit(stated, udd.Pendulum(0.6), free=["k0"])
    assert tables.noise_beforehand(fit) == "the measurement said"


def test_nothing_missing_is_said(pages: dict[str, str]) -> None:
    text = Page(pages["nothing"]).words
    assert "Nothing is missing" in text
    assert "“nothing missing” means that these data need no further effect" in text
    assert "with the effect" not in text


def test_a_law_that_the_library_lacks_is_named_by_its_title():
    discovery = discovered.pendulum()
    (wave,) = waves(udd.Pendulum(1.0), [0.3])
    added = replace(discovery.effects[0], effect=wave.effect, title=wave.title, curve=None)
    named = replace(discovery, effects=[added], alternatives=[], verdict="effect identified")
    assert words.verdict(named) == "There is a wave of frequency 0.3 in torque."


def test_a_model_that_does_not_explain_is_not_called_complete() -> None:
    calm = discovered.nothing()
    assert "Nothing is missing" in words.verdict(calm)
    wrong = replace(calm, error_before=discovered.disk().error_before)
    assert "does not explain this motion" in words.verdict(wrong)
    lost = replace(calm, verdict="effect present, form not identified")
    assert "no effect of the library explains" in words.verdict(lost)


def test_a_pendulum_has_its_page(pages: dict[str, str]) -> None:
    text = Page(pages["pendulum"]).words
    assert "The air resists with the square of the speed" in text
    assert "Effects that the model of the pendulum lacks" in text
    assert "mrad" in text


def test_the_same_result_gives_the_same_page(pages: dict[str, str], tmp_path: Path) -> None:
    discovered.nothing().report(tmp_path / "again.html", command="udd discover nothing.csv <&>")
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == pages["nothing"]


def test_the_input_is_named_with_its_checksum(tmp_path: Path) -> None:
    data = tmp_path / "swing.csv"
    data.write_text("t,theta\n0,1\n")
    discovered.pendulum().report(tmp_path / "page.html", source=data)
    text = Page((tmp_path / "page.html").read_text(encoding="utf-8")).words
    assert "swing.csv" in text
    assert hashlib.sha256(data.read_bytes()).hexdigest() in text


def test_a_page_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    discovery = discovered.pendulum()
    with pytest.raises(UddError, match="there is no folder"):
        discovery.report(tmp_path / "absent" / "page.html")
    with pytest.raises(UddError, match="is a folder"):
        discovery.report(tmp_path)
    with pytest.raises(UddError, match="cannot be read"):
        discovery.report(tmp_path / "page.html", source=tmp_path / "absent.csv")
    with pytest.raises(UddError, match="cannot be read"):
        discovery.report(tmp_path / "page.html", film=tmp_path / "absent.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("value", "error", "said"),
    [
        (5.0312, 0.12, "5.03(12)"),
        (-5.0312, 1.2, "−5.0(1.2)"),
        (0.042, 0.000076, "0.042000(76)"),
        (12345.6, 700.0, "12346(700)"),
        (4.8e-4, 3.4e-4, "4.8(3.4) × 10<sup>−4</sup>"),
        (0.0119999, 2.04e-8, "0.011999900(20)"),
        (0.5, 0.0996, "0.50(10)"),
        (-0.0001, 0.051, "0.000(51)"),
        (0.08, None, "0.08"),
        (1.5, float("nan"), "1.5"),
    ],
)
def test_values_carry_two_digits_of_their_error(value: float, error: float | None, said: str) -> None:
    assert str(words.with_error(value, error)) == said


@pytest.mark.parametrize(
    ("formula", "said"),
    [
        ("torque = -c Omega^3", "torque = −c Ω<sup>3</sup>"),
        ("W_c = W - b W Z", "W<sub>c</sub> = W − b W Z"),
        ("torque = -kappa beta + c", "torque = −κ β + c"),
        ("1 < 2", "1 &lt; 2"),
        ("dOmega/dT", "dΩ/dT"),
    ],
)
def test_formulas_are_written_as_people_do(formula: str, said: str) -> None:
    assert str(words.pretty(formula)) == said


def test_every_parameter_is_explained() -> None:
    names = [(name, model.kind) for model in (udd.Disk(0.04), udd.Pendulum(0.5)) for name in model.parameters]
    names += [(n, kind) for kind in ("disk", "pendulum") for n, _unit in _core.camera_parameters(kind)]
    assert {name for name, kind in [*names, ("clock", "disk")] if not meaning(name, kind)} == set()


def test_small_chances() -> None:
    assert words.probability(0.25) == "0.25"
    assert words.probability(3e-7) == "below 10<sup>−6</sup>"
    assert words.probability(0.0) == "below 10<sup>−300</sup>"


def test_what_no_library_holds_is_told_by_its_curve(tmp_path: Path) -> None:
    """A torque with seven waves per turn: the page says along what, and shows the curve."""
    result = discovered.outside()
    assert result.effects and result.effects[0].curve is not None
    result.report(tmp_path / "page.html")
    page = Page((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert "depending on the orientation β" in page.words
    assert "torque as a function of beta, with its band" in [image["alt"] for image in page.all("img")]
    assert "Table of the best curves" in page.words
    assert "effects of the library were tried; " not in page.words  # more than these


def test_one_equation_s_terms_are_counted() -> None:
    told = "the rate v' has one more term"
    assert words._counted([told] * 4) == ["the rate v' has 4 more terms"]
    assert words._counted([told, "the rate x' has one more term"]) == [told, "the rate x' has one more term"]


def test_a_wave_is_called_by_the_frequency_that_was_fitted() -> None:
    tried = udd.effects.drive_ripple(a=0.1, b=0.0, f=0.284)
    candidate = Candidate(tried, "drive ripple at 0.284 Hz")
    assert _title(candidate, tried.replace(f=0.29178)) == "drive ripple at 0.2918 Hz"
    (wave,) = waves(udd.Model(["v"], {"v": "-v"}), [1.714])
    assert _title(wave, wave.effect.replace(f=1.7293)) == "a wave of frequency 1.729 in v'"


def test_camera_parameters_are_explained_where_they_appear() -> None:
    t = np.arange(0, 20, 0.05)
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.5]).state[:, 1]
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    text = udd.fit(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0)).summary()
    assert "zero of the angle" in text
    assert "pivot above the assumed one, in lengths of the pendulum" in text


def test_contents_guide_and_data_are_on_the_page(pages: dict[str, str]) -> None:
    page, source = Page(pages["disk"]), pages["disk"]
    targets = {attrs["href"] for tag, attrs in page.tags if tag == "a" and attrs["href"].startswith("#")}
    there = {f"#{attrs['id']}" for tag, attrs in page.tags if tag == "section"}
    assert targets == there and len(there) > 5
    assert "How to read this page" in source
    tables = [attrs for tag, attrs in page.tags if tag == "a" and "download" in attrs]
    assert tables and all(one["href"].startswith("data:text/csv") for one in tables)
    for puzzle in ("still there in the next", "over none [nats]", "a 24th of"):
        assert puzzle not in source


def test_effects_that_act_identically_have_equal_bars() -> None:
    from udd.plot.evidence import decreases

    discovery = discovered.disk()
    (effect,) = discovery.effects
    alike = [other.title for other in discovery.alternatives if other.likeness > words.IDENTICAL]
    assert alike
    assert {decreases(discovery, 0)[title] for title in alike} == {effect.chi2}


def test_the_origin_of_a_film_is_on_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    result, origin = discovered.disk(), "This film was rendered <here>."
    rendered = result.measurement.with_meta(origin=origin)
    monkeypatch.setattr(type(result), "measurement", property(lambda _: rendered))
    assert origin in [str(note.text) for note in head_of(result, "", []).notes]


def test_errors_of_the_known_model_contain_what_it_lacks() -> None:
    """Those that `udd.fit` reports of the same record, and not the hundredth part of them."""
    from udd.report import tables

    discovery = discovered.disk()
    alone = udd.fit(discovery.measurement, udd.Disk(discovered.DRIVE))
    row = next(row for row in tables.parameters(discovery) if row["name"] == "W")
    value, _, brackets = str(row["before"]).rstrip(")").partition("(")
    digits = 0 if "." in brackets else len(value.partition(".")[2])
    error = float(brackets) / 10**digits
    unit = {"m/s": 1.0, "cm/s": 1e2, "mm/s": 1e3}[str(row["unit"])]
    assert error == pytest.approx(unit * alone.errors["W"], rel=0.2)
    assert alone.errors["W"] > 20 * discovery.baseline.errors["W"]


def test_a_written_model_of_a_pendulum_keeps_its_own_model_error() -> None:
    # The record is a pendulum's, the model is text: the model errors assumed for pendulums are not its own.
    t = np.arange(0, 6, 0.05)
    measurement = udd.Measurement(t, {"theta": 0.4 * np.cos(3 * t) * np.exp(-0.1 * t**1.5)})
    model = udd.Model(
        ["theta", "omega"], {"theta": "omega", "omega": "-a*sin(theta)-k*omega"}, {"a": 9.0, "k": 0.01}
    )
    fit = loosest(udd.fit(measurement, model))
    assert fit.problem.diffusion in fit.problem.schedule
    assert fit.with_diagnostics().errors.keys() == {"a", "k"}


def test_an_error_below_the_noise_is_called_no_more_than_noise() -> None:
    discovery = discovered.disk()
    numbers = words.headline(discovery)
    h = discovery.horizon
    value, floor = discovery.error_after.at(h)[0], discovery.error_after.at(h)[3]
    assert numbers.before_note == ""
    assert numbers.after_note == ("no more than noise" if value <= floor else "")
    for error, note in ((1.0, "no more than noise"), (1.01, "")):
        median = np.full_like(discovery.error_after.median, error * floor)
        scaled = dataclasses.replace(
            discovery, error_after=dataclasses.replace(discovery.error_after, median=median)
        )
        assert words.headline(scaled).after_note == note


@pytest.mark.parametrize(
    ("square", "error", "said"),
    [
        (0.01**2 / 24, 1e-7, "10.00(12)"),  # open for 10 ms
        (0.0, 0.01**2 / 48, "at most 10"),
        (-1e-5, 1e-6, "at most 6.9"),
    ],
)
def test_the_shutter_s_row_is_a_time(square: float, error: float, said: str) -> None:
    from types import SimpleNamespace

    from udd.report import tables

    fit: Any = SimpleNamespace(parameters={"shutter": square}, errors={"shutter": error})
    assert tables._open_time(fit, "shutter") == said
    row = next(row for row in tables.camera(discovered.disk()) if row["name"] == "shutter")
    assert row["unit"] == "ms" and row["meaning"] == "time for which the shutter is open"
