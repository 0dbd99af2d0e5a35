"""The documentation's sources; that its pages run, `make docs` checks."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

import udd

DOCS = Path(__file__).resolve().parents[2] / "docs"


def reference(pages: str = "*") -> set[str]:
    """Return the names that pages of the reference list, each of which gets a page."""
    text = "\n".join(path.read_text(encoding="utf-8") for path in (DOCS / "api").glob(f"{pages}.md"))
    return set(re.findall(r"^   udd\.([\w.]+)$", text, re.MULTILINE))


def test_the_reference_lists_every_public_name() -> None:
    public = {name for name in udd.__all__ if not inspect.ismodule(getattr(udd, name))}
    assert public - reference() == set()


@pytest.mark.parametrize("module", ["related_systems", "plot"])
def test_the_reference_lists_every_function_of(module: str) -> None:
    assert reference(module) == {f"{module}.{name}" for name in getattr(udd, module).__all__}


def test_the_bibliography_lists_every_work_that_the_code_cites_under_its_number() -> None:
    text = (DOCS / "references.md").read_text(encoding="utf-8")
    bibliography = re.sub(r"\s+", " ", text)
    listed = re.findall(r"^(\d+)\. (.*(?:\n    .*)*)", text, re.MULTILINE)
    entries = {number: re.sub(r"\s+", " ", entry) for number, entry in listed}
    cited = set()
    for path in [*(DOCS.parent / "python").rglob("*.py"), *(DOCS.parent / "rust").rglob("*.rs")]:
        text = re.sub(r"\s+(//[/!]?\s+)?", " ", path.read_text(encoding="utf-8"))
        for work, number in re.findall(r"\b(\d+ \((?:19|20)\d\d\) [A-Z]?\d+)(?: \[(\d+)\])?", text):
            cited.add(work)
            assert not number or work in entries[number], f"{path.name} cites {work} as [{number}]"
    assert len(cited) > 20
    assert {work for work in cited if work not in bibliography} == set()


def test_every_page_is_in_the_table_of_contents() -> None:
    listed: set[Path] = set()
    for page in DOCS.rglob("*.md"):
        trees = re.findall(
            r"^```\{toctree\}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
        )
        lines = [line for tree in trees for line in tree.splitlines() if line and not line.startswith(":")]
        listed |= {(page.parent / f"{line}.md").resolve() for line in lines}
    written = {page for page in DOCS.rglob("*.md") if not {"_build", "generated"} & set(page.parts)}
    assert written - listed == {DOCS / "index.md"}


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
