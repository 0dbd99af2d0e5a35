"""The pictures and tables of a report as files of their own."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from udd.report.document import Report


def save_parts(report: Report, folder: Path) -> list[dict[str, str]]:
    """Write the parts of a report into a folder; their names and titles, the whole report first."""
    made = [
        {"name": "report.html", "title": "The whole report"},
        {"name": "measurement.csv", "title": "The measured motion"},
        {"name": "discovery.json", "title": "All numbers, for a machine"},
    ]
    for k, image in enumerate(report.images, start=1):
        name = f"picture-{k}.{image.ending}"
        (folder / name).write_bytes(image.content)
        made.append({"name": name, "title": image.alt})
    for k, table in enumerate(report.tables, start=1):
        text = io.StringIO()
        csv.writer(text).writerows(table.plain())
        name = f"table-{k}.csv"
        (folder / name).write_text(text.getvalue(), encoding="utf-8")
        made.append({"name": name, "title": f"Table: {table.title}"})
    return made
