"""Items that the tracker can calibrate; options, table, command line and page read this list."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple


class Estimate(NamedTuple):
    """Value of an item, its standard error (0: given), and its source."""

    value: float | list[float]
    sigma: float
    how: str


@dataclass(frozen=True)
class Item:
    """An item of the self-calibration.

    Attributes
    ----------
    name : str
        Name of the item in `calibrate`.
    what : str
        Short description.
    rows : tuple of str
        Rows of the item in ``meta["calibration"]``. If empty, it is the row `name`.
    numbers : (float, float), optional
        Allowed range, if a number may be given. Otherwise the item is only switched on and off.
    unit : str
        Unit of that number.
    shown : (float, str)
        Factor and unit for display on the page.
    """

    name: str
    what: str
    rows: tuple[str, ...] = ()
    numbers: tuple[float, float] | None = None
    unit: str = ""
    shown: tuple[float, str] = (1.0, "")

    def has(self, row: str) -> bool:
        """Return True if a row of the table belongs to this item."""
        return row in (self.rows or (self.name,)) or (self.name == "layout" and row.startswith("mark "))


def _item(what: str, **more: Any) -> Any:
    return field(default=True, metadata={"what": what, **more})


@dataclass(frozen=True)
class Calibrate:
    """Switches of the self-calibration.

    True: estimate the item; False: it is absent, or given elsewhere; a number: its value.
    """

    layout: bool = _item("where the marks sit on the disk", shown=(1e3, "mm (right, up)"))
    scale: bool = _item("pixels per metre; off needs `scale`", shown=(1.0, "px/m"))
    lens: bool | float = _item("relative displacement at the picture's corner", numbers=(-0.3, 0.3))
    tilt: bool = _item(
        "camera's angle to the disk's plane", rows=("tilt across", "tilt upward", "aspect", "shear")
    )
    readout: bool | float = _item(
        "time of a rolling shutter from the first row to the last",
        numbers=(-0.1, 0.1),
        unit="s",
        shown=(1e3, "ms"),
    )
    exposure: bool | float = _item(
        "time during which the shutter is open", numbers=(0.0, 0.1), unit="s", shown=(1e3, "ms")
    )
    pivot: bool = _item("where the wheels hold the disk; off needs `pivot`", shown=(1.0, "px (right, down)"))

    def given(self, name: str) -> float | None:
        """Return the given value of an item, or None if it is to be estimated."""
        value = getattr(self, name)
        return None if value is True else float(value)

    def estimate(self, name: str, value: float, sigma: float, how: str) -> Estimate:
        """Return the estimate of an item with its source, which is `how` unless the value was given."""
        return Estimate(value, sigma, how if self.given(name) is None else "given")


SWITCHES = tuple(Item(f.name, **f.metadata) for f in fields(Calibrate))
ITEMS = (
    *SWITCHES,
    Item("W", "the drive's velocity as the film shows it", shown=(1.0, "m/s")),
    Item("wobble", "amplitude of a turning out of the plane", shown=(180 / math.pi, "degrees")),
)


def table(estimates: Mapping[str, Estimate]) -> dict[str, list[Any]]:
    """Return rows [value, standard error, source] in the order of `ITEMS`; None if a number is not finite."""
    rows = {name: e for item in ITEMS for name, e in estimates.items() if item.has(name)}
    return {name: [_plain(e.value), _plain(e.sigma), e.how] for name, e in rows.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(v) for v in value]
    return float(value) if math.isfinite(value) else None


def unit_of(row: str) -> tuple[float, str]:
    """Return the factor and the unit for display of a row on the page."""
    return next((item.shown for item in ITEMS if item.has(row)), (1.0, ""))
