"""Tables of names and values that people write: the one door of sweeps, models, effects and configs."""

from __future__ import annotations

import inspect
import json
import re
import tomllib
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from udd.errors import ModelError, UddError

from .input_files import NESTED, MemoryLimit, read_regular

_LONGEST = 100  # characters of a name
_DEEPEST = 16  # lists and tables within each other
_NESTED_TOML = 1000  # bytes of memory that a byte of TOML may take
_KEY = r"""[ \t]*(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*"""
#: A name of more than these parts: ``a.b.c``.
_DOTTED = re.compile(rf"(?:^|[\[{{,]){_KEY}(?:\.{_KEY}){{{_DEEPEST},}}", re.MULTILINE)


def table(
    where: str,
    data: object,
    allowed: Collection[str] | None = None,
    needed: Collection[str] = (),
    *,
    error: type[UddError] = ModelError,
) -> dict[str, Any]:
    """Copy a table that must have each of the keys `needed`, and none but those `allowed`.

    Raises
    ------
    UddError
        Of the kind `error`, naming what is wrong, where, and which keys there are.
    """
    if not isinstance(data, Mapping):
        raise error(f"{where} must be a table of names and values, not {_shown(data)}")
    for key in data:
        if not isinstance(key, str) or len(key) > _LONGEST or (allowed is not None and key not in allowed):
            raise error(f"{where} has no {_shown(key)}; it has {', '.join(allowed or ['short names'])}")
    for key in needed:
        if key not in data:
            raise error(f"{where} does not say its {key}")
    if _deeper(data, _DEEPEST):
        raise error(f"{where} is nested more than {_DEEPEST} deep")
    return dict(data)


def arguments(where: str, data: object, of: Callable[..., Any]) -> dict[str, Any]:
    """Return a table of the arguments of a function."""
    taken = inspect.signature(of).parameters
    return table(where, data, taken, [name for name, one in taken.items() if one.default is one.empty])


def parsed(what: str, text: str, *, toml: bool = False, error: type[UddError] = ModelError) -> Any:
    """Parse a text in JSON or TOML.

    Raises
    ------
    UddError
        Of the kind `error`: it is not that, or brackets or dotted names are nested beyond all reason.
    """
    # tomllib keeps a copy of a dotted name for each of its dots.
    if toml and _DOTTED.search(text):
        raise error(f"{what} has names of more than {_DEEPEST} parts")
    try:
        return tomllib.loads(text) if toml else json.loads(text)
    except (ValueError, RecursionError) as reason:
        raise error(f"{what} is not {'TOML' if toml else 'JSON'}: {reason}") from None


def read(
    path: Path, *, toml: bool = False, error: type[UddError] = UddError, limit: float | None = None
) -> Any:
    """Parse a file in JSON or TOML.

    Parameters
    ----------
    path : Path
    toml : bool
        Read TOML, not JSON.
    error : type
        Kind of `UddError` to raise.
    limit : float
        Bytes of memory that it may take. A byte of JSON counts as 100, a byte of TOML as 1000.

    Raises
    ------
    UddError
        The errors of :func:`parsed`; the file cannot be read, is not regular, or takes more than `limit`.
    """
    name = str(path) if len(str(path)) < 200 else f"{str(path)[:100]}..."
    memory = MemoryLimit(limit, error)
    try:
        text = read_regular(path, memory).decode("utf-8")
        memory.take((_NESTED_TOML if toml else NESTED) * len(text))
    except OSError as reason:
        raise error(f"{name} cannot be read: {reason.strerror}") from None
    except UddError as reason:
        raise error(f"{name}: {reason}") from None
    except ValueError as reason:  # no UTF-8
        raise error(f"{name} is not text: {reason}") from None
    return parsed(name, text, toml=toml, error=error)


def _deeper(data: object, limit: int) -> bool:
    """Return True if lists and tables are nested more than `limit` deep."""
    if isinstance(data, Mapping | list | tuple):
        return not limit or any(
            _deeper(one, limit - 1) for one in (data.values() if isinstance(data, Mapping) else data)
        )
    return False


def _shown(value: object) -> str:
    try:
        return repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, lists without end
        return f"a {type(value).__name__} beyond all size"
