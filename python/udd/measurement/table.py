"""The measured motion as an immutable table."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.labelled import dataset
from udd.errors import MeasurementError

from .input_signal import InputSignal, input_signals

if TYPE_CHECKING:
    import xarray as xr

DISK = ("Y", "Z", "beta")
PENDULUM = ("theta",)
#: Motion of a film's camera: the place of the steady picture's corner in a frame [pixels], the frame's turn
#: [rad] and enlargement, and its light relative to the steady picture.
CAMERA_COLUMNS = ("camera_u", "camera_v", "camera_turn", "camera_zoom", "camera_gain")
#: Columns of a tracked film on the quality of each frame.
QUALITY = ("marks", "complete", "residual_px", "blur_px", "method")
USABLE = ("gap", "degraded")  # flags of frames that hold what they show all the same
SHORTEST = 10  # rows; with fewer there are no more data than unknowns in any model here


@dataclass(frozen=True, eq=False)
class Measurement(Drawable):
    """Measured motion of a disk, of a pendulum, or of a user's own model.

    Parameters
    ----------
    t : array_like, shape (n,)
        Times [s], strictly increasing.
    values : array_like, shape (n, m), or mapping of name to shape (n,)
        One column per name. A disk has ``Y, Z`` [m] and ``beta`` [rad, unwrapped]; a pendulum has
        ``theta`` [rad, 0 hanging]; others are states of a user's own :class:`udd.Model`. NaN marks a frame
        without this coordinate.
    sigma : array_like or mapping, optional
        Standard errors in the layout and units of `values`.
    rho : array_like, shape (n, m (m - 1) / 2), optional
        Correlations of the errors, in the order of `pairs`.
    flag : sequence of str, optional
        Why a frame is not usable; the empty string is a good frame. One that begins with ``gap`` (frames are
        missing before this one) or ``degraded`` is a remark: the row counts, with its standard errors.
    meta : mapping, optional
        Other data: ``R`` [m], ``W`` [m/s], ``source``, ``fps``, ``middle`` (Y and Z [m] of the picture's
        middle, the centre of the lens's distortion), ...
    names : tuple of str, optional
        Column names; by default those of a record with this number of columns.
    quality : mapping, optional
        Quality of each row by name, shape (n,). A tracked film has ``marks`` (number in view), ``complete``
        (share of the marks' edges in view), ``residual_px`` (r.m.s. misfit of the marks), ``blur_px``
        (length of the streaks) and ``method`` ("refined", "fast" or "none"). A moving camera also has
        ``camera_u, camera_v`` [pixels], ``camera_turn`` [rad], ``camera_zoom`` and ``camera_gain``.
    inputs : mapping, optional
        Measured inputs (what drives it) by name: an :class:`udd.InputSignal` with a clock of its own, or an
        array (n,) of samples at `t`, joined by straight lines. ``meta["input_units"]`` may hold their units,
        as text by name. A selection of rows keeps the whole signals: a model needs its input between the
        rows.

    Raises
    ------
    MeasurementError
        Times not increasing or duplicate, infinite values, sigma not positive, shapes that differ; an input
        that is no signal, or has the name of a column.

    See Also
    --------
    udd.read_measurement : reads a file.
    udd.track : measures a film.
    udd.fit : fits a model to it.
    udd.plot.time_series : draw the columns.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(20) / 25
    >>> m = Measurement(t, {"theta": 0.1 * np.cos(4 * t)}, meta={"source": "clock"})
    >>> m.kind, m.names, len(m), round(m.duration, 2)
    ('pendulum', ('theta',), 20, 0.76)
    >>> driven = Measurement(t, {"theta": 0.1 * np.cos(4 * t)}, inputs={"u": np.sin(t)})
    >>> driven
    <Measurement of theta, driven by u: 20 rows, t = 0 to 0.76 s>
    >>> driven["u"][:2], driven.inputs["u"](0.02)
    (array([0. , 0.03998933]), array(0.01999467))
    """

    t: NDArray[np.float64]
    values: NDArray[np.float64]
    sigma: NDArray[np.float64] | None = None
    rho: NDArray[np.float64] | None = None
    flag: NDArray[np.str_] = field(default_factory=lambda: np.empty(0, dtype=np.str_))
    meta: Mapping[str, Any] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    quality: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    inputs: Mapping[str, InputSignal] = field(default_factory=dict)

    @checked_arguments(error=MeasurementError)
    def __init__(
        self,
        t: ArrayLike,
        values: ArrayLike | Mapping[str, ArrayLike],
        sigma: ArrayLike | Mapping[str, ArrayLike] | None = None,
        rho: ArrayLike | None = None,
        flag: ArrayLike | None = None,
        meta: Mapping[str, Any] | None = None,
        names: tuple[str, ...] = (),
        quality: Mapping[str, ArrayLike] | None = None,
        inputs: Mapping[str, InputSignal | ArrayLike] | None = None,
    ) -> None:
        for what, given in (("meta", meta), ("quality", quality), ("inputs", inputs)):
            if given is not None and not isinstance(given, Mapping):
                raise MeasurementError(f"{what} must be entries by their names, not {given!r:.80}")
        times = _numbers("t", t)
        names = _names(names) or _names(tuple(values) if isinstance(values, Mapping) else ())
        table = _columns("values", values, names)
        if not names:
            names = {3: DISK, 1: PENDULUM}.get(table.shape[1], ())
        if not names or len(set(names)) < len(names):
            raise MeasurementError(
                f"columns must be {DISK}, {PENDULUM} or states by their names, not {names}"
            )
        n, m = table.shape
        flags = np.full(n, "") if flag is None else np.array(flag, dtype=np.str_)
        correlations = None if rho is None else _numbers("rho", rho)
        put = object.__setattr__
        put(self, "t", times)
        put(self, "values", table)
        put(self, "sigma", None if sigma is None else _columns("sigma", sigma, names))
        if correlations is not None and correlations.size != n * (m * (m - 1) // 2):
            raise MeasurementError(f"rho has shape {correlations.shape}, expected {(n, m * (m - 1) // 2)}")
        put(self, "rho", None if correlations is None else correlations.reshape(n, m * (m - 1) // 2))
        put(self, "flag", flags)
        put(self, "meta", dict(meta or {}))
        put(self, "names", names)
        quality_columns = {name: np.array(column) for name, column in (quality or {}).items()}
        put(self, "quality", quality_columns)
        if (
            odd := next((name for name, column in quality_columns.items() if column.shape != (n,)), None)
        ) is not None:
            raise MeasurementError(f"{odd} has shape {quality_columns[odd].shape}, expected {(n,)}")
        if times.shape != (n,) or flags.shape != (n,) or m != len(names):
            raise MeasurementError(f"t, values and flag have different lengths: {times.shape}, {table.shape}")
        if self.sigma is not None and self.sigma.shape != (n, m):
            raise MeasurementError(f"sigma has shape {self.sigma.shape}, values have {(n, m)}")
        check(self, lambda i: f"row {i}")
        put(self, "inputs", input_signals(inputs, times))
        _check_inputs(self)
        for array in (times, table, self.sigma, self.rho, flags, *quality_columns.values()):
            if array is not None:
                array.setflags(write=False)

    @property
    def kind(self) -> str:
        """``"disk"`` or ``"pendulum"``; ``"own"`` where the columns are states of a user's own model."""
        return {DISK: "disk", PENDULUM: "pendulum"}.get(self.names, "own")

    @property
    def angles(self) -> tuple[str, ...]:
        """The columns of a disk or a pendulum that are angles; empty for a model of the user's own.

        There the model says which states are angles.
        """
        return {DISK: ("beta",), PENDULUM: ("theta",)}.get(self.names, ())

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Pairs of names in the order of the columns of `rho`."""
        return tuple(combinations(self.names, 2))

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Usable rows, shape (n,): what was measured is there and the flag is empty or a mere remark.

        A disk or a pendulum needs every coordinate; a user's own model needs any, since sensors may have
        rates of their own.
        """
        there = np.isfinite(self.values)
        return np.asarray(
            (there.any(axis=1) if self.kind == "own" else there.all(axis=1)) & usable(self.flag)
        )

    @property
    def duration(self) -> float:
        """Time from the first to the last row [s]."""
        return float(self.t[-1] - self.t[0])

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a column (or `quality`), a standard error as ``sigma_<name>``, or an input at `t`."""
        if name in self.inputs:
            return self.inputs[name](self.t)
        if name in self.quality and name not in self.names:
            return self.quality[name]
        table, column = self.values, name
        if name.startswith("sigma_") and self.sigma is not None:
            table, column = self.sigma, name.removeprefix("sigma_")
        if column not in self.names:
            raise KeyError(name)
        return table[:, self.names.index(column)]

    def covariance(self) -> NDArray[np.float64]:
        """Return the covariance matrix of each row.

        Returns
        -------
        ndarray, shape (n, m, m)
            In the units of `values` squared.

        Raises
        ------
        MeasurementError
            No standard errors are known.
        """
        if self.sigma is None:
            raise MeasurementError("this measurement has no standard errors (no sigma columns)")
        m = len(self.names)
        correlation = np.broadcast_to(np.eye(m), (len(self), m, m)).copy()
        if self.rho is not None:
            for k, (a, b) in enumerate(combinations(range(m), 2)):
                correlation[:, a, b] = correlation[:, b, a] = self.rho[:, k]
        return np.asarray(self.sigma[:, :, None] * correlation * self.sigma[:, None, :])

    @checked_arguments(error=MeasurementError)
    def slice(self, t0: float, t1: float) -> Measurement:
        """Return the rows of a span of time.

        Parameters
        ----------
        t0, t1 : float
            The rows with ``t0 <= t < t1`` are returned [s].

        Returns
        -------
        Measurement
            The times keep their origin, and the inputs stay whole.
        """
        return self.rows((self.t >= t0) & (self.t < t1))

    @checked_arguments(error=MeasurementError)
    def rows(self, mask: ArrayLike) -> Measurement:
        """Return the rows that a mask or an index array picks.

        Parameters
        ----------
        mask : array_like of bool or int, shape (n,) or (k,)
            A boolean for each row, or row numbers.

        Returns
        -------
        Measurement
            The inputs stay whole.
        """
        pick = np.asarray(mask)
        try:
            self.t[pick]
        except IndexError:
            raise MeasurementError(
                f"mask must be True or False for each of {len(self)} rows, or numbers of rows: {mask!r:.80}"
            ) from None
        return Measurement(
            self.t[pick],
            self.values[pick],
            None if self.sigma is None else self.sigma[pick],
            None if self.rho is None else self.rho[pick],
            self.flag[pick],
            self.meta,
            self.names,
            {name: column[pick] for name, column in self.quality.items()},
            self.inputs,
        )

    def to_xarray(self) -> xr.Dataset:
        """Return labelled arrays over ``t``: columns, their ``sigma_...``, ``flag`` and inputs.

        An input that was sampled at other times than `t` lies over times of its own, ``t_<name>``.

        Returns
        -------
        xarray.Dataset
            ``to_dataframe()`` of it is a table for pandas.

        Examples
        --------
        >>> import udd
        >>> udd.Measurement([0.0, 0.1], {"theta": [0.2, 0.1]}).to_xarray().theta.attrs
        {'units': 'rad'}
        """
        units = (
            {"Y": "m", "Z": "m", "beta": "rad", "theta": "rad", "t": "s"}
            if self.kind != "own"
            else {"t": "s"}
        )
        columns: dict[str, Any] = {name: self.values[:, k] for k, name in enumerate(self.names)}
        if self.sigma is not None:
            columns |= {f"sigma_{name}": self.sigma[:, k] for k, name in enumerate(self.names)}
            units |= {f"sigma_{name}": units[name] for name in self.names if name in units}
        if len(self.flag):
            columns["flag"] = self.flag
        labelled_data = dataset(columns, ["t"], units, {"t": self.t})
        for name, signal in self.inputs.items():
            at = "t" if self.on_rows(name) else f"t_{name}"
            if at != "t":
                labelled_data = labelled_data.assign_coords({at: (at, signal.t, {"units": "s"})})
            unit = _unit_of(self.meta, name)
            labelled_data[name] = (
                at,
                signal.values,
                {"hold": signal.hold} | ({"units": unit} if unit else {}),
            )
        return labelled_data

    @checked_arguments(error=MeasurementError)
    def on_rows(self, name: str) -> bool:
        """Return True if an input was sampled at the times of the rows.

        Parameters
        ----------
        name : str
            Name of an input.

        Returns
        -------
        bool
        """
        if name not in self.inputs:
            input_names = ", ".join(self.inputs) or "no inputs"
            raise MeasurementError(f"nothing that drives it is called {name!r:.80}; there are {input_names}")
        return np.array_equal(self.inputs[name].t, self.t)

    def __repr__(self) -> str:
        span = f", t = {self.t[0]:.6g} to {self.t[-1]:.6g} s" if len(self) else ""
        driven = f", driven by {', '.join(self.inputs)}" if self.inputs else ""
        return f"<Measurement of {', '.join(self.names)}{driven}: {len(self)} rows{span}>"

    @checked_arguments(error=MeasurementError)
    def with_meta(self, **changes: Any) -> Measurement:
        """Return the same rows with entries of `meta` replaced or added.

        Parameters
        ----------
        **changes
            Entries by name.

        Returns
        -------
        Measurement
            With the changed `meta`.
        """
        return replace(self, meta={**self.meta, **changes})

    @checked_arguments(error=MeasurementError)
    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the file format of the package; a reader gets the same bits back.

        The file appears complete or not at all.

        Parameters
        ----------
        path : path
            File to write.
        """
        from .write import to_csv

        to_csv(self, path)

    @checked_arguments(error=MeasurementError)
    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Write the same table as Parquet (needs pyarrow).

        Parameters
        ----------
        path : path
            File to write.
        """
        from .write import to_parquet

        to_parquet(self, path)


def usable(flag: NDArray[np.str_]) -> NDArray[np.bool_]:
    """Return a mask of flags that are empty, or only a remark on a row that counts."""
    return np.asarray([not said or said.startswith(USABLE) for said in flag.tolist()], dtype=bool)


def _names(given: Any) -> tuple[str, ...]:
    """Return the names of the columns, as a tuple."""
    if not isinstance(given, (tuple, list)) or not all(isinstance(name, str) for name in given):
        raise MeasurementError(f"names must be a list of the columns' names, not {given!r:.80}")
    return tuple(given)


def _numbers(what: str, given: ArrayLike) -> NDArray[np.float64]:
    """Copy an argument as numbers."""
    try:
        return np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise MeasurementError(f"{what} must be numbers (of a table in rows of one length)") from None


def _columns(
    what: str, values: ArrayLike | Mapping[str, ArrayLike], names: tuple[str, ...]
) -> NDArray[np.float64]:
    """One column per name."""
    if isinstance(values, Mapping):
        lost = [name for name in names if name not in values]
        if lost:
            raise MeasurementError(f"no column {lost[0]}: found {', '.join(values)}")
        columns = [_numbers(name, values[name]) for name in names]
        shapes = [column.shape for column in columns]
        if any(len(shape) != 1 for shape in shapes) or len(set(shapes)) > 1:
            sizes = ", ".join(f"{name} {shape}" for name, shape in zip(names, shapes, strict=True))
            raise MeasurementError(f"{what} must be columns of one length, not of shapes {sizes}")
        return np.column_stack(columns) if columns else np.empty((0, 0))
    table = _numbers(what, values)
    if table.ndim not in (1, 2):
        raise MeasurementError(f"{what} must be a column or a table (n, m), not of shape {table.shape}")
    return table[:, None] if table.ndim == 1 else table


def _check_inputs(m: Measurement) -> None:
    """Refuse an input whose name no formula can hold, or that means a column already."""
    taken = {"t", "flag", *m.names, *m.quality, *(f"sigma_{name}" for name in m.names)}
    taken |= {f"rho_{a}{b}" for a, b in m.pairs}
    for name in m.inputs:
        if not name.isidentifier():
            raise MeasurementError(f"an input's name must be fit for a formula, like u_1, not {name!r}")
        if name in taken:
            raise MeasurementError(f"an input and a column are both called {name}")


def _unit_of(meta: Mapping[str, Any], name: str) -> str:
    units = meta.get("input_units")
    return str(units.get(name, "")) if isinstance(units, Mapping) else ""


def check(m: Measurement, where: Any) -> None:
    """Refuse what no fit could use; `where` names a row in the user's terms."""

    def first(bad: Any) -> int | None:
        return int(np.argmax(bad)) if np.any(bad) else None

    if (i := first(~np.isfinite(m.t))) is not None:
        raise MeasurementError(f"{where(i)}: the time is missing or infinite")
    step = np.diff(m.t)
    if (i := first(step <= 0)) is not None:
        what = "repeats the time" if step[i] == 0 else "goes back in time from"
        raise MeasurementError(f"{where(i + 1)} {what} {float(m.t[i])!r} s: times must increase")
    for k, name in enumerate(m.names):
        if (i := first(np.isinf(m.values[:, k]))) is not None:
            raise MeasurementError(f"{where(i)}: {name} is infinite")
        if m.sigma is not None:
            sigma = m.sigma[:, k]
            if (i := first(np.isinf(sigma) | (sigma <= 0))) is not None:
                raise MeasurementError(
                    f"{where(i)}: sigma_{name} is {sigma[i]!s}, it must be positive and finite"
                )
            if (i := first(m.seen & np.isfinite(m.values[:, k]) & np.isnan(sigma))) is not None:
                raise MeasurementError(f"{where(i)}: {name} has a value but sigma_{name} is missing")
    if m.rho is not None:
        if (i := first((np.abs(m.rho) >= 1).any(axis=1))) is not None:
            raise MeasurementError(f"{where(i)}: a correlation lies outside -1 ... 1")
        if (i := first(m.seen & np.isnan(m.rho).any(axis=1))) is not None:
            raise MeasurementError(f"{where(i)}: a correlation is missing")


def check_length(m: Measurement) -> None:
    """Refuse a record with fewer usable rows than a fit has unknowns."""
    count = int(m.seen.sum())
    if count == 0:
        raise MeasurementError(f"no usable row: {', '.join(m.names)} are empty, NaN or flagged throughout")
    if count < SHORTEST:
        raise MeasurementError(f"too short: {count} usable rows, at least {SHORTEST} are needed")
