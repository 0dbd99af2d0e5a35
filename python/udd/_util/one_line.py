"""Results on one line: what a notebook shows of a cell's last value."""

from __future__ import annotations

from dataclasses import fields
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

_LONGEST = 300  # characters of a line
_PART = 48  # of one value in it
_FEW = 4  # entries of a list that are shown


class OneLine:
    """A dataclass whose repr is one line: arrays by their shape, long values cut."""

    def __repr__(self) -> str:
        shown = ", ".join(
            f"{field.name}={brief(getattr(self, field.name))}"
            for field in fields(self)  # type: ignore[arg-type]
            if field.repr
        )
        return cut(f"{type(self).__name__}({shown})", _LONGEST)


def brief(value: Any) -> str:
    """Return a value as a part of a line."""
    if isinstance(value, np.ndarray):
        return f"array{value.shape}"
    if isinstance(value, list | tuple) and len(value) > _FEW:
        return f"{type(value).__name__} of {len(value)}"
    if isinstance(value, dict) and len(value) > _FEW:
        return f"{{{', '.join(map(str, list(value)[:_FEW]))}, ...}}"
    text = repr(str(value)) if isinstance(value, Path) else repr(value)
    return cut(" ".join(text.split()), _PART)


def cut(text: str, longest: int) -> str:
    """Return a text, shortened to so many characters."""
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def link_to(path: Path, text: str) -> str:
    """Return HTML with a link to a file. Notebooks reach files in their folder by a relative path."""
    try:
        target = quote(path.resolve().relative_to(Path.cwd()).as_posix())
    except (OSError, ValueError):
        target = path.absolute().as_uri()
    return f'<a href="{escape(target)}" target="_blank">{escape(str(path))}</a>: {escape(text)}'
