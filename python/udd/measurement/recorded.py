"""Columns of a file that make a measurement: found by name, cut to one run of the clock, in base units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from udd._util.steady_clock import SteadyClock, steady_clock
from udd.errors import MeasurementError

from .formats import Table
from .formats.headings import COUNTED, USUAL, Heading, ending, in_base_units, size
from .formats.text_column import TextColumn
from .guesses import guessed
from .input_signal import Hold, InputSignal, named_signal

Asked = str | tuple[str, str]
_MOTIONS = ({"theta"}, {"Omega"}, {"Y", "Z", "beta"})  # columns of a pendulum or a disk besides t


@dataclass(frozen=True)
class Units:
    """Treatment of the units in headings.

    Attributes
    ----------
    standard : frozenset of str
        The columns of a disk, of a pendulum or of a bob: an unknown unit, or a unit of another quantity, is
        refused. In a user's own model the same names may mean anything.
    mapped : bool
        True if the user gave the coordinates of the columns.
    of_user_model : bool
        True if the columns are states of a user's own model, without a mapping.
    """

    standard: frozenset[str] = frozenset()
    mapped: bool = False
    of_user_model: bool = False


@dataclass(frozen=True)
class Conversion:
    """The factor from a column's unit to the base unit, and a remark on a change or on a unit that stays."""

    size: float = 1.0
    remark: str = ""
    kept: str = ""


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
    def coordinates(self) -> tuple[str, ...]:
        """The coordinates in the mapping, without the time, errors and flags."""
        beside = ("sigma_", "rho_")
        return tuple(n for n in self.mapping or {} if n not in ("t", "flag") and not n.startswith(beside))

    @property
    def names(self) -> set[str]:
        """The names of all columns."""
        return {heading.name for table in self.tables for heading in table.headings}

    def find(self, table: Table, name: str) -> Asked | None:
        """Return the user's name of the column for `name`, if the table has it."""
        asked = (self.mapping or {}).get(name, name)
        parts = [asked] if isinstance(asked, str) else asked
        return asked if all(table.find(part) is not None for part in parts) else None

    def missing(self, asked: str) -> MeasurementError:
        """Return the sentence about a column that is in no table."""
        headings = [raw for table in self.tables for raw in table.raw_headings]
        listed = ", ".join(headings[:40]) + (f" and {len(headings) - 40} more" if len(headings) > 40 else "")
        return MeasurementError(f"no column {asked}: found {listed or 'nothing'}")

    def frames(self, names: Sequence[str], units: Units) -> Frames:
        """Return the table that holds the coordinates.

        Raises
        ------
        MeasurementError
            One of them is nowhere, or they lie in tables that have clocks of their own.
        """
        for table in self.tables:
            if all(self.find(table, name) is not None for name in names):
                return Frames(self, table, _run(self, table, units), units)
        for name in names:
            if all(self.find(table, name) is None for table in self.tables):
                if all(self.find(table, "t") is None for table in self.tables) and self.rate is None:
                    break  # what is said of the time is said first
                if self.mapping is None:
                    asked = self._guess() or f"which of them is it, columns={{{name!r}: ...}}?"
                    raise MeasurementError(f"{self.missing(name)}; {asked}")
                raise self.missing(_text(self.mapping.get(name, name)))
        else:
            clocks = ", ".join(table.name or f"{len(table)} rows" for table in self.tables)
            raise MeasurementError(
                f"{', '.join(names)} are in tables with different clocks ({clocks}); read each by columns="
            )
        guess = self._guess()
        raise MeasurementError(f"{self.missing('t')}; {guess}") if guess else self.missing("t")

    def _guess(self) -> str:
        """Return the columns to try, by their headings in English, German or Dutch; empty if none fit."""
        table = max(self.tables, key=len)
        roles = guessed(table)
        columns = {role: table.headings[k].raw for k, role in enumerate(roles) if role}
        fits = set(columns) - {"t"} in _MOTIONS and "t" in columns
        if self.mapping is not None or not fits or any("," in raw or '"' in raw for raw in columns.values()):
            return ""
        return f'try columns="{",".join(f"{role}={raw}" for role, raw in columns.items())}"'


@dataclass
class Frames:
    """One table's columns by coordinate, with a record of their names in the file."""

    record: Recorded
    whole: Table  # with all its rows
    run: Run
    units: Units
    sources: dict[str, str] = field(default_factory=dict)
    converted: dict[str, str] = field(default_factory=dict)
    kept: list[str] = field(default_factory=list)
    used: set[str] = field(default_factory=set)

    @property
    def table(self) -> Table:
        """The rows of one run of the clock."""
        return self.run.table

    @property
    def renamed(self) -> bool:
        """Return True if a column has another name in the file."""
        return any(name != text for name, text in self.sources.items())

    def has(self, name: str) -> bool:
        """Return True if there is a column for it."""
        return self.record.find(self.table, name) is not None

    def times(self) -> NDArray[np.float64]:
        """Return the times of the rows [s]."""
        self._note("t", self.run.heading, self.run.conversion)
        self.kept += [self.table.cut] if self.table.cut else []
        return self.run.t

    def column(self, name: str) -> NDArray[np.float64]:
        """Return the column for `name`, converted to s, m, rad and their products."""
        asked = self.record.find(self.table, name)
        if asked is None:
            raise self.record.missing(_text((self.record.mapping or {}).get(name, name)))
        if not isinstance(asked, str):
            return self._bob(name, asked)
        k = self.table.find(asked)
        assert k is not None
        heading = self.table.headings[k]
        conversion = _conversion(name, heading, self.units)
        self._note(name, heading, conversion)
        factor = conversion.size
        return self.table.numbers(k) if factor == 1.0 else self.table.numbers(k) * factor

    def _bob(self, name: str, asked: tuple[str, str]) -> NDArray[np.float64]:
        """Return the angle from hanging of a point whose pivot is the origin."""
        places = [k for k in map(self.table.find, asked) if k is not None]
        x, y = (self.table.numbers(k) for k in places)
        units = {self.table.headings[k].unit for k in places}
        if len(units) > 1:
            raise MeasurementError(
                f"the columns {' and '.join(asked)} are in different units; give both the same"
            )
        self.used |= {self.table.headings[k].raw for k in places}
        self.sources[name] = f"atan2(x, -y) of {' and '.join(asked)}"
        return np.arctan2(x, -y)

    def words(self, name: str) -> NDArray[np.str_]:
        """Return the column for `name` as text."""
        asked = self.record.find(self.table, name)
        k = self.table.find(asked) if isinstance(asked, str) else None
        if k is None:
            raise self.record.missing(name)
        self._note(name, self.table.headings[k], Conversion())
        return self.table.words(k)

    def _note(self, name: str, heading: Heading, conversion: Conversion) -> None:
        self.used.add(heading.raw)
        self.sources[name] = heading.raw + (f", {conversion.remark}" if conversion.remark else "")
        if name.startswith("sigma_"):
            return
        if conversion.remark:
            self.converted[name] = conversion.remark
        if conversion.kept:
            self.kept.append(conversion.kept)

    def input(self, name: str, asked: str, hold: Hold) -> tuple[InputSignal, str]:
        """Return a measured input with the clock of its table, and its unit."""
        tables = [self.whole, *(table for table in self.record.tables if table is not self.whole)]
        for table in tables:
            k = table.find(asked)
            if k is None:
                continue
            run = self.run if table is self.whole else _run(self.record, table, self.units)
            values = run.table.numbers(k)
            there = ~np.isnan(values)
            heading = table.headings[k]
            self.used |= {heading.raw, run.heading.raw}
            self.sources[name] = f"{heading.raw}, input"
            if not there.all():
                self.sources[name] += f", {int((~there).sum())} samples empty"
            return named_signal(name, run.t[there], values[there], hold), heading.unit
        raise self.record.missing(asked)

    def column_sources(self) -> dict[str, str]:
        """Return the column of each coordinate, and the columns that were ignored."""
        rest = [raw for table in self.record.tables for raw in table.raw_headings if raw not in self.used]
        return self.sources | ({"passed over": ", ".join(dict.fromkeys(rest))} if rest else {})


@dataclass(frozen=True)
class Run:
    """The rows of one run of the clock and their times [s]: where these come from, and their rounding."""

    table: Table
    t: NDArray[np.float64]
    heading: Heading
    conversion: Conversion
    clock: SteadyClock | None = None


def _run(record: Recorded, table: Table, units: Units) -> Run:
    """Cut a table to the part and the rows that were asked for."""
    table = _framed(table)
    asked = record.find(table, "t")
    k = table.find(asked) if isinstance(asked, str) else None
    if k is None:
        if record.rate is None:
            error = record.missing(_text((record.mapping or {}).get("t", "t")))
            raise MeasurementError(f"{error}; of evenly spaced samples say how many a second, rate=")
        t, conversion = np.arange(len(table)) / record.rate, Conversion()
        heading = Heading(f"rows at {record.rate:g} Hz", "t")
    else:
        if record.rate is not None:
            raise MeasurementError(f"rate is for files without times, but here is {table.headings[k].raw}")
        heading = table.headings[k]
        conversion = _conversion("t", heading, units)
        factor = conversion.size
        table = _timed(table, k)
        t = table.numbers(k) if factor == 1.0 else table.numbers(k) * factor
    if not len(t):
        raise MeasurementError("the file holds no rows")
    pick = _rows(record, t)
    if pick is not None:
        table, t = table.rows(pick), t[pick]
    clock = None if k is None else steady_clock(t)
    return Run(table, t if clock is None else clock.all_at(t), heading, conversion, clock)


def _rows(record: Recorded, t: NDArray[np.float64]) -> NDArray[np.int64] | None:
    """Return the rows of the part between two jumps of the clock, of equal times the first; None for all."""
    if record.part is None and record.repeated is None:
        return None
    rows = np.arange(len(t))
    if record.part is not None:
        parts = np.split(rows, np.flatnonzero(np.diff(t) < 0) + 1)
        if not 0 <= record.part < len(parts):
            raise MeasurementError(
                f"there is no part {record.part}: the file has {len(parts)} runs, numbered from 0"
            )
        rows = parts[record.part]
    if record.repeated == "first":
        rows = rows[np.diff(t[rows], prepend=np.nan) != 0]
    return rows


def _framed(table: Table) -> Table:
    """Drop the rows at the end of the table that hold only an input with its own clock."""
    if not any(heading.name.startswith("t:") for heading in table.headings):
        return table
    k = table.find("t")
    if k is None:
        return table
    there = np.flatnonzero(~np.isnan(table.numbers(k)))
    return table.rows(np.arange(int(there[-1]) + 1 if len(there) else 0))


def _timed(table: Table, k: int) -> Table:
    """Drop a last row without a time, as in a log that was cut off."""
    column = table.columns[k]
    if len(table) < 2 or not isinstance(column, TextColumn) or column.values is None:
        return table
    if not np.isnan(column.values[-1]):
        return table
    cut = f"{table.place(len(table) - 1)}, the last, has no time, and is passed over"
    return replace(table.rows(np.arange(len(table) - 1)), cut=table.cut or cut)


def own_inputs(table: Table) -> dict[str, InputSignal]:
    """Return the inputs in a file of the package: ``input:NAME``, over ``t:NAME`` if that column exists."""
    holds = table.meta.get("input_hold")
    places = {heading.name: k for k, heading in enumerate(table.headings)}
    signals = {}
    for name in (n.removeprefix("input:") for n in places if n.startswith("input:")):
        has_clock = f"t:{name}" in places
        if not has_clock and "t" not in places:
            continue
        t, values = (
            table.numbers(places[f"t:{name}" if has_clock else "t"]),
            table.numbers(places[f"input:{name}"]),
        )
        there = ~np.isnan(t if has_clock else values)
        hold = holds.get(name, "linear") if isinstance(holds, dict) else "linear"
        signals[name] = named_signal(name, t[there], values[there], hold)
    return signals


def _conversion(name: str, heading: Heading, units: Units) -> Conversion:
    """Return the conversion of a column from the unit in its heading.

    Raises
    ------
    MeasurementError
        It is not known, or of another quantity than the column is.
    """
    if heading.dates:
        return Conversion(remark="dates to s since the first")
    plain = name.removeprefix("sigma_")
    unit = heading.unit or (ending(plain, heading) if units.mapped else "")
    if not unit:
        return Conversion()
    base, base_unit = COUNTED.get(plain), in_base_units(unit)
    factor = size(name, unit)
    if base is not None and factor is None:
        if base_unit is not None and (base != "m" or plain in units.standard or units.mapped):
            raise MeasurementError(f"{name} is counted in {base}, but the column is called {heading.raw}")
        if base_unit is None and plain in units.standard:
            raise MeasurementError(f"the unit {unit[:80]!r} of {name} is not known; write {USUAL[base]}")
        if base_unit is None and base != "m":
            return Conversion(kept=f"the unit {unit[:80]!r} of {name} is not known, its numbers stay")
    elif base is not None and factor is not None:
        base_unit = (factor, base)
    if base_unit is None or base_unit[0] == 1.0:
        return Conversion()
    if units.of_user_model and base_unit[1].startswith("m"):
        # A model may count in mm; what it takes the sine of is in rad.
        return Conversion(kept=f'{name} stays in {unit} (columns="{name}={name}" makes it {base_unit[1]})')
    if base is None and not units.mapped and not units.of_user_model:
        return Conversion()
    return Conversion(base_unit[0], f"{unit} to {base_unit[1]}")


def _text(asked: Asked) -> str:
    return asked if isinstance(asked, str) else " and ".join(asked)
