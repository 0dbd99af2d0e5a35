"""Text tables: commas, semicolons, tabs or blanks, with the habits of Excel, of Tracker and of phyphox."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import MeasurementError

from .headings import Heading, headings
from .table import NOTHING, Table, number

_FIRST = 50  # rows in which a header is looked for
_WITH_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
_WHOLE = re.compile(r"[-+]?\d+([eE][-+]?\d+)?")
#: A date, or the time of a day.
_DATE = re.compile(r"\d{1,4}([-./])\d{1,2}\1\d{1,4}\b|\d{1,2}:\d{2}\b")


def read(raw: bytes, given: list[str] | None) -> list[Table]:
    """Read a text table; `given` names its columns instead of a header.

    Lines ``# key = value`` are about the whole file. Excel's byte order mark, its line ``sep=;``, decimal
    commas beside semicolons, tabs, blanks or in quotes, and empty rows are understood. Dates as ISO 8601 has
    them become seconds since the first. Tracker's export of several points begins
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
    cells = [_split(line, mark) for _, line in body]
    comma = _decimal_comma([line for _, line in body], cells, mark)
    names, start = _header(cells, comma, given)
    if several and start > 1:
        names = _of_points(names, cells[start - 2])
    rows = [
        (line_number, row)
        for (line_number, _), row in zip(body[start:], cells[start:], strict=True)
        if any(cell and cell.lower() != "nan" for cell in row)
    ]
    if mark == "," and not comma:
        _no_commas_between_commas(names, [row for _, row in rows])
    columns: list[Any] = [[row[k] if k < len(row) else None for _, row in rows] for k in range(len(names))]
    lines = [line_number for line_number, _ in rows]
    return [Table(_seconds(headings(names), columns, lines), columns, meta, lines, comma)]


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
    if (
        sum("," in line and "\t" not in line and _blanks_and_commas(line.split()) for line in lines)
        > len(lines) / 2
    ):
        return " "
    for mark in "\t;,":
        if sum(mark in line for line in lines) > len(lines) / 2:
            return mark
    return " "


def _blanks_and_commas(cells: list[str]) -> bool:
    """Whether cells between blanks are numbers with decimal commas, as ``0,04 0,39``."""
    some = [cell for cell in cells if not _numeric(cell, False)]
    return len(cells) > 1 and bool(some) and all(_WITH_COMMA.fullmatch(cell) for cell in some)


def _decimal_comma(lines: list[str], cells: list[list[str]], mark: str) -> bool:
    """Whether numbers have decimal commas; between commas only in quotes, and not where there are points."""
    if mark != ",":
        return mark in ";\t " and sum("," in line for line in lines) > len(lines) / 2
    quoted = [row for row in cells if any("," in cell and _WITH_COMMA.fullmatch(cell) for cell in row)]
    points = any("." in cell and _numeric(cell, False) for row in quoted for cell in row)
    return len(quoted) > len(cells) / 2 and not points


def _no_commas_between_commas(names: list[str], rows: list[list[str]]) -> None:
    """Refuse rows that decimal commas have torn apart."""
    torn = [row for row in rows if len(row) > len(names) and all(_WHOLE.fullmatch(cell) for cell in row)]
    if len(torn) > len(rows) / 2:
        raise MeasurementError(
            f"rows have {len(torn[0])} whole numbers for {len(names)} columns, as decimal commas between "
            "commas make them: separate columns by semicolons"
        )


def _split(line: str, mark: str) -> list[str]:
    if mark == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line.strip("\r\n")], delimiter=mark))]
    except csv.Error as error:  # a cell longer than 128 kB
        raise MeasurementError(f"this is not a text table ({error})") from None


def _header(cells: list[list[str]], comma: bool, given: list[str] | None) -> tuple[list[str], int]:
    """The names of the columns, and the row after them: a row with a time, or that above the numbers.

    Of rows with words between their numbers the first with two numbers counts.
    """
    head = next((i for i, row in enumerate(cells[:_FIRST]) if _has_time(row)), None)
    if given is not None:
        if head is None:
            rows = (i for i, row in enumerate(cells) if len(row) > 1 and all(_counts(c, comma) for c in row))
            return given, next(rows, len(cells))
        return given, head + 1
    if head is None:
        whole = (i for i, row in enumerate(cells) if all(_counts(c, comma) for c in row))
        some = (i for i, row in enumerate(cells) if sum(bool(c) and _counts(c, comma) for c in row) > 1)
        first = next(whole, next(some, None))
        if first is None:
            raise _without_numbers(cells)
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


def _without_numbers(cells: list[list[str]]) -> MeasurementError:
    """What to say of a table in which no row has two numbers."""
    date = next((cell for row in cells for cell in row if _DATE.match(cell)), None)
    if date is None:
        return MeasurementError("no row holds numbers")
    return MeasurementError(
        f"{date[:80]!r} is no date that is read: write the time in seconds, or dates as 2024-05-03 12:00:00"
    )


def _date(cell: str | None) -> datetime | None:
    """The date with time in a cell (ISO 8601); None where it is none."""
    if cell is None or not _DATE.match(cell):
        return None
    try:
        return datetime.fromisoformat(cell)
    except ValueError:
        return None


def _seconds(heads: list[Heading], columns: list[Any], lines: Sequence[int]) -> list[Heading]:
    """Put seconds since the first date where dates stand; where no column is t, the first of these is."""
    heads = list(heads)
    for k, column in enumerate(columns):
        first = next((cell for cell in column if cell), None)
        if _date(first) is not None:
            columns[k] = _since_first(column, lines)
            name = heads[k].name if any(heading.name == "t" for heading in heads) else "t"
            heads[k] = replace(heads[k], name=name, dates=True)
    return heads


def _since_first(column: list[str | None], lines: Sequence[int]) -> NDArray[np.float64]:
    first = None
    seconds = np.full(len(column), np.nan)
    for i, cell in enumerate(column):
        if not cell or cell.lower() in NOTHING:
            continue
        date = _date(cell)
        first = first or date
        if date is None or first is None or (date.tzinfo is None) != (first.tzinfo is None):
            raise MeasurementError(f"line {lines[i]}: {cell[:80]!r} is no date like that of the first row")
        seconds[i] = (date - first).total_seconds()
    return seconds


def _counts(cell: str, comma: bool) -> bool:
    """Whether a cell is a number, or a date that becomes one."""
    return _numeric(cell, comma) or _date(cell) is not None


def _numeric(cell: str, comma: bool) -> bool:
    try:
        number(cell, comma)
    except ValueError:
        return False
    return True
