"""A table as a file holds it: columns under their headings, not yet a measurement."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.input_files import MemoryLimit
from udd.errors import MeasurementError

from .headings import Heading
from .text_column import TextColumn

_LONGEST = 200  # characters of a cell that is kept as text
#: Texts of people and programs for an empty cell.
NOTHING = {"", "nan", "na", "n/a", "null", "none"}


@dataclass(frozen=True)
class Table:
    """Columns of one length.

    `columns` are numbers, or cells as text (None if a row ends before them). `lines` are the numbers of the
    rows' lines, if the file has lines; `name` is that of the table, if a file holds several; `cut` says that
    a last row was ignored.
    """

    headings: list[Heading]
    columns: list[NDArray[np.float64] | list[str | None] | TextColumn]
    meta: dict[str, Any] = field(default_factory=dict)
    lines: NDArray[np.int32] | None = None
    comma: bool = False  # decimal comma
    name: str = ""
    memory: MemoryLimit = field(default_factory=MemoryLimit)
    cut: str = ""

    def __len__(self) -> int:
        return len(self.columns[0]) if self.columns else 0

    @property
    def raw_headings(self) -> list[str]:
        """The headings of its columns, as the file has them."""
        return [heading.raw for heading in self.headings if heading.name not in ("", "_")]

    def find(self, asked: str) -> int | None:
        """Find a column: by its heading as it stands, else without unit, else in any case.

        Raises
        ------
        MeasurementError
            Several columns are called so.
        """
        ways: tuple[Callable[[Heading], bool], ...] = (
            lambda heading: asked in (heading.raw, f"{self.name}/{heading.raw}"),
            lambda heading: asked in (heading.name, heading.plain),
            lambda heading: (
                asked.casefold()
                in (heading.raw.casefold(), heading.name.casefold(), heading.plain.casefold())
            ),
        )
        for way in ways:
            there = [k for k, heading in enumerate(self.headings) if way(heading)]
            if len(there) > 1:
                raise MeasurementError(f"two columns are called {asked}")
            if there:
                return there[0]
        return None

    def numbers(self, k: int) -> NDArray[np.float64]:
        """Return a column as numbers, NaN for empty cells.

        Raises
        ------
        MeasurementError
            A cell is not a number, or is not there.
        """
        column = self.columns[k]
        if isinstance(column, TextColumn) and column.values is not None:
            return column.values
        if isinstance(column, np.ndarray):
            return column
        out = np.empty(len(column))
        name = self.headings[k].name
        for i, (cell, there) in enumerate(_cells(column)):
            if cell is None:
                raise MeasurementError(
                    f"{self.place(i)} ends before column {name}: {there} of {len(self.columns)} cells"
                )
            try:
                out[i] = number(cell, self.comma)
            except ValueError:
                help_ = " (a time is in seconds, or a date as 2024-05-03 12:00:00)" if name == "t" else ""
                raise MeasurementError(
                    f"{self.place(i)}: {cell[:80]!r} is not a number for {name}{help_}"
                ) from None
        return out

    def words(self, k: int) -> NDArray[np.str_]:
        """Return a column as text, empty for empty cells.

        Raises
        ------
        MeasurementError
            One is too long: NumPy gives each text the room of the longest.
        """
        column = self.columns[k]
        cells = column.tolist() if isinstance(column, np.ndarray) else (cell for cell, _ in _cells(column))
        longest = max((len(cell) for cell in map(_text, cells)), default=0)
        if longest > _LONGEST:
            raise MeasurementError(
                f"a text in column {self.headings[k].name} has {longest} characters, more than {_LONGEST}"
            )
        self.memory.take(4 * longest * len(column))
        out = np.empty(len(column), dtype=f"<U{max(1, longest)}")
        cells = column.tolist() if isinstance(column, np.ndarray) else (cell for cell, _ in _cells(column))
        for i, cell in enumerate(map(_text, cells)):
            out[i] = cell
        return out

    def place(self, row: int) -> str:
        """Return the place of a row, in the user's terms."""
        return f"row {row}" if self.lines is None else f"line {self.lines[row]}"

    def rows(self, pick: Sequence[int] | NDArray[np.int64]) -> Table:
        """Return the table of some of its rows."""
        chosen = np.asarray(pick, dtype=np.int64)

        def some(column: Any) -> Any:
            if isinstance(column, TextColumn):
                return column.picked(chosen)
            return column[chosen] if isinstance(column, np.ndarray) else [column[i] for i in chosen]

        lines = None if self.lines is None else some(self.lines)
        return replace(self, columns=[some(column) for column in self.columns], lines=lines)


def _cells(column: list[str | None] | TextColumn) -> Iterator[tuple[str | None, int]]:
    """Return the cells of a column, and the numbers of cells of its rows."""
    return column.cells() if isinstance(column, TextColumn) else ((cell, 0) for cell in column)


def _text(cell: Any) -> str:
    return str(cell) if cell else ""


def number(cell: str, comma: bool) -> float:
    """Read the number in a cell, NaN if it is empty; raise ValueError for other text."""
    if cell.strip().lower() in NOTHING:
        return float("nan")
    if "_" in cell:  # Python would read 1_000
        raise ValueError(cell)
    return float(cell.replace(",", ".") if comma else cell)
