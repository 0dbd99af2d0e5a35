"""Units of errors and other small quantities: mm, mrad, ms."""

from __future__ import annotations

_SMALL = {
    "m": ("mm", 1e3),
    "rad": ("mrad", 1e3),
    "s": ("ms", 1e3),
    "s/m": ("ms/m", 1e3),
    "spread": ("% of the spread", 1e2),
}


def small_unit(unit: str) -> tuple[str, float]:
    """Return the unit for small values, and the factor from `unit` to it."""
    return _SMALL.get(unit, (unit, 1.0))
