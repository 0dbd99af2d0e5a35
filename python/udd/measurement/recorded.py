"""Which columns of a file make a measurement: found by name, cut to one run of the clock, in base units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from udd.errors import MeasurementError

from .formats import Table
from .formats.headings import COUNTED, Heading, in_base_units, size
from .input_signal import Hold, InputSignal, named_signal

Asked = str | tuple[str, str]


@dataclass(frozen=True)
class Recorded:
    """A file's tables, and what the user said of them; without `mapping` columns are what they are called."""

    tables: Sequence[Table]
    mapping: Mapping[str, Asked] | None = None
    rate: float | None = None
    repeated: str | None = None
    part: int | None = None

    def __post_init__(self) -> None:
        number = isinstance(self.rate, int | float) and not isinstance(self.rate, bool)
        if self.rate is not None and not (number and 0 < self.rate < np.inf):
            raise MeasurementError(f"rate must be a positive number of samples per second, not {self.rate!r}")
        if self.repeated not in (None, "first"):
            raise MeasurementError(f'repeated must be "first" or None, not {self.repeated!r}')
        if self.part is not None and (isinstance(self.part, bool) or not isinstance(self.part, int)):
            raise MeasurementError(f"part must be a whole number from 0, not {self.part!r}")

    @property
    def asked(self) -> tuple[str, ...]:
        """What the mapping names: coordinates, without the time and what is said beside them."""
        beside = ("sigma_", "rho_")
        return tuple(n for n in self.mapping or {} if n not in ("t", "flag") and not n.startswith(beside))

    @property
    def names(self) -> set[str]:
        """The names of all columns."""
        return {heading.name for table in self.tables for heading in table.headings}

    def find(self, table: Table, name: str) -> Asked | None:
        """What the user calls the column for `name`, where the table has it."""
        asked = (self.mapping or {}).get(name, name)
        parts = [asked] if isinstance(asked, str) else asked
        return asked if all(table.find(part) is not None for part in parts) else None

    def missing(self, asked: str) -> MeasurementError:
        """The sentence about a column that is nowhere."""
        found = [raw for table in self.tables for raw in table.found]
        listed = ", ".join(found[:40]) + (f" and {len(found) - 40} more" if len(found) > 40 else "")
        return MeasurementError(f"no column {asked}: found {listed or 'nothing'}")

    def frames(self, names: Sequence[str], *, convert: bool) -> Frames:
        """The table in which the coordinates lie.

        Raises
        ------
        MeasurementError
            One of them is nowhere, or they lie in tables that have clocks of their own.
        """
        for table in self.tables:
            if all(self.find(table, name) is not None for name in names):
                return Frames(self, table, _run(self, table, convert), convert)
        for name in names:
            if all(self.find(table, name) is None for table in self.tables):
                if all(self.find(table, "t") is None for table in self.tables) and self.rate is None:
                    break  # what is said of the time is said first
                if self.mapping is None:
                    raise MeasurementError(
                        f"{self.missing(name)}; which of them is it, columns={{{name!r}: ...}}?"
                    )
                raise self.missing(_text(self.mapping.get(name, name)))
        else:
            clocks = ", ".join(table.name or f"{len(table)} rows" for table in self.tables)
            raise MeasurementError(
                f"{', '.join(names)} lie in tables with clocks of their own ({clocks}): read them one by one"
            )
        raise self.missing("t")


@dataclass
class Frames:
    """One table's columns by what they are; what was taken for what is kept beside."""

    record: Recorded
    whole: Table  # with all its rows
    run: Run
    convert: bool
    taken: dict[str, str] = field(default_factory=dict)
    converted: dict[str, str] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)

    @property
    def table(self) -> Table:
        """The rows of one run of the clock."""
        return self.run.table

    @property
    def renamed(self) -> bool:
        """Whether anything is called otherwise in the file."""
        return any(name != text for name, text in self.taken.items())

    def has(self, name: str) -> bool:
        """Whether there is a column for it."""
        return self.record.find(self.table, name) is not None

    def times(self) -> NDArray[np.float64]:
        """The times of the rows [s]."""
        self._note("t", self.run.heading, self.run.unit)
        return self.run.t

    def column(self, name: str) -> NDArray[np.float64]:
        """The column for `name`, in s, m, rad and what these make, where its heading states another unit."""
        asked = self.record.find(self.table, name)
        if asked is None:
            raise self.record.missing(_text((self.record.mapping or {}).get(name, name)))
        if not isinstance(asked, str):
            return self._bob(name, asked)
        k = self.table.find(asked)
        assert k is not None
        heading = self.table.headings[k]
        one, unit = _unit(name, heading, self.convert, mapped=self.record.mapping is not None)
        self._note(name, heading, unit)
        return self.table.numbers(k) if one == 1.0 else self.table.numbers(k) * one

    def _bob(self, name: str, asked: tuple[str, str]) -> NDArray[np.float64]:
        """The angle from hanging of a point whose pivot is the origin."""
        places = [k for k in map(self.table.find, asked) if k is not None]
        x, y = (self.table.numbers(k) for k in places)
        units = {self.table.headings[k].unit for k in places}
        if len(units) > 1:
            raise MeasurementError(f"the columns {' and '.join(asked)} are in different units")
        self.used |= {self.table.headings[k].raw for k in places}
        self.taken[name] = f"atan2(x, -y) of {' and '.join(asked)}"
        return np.arctan2(x, -y)

    def words(self, name: str) -> NDArray[np.str_]:
        """The column for `name` as text."""
        asked = self.record.find(self.table, name)
        k = self.table.find(asked) if isinstance(asked, str) else None
        if k is None:
            raise self.record.missing(name)
        self._note(name, self.table.headings[k], "")
        return self.table.words(k)

    def _note(self, name: str, heading: Heading, unit: str) -> None:
        self.used.add(heading.raw)
        self.taken[name] = heading.raw + (f", {unit}" if unit else "")
        if unit and not name.startswith("sigma_"):
            self.converted[name] = unit

    def input(self, name: str, asked: str, hold: Hold) -> tuple[InputSignal, str]:
        """A measured input, with the clock of the table where it lies, and the unit that it states."""
        tables = [self.whole, *(table for table in self.record.tables if table is not self.whole)]
        for table in tables:
            k = table.find(asked)
            if k is None:
                continue
            run = self.run if table is self.whole else _run(self.record, table, self.convert)
            values = run.table.numbers(k)
            there = ~np.isnan(values)
            heading = table.headings[k]
            self.used |= {heading.raw, run.heading.raw}
            self.taken[name] = f"{heading.raw}, input"
            if not there.all():
                self.taken[name] += f", {int((~there).sum())} samples empty"
            return named_signal(name, run.t[there], values[there], hold), heading.unit
        raise self.record.missing(asked)

    def told(self) -> dict[str, str]:
        """What each column was taken for, and which were passed over."""
        rest = [raw for table in self.record.tables for raw in table.found if raw not in self.used]
        return self.taken | ({"passed over": ", ".join(dict.fromkeys(rest))} if rest else {})


@dataclass(frozen=True)
class Run:
    """The rows of one run of the clock, their times [s], and where these come from."""

    table: Table
    t: NDArray[np.float64]
    heading: Heading
    unit: str


def _run(record: Recorded, table: Table, convert: bool) -> Run:
    """Cut a table to the part and the rows that were asked for."""
    table = _framed(table)
    asked = record.find(table, "t")
    k = table.find(asked) if isinstance(asked, str) else None
    if k is None:
        if record.rate is None:
            error = record.missing(_text((record.mapping or {}).get("t", "t")))
            raise MeasurementError(f"{error}; of evenly spaced samples say how many a second, rate=")
        t, unit = np.arange(len(table)) / record.rate, ""
        heading = Heading(f"rows at {record.rate:g} Hz", "t")
    else:
        if record.rate is not None:
            raise MeasurementError(f"rate is for files without times, but here is {table.headings[k].raw}")
        heading = table.headings[k]
        one, unit = _unit("t", heading, convert, mapped=record.mapping is not None)
        t = table.numbers(k) if one == 1.0 else table.numbers(k) * one
    if not len(t):
        raise MeasurementError("the file holds no rows")
    pick = _rows(record, t)
    return Run(table, t, heading, unit) if pick is None else Run(table.rows(pick), t[pick], heading, unit)


def _rows(record: Recorded, t: NDArray[np.float64]) -> NDArray[np.int64] | None:
    """The rows of the part between two jumps of the clock, of equal times the first; None for all."""
    if record.part is None and record.repeated is None:
        return None
    rows = np.arange(len(t))
    if record.part is not None:
        parts = np.split(rows, np.flatnonzero(np.diff(t) < 0) + 1)
        if not 0 <= record.part < len(parts):
            raise MeasurementError(
                f"there is no part {record.part}: the clock runs {len(parts)} times, from 0"
            )
        rows = parts[record.part]
    if record.repeated == "first":
        rows = rows[np.diff(t[rows], prepend=np.nan) != 0]
    return rows


def _framed(table: Table) -> Table:
    """The table without the rows at its end that hold only an input with a clock of its own."""
    if not any(heading.name.startswith("t:") for heading in table.headings):
        return table
    k = table.find("t")
    if k is None:
        return table
    there = np.flatnonzero(~np.isnan(table.numbers(k)))
    return table.rows(np.arange(int(there[-1]) + 1 if len(there) else 0))


def own_inputs(table: Table) -> dict[str, InputSignal]:
    """The inputs that a file of the package holds: ``input:NAME``, over ``t:NAME`` where that is there."""
    holds = table.meta.get("input_hold")
    places = {heading.name: k for k, heading in enumerate(table.headings)}
    found = {}
    for name in (n.removeprefix("input:") for n in places if n.startswith("input:")):
        own = f"t:{name}" in places
        if not own and "t" not in places:
            continue
        t, values = (
            table.numbers(places[f"t:{name}" if own else "t"]),
            table.numbers(places[f"input:{name}"]),
        )
        there = ~np.isnan(t if own else values)
        hold = holds.get(name, "linear") if isinstance(holds, dict) else "linear"
        found[name] = named_signal(name, t[there], values[there], hold)
    return found


def _unit(name: str, heading: Heading, convert: bool, *, mapped: bool) -> tuple[float, str]:
    """What one of a column's unit is in the base unit, and a word on the change where there is one.

    Only a column that the user pointed at is taken at its word where its name does not say what it counts.
    """
    if not convert or not heading.unit:
        return 1.0, ""
    base = COUNTED.get(name.removeprefix("sigma_"))
    if base is not None:
        one = size(name, heading.unit)
        known = in_base_units(heading.unit)
        if one is None and mapped and known is not None:
            raise MeasurementError(f"{name} is counted in {base}, but the column is called {heading.raw}")
        return (1.0, "") if one in (None, 1.0) else (float(one or 1.0), f"{heading.unit} to {base}")
    known = in_base_units(heading.unit) if mapped else None
    if known is None or known[0] == 1.0:
        return 1.0, ""
    return known[0], f"{heading.unit} to {known[1]}"


def _text(asked: Asked) -> str:
    return asked if isinstance(asked, str) else " and ".join(asked)
