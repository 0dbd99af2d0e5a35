"""The terminal shows the page's report: the same sentences, numbers and tables, as text."""

from __future__ import annotations

import pytest
from markupsafe import Markup

import discovered
from udd.report import as_text, report_of, summary_of
from udd.report.document import Bullets, Column, Head, Number, Paragraph, Report, Section, Table


@pytest.mark.parametrize("made", [discovered.disk, discovered.nothing, discovered.pendulum])
def test_the_terminal_and_the_page_have_one_report(made):
    result = made()
    page, summary = report_of(result), summary_of(result)
    assert summary.head == page.head
    sections = {section.heading: section.parts for section in page.sections}
    for section in summary.sections:
        # Nothing is said here that the page does not say, nor said twice in other words.
        assert set(section.parts) <= set(sections[section.heading])
    text = as_text(page)
    assert text.isascii()
    assert "<" not in text.replace("<=", "").replace("< ", "")
    assert text.splitlines()[0].startswith(f"{result.verdict}: ")
    assert set(as_text(summary).splitlines()) <= set(text.splitlines())
    for name in result.fit.parameters:
        own = name.rpartition(".")[2]
        assert any(line.split()[:1] == [own] for line in text.splitlines()), name


def test_nothing_missing_is_said_once():
    first = as_text(summary_of(discovered.nothing())).splitlines()[0]
    assert first.startswith("nothing missing: the known model explains this motion")


def test_formulas_numbers_and_tables_are_spelt_out():
    rows = ((Markup("Ω<sup>2</sup>"), "5.0(1) × 10⁻⁶"), ("k", "−1"))
    table = Table("numbers", (Column("name"), Column("value")), rows)
    number = Number(Markup("χ²"), "2.5\u00a0mm", "95 % interval")
    head = Head("", Markup("I<sub>c</sub> dΩ/dT = &minus;k"), "found", (Paragraph("why"),), (number,))
    report = Report(head, (Section("Parts", (table, Bullets(("a", "b")))),))
    assert as_text(report).splitlines() == [
        "found: I_c dOmega/dT = -k",
        "  why",
        "  chi^2: 2.5 mm (95 % interval)",
        "Parts:",
        "  name     value",
        "  Omega^2  5.0(1) x 10^-6",
        "  k        -1",
        "  - a",
        "  - b",
    ]
