"""Guesses of the meaning of columns, from headings in English, German and Dutch."""

from __future__ import annotations

import unicodedata

import numpy as np

from .formats import Table
from .formats.headings import UNITS, Heading

#: Quantities of a disk's or a pendulum's column.
ROLES = ("t", "theta", "Omega", "Y", "Z", "beta")
#: Words of headings; the first role with a word in a heading has it, so longer words come first.
_WORDS: dict[str, tuple[str, ...]] = {
    "t": ("time", "zeit", "tijd", "sekunden", "seconds", "seconden"),
    "Omega": ("angular velocity", "angular speed", "winkelgeschwindigkeit", "hoeksnelheid", "gyro", "omega"),
    "beta": ("orientation", "orientierung", "ausrichtung", "orientatie", "drehwinkel", "draaihoek", "beta"),
    "theta": ("angle", "winkel", "hoek", "auslenkung", "uitwijking", "theta"),
    "Z": ("height", "vertical", "hohe", "hoehe", "vertikal", "hoogte", "verticaal"),
    "Y": ("horizontal", "waagerecht", "horizontaal", "sideways"),
}
#: Words of headings of what drives a machine.
_DRIVERS = (
    *("torque", "voltage", "current", "force", "input", "drive", "motor"),
    *("drehmoment", "spannung", "strom", "kraft", "antrieb", "eingang"),
    *("koppel", "spanning", "stroom", "kracht", "aandrijving", "ingang"),
)
_LETTERS = {"t": "t", "y": "Y", "z": "Z"}


def guessed(table: Table) -> list[str]:
    """Return the role of each column of a table, or an empty text; each role occurs once."""
    roles = [_role(heading) for heading in table.headings]
    rates = [k for k, role in enumerate(roles) if role == "Omega"]
    if len(rates) > 1:
        best = max(rates, key=lambda k: _liveliness(table, k))
        roles = [role if role != "Omega" or k == best else "" for k, role in enumerate(roles)]
    letters = [_letter(heading) for heading in table.headings]
    if "beta" in roles and "Z" not in roles and {"x", "y"} <= set(letters):
        # A camera's axes, with an orientation: of a disk.
        roles = [{"x": "Y", "y": "Z"}.get(letter, role) for letter, role in zip(letters, roles, strict=True)]
    taken: set[str] = set()
    for k, role in enumerate(roles):
        roles[k] = "" if role in taken else role
        taken.add(role)
    if not taken & {*ROLES[1:]}:  # an angle by its unit alone
        angles = [k for k, heading in enumerate(table.headings) if heading.unit in UNITS["rad"]]
        for k in angles[:1]:
            roles[k] = "theta"
    if "theta" in taken or not taken & {"Y", "Z", "beta"}:
        # A pendulum's table: what else has an axis' letter is passed over.
        roles = ["" if role in ("Y", "Z", "beta") else role for role in roles]
    return ["" if role == "Omega" and taken & {"theta", "Y", "Z"} else role for role in roles]


def is_input(table: Table, k: int) -> bool:
    """Return True if a column varies and its heading names what drives a machine, such as a torque."""
    words = _words(table.headings[k])
    if not any(word in words for word in _DRIVERS):
        return False
    try:
        return float(np.ptp(table.numbers(k))) > 0.0
    except ValueError:
        return False


def _words(heading: Heading) -> str:
    """Return a heading in lower case and without accents."""
    plain = unicodedata.normalize("NFKD", heading.raw.casefold())
    return "".join(letter for letter in plain if not unicodedata.combining(letter))


def _role(heading: Heading) -> str:
    if heading.name in ROLES:
        return heading.name
    if heading.unit in UNITS["rad/s"]:
        return "Omega"
    words = _words(heading)
    for role, role_words in _WORDS.items():
        if any(word in words for word in role_words):
            return role
    return _LETTERS.get(_letter(heading), "")


def _letter(heading: Heading) -> str:
    """Return a heading without its unit, in lower case."""
    return (heading.plain or heading.name).casefold().strip()


def _liveliness(table: Table, k: int) -> float:
    """Measure the variation of a rate of rotation; 0 if it has one sign, as a magnitude does."""
    try:
        values = table.numbers(k)
    except ValueError:
        return 0.0
    there = values[np.isfinite(values)]
    return float(np.std(there)) if there.size and there.min() < 0.0 < there.max() else 0.0
