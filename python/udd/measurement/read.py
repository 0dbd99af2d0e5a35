"""Reading a measurement: the package's own files, and the rough ones that laboratories keep."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import MeasurementError

from .input_signal import InputSignal
from .table import ANGLES, DISK, PENDULUM, QUALITY, Measurement, check_length

ALIASES = {
    "time": "t",
    "T": "t",
    "Time": "t",
    "angle": "theta",
    "Angle": "theta",
    "Theta": "theta",
    "θ": "theta",
}
ALIASES |= {"β": "beta", "Beta": "beta", "X": "x"}
#: Units that a column's name may state, and what they are in s, m and rad.
UNITS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "m": {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254},
    "rad": {
        "rad": 1.0,
        "mrad": 1e-3,
        **dict.fromkeys(("deg", "degree", "degrees", "°"), math.pi / 180),
        **dict.fromkeys(("rev", "turn", "turns"), 2 * math.pi),
    },
}
#: In what a disk's and a pendulum's columns are counted.
COUNTED: dict[str, str] = {"t": "s", "Y": "m", "Z": "m", "x": "m", "y": "m", "beta": "rad", "theta": "rad"}
#: Names that a unit may follow without brackets; others may be states of a user's own model.
_ENDING = ("t", "Y", "Z", "beta", "theta")
NOTHING = {
    "",
    "nan",
    "na",
    "n/a",
    "null",
    "none",
}  # what people and programs put into an empty cell


@dataclass
class Table:
    """Cells as text, with the line each row came from."""

    names: list[str]
    rows: list[list[str]]
    lines: list[int]
    meta: dict[str, Any]
    comma: bool = False  # decimal comma
    units: dict[str, str] = field(default_factory=dict)  # as the columns' names state them


def read_measurement(
    path: str | os.PathLike[str],
    columns: str | Sequence[str] | None = None,
    states: Sequence[str] | None = None,
    **meta: Any,
) -> Measurement:
    r"""Read a measured motion of a disk or of a pendulum.

    Parameters
    ----------
    path : path
        A text table (commas, semicolons, tabs or blanks; found by looking), or Parquet. Columns
        ``t, Y, Z, beta`` for a disk or ``t, theta`` for a pendulum [s, m, rad]; a pendulum bob's
        ``t, x, y`` [m, pivot at the origin, y up] becomes theta = atan2(x, -y). Optional:
        ``sigma_*``, ``rho_*``, ``flag``. Lines ``# key = value`` become `meta`. Other columns, and
        lines above the header, are passed over. A unit in a column's name, as in ``Angle (deg)``, ``t_ms`` or
        ``Y [mm]``, is converted to s, m or rad, and a warning tells so; columns of a user's own model stay in
        the unit that the model counts in. An empty cell or NaN is a frame where it was not seen.
    columns : str or sequence of str, optional
        The columns' names in order, for a file without a (usable) header: ``"t,theta,_"``. An
        underscore is a column to pass over.
    states : sequence of str, optional
        The columns that are wanted, where they are states of a user's own :class:`udd.Model`.
    **meta
        Entries that win over those of the file, such as ``W=0.039``; None is ignored.

    Returns
    -------
    Measurement
        Angles are unwrapped when the file holds them wrapped to one turn.

    Raises
    ------
    MeasurementError
        The file is missing, empty or not a table; a column is missing; a cell is not a number;
        times do not increase; a value is infinite; a sigma is not positive; too few usable rows.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "swing.txt"
    >>> rows = "".join(f"{i / 25} {0.3 * (-1)**i}\n" for i in range(12))
    >>> _ = file.write_text("my swing\ntime angle\n" + rows)
    >>> read_measurement(file).kind
    'pendulum'
    """
    source = Path(path)
    table = _load(source, columns)
    try:
        return _measurement(
            table,
            source,
            {key: value for key, value in meta.items() if value is not None},
            states,
        )
    except MeasurementError as error:
        raise MeasurementError(f"{source}: {error}") from None


def columns_of(path: str | os.PathLike[str], columns: str | Sequence[str] | None = None) -> list[str]:
    """The names of a table's columns, read as by :func:`read_measurement`."""
    return _load(Path(path), columns).names


def _load(path: Path, columns: str | Sequence[str] | None) -> Table:
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise MeasurementError(f"{path}: there is no such file") from None
    except OSError as error:
        raise MeasurementError(f"{path}: cannot be read ({error.strerror})") from None
    if not raw.strip():
        raise MeasurementError(f"{path}: the file is empty")
    given = None
    if columns is not None:
        given = [c.strip() for c in (columns.split(",") if isinstance(columns, str) else columns)]
    try:
        if raw[:4] == b"PAR1":
            return _parquet(path)
        return _text(raw, given)
    except MeasurementError as error:
        raise MeasurementError(f"{path}: {error}") from None


def _text(raw: bytes, given: list[str] | None) -> Table:
    if b"\0" in raw[:4096]:
        raise MeasurementError("this is not a text table")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    meta: dict[str, Any] = {}
    body: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.lstrip().startswith("#"):
            key, equals, value = line.lstrip().lstrip("#").partition("=")
            if equals:
                meta[key.strip()] = _value(value.strip())
        elif line.strip():
            body.append((number, line))
    if not body:
        raise MeasurementError("the file holds no rows")
    mark = _delimiter([line for _, line in body])
    comma = mark == ";" and sum("," in line for _, line in body) > len(body) / 2
    cells = [_split(line, mark) for _, line in body]

    head = next((i for i, row in enumerate(cells[:50]) if "t" in _named(row)), None)
    if given is not None:
        names, units = _named(given), _stated(given)
        start = (
            head + 1
            if head is not None
            else next(
                (i for i, row in enumerate(cells) if len(row) > 1 and all(_numeric(c, comma) for c in row)),
                len(cells),
            )
        )
    elif head is not None:
        names, units, start = _named(cells[head]), _stated(cells[head]), head + 1
    else:
        first = next(
            (i for i, row in enumerate(cells) if all(_numeric(c, comma) for c in row)),
            len(cells),
        )
        if first > 0 and len(cells[first - 1]) > 1:
            raise MeasurementError(f"no column t: found {', '.join(cells[first - 1])}")
        raise MeasurementError(
            'no header names the columns: say what they are, for example columns="t,theta,_"'
        )
    return Table(names, cells[start:], [number for number, _ in body[start:]], meta, comma, units)


def _delimiter(lines: list[str]) -> str:
    for mark in "\t;,":
        if sum(mark in line for line in lines) > len(lines) / 2:
            return mark
    return " "


def _split(line: str, mark: str) -> list[str]:
    if mark == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line.strip("\r\n")], delimiter=mark))]


def _named(cells: list[str]) -> list[str]:
    """Names without units and TeX: ``t_{1}``, ``T [s]`` and ``t_ms`` are all t."""
    return [name for name, _unit in _columns_in(cells)]


def _stated(cells: list[str]) -> dict[str, str]:
    """The units that names state, by the names without them."""
    return {name: unit for name, unit in _columns_in(cells) if unit}


def _columns_in(cells: list[str]) -> list[tuple[str, str]]:
    """Names and the units that they state; empty where they state none that is known."""
    bare = [re.sub(r"_?\{[^}]*\}|\[[^]]*\]|\([^)]*\)", "", cell).strip() for cell in cells]
    names = [ALIASES.get(name, name) for name in bare]
    result = []
    for cell, plain, name in zip(cells, bare, names, strict=True):
        stated = re.search(r"[\[(]\s*([^])]+?)\s*[])]", cell)
        unit = stated.group(1) if stated else ""
        # As an ending a unit belongs to what a disk and a pendulum are known by, unless that is there too.
        base, mark, ending = (
            re.split(r"(_|/)(?=[^_/]*$)", plain, maxsplit=1) if re.search("[_/]", plain) else (plain, "", "")
        )
        known = ALIASES.get(base, base)
        if mark and known in _ENDING and known not in names and _size(known, ending):
            name, unit = known, ending
        result.append((name, unit if _size(name.removeprefix("sigma_"), unit) else ""))
    return result


def _size(name: str, unit: str) -> float | None:
    """What one of a unit is in the unit that a column is counted in; None where it is no unit of that."""
    known = UNITS.get(COUNTED.get(name, ""), {})
    return known.get(unit, known.get(unit.lower()))


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def _numeric(cell: str, comma: bool) -> bool:
    try:
        _number(cell, comma)
    except ValueError:
        return False
    return True


def _number(cell: str, comma: bool) -> float:
    if cell.strip().lower() in NOTHING:
        return float("nan")
    if "_" in cell:  # Python would read 1_000
        raise ValueError(cell)
    return float(cell.replace(",", ".") if comma else cell)


def _parquet(path: Path) -> Table:
    try:
        pq = import_module("pyarrow.parquet")
    except ImportError:
        raise MeasurementError("Parquet files need the package pyarrow (pip install pyarrow)") from None
    try:
        table = pq.read_table(path)
    except (OSError, ValueError) as error:  # ArrowInvalid is a ValueError
        raise MeasurementError(f"the Parquet file cannot be read ({error})") from None
    stored = table.schema.metadata or {}
    meta = {
        k.decode(): _value(v.decode()) for k, v in stored.items() if k not in (b"pandas", b"ARROW:schema")
    }
    columns = [
        ["" if x is None else str(x) for x in table.column(name).to_pylist()] for name in table.column_names
    ]
    rows = [list(row) for row in zip(*columns, strict=True)]
    names = list(table.column_names)
    return Table(_named(names), rows, list(range(1, len(rows) + 1)), meta, units=_stated(names))


def _measurement(
    table: Table, path: Path, meta: dict[str, Any], states: Sequence[str] | None = None
) -> Measurement:
    have = set(table.names)
    if isinstance(states, str):
        raise MeasurementError(f"states is a list of columns, not {states!r}")
    wanted = _WANTED | set(states or ())
    twice = next((n for n in table.names if n != "_" and table.names.count(n) > 1 and n in wanted), None)
    if twice is not None:
        raise MeasurementError(f"two columns are called {twice}")

    def need(name: str) -> NDArray[np.float64]:
        if name not in have:
            raise MeasurementError(f"no column {name}: found {', '.join(n for n in table.names if n != '_')}")
        unit = "" if states is not None else table.units.get(name, "")
        size = _size(name.removeprefix("sigma_"), unit) if unit else 1.0
        if size in (None, 1.0):
            return _column(table, name)
        if not name.startswith("sigma_"):
            converted[name] = unit
        return _column(table, name) * size

    converted: dict[str, str] = {}
    names: tuple[str, ...] = DISK if have & {"Y", "Z", "beta"} else PENDULUM
    if states is not None:
        names = tuple(states)
    driven = _inputs(table)
    table = _framed(table)
    t = need("t")
    if not len(t):
        raise MeasurementError("the file holds no rows")
    extra: dict[str, Any] = {}
    if names == PENDULUM and "theta" not in have and {"x", "y"} & have:
        x, y = need("x"), need("y")
        values = np.arctan2(x, -y)[:, None]
        extra["length"] = float(np.nanmedian(np.hypot(x, y))) if np.isfinite(x + y).any() else float("nan")
    else:
        values = np.column_stack([need(name) for name in names])
    flag = None
    if "flag" in have:
        k = table.names.index("flag")
        flag = np.array([row[k] if k < len(row) else "" for row in table.rows], dtype=np.str_)
    for k in (k for k, name in enumerate(names) if name in ANGLES):
        values[:, k] = unwrap(values[:, k])
    sigma = rho = None
    if any(f"sigma_{name}" in have for name in names):
        sigma = np.column_stack([need(f"sigma_{name}") for name in names])
    pairs = [f"rho_{a}{b}" for a, b in combinations(names, 2)]
    if have & set(pairs):
        rho = np.column_stack([need(name) for name in pairs])
    if converted:
        told = ", ".join(f"{name} from {unit} to {COUNTED[name]}" for name, unit in converted.items())
        warnings.warn(f"{path}: converted {told}, as the names of its columns say", stacklevel=3)
    meta = {"source": path.name} | extra | {k: v for k, v in table.meta.items() if k != "input_hold"} | meta
    quality = _quality(table, names) if "px_per_m" in meta else {}
    m = _located(table, lambda: Measurement(t, values, sigma, rho, flag, meta, names, quality, driven))
    check_length(m)
    return m


def _inputs(table: Table) -> dict[str, InputSignal]:
    """The inputs that a file of the package holds: ``input:NAME``, over ``t:NAME`` where that is there."""
    holds = table.meta.get("input_hold")
    found = {}
    for name in (n.removeprefix("input:") for n in table.names if n.startswith("input:")):
        own = f"t:{name}" in table.names
        t, values = _column(table, f"t:{name}" if own else "t"), _column(table, f"input:{name}")
        there = ~np.isnan(t if own else values)
        hold: Any = holds.get(name, "linear") if isinstance(holds, dict) else "linear"
        try:
            found[name] = InputSignal(t[there], values[there], hold)
        except MeasurementError as error:
            raise MeasurementError(f"the input {name}: {error}") from None
    return found


def _framed(table: Table) -> Table:
    """The table without the rows at its end that hold only an input with a clock of its own."""
    if not any(name.startswith("t:") for name in table.names):
        return table
    end, at = len(table.rows), table.names.index("t")
    while end and not (len(table.rows[end - 1]) > at and table.rows[end - 1][at].strip()):
        end -= 1
    return replace(table, rows=table.rows[:end], lines=table.lines[:end])


def _quality(table: Table, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    """What a tracked film's file says of each frame; in anybody else's the names may mean anything."""
    found: dict[str, NDArray[Any]] = {}
    for name in (n for n in QUALITY if n in table.names and n not in names):
        if name == "method":
            k = table.names.index(name)
            found[name] = np.array([row[k] if k < len(row) else "" for row in table.rows], dtype=np.str_)
        else:
            found[name] = _column(table, name)
            if name == "marks" and np.isfinite(found[name]).all():
                found[name] = found[name].astype(np.int64)
    return found


_WANTED = {"t", "x", "y", "flag", *DISK, *PENDULUM}


def _column(table: Table, name: str) -> NDArray[np.float64]:
    k = table.names.index(name)
    out = np.empty(len(table.rows))
    for i, (row, line) in enumerate(zip(table.rows, table.lines, strict=True)):
        if k >= len(row):
            raise MeasurementError(
                f"line {line} ends before column {name}: {len(row)} of {len(table.names)} cells"
            )
        try:
            out[i] = _number(row[k], table.comma)
        except ValueError:
            raise MeasurementError(
                f"line {line}: {row[k]!r} stands where a number for {name} should be"
            ) from None
    return out


def _located(table: Table, make: Callable[[], Measurement]) -> Measurement:
    """Say "line 7" where the table says "row 3"."""
    try:
        return make()
    except MeasurementError as error:
        said = re.match(r"row (\d+)", str(error))
        if said is None:
            raise
        line = table.lines[int(said.group(1))]
        raise MeasurementError(f"line {line}{str(error)[said.end() :]}") from None


def unwrap(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Undo the wrapping of an angle [rad] that a file keeps within one turn.

    An angle that spans more than a turn is unwrapped already and is returned as it is: fast
    rotation across a gap may truly move it by more than half a turn.
    """
    seen = np.isfinite(angle)
    good = angle[seen]
    if len(good) < 2 or np.ptp(good) > 2 * np.pi + 1e-9 or np.abs(np.diff(good)).max() <= np.pi:
        return angle
    out = angle.copy()
    out[seen] = np.unwrap(good)
    return out
