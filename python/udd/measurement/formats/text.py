"""Text tables: commas, semicolons, tabs or blanks, with the habits of Excel, of Tracker and of phyphox."""

from __future__ import annotations

import csv
import json
import re
from typing import Any

from udd.errors import MeasurementError

from .headings import headings
from .table import Table, number

_FIRST = 50  # rows in which a header is looked for


def read(raw: bytes, given: list[str] | None) -> list[Table]:
    """Read a text table; `given` names its columns instead of a header.

    Lines ``# key = value`` are about the whole file. Excel's byte order mark, its line ``sep=;``, decimal
    commas beside semicolons or tabs, and empty rows are understood. Tracker's export of several points begins
    with ``#multi:`` and a row of their names, and repeats the columns of each: they are called ``mass A x``.
    """
    meta: dict[str, Any] = {}
    body: list[tuple[int, str]] = []
    several, mark = False, ""
    for line_number, line in enumerate(_decoded(raw).splitlines(), start=1):
        if line.lstrip().startswith("#"):
            several |= line.lstrip().lower().startswith("#multi:")
            key, equals, text = line.lstrip().lstrip("#").partition("=")
            if equals:
                meta[key.strip()] = value(text.strip())
        elif not body and re.fullmatch(r"sep=.", line.strip()):
            mark = line.strip()[-1]
        elif line.strip():
            body.append((line_number, line))
    if not body:
        raise MeasurementError("the file holds no rows")
    mark = mark or _delimiter([line for _, line in body])
    comma = mark in ";\t" and sum("," in line for _, line in body) > len(body) / 2
    cells = [_split(line, mark) for _, line in body]
    names, start = _header(cells, comma, given)
    if several and start > 1:
        names = _of_points(names, cells[start - 2])
    rows = [
        (line_number, row)
        for (line_number, _), row in zip(body[start:], cells[start:], strict=True)
        if any(cell and cell.lower() != "nan" for cell in row)
    ]
    columns: list[Any] = [[row[k] if k < len(row) else None for _, row in rows] for k in range(len(names))]
    return [Table(headings(names), columns, meta, [line_number for line_number, _ in rows], comma)]


def value(text: str) -> Any:
    """What stands behind the equals sign in a file's head."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def _decoded(raw: bytes) -> str:
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):  # "Unicode text" of Excel
        try:
            return raw.decode("utf-16")
        except UnicodeDecodeError:
            raise MeasurementError("this is not a text table") from None
    if b"\0" in raw[:4096]:
        raise MeasurementError("this is not a text table")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _delimiter(lines: list[str]) -> str:
    for mark in "\t;,":
        if sum(mark in line for line in lines) > len(lines) / 2:
            return mark
    return " "


def _split(line: str, mark: str) -> list[str]:
    if mark == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line.strip("\r\n")], delimiter=mark))]
    except csv.Error as error:  # a cell longer than 128 kB
        raise MeasurementError(f"this is not a text table ({error})") from None


def _header(cells: list[list[str]], comma: bool, given: list[str] | None) -> tuple[list[str], int]:
    """The names of the columns, and the row after them: a row with a time, or that above the numbers."""
    head = next((i for i, row in enumerate(cells[:_FIRST]) if _has_time(row)), None)
    if given is not None:
        if head is None:
            rows = (i for i, row in enumerate(cells) if len(row) > 1 and all(_numeric(c, comma) for c in row))
            return given, next(rows, len(cells))
        return given, head + 1
    if head is None:
        first = next(
            (i for i, row in enumerate(cells) if all(_numeric(c, comma) for c in row)),
            len(cells),
        )
        if not (first > 0 and len(cells[first - 1]) > 1):
            raise MeasurementError(
                'no header names the columns: say what they are, for example columns="t,theta,_"'
            )
        head = first - 1
    return cells[head], head + 1


def _has_time(row: list[str]) -> bool:
    return any(heading.name == "t" for heading in headings(row))


def _of_points(names: list[str], points: list[str]) -> list[str]:
    """Tracker's columns under the names of its points, each of which stands above its first column."""
    result, point = [], ""
    for k, name in enumerate(names):
        point = (points[k] if k < len(points) else "") or point
        result.append(f"{point} {name}" if point and name else name)
    return result


def _numeric(cell: str, comma: bool) -> bool:
    try:
        number(cell, comma)
    except ValueError:
        return False
    return True
