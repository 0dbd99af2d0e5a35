"""Text tables: commas, semicolons, tabs or blanks, with the habits of Excel, of Tracker and of phyphox."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import chain, islice, repeat, zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.input_files import NESTED, MemoryLimit
from udd.errors import MeasurementError

from .headings import Heading, headings, is_unit, joined, stated_unit
from .table import NOTHING, Table, number
from .text_column import Rows, TextColumn, split
from .text_lines import Lines

_FIRST = 50  # rows in which a header is looked for
_WITH_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
#: A name in quotes, a symbol and a unit, as CASSY writes them.
_DEFINED = re.compile(r'^"([^"]*)"\s*([^/]*?)\s*(?:/\s*(.+))?$')
_WHOLE = re.compile(r"[-+]?\d+([eE][-+]?\d+)?")
#: A date, or the time of a day.
_DATE = re.compile(r"\d{1,4}([-./])\d{1,2}\1\d{1,4}\b|\d{1,2}:\d{2}\b")


def read(raw: bytes, given: list[str] | None, memory: MemoryLimit) -> list[Table]:
    """Read a text table; `given` names its columns instead of a header.

    Lines ``# key = value`` are about the whole file. Excel's byte order mark, its line ``sep=;``, decimal
    commas together with semicolons, tabs, blanks or in quotes, and empty rows are understood. Dates in ISO
    8601 become seconds since the first. Tracker's export of several points begins with ``#multi:`` and a row
    of their names, and repeats the columns of each: they are called ``mass A x``.
    A row below the names may hold units. A last row that was cut off is passed over.
    """
    lines = Lines(raw, memory)
    meta: dict[str, Any] = {}
    several = False
    for comment in lines.comments:
        several |= comment.lower().startswith("#multi:")
        key, equals, text = comment.lstrip("#").partition("=")
        if equals:
            meta[key.strip()] = value(text.strip(), memory)
    counts = _counted(lines)
    if not counts.lines:
        raise MeasurementError("the file holds no rows")
    mark = lines.mark or counts.delimiter()
    comma = _decimal_comma(lines, counts, mark)
    names, start, above = _header(lines, mark, comma, given)
    if several and start > 1:
        names = _of_points(names, above)
    below = next(islice(_rows(lines, mark), start, None), [])
    if _are_units(below, comma):
        names, start = (names if given is not None else joined(names, below)), start + 1
    elif given is None and len(above) == len(names) and not _has_time(names) and all(map(is_unit, names)):
        names = joined(above, names)
    rows = Rows(lines, mark, start, len(names))
    columns, numbers, cut = _columns(rows, counts.lines - start, comma, memory)
    heads = _seconds(headings(names), columns, numbers)
    return [Table(heads, columns, meta, numbers, comma, memory=memory, cut=cut)]


def value(text: str, memory: MemoryLimit) -> Any:
    """Parse the text behind the equals sign in a file's head."""
    memory.take(NESTED * len(text) if text[:1] in ("[", "{") else len(text))
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


@dataclass
class Counts:
    """Counts of lines, and of lines with each separator."""

    lines: int = 0
    tabs: int = 0
    semicolons: int = 0
    commas: int = 0
    blanks: int = 0  # between numbers with decimal commas
    quotes: int = 0

    def delimiter(self) -> str:
        """Return the character that separates the columns."""
        if self.blanks > self.lines / 2:
            return " "
        for mark, count in (("\t", self.tabs), (";", self.semicolons), (",", self.commas)):
            if count > self.lines / 2:
                return mark
        return " "


def _counted(lines: Lines) -> Counts:
    counts = Counts()
    for _, block in lines.blocks():
        counts.lines += len(block)
        counts.tabs += sum("\t" in line for line in block)
        counts.semicolons += sum(";" in line for line in block)
        counts.quotes += sum('"' in line for line in block)
        commas = [line for line in block if "," in line]
        counts.commas += len(commas)
        counts.blanks += sum("\t" not in line and _blanks_and_commas(line.split()) for line in commas)
    return counts


def _blanks_and_commas(cells: list[str]) -> bool:
    """Return True if cells between blanks are numbers with decimal commas, as ``0,04 0,39``."""
    if len(cells) < 2:
        return False
    some = [cell for cell in cells if not _numeric(cell, False)]
    return bool(some) and all(_WITH_COMMA.fullmatch(cell) for cell in some)


def _decimal_comma(lines: Lines, counts: Counts, mark: str) -> bool:
    """Return True if numbers have decimal commas: between commas only in quotes, and never with points."""
    if mark != ",":
        return mark in ";\t " and counts.commas > counts.lines / 2
    if counts.quotes <= counts.lines / 2:
        return False
    quoted = 0
    for _, block in lines.blocks():
        for row in split([line for line in block if '"' in line], mark):
            if any("," in cell and _WITH_COMMA.fullmatch(cell) for cell in row):
                quoted += 1
                if any("." in cell and _numeric(cell, False) for cell in row):
                    return False
    return quoted > counts.lines / 2


def _columns(
    rows: Rows, most: int, comma: bool, memory: MemoryLimit
) -> tuple[list[Any], NDArray[np.int32], str]:
    """Convert the columns whose cells are all numbers; return all, the rows' lines, and what is cut off.

    A last row that ends before the others do was cut off, and is passed over.
    """
    memory.take(most * (8 * rows.columns + 4))
    numbers = np.empty(most, dtype=np.int32)
    columns: list[NDArray[np.float64] | None] = [np.empty(most) for _ in range(rows.columns)]
    done = torn = width = 0
    narrowest, cut = rows.columns, ""
    for numbers_of_lines, block, last in _with_last(rows.blocks()):
        if last and done + len(block) > 1:
            narrowest = min([narrowest, *map(len, block[:-1])])
            if len(block[-1]) < narrowest:
                cut = f"line {numbers_of_lines[-1]}, the last, is cut off, and is passed over"
                numbers_of_lines, block = numbers_of_lines[:-1], block[:-1]
        narrowest = min([narrowest, *map(len, block)])
        end = done + len(block)
        numbers[done:end] = numbers_of_lines
        for k, cells in enumerate(islice(chain(zip_longest(*block), repeat((None,))), rows.columns)):
            column = columns[k]
            if block and column is not None and not _fill(column[done:end], cells, comma):
                columns[k] = None
        if rows.mark == "," and not comma:
            for row in block:
                if len(row) > rows.columns and all(map(_WHOLE.fullmatch, row)):
                    torn, width = torn + 1, width or len(row)
        done = end
    if torn > done / 2:
        raise MeasurementError(
            f"rows have {width} whole numbers for {rows.columns} columns, as decimal commas between "
            "commas make them: separate columns by semicolons"
        )
    pick = np.arange(done) if cut else None
    made = [
        TextColumn(rows, k, None if column is None else column[:done], done, pick)
        for k, column in enumerate(columns)
    ]
    return made, numbers[:done], cut


def _with_last(
    blocks: Iterator[tuple[list[int], list[list[str]]]],
) -> Iterator[tuple[list[int], list[list[str]], bool]]:
    """Yield blocks that hold rows, and whether each is the last of them."""
    before: tuple[list[int], list[list[str]]] | None = None
    for position, block in blocks:
        if block:
            if before is not None:
                yield *before, False
            before = position, block
    if before is not None:
        yield *before, True


def _fill(out: NDArray[np.float64], cells: Sequence[str | None], comma: bool) -> bool:
    """Fill in the cells' numbers; False if one is none, or not there."""
    try:
        if not comma:
            out[:] = [float(cell) for cell in cells]  # type: ignore[arg-type]  # a missing one is caught
            if not any("_" in cell for cell in cells):  # type: ignore[operator]
                return True
    except (TypeError, ValueError):
        pass  # an empty cell, or one that is no number
    try:
        out[:] = [number(cell, comma) for cell in cells]  # type: ignore[arg-type]
    except (AttributeError, ValueError):
        return False
    return True


def _header(
    lines: Lines, mark: str, comma: bool, given: list[str] | None
) -> tuple[list[str], int, list[str]]:
    """Return the names of the columns, the number of rows up to them, and the row above them.

    The names are a row with a time, or the row above the first row of numbers (two numbers suffice if every
    row holds words).
    """
    first = [row for row, _ in zip(_rows(lines, mark), range(_FIRST), strict=False)]
    head = next((i for i, row in enumerate(first) if _has_time(row)), None)
    if given is not None:
        if head is None:
            first_row = _first_row(
                lines, mark, lambda row: len(row) > 1 and all(_counts(c, comma) for c in row)
            )
            return given, sum(1 for _ in lines) if first_row is None else first_row[0], []
        return given, head + 1, first[head - 1] if head else []
    if head is not None:
        return first[head], head + 1, first[head - 1] if head else []
    first_row = _first_row(lines, mark, lambda row: all(_counts(c, comma) for c in row)) or _first_row(
        lines, mark, lambda row: sum(bool(c) and _counts(c, comma) for c in row) > 1
    )
    if first_row is None:
        raise _without_numbers(lines, mark)
    at, names, above = first_row
    if len(names) < 2:
        raise MeasurementError(
            'no header names the columns: say what they are, for example columns="t,theta,_"'
        )
    return names, at, above


def _rows(lines: Lines, mark: str) -> Iterator[list[str]]:
    for _, block in lines.blocks():
        for line, row in zip(block, split(block, mark), strict=True):
            yield _definitions(line, mark) or row


def _first_row(
    lines: Lines, mark: str, is_it: Callable[[list[str]], bool]
) -> tuple[int, list[str], list[str]] | None:
    """Return the place of the first row of a kind, and the two rows above it; None without such a row."""
    above: list[list[str]] = [[], []]
    for i, row in enumerate(_rows(lines, mark)):
        if is_it(row):
            return i, above[1], above[0]
        above = [above[1], row]
    return None


def _definitions(line: str, mark: str) -> list[str] | None:
    """Read the names and units in CASSY's line ``DEF="Zeit" t / s``; None if it is another line."""
    if not line.startswith('DEF="'):
        return None
    cells = line.removeprefix("DEF=").rstrip().split(mark if mark != " " else None)
    return [_DEFINED.sub(_defined, cell.strip()) for cell in cells]


def _defined(definition: re.Match[str]) -> str:
    name, symbol, unit = definition.groups()
    return f"{name or symbol} ({unit})" if unit else (name or symbol)


def _are_units(row: list[str], comma: bool) -> bool:
    """Return True if a row below the names holds units: one that is known at least, and no numbers."""
    return any(stated_unit(cell) for cell in row) and not any(cell and _counts(cell, comma) for cell in row)


def _has_time(row: list[str]) -> bool:
    return any(heading.name == "t" for heading in headings(row))


def _of_points(names: list[str], points: list[str]) -> list[str]:
    """Tracker's columns under the names of its points, each of which stands above its first column."""
    result, point = [], ""
    for k, name in enumerate(names):
        point = (points[k] if k < len(points) else "") or point
        result.append(f"{point} {name}" if point and name else name)
    return result


def _without_numbers(lines: Lines, mark: str) -> MeasurementError:
    """Return the error for a table in which no row has two numbers."""
    date = next((cell for row in _rows(lines, mark) for cell in row if _DATE.match(cell)), None)
    if date is None:
        return MeasurementError("no row holds numbers")
    return MeasurementError(
        f"{date[:80]!r} is no date that is read: write the time in seconds, or dates as 2024-05-03 12:00:00"
    )


def _date(cell: str | None) -> datetime | None:
    """Read the date with time in a cell (ISO 8601); None for other text."""
    if cell is None or not _DATE.match(cell):
        return None
    try:
        return datetime.fromisoformat(cell)
    except ValueError:
        return None


def _seconds(heads: list[Heading], columns: list[Any], lines: NDArray[np.int32]) -> list[Heading]:
    """Put seconds since the first date where dates stand; where no column is t, the first of these is."""
    heads = list(heads)
    for k, column in enumerate(columns):
        first = None if column.values is not None else next((c for c, _ in column.cells() if c), None)
        if _date(first) is not None:
            columns[k] = _since_first(column, lines)
            name = heads[k].name if any(heading.name == "t" for heading in heads) else "t"
            heads[k] = replace(heads[k], name=name, dates=True)
    return heads


def _since_first(column: TextColumn, lines: NDArray[np.int32]) -> NDArray[np.float64]:
    first = None
    seconds = np.full(len(column), np.nan)
    for i, (cell, _) in enumerate(column.cells()):
        if not cell or cell.lower() in NOTHING:
            continue
        date = _date(cell)
        first = first or date
        if date is None or first is None or (date.tzinfo is None) != (first.tzinfo is None):
            raise MeasurementError(f"line {lines[i]}: {cell[:80]!r} is no date like that of the first row")
        seconds[i] = (date - first).total_seconds()
    return seconds


def _counts(cell: str, comma: bool) -> bool:
    """Return True if a cell is a number, or a date that becomes a number."""
    return _numeric(cell, comma) or _date(cell) is not None


def _numeric(cell: str, comma: bool) -> bool:
    try:
        number(cell, comma)
    except ValueError:
        return False
    return True
