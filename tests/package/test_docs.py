"""The documentation's sources; that its pages run, `make docs` checks."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

import udd

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_reference_holds_every_public_name() -> None:
    told = "\n".join(path.read_text(encoding="utf-8") for path in (DOCS / "api").glob("*.md"))
    described = set(re.findall(r"auto(?:class|function|exception):: udd\.(\w+)\n", told))
    wanted = {name for name in udd.__all__ if not inspect.ismodule(getattr(udd, name))}
    assert wanted - described == set()


@pytest.mark.parametrize("module", ["related_systems", "plot"])
def test_the_reference_holds_every_function_of(module: str) -> None:
    told = (DOCS / "api" / f"{module}.md").read_text(encoding="utf-8")
    described = set(re.findall(rf"autofunction:: udd\.{module}\.(\w+)\n", told))
    assert described == set(getattr(udd, module).__all__)


def test_every_page_is_in_the_table_of_contents() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    for page in DOCS.glob("*.md"):
        assert page.stem == "index" or f"\n{page.stem}\n" in index


def test_the_gallery_has_every_plot_function() -> None:
    shown = set(re.findall(r"udd\.plot\.(\w+)\(", (DOCS / "pictures.md").read_text(encoding="utf-8")))
    assert shown == set(udd.plot.__all__)


def test_the_changelog_has_a_short_line_for_each_change() -> None:
    text = (DOCS.parent / "CHANGELOG.md").read_text(encoding="utf-8")
    assert len(text.encode()) <= 8000
    changes = re.split(r"\n(?=- |\n)", text)
    assert [change for change in changes if change.startswith("- ") and len(change) > 140] == []
    for heading in re.findall("^## (.*)$", text, re.MULTILINE):
        assert re.fullmatch(r"\d+\.\d+\.\d+ - \d{4}-\d\d-\d\d|Unreleased", heading)
