"""A table that a visitor drops: its columns to choose from, and the measurement that the choice makes."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from udd.errors import MeasurementError, UddError
from udd.measurement import InputSignal, Measurement, read_measurement
from udd.measurement.formats.headings import COUNTED, UNITS
from udd.measurement.formats.table import Table
from udd.measurement.guesses import ROLES, guessed, is_input
from udd.measurement.gyroscope import holds_rates_alone, read_gyroscope, starts_to_turn
from udd.measurement.read import tables_of

from .driven_models import DRIVE, TORQUE

_ROWS = 6  # that are shown
_COLUMNS = 40
_KNOWN = ("W", "R", "length")  # what a header may say
_INPUT = "input"  # the role of what drives the machine
_MOTIONS = ({"theta"}, {"Omega"}, {"Y", "Z", "beta"})


def look(path: Path) -> dict[str, Any]:
    """Return the columns of a table with its first rows, a guess of each, and what its header says."""
    tables = tables_of(path)
    table = max(tables, key=len)
    roles = guessed(table)
    if "t" in roles and {*roles} - {"", "t"} in _MOTIONS:
        free = [k for k, role in enumerate(roles) if not role and is_input(table, k)]
        for k in free[:1]:
            roles[k] = _INPUT
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the page shows the unit of each column
        kind = _kind(path)
        begin = starts_to_turn(read_gyroscope(path)) if kind == "gyroscope" else None
    if kind == "pendulum" and {"Y", "Z", "beta"} <= {*roles}:
        kind = ""  # read as a pendulum's bob, which x and y alone would be
    chosen = [k for k, heading in enumerate(table.headings) if heading.name not in ("", "_")][:_COLUMNS]
    return {
        "columns": [
            {
                "heading": table.headings[k].raw[:60],
                "unit": table.headings[k].unit or _usual_unit(table, k, roles[k]),
                "guess": roles[k],
                "cells": _cells(table, k),
            }
            for k in chosen
        ],
        "rows": len(table),
        "meta": {name: _number(table.meta.get(name)) for name in _KNOWN},
        "kind": kind,
        "begin": begin,
        "units": {role: list(UNITS[_base(role)]) for role in ROLES} | {_INPUT: ["", *UNITS["m/s"]]},
    }


def _usual_unit(table: Table, k: int, role: str) -> str:
    """Degrees for angles beyond a turn of a pendulum whose heading states no unit."""
    if role != "theta":
        return ""
    try:
        values = table.numbers(k)
    except UddError:
        return ""
    return "deg" if np.nanmax(np.abs(values), initial=0.0) > np.pi else ""


def _kind(path: Path) -> str:
    """Return what the table is read as by default: "disk", "pendulum", "gyroscope", or ""."""
    try:
        return read_measurement(path).kind
    except UddError:
        pass
    try:
        return "gyroscope" if holds_rates_alone(path) and len(read_gyroscope(path)) else ""
    except UddError:
        return ""


def _cells(table: Table, k: int) -> list[str]:
    """Return the first cells of a column, as numbers if possible, otherwise as text."""
    try:
        return [f"{value:.6g}" for value in table.numbers(k)[:_ROWS].tolist()]
    except UddError:
        pass
    try:
        return [str(cell)[:20] for cell in table.words(k)[:_ROWS]]
    except UddError:
        return ["..."] * min(_ROWS, len(table))


def _number(value: Any) -> float | None:
    try:
        made = float(value)
    except (TypeError, ValueError):
        return None
    return made if np.isfinite(made) else None


def _base(role: str) -> str:
    return COUNTED.get(role, "rad/s")


def measurement_of(path: Path, choices: Sequence[Any], constants: dict[str, Any]) -> Measurement:
    """Read a table with the columns that were chosen, ``[role, heading, unit]`` each; none: as it stands.

    Raises
    ------
    UddError
        The choice makes no motion of a disk or a pendulum, or the table cannot be read.
    """
    if not choices:
        try:
            return read_measurement(path, **constants)
        except UddError:
            if not holds_rates_alone(path):
                raise
            return read_gyroscope(path, **constants)
    columns: dict[str, str] = {}
    units: dict[str, str] = {}
    for choice in choices:
        if not isinstance(choice, list) or [type(part) for part in choice] != [str] * 3:
            raise UddError("the choice of columns cannot be read")
        role, heading, unit = choice
        if role not in (*ROLES, _INPUT):
            raise UddError(f"no column is a {role:.20}")
        if role in columns:
            raise UddError(f"two columns are chosen as {role}")
        columns[role], units[role] = heading, unit
    driver = columns.pop(_INPUT, None)
    if set(columns) - {"t"} not in _MOTIONS:
        raise UddError(
            "choose t with theta, t with Omega, or t with Y, Z and beta; an input may go with any of them"
        )
    name = TORQUE if {"theta", "Omega"} & set(columns) else DRIVE
    if driver and name == DRIVE and not units[_INPUT]:
        raise UddError("choose the unit of the input: with a disk it is the drive speed W")
    record = read_measurement(path, columns, inputs=driver and {name: driver}, **constants)
    stated = {h.raw: h.unit for table in tables_of(path) for h in table.headings}
    factors = {role: _factor(role, units[role], stated.get(columns[role], "")) for role in columns}
    values = record.values * [factors[column] for column in record.names]
    inputs = {}
    if driver:
        signal, times = record.inputs[name], factors.get("t", 1.0)
        factor = (
            UNITS["m/s"][units[_INPUT]] if name == DRIVE else 1.0
        )  # an input keeps the unit of its column
        inputs[name] = InputSignal(signal.t * times, signal.values * factor, signal.hold)
        if name == DRIVE:
            inputs["W_rate"] = inputs[name].rate()
    return replace(record, t=record.t * factors.get("t", 1.0), values=values, inputs=inputs)


def _factor(role: str, unit: str, stated: str) -> float:
    """Return the factor for values that were read with the unit of the heading."""
    factors = UNITS[_base(role)]
    if not unit or unit == stated:
        return 1.0
    if unit not in factors:
        raise MeasurementError(f"{unit} is no unit of {role}")
    return factors[unit] / factors.get(stated, 1.0)
