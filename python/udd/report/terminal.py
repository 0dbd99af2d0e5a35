"""A report for the terminal: the same sentences, numbers and tables as the page's, as plain text."""

from __future__ import annotations

import re
from collections.abc import Iterator

from markupsafe import Markup

from .document import (
    Bullets,
    Head,
    Number,
    Paragraph,
    Part,
    Report,
    Section,
    Subheading,
    Table,
    Text,
    text_of,
)

_ASCII = {
    "Ω": "Omega",
    "ω": "omega",
    "β": "beta",
    "θ": "theta",
    "κ": "kappa",
    "φ": "phi",
    "ε": "eps",
    "π": "pi",
    "χ": "chi",
    "±": "+-",
    "×": "x",
    "−": "-",
    "–": "-",
    "“": '"',
    "”": '"',
    "\u00a0": " ",
    "\u2002": " ",
}
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def as_text(report: Report) -> str:
    """Render a report as text, in characters that every terminal has; pictures are left out."""
    return "\n".join(
        [*_head(report.head), *(line for section in report.sections for line in _section(section))]
    )


def _head(head: Head) -> Iterator[str]:
    # The verdict stands before the title already.
    yield f"{head.verdict}: {_line(head.title).removeprefix('Nothing is missing: ')}"
    yield from (f"  {_line(one.text)}" for one in head.said)
    yield from (f"  {_number(one)}" for one in head.numbers)
    yield from (f"  {_line(one.text)}" for one in head.notes)


def _section(section: Section) -> Iterator[str]:
    yield f"{_line(section.heading)}:"
    yield from (f"  {line}" for part in section.parts for line in _part(part))


def _part(part: Part) -> Iterator[str]:
    if isinstance(part, Bullets):
        yield from (f"- {_line(entry)}" for entry in part.entries)
    elif isinstance(part, Table):
        yield from _table(part)
    elif isinstance(part, (Paragraph, Subheading)):
        yield _line(part.text)


def _table(table: Table) -> Iterator[str]:
    rows = [tuple(column.title for column in table.columns), *table.rows]
    cells = [[_line(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    for row in cells:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def _number(number: Number) -> str:
    remark = f" ({_line(number.remark)})" if number.remark else ""
    return f"{_line(number.what)}: {_line(number.value)}{remark}"


def _line(text: Text) -> str:
    """Text without tags and without symbols that a terminal may lack."""
    bare = text_of(text) if isinstance(text, Markup) else text
    spelt = re.sub("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", lambda m: f"^{m[0].translate(_RAISED)}", bare)
    for symbol, name in _ASCII.items():
        spelt = spelt.replace(symbol, name)
    return " ".join(spelt.split())
