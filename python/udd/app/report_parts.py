"""The pictures and tables of a report as files of their own."""

from __future__ import annotations

import base64
import csv
import io
import re
from html.parser import HTMLParser
from pathlib import Path

_ENDINGS = {"image/png": "png", "image/svg+xml": "svg", "video/mp4": "mp4"}


class _Reader(HTMLParser):
    """Notes headings, embedded pictures and the cells of tables."""

    def __init__(self) -> None:
        super().__init__()
        self.heading = ""
        self.pictures: list[tuple[str, str, bytes]] = []
        self.tables: list[tuple[str, list[list[str]]]] = []
        self._text: list[str] | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag in ("h1", "h2", "h3", "th", "td"):
            self._text = []
        elif tag == "table":
            self.tables.append((self.heading, []))
        elif tag == "tr" and self.tables:
            self.tables[-1][1].append([])
        elif tag in ("img", "video", "source"):
            kind, _, content = (given.get("src") or "").removeprefix("data:").partition(";base64,")
            if kind in _ENDINGS:
                title = given.get("alt") or given.get("aria-label") or self.heading
                self.pictures.append((title, _ENDINGS[kind], base64.b64decode(content)))

    def handle_endtag(self, tag: str) -> None:
        if self._text is None:
            return
        text = re.sub(r"\s+", " ", "".join(self._text)).strip()
        if tag in ("h1", "h2", "h3"):
            self.heading, self._text = text, None
        elif tag in ("th", "td"):
            self.tables[-1][1][-1].append(text)
            self._text = None

    def handle_data(self, data: str) -> None:
        if self._text is not None:
            self._text.append(data)


def split(report: Path, folder: Path) -> list[dict[str, str]]:
    """Write the parts of a report into a folder; their names and titles, the whole report first."""
    reader = _Reader()
    reader.feed(report.read_text(encoding="utf-8"))
    made = [
        {"name": "report.html", "title": "The whole report"},
        {"name": "measurement.csv", "title": "The measured motion"},
        {"name": "discovery.json", "title": "All numbers, for a machine"},
    ]
    for k, (title, ending, content) in enumerate(reader.pictures, start=1):
        name = f"picture-{k}.{ending}"
        (folder / name).write_bytes(content)
        made.append({"name": name, "title": title})
    for k, (title, rows) in enumerate(reader.tables, start=1):
        text = io.StringIO()
        csv.writer(text).writerows(row for row in rows if row)
        name = f"table-{k}.csv"
        (folder / name).write_text(text.getvalue(), encoding="utf-8")
        made.append({"name": name, "title": f"Table: {title}"})
    return made
