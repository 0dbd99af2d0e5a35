"""JSON that every reader takes."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def as_json(data: Any) -> str:
    """JSON that every reader takes: what is not finite is null."""
    return json.dumps(_plain(data), allow_nan=False)


def _plain(value: Any) -> Any:
    import numpy as np  # a help that prints no data must not wait for it

    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    return value
