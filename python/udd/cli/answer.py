"""What a command answers: text for a person, data for a machine."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Answer:
    """The result of a command; `code` is its exit code."""

    text: str
    data: Mapping[str, Any]
    code: int = 0


def as_json(data: Any) -> str:
    """JSON that every reader takes: what is not finite is null."""
    return json.dumps(_plain(data), allow_nan=False)


def _plain(value: Any) -> Any:
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


def watched() -> bool:
    """Whether somebody sees a progress bar."""
    return sys.stderr.isatty()


@contextmanager
def telling() -> Iterator[Callable[[str], None]]:
    """Show on one line what is being done and for how long; nothing where nobody watches."""
    from tqdm import tqdm

    with tqdm(bar_format="{desc} [{elapsed}]", disable=not watched(), leave=False) as bar:

        def tell(text: str) -> None:
            bar.set_description_str(text)
            bar.refresh()

        yield tell
