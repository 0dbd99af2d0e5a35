"""Binary messages to the page: a header of eight 32-bit numbers, then float64, all little-endian.

The header: what it is, the generation that it belongs to, and six numbers whose meaning depends on that.
A generation is the page's own count of what it asked for; an answer to an older one is thrown away there.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from .maps import Array, Diagram, Exponents

PIECE, SECTION, DIAGRAM, EXPONENTS, FRAME = 1, 2, 3, 4, 5


def _pack(kind: int, generation: int, numbers: tuple[int, ...], *tables: Array) -> bytes:
    head = struct.pack("<8I", kind, generation, *numbers, *([0] * (6 - len(numbers))))
    return head + b"".join(np.ascontiguousarray(t, dtype="<f8").tobytes() for t in tables)


def piece(generation: int, run: int, first: int, rows: Array, last: bool) -> bytes:
    """States of a run: which run, the first one's number, rows, columns, whether the run ends with them."""
    return _pack(PIECE, generation, (run, first, *rows.shape, int(last)), rows)


def section(generation: int, points: Array) -> bytes:
    """Crossings: rows, columns."""
    return _pack(SECTION, generation, points.shape, points)


def diagram(generation: int, result: Diagram) -> bytes:
    """Starts, values, points, components; then the values, labels, periods and points."""
    return _pack(DIAGRAM, generation, result.points.shape, *vars(result).values())


def exponents(generation: int, result: Exponents) -> bytes:
    """Encode exponents: their number, the drives, the exponents, their errors."""
    return _pack(EXPONENTS, generation, result.values.shape, *vars(result).values())


def frame(said: dict[str, Any], picture: bytes) -> bytes:
    """Encode a picture of a film: the length of the JSON text that follows, then the JPEG."""
    text = json.dumps(said, allow_nan=False).encode()
    return struct.pack("<8I", FRAME, 0, len(text), 0, 0, 0, 0, 0) + text + picture
