"""Name and unit in the heading of a column."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

_ALIASES = {"T": "t", "angle": "theta", "Angle": "theta", "Theta": "theta", "θ": "theta", "β": "beta"}
_ALIASES |= {"Beta": "beta", "X": "x"}
_TIMES = {"time", "zeit", "tijd", "temps", "tiempo", "tempo"}
_TURN = 2 * math.pi
_ANGLES = {
    **dict.fromkeys(("rad", "radian", "radians"), 1.0),
    "mrad": 1e-3,
    # Grad is German for degrees; grad may be gradians, and is not known.
    **dict.fromkeys(("deg", "degree", "degrees", "°", "º", "Grad", "graden"), math.pi / 180),
    "arcmin": math.pi / 180 / 60,
    "arcsec": math.pi / 180 / 3600,
    **dict.fromkeys(("rev", "turn", "turns"), _TURN),
}
_LENGTHS = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), 1.0),
    **{"km": 1e3, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    **dict.fromkeys(("in", "inch", "inches"), 0.0254),
    "ft": 0.3048,
}
_DURATIONS = {
    **dict.fromkeys(
        ("s", "sec", "secs", "second", "seconds", "sek", "sekunden", "Sekunden", "seconden"), 1.0
    ),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
    **{"us": 1e-6, "µs": 1e-6, "ns": 1e-9},
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hour", "hours"), 3600.0),
}
#: Units that a column's heading may state, and what they are in s, m, rad and what these make.
UNITS: dict[str, dict[str, float]] = {
    "s": _DURATIONS,
    "m": _LENGTHS,
    "rad": _ANGLES,
    "m/s": {f"{unit}/s": size for unit, size in _LENGTHS.items()} | {"km/h": 1 / 3.6},
    "rad/s": {
        **{f"{unit}/s": size for unit, size in _ANGLES.items()},
        **dict.fromkeys(("rpm", "rev/min", "1/min"), _TURN / 60),
        **{"rps": _TURN, "dps": math.pi / 180},
    },
    "m/s^2": {f"{unit}/s{two}": size for unit, size in _LENGTHS.items() for two in ("^2", "²", "2")},
    "rad/s^2": {f"{unit}/s{two}": size for unit, size in _ANGLES.items() for two in ("^2", "²", "2")},
}
#: In what a disk's and a pendulum's columns are counted.
COUNTED: dict[str, str] = {"t": "s", "Y": "m", "Z": "m", "x": "m", "y": "m", "beta": "rad", "theta": "rad"}
#: Units to suggest for a quantity if a unit is not known.
USUAL: dict[str, str] = {"s": "s or ms", "m": "m, cm or mm", "rad": "deg or rad"}
#: Separators before a unit without brackets: ``t_ms``, ``t / s``, ``angle deg``, ``angle in deg``.
_BEFORE_UNIT = re.compile(r"(?:\s*[_/,]\s*|\s+in\s+|\s+)(?=[^_/,\s]+$)")
# None of these matches an opening bracket within another, so that a row of brackets is read once.
_IN_BRACKETS = re.compile(r"_?\{[^{}]*\}|\[[^][]*\]|\([^()]*\)")
_UNIT = re.compile(r"[\[(]([^][()]+)[])]")
#: Texts that look like an unknown unit, such as V or mV/K.
_SYMBOL = r"[\[(]?[^\W\d]{1,3}(?:[/*·][^\W\d]{1,3})?[\])]?"
#: Names that a unit may follow without brackets; others may be states of a user's own model.
_ENDING = ("t", "Y", "Z", "beta", "theta")


@dataclass(frozen=True)
class Heading:
    """A column's heading: as it stands, the name without unit and TeX, and the unit that it states.

    `plain` is the name without unit. `dates` says that the numbers are seconds that were counted from dates.
    """

    raw: str
    name: str
    unit: str = ""
    dates: bool = False
    plain: str = ""


def headings(cells: Sequence[str]) -> list[Heading]:
    """``t_{1}``, ``T [s]``, ``Time (ms)``, ``time ms`` and ``t_ms`` are all t, the last three in ms."""
    bare = [_IN_BRACKETS.sub("", cell).strip() for cell in cells]
    names = [_symbol(name) for name in bare]
    taken = set(names)
    result = []
    for cell, plain, name in zip(cells, bare, names, strict=True):
        stated = [said for one in _UNIT.findall(cell) if (said := one.strip())]
        unit = next((one for one in stated if in_base_units(one)), stated[-1] if stated else "")
        # As an ending a unit belongs to what a disk and a pendulum are known by, unless that is there too.
        base, unit_after = _parted(plain)
        symbol = _symbol(base)
        if symbol in _ENDING and symbol not in taken and size(symbol, unit_after):
            name, unit = symbol, unit_after
        result.append(Heading(cell.strip(), name, unit, plain=plain))
    return result


def stated_unit(cell: str) -> str:
    """Return the known unit of a cell, alone or in brackets; empty if not available."""
    texts = [cell.strip(), *(part.strip() for part in _UNIT.findall(cell))]
    return next((text for text in texts if in_base_units(text)), "")


def is_unit(cell: str) -> bool:
    """Return True if a cell is a known unit and nothing else, in brackets perhaps."""
    return in_base_units(cell.strip("[]() ")) is not None


def joined(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """Join names and the units in a row below them. Cells that are no units are ignored."""
    below = [*units, *[""] * len(names)]
    result = []
    for name, cell in zip(names, below, strict=False):
        unit = stated_unit(cell) or (cell.strip("[]() ") if re.fullmatch(_SYMBOL, cell) else "")
        result.append(f"{name} ({unit})" if name and unit else name)
    return result


def _parted(name: str) -> tuple[str, str]:
    """Split a heading without brackets into a name and a possible unit."""
    base, *rest = _BEFORE_UNIT.split(" ".join(name.split()), maxsplit=1)
    return base, "".join(rest)


def ending(name: str, heading: Heading) -> str:
    """Return the unit without brackets, as in ``Winkel deg``, of a column of times or angles."""
    unit = _parted(heading.raw)[1]
    return unit if COUNTED.get(name) in ("s", "rad") and size(name, unit) else ""


def _symbol(name: str) -> str:
    return "t" if name.casefold() in _TIMES else _ALIASES.get(name, name)


def size(name: str, unit: str) -> float | None:
    """Return the factor from a unit to the unit of a column; None for a unit of another quantity."""
    return _size(COUNTED.get(name.removeprefix("sigma_"), ""), unit)


def in_base_units(unit: str) -> tuple[float, str] | None:
    """Return the factor of a known unit and its base unit; None for an unknown unit."""
    return next(((one, base) for base in UNITS if (one := _size(base, unit)) is not None), None)


def _size(base: str, unit: str) -> float | None:
    factors = UNITS.get(base, {})
    unit = unit.replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    return factors.get(unit, factors.get(unit.lower()))
