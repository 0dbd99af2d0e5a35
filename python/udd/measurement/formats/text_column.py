"""A column of a text table: numbers if all cells are numbers, else the cells as texts."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from udd.errors import MeasurementError

from .text_lines import Lines

_CELL = 1 << 17  # characters of a cell


@dataclass(frozen=True)
class Rows:
    """The rows of a text table: its lines from the row `start` on that hold a cell other than NaN."""

    lines: Lines
    mark: str
    start: int = 0
    columns: int = 0  # what stands behind these is passed over

    def blocks(self) -> Iterator[tuple[list[int], list[list[str]]]]:
        """Yield the lines' numbers and the rows' cells, a block at a time."""
        before = 0
        for numbers, lines in self.lines.blocks():
            skip = max(0, self.start - before)
            before += len(lines)
            numbers_of_lines, rows = [], []
            for number, row in zip(numbers[skip:], split(lines[skip:], self.mark), strict=True):
                for cell in row:
                    if cell and cell.lower() != "nan":
                        numbers_of_lines.append(number)
                        rows.append(row)
                        break
            yield numbers_of_lines, rows

    def column(self, k: int) -> Iterator[tuple[str | None, int]]:
        """Yield the cells of a column (None where a row ends before it), and how many each row has."""
        for _, rows in self.blocks():
            for row in rows:
                count = len(row)
                yield (row[k] if k < count else None), min(count, self.columns)


@dataclass(frozen=True, eq=False)
class TextColumn:
    """A column of a text table.

    Attributes
    ----------
    rows : Rows
        The cells of the table.
    k : int
        Number of the column.
    values : ndarray or None
        Its numbers, if all cells are numbers or empty.
    length : int
    pick : ndarray or None
        The rows to take, in their order; by default all.
    """

    rows: Rows
    k: int
    values: NDArray[np.float64] | None
    length: int
    pick: NDArray[np.int64] | None = field(default=None)

    def __len__(self) -> int:
        return self.length

    def cells(self) -> Iterator[tuple[str | None, int]]:
        """Yield the cells as `Rows.column` does."""
        if self.pick is None:
            yield from self.rows.column(self.k)
            return
        wanted = np.zeros(int(self.pick.max(initial=-1)) + 1, dtype=bool)
        wanted[self.pick] = True
        # Rows are picked in their order.
        for said, cell in zip(wanted, self.rows.column(self.k), strict=False):
            if said:
                yield cell

    def picked(self, rows: NDArray[np.int64]) -> TextColumn:
        """Return the column of some of its rows, in their order."""
        values = None if self.values is None else self.values[rows]
        pick = rows if self.pick is None else self.pick[rows]
        return replace(self, values=values, length=len(rows), pick=pick)


def split(lines: list[str], mark: str) -> list[list[str]]:
    """Split each line into cells.

    Raises
    ------
    MeasurementError
        A cell is too long for a table.
    """
    if mark == " ":
        return [line.split() for line in lines]
    return [
        _quoted(line, mark)
        if '"' in line or len(line) > _CELL
        else [cell.strip() for cell in line.split(mark)]
        for line in lines
    ]


def _quoted(line: str, mark: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line.strip("\r\n")], delimiter=mark))]
    except csv.Error as error:  # a cell longer than 128 kB
        raise MeasurementError(f"this is not a text table ({error})") from None
