"""Reading a measurement from a file of any known kind, with a remark on the use of each column."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.input_files import LARGEST, MemoryLimit, read_regular
from udd.errors import MeasurementError, outside

from .formats import HEAD, Table, format_of
from .formats.headings import Heading
from .input_signal import Hold
from .recorded import Frames, Recorded, Units, own_inputs
from .table import CAMERA_COLUMNS, DISK, PENDULUM, QUALITY, Measurement, check_length
from .unwrapping import unwrapped

Columns = str | Sequence[str] | Mapping[str, str | tuple[str, str]]


@checked_arguments(error=MeasurementError)
def read_measurement(
    path: str | os.PathLike[str],
    columns: Columns | None = None,
    states: Sequence[str] | None = None,
    *,
    inputs: str | Sequence[str] | Mapping[str, str] | None = None,
    hold: Hold = "linear",
    rate: float | None = None,
    repeated: Literal["first"] | None = None,
    part: int | None = None,
    limit: float = LARGEST,
    **meta: Any,
) -> Measurement:
    r"""Read a measured motion of a disk, of a pendulum or of a machine of your own.

    Parameters
    ----------
    path : path
        A text table (commas, semicolons, tabs or blanks, and decimal commas, are recognised). Parquet,
        NumPy's ``.npz`` and ``.npy``, MATLAB's ``.mat``, HDF5 (with MATLAB 7.3, needs h5py). A ``.zip`` of
        tables as phyphox exports it. A Tracker project (``.trk``, ``.trz``) or Tracker's table of several
        points.

        A disk has the columns ``t, Y, Z, beta``, a pendulum ``t, theta`` [s, m, rad]. A pendulum bob's
        ``t, x, y`` [m, pivot at the origin, y up] becomes theta = atan2(x, -y). Optional columns are
        ``sigma_*``, ``rho_*`` and ``flag``. Lines ``# key = value`` become `meta`. Other columns, and lines
        above the header, are ignored. An empty cell or NaN is a frame without this coordinate.

        A unit in a column's name, as in ``Angle (deg)``, ``t_ms`` or ``Y [mm]``, is converted to s, m or
        rad, and dates (ISO 8601) to seconds since the first. A warning says so. Times of a constant rate that
        the file rounds, as to ms, are corrected to that rate (``meta["clock"]``). Other times stay.
    columns : mapping, str or sequence of str, optional
        Which column is which coordinate: ``{"theta": "position"}``, or ``"theta=position"``. Two columns,
        ``{"theta": ("mass A x", "mass A y")}``, are a bob's position. A column of the time that is called so
        needs no entry. Units in the columns' names are converted to s, m, rad and their products, as rpm to
        rad/s. A unit of another quantity is refused, and so is an unknown unit of a disk or a pendulum.
        For a file without a (usable) header, give the columns' names in order: ``"t,theta,_"``. An underscore
        is a column to ignore.
    states : sequence of str, optional
        The columns to read, if they are states of a user's own :class:`udd.Model`. Times, angles and their
        rates are converted to s and rad. Other columns stay in the model's unit; a warning says so if the
        heading states another unit than m, and `columns` converts them.
    inputs : sequence of str or mapping, optional
        Columns with the inputs of the machine: ``["torque"]``, or ``{"u": "Motor torque (N m)"}``. They keep
        their unit, which is in ``meta["input_units"]``. An input from another table of the file, or of
        another length, keeps its own clock. Empty samples are left out.
    hold : {"linear", "zero", "cubic"}, default "linear"
        Interpolation of these inputs between their samples.
    rate : float, optional
        Samples per second [Hz] of a file that has no column of times.
    repeated : {"first"}, optional
        Keep the first of several rows with the same time; by default they are refused.
    part : int, optional
        If the clock jumps back: which of the stretches between its jumps, from 0.
    limit : float, default 1e9
        Bytes of data that the file may unpack to: its content, and 8 for each number. More is refused.
    **meta
        Entries that replace those of the file, such as ``W=0.039``; None is ignored.

    Returns
    -------
    Measurement
        The angle of a disk or a pendulum is made continuous if the file keeps it within one turn. The angles
        of other models are made continuous by the fit. ``meta["columns"]`` says which column of the file each
        coordinate is, if they have other names in the file.

    Raises
    ------
    MeasurementError
        The file is missing, empty, broken, of an unknown kind, no regular file, larger than `limit`, or
        refers to other files (HDF5). A column is missing, or a cell is not a number. Times do not increase,
        a value is infinite, a sigma is not positive, or there are too few usable rows.

    See Also
    --------
    udd.track : measures a film.
    udd.fit : fits a model to the record.
    udd.plot.time_series : draw the columns.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "swing.txt"
    >>> rows = "".join(f"{i / 25} {0.3 * (-1)**i} {i}\n" for i in range(12))
    >>> _ = file.write_text("my swing\ntime angle torque\n" + rows)
    >>> read_measurement(file).kind
    'pendulum'
    >>> m = read_measurement(file, columns={"q": "angle"}, inputs={"tau": "torque"})
    >>> m
    <Measurement of q, driven by tau: 12 rows, t = 0 to 0.44 s>
    >>> m.meta["columns"]
    {'t': 'time', 'q': 'angle', 'tau': 'torque, input'}
    """
    source = Path(path)
    mapping, given = _mapping(columns)
    if isinstance(states, str) or not (states is None or isinstance(states, Iterable)):
        raise MeasurementError(f"states is a list of columns, not {states!r}")
    drivers = _drivers(inputs)
    tables = _load(source, given, limit)
    about = {key: value for key, value in meta.items() if value is not None}
    try:
        record = Recorded(tables, mapping, rate=rate, repeated=repeated, part=part)
        m, frames = _measurement(record, source, about, states, drivers, hold)
    except MeasurementError as error:
        raise MeasurementError(f"{source}: {error}") from None
    for kept in frames.kept:
        warnings.warn(f"{source}: {kept}", stacklevel=outside())
    if frames.converted:
        changes = ", ".join(f"{name} from {units}" for name, units in frames.converted.items())
        warnings.warn(f"{source}: converted {changes}, as its columns say", stacklevel=outside())
    return m


def tables_of(path: str | os.PathLike[str], *, limit: float = LARGEST) -> list[Table]:
    """Read the tables in a file, before their columns are interpreted."""
    return _load(Path(path), None, limit)


def headings_of(
    path: str | os.PathLike[str], columns: Columns | None = None, *, limit: float = LARGEST
) -> list[Heading]:
    """Return the headings of a file's columns that have a name, with their units."""
    tables = _load(Path(path), _mapping(columns)[1], limit)
    return [heading for table in tables for heading in table.headings if heading.name]


def columns_of(
    path: str | os.PathLike[str], columns: Columns | None = None, *, limit: float = LARGEST
) -> list[str]:
    """Return the names of a file's columns, read as by :func:`read_measurement`."""
    mapping = _mapping(columns)[0]
    names = [heading.name for heading in headings_of(path, columns, limit=limit)]
    return [*(mapping or {}), *(name for name in names if name not in (mapping or {}))]


def column_sentence(columns: Any) -> str:
    """Say in a sentence which column each coordinate is (``meta["columns"]``); empty if unknown."""
    if not isinstance(columns, Mapping):
        return ""
    taken = [
        f"input {name} from {text.removesuffix(', input')}"
        if text.endswith(", input")
        else f"{name} from {text}"
        for name, text in columns.items()
        if name != "passed over" and isinstance(text, str)
    ]
    rest = f"; passed over: {columns['passed over']}" if "passed over" in columns else ""
    return f"read {', '.join(taken)}{rest}"


def _mapping(columns: Columns | None) -> tuple[dict[str, str | tuple[str, str]] | None, list[str] | None]:
    """Return the columns by their meaning, or else all their names in order."""
    if columns is None:
        return None, None
    if isinstance(columns, Mapping):
        for name, asked in columns.items():
            pair = (
                isinstance(asked, tuple | list) and len(asked) == 2 and all(isinstance(a, str) for a in asked)
            )
            if not isinstance(name, str) or not (isinstance(asked, str) or pair):
                raise MeasurementError(f"columns needs the name of a column for {name}, not {asked!r}")
        return {name: a if isinstance(a, str) else (a[0], a[1]) for name, a in columns.items()}, None
    if not isinstance(columns, Iterable):
        raise MeasurementError(f"columns must be names of columns, not {columns!r}")
    names = columns.split(",") if isinstance(columns, str) else list(columns)
    if not all(isinstance(name, str) for name in names):
        raise MeasurementError(f"columns must be names of columns, not {columns!r}")
    if isinstance(columns, str) and "=" in columns:
        return dict(pairs(columns, "columns")), None
    return None, [name.strip() for name in names]


def pairs(text: str, what: str) -> dict[str, str]:
    """``theta=position,x=Bob (m)`` as a mapping; of a name alone the column is called so.

    Raises
    ------
    MeasurementError
        A name or a column is missing.
    """
    mapping = {}
    for pair in text.split(","):
        name, equals, column = (part.strip() for part in pair.partition("="))
        if not name or (equals and not column):
            raise MeasurementError(f"{what} must look like theta=position, not {pair.strip()!r}")
        mapping[name] = column or name
    return mapping


def _drivers(inputs: str | Sequence[str] | Mapping[str, str] | None) -> dict[str, str]:
    """Return the columns of the inputs by name."""
    if inputs is None:
        return {}
    if isinstance(inputs, str):
        return pairs(inputs, "inputs")
    if not isinstance(inputs, Iterable):
        raise MeasurementError(f"inputs must be names of columns, not {inputs!r}")
    column_of = dict(inputs) if isinstance(inputs, Mapping) else {name: name for name in inputs}
    if not all(isinstance(part, str) for pair in column_of.items() for part in pair):
        raise MeasurementError(f"inputs must be names of columns, not {inputs!r}")
    return column_of


def _load(path: Path, given: list[str] | None, limit: float) -> list[Table]:
    memory = MemoryLimit(limit, MeasurementError)
    try:
        raw = read_regular(path, memory)
        if not raw.strip():
            raise MeasurementError("the file is empty")
        return format_of(raw[:HEAD], path.suffix).read(raw, given, memory)
    except FileNotFoundError:
        raise MeasurementError(f"{path}: there is no such file") from None
    except OSError as error:
        raise MeasurementError(f"{path}: cannot be read ({error.strerror})") from None
    except MeasurementError as error:
        raise MeasurementError(f"{path}: {error}") from None


def _measurement(
    record: Recorded,
    path: Path,
    meta: dict[str, Any],
    states: Sequence[str] | None,
    drivers: dict[str, str],
    hold: Hold,
) -> tuple[Measurement, Frames]:
    """Make the measurement of the columns, and return it with their frames."""
    names, bob = _names(record, states)
    columns = ("x", "y") if bob else names
    mapped = record.mapping is not None
    unit_columns = ("t", *columns) if states is None and names in (DISK, PENDULUM) else ()
    keeps_units = states is not None and not mapped
    frames = record.frames(columns, Units(frozenset(unit_columns), mapped, keeps_units))
    t = frames.times()
    extra: dict[str, Any] = {}
    if bob:
        x, y = frames.column("x"), frames.column("y")
        values = np.arctan2(x, -y)[:, None]
        frames.sources["theta"] = f"atan2(x, -y) of {frames.sources.pop('x')} and {frames.sources.pop('y')}"
        extra["length"] = float(np.nanmedian(np.hypot(x, y))) if np.isfinite(x + y).any() else float("nan")
    else:
        values = np.column_stack([frames.column(name) for name in names])
    sigma = rho = None
    if any(frames.has(f"sigma_{name}") for name in names):
        sigma = np.column_stack([frames.column(f"sigma_{name}") for name in names])
    between = [f"rho_{a}{b}" for a, b in combinations(names, 2)]
    if any(frames.has(name) for name in between):
        rho = np.column_stack([frames.column(name) for name in between])
    flag = frames.words("flag") if frames.has("flag") else None
    head = {k: v for k, v in frames.table.meta.items() if k != "input_hold"}
    meta = {"source": path.name} | extra | head | meta
    if frames.run.clock is not None:
        meta["clock"] = frames.run.clock.text
    quality = _quality(frames, names) if "px_per_m" in meta else {}
    signals = own_inputs(frames.whole)
    units = {}
    for name, asked in drivers.items():
        if name not in signals:
            signals[name], units[name] = frames.input(name, asked, hold)
    if any(units.values()):
        said = meta.get("input_units")
        stated = {name: unit for name, unit in units.items() if unit}
        meta["input_units"] = stated | (said if isinstance(said, dict) else {})
    if drivers or frames.renamed:
        meta.setdefault("columns", frames.column_sources())
    m = _located(
        frames.table, lambda: Measurement(t, values, sigma, rho, flag, meta, names, quality, signals)
    )
    check_length(m)
    return unwrapped(m), frames


def _names(record: Recorded, states: Sequence[str] | None) -> tuple[tuple[str, ...], bool]:
    """Return the measurement's columns, and True if a bob's position determines them."""
    if states is not None:
        return tuple(states), False
    if record.mapping is not None:
        return record.coordinates, False
    have = record.names
    if have & set(DISK):
        return DISK, False
    return PENDULUM, "theta" not in have and bool({"x", "y"} & have)


def _quality(frames: Frames, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    """Return the quality of each frame of a tracked film. In other files the names may mean anything."""
    quality: dict[str, NDArray[Any]] = {}
    for name in (n for n in (*QUALITY, *CAMERA_COLUMNS) if frames.has(n) and n not in names):
        if name == "method":
            quality[name] = frames.words(name)
        else:
            quality[name] = frames.column(name)
            if name == "marks" and np.isfinite(quality[name]).all():
                quality[name] = quality[name].astype(np.int64)
    return quality


def _located(table: Table, make: Callable[[], Measurement]) -> Measurement:
    """Say "line 7" where the table says "row 3", and what helps where times do not increase."""
    try:
        return make()
    except MeasurementError as error:
        said = re.match(r"row (\d+)", str(error))
        if said is None:
            raise
        rest = str(error)[said.end() :]
        for beginning, help_ in _HELP.items():
            rest += help_ if rest.startswith(beginning) else ""
        raise MeasurementError(f"{table.place(int(said.group(1)))}{rest}") from None


_HELP = {
    " repeats the time": ' (repeated="first" keeps the first of such rows)',
    " goes back in time": " (part=0, part=1 ... reads the rows between such jumps)",
}
