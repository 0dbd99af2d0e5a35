"""Numbers that people write on the command line or in an address."""

from __future__ import annotations

import re

_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?|[+-]?\d+,")


def number_in(text: str) -> float:
    """Return the number that a text holds.

    Parameters
    ----------
    text : str
        A number with a decimal point, as commas separate numbers.

    Raises
    ------
    ValueError
        The text is not a number. The message names the decimal point if the text has a decimal comma.

    Examples
    --------
    >>> number_in("4.2e-2")
    0.042
    >>> number_in("0,042")
    Traceback (most recent call last):
        ...
    ValueError: the decimal sign is a point: 0.042, not 0,042
    """
    plain = text.strip()
    if plain.isascii() and "_" not in plain:
        try:
            return float(plain)
        except ValueError:
            pass
    raise ValueError(decimal_hint(plain) or f"a number is needed, not {plain[:60]!r}")


def decimal_hint(text: str) -> str:
    """Return what to write instead of a decimal comma; nothing if the text has none."""
    plain = text.strip()
    if not _COMMA.fullmatch(plain):
        return ""
    return f"the decimal sign is a point: {plain.replace(',', '.')}, not {plain}"
