"""A config file for the tracker, written."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import Item

from udd._util.arguments import checked_arguments
from udd.tracking.options import FIELDS
from udd.video.reader import TrackError

from .config import settings

TABLES = ("calibrate", "sigma", "layout")  # TOML requires them after the rest


@checked_arguments(error=TrackError)
def write_config(path: str | os.PathLike[str], config: Mapping[str, Any], *, comment: str = "") -> None:
    """Write what is known of a film as a TOML file, for `udd.track(..., config=path)`.

    Parameters
    ----------
    path : path
        File to write; an existing one is replaced when the new one is complete.
    config : mapping
        Arguments of `udd.track` by name: ``pivot``, ``scale``, ``layout``, ..., each as it is given there.
    comment : str, optional
        Text at the head of the file.

    Raises
    ------
    TrackError
        A name that there is not, or a value of the wrong kind.
    UddError
        There is no such folder, or the file cannot be written.

    See Also
    --------
    udd.tracking.click : finds the options by clicks.
    udd.track : takes the file.

    Examples
    --------
    >>> import tempfile, pathlib, udd.tracking
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "disk.toml"
    >>> udd.tracking.write_config(path, {"pivot": [275, 310.5], "sigma": {"pivot": 3.0}})
    >>> print(path.read_text())
    pivot = [275, 310.5] # where the wheels hold the disk, pixels (u, v down)
    <BLANKLINE>
    [sigma] # standard errors of what is given (pixels, pixels per metre, m): the film improves it
    pivot = 3.0
    """
    from udd._util.atomic_files import write_whole

    settings(config)
    write_whole(Path(path), as_toml(config, comment).encode())


def as_toml(config: Mapping[str, Any], comment: str = "") -> str:
    """Return the text of the file."""
    document = tomlkit.document()
    for line in comment.splitlines():
        document.add(tomlkit.comment(_plain(line)))
    plain = {name: value for name, value in config.items() if name not in TABLES}
    if comment and plain:
        document.add(tomlkit.nl())
    for name, value in plain.items():
        document.add(name, _noted(tomlkit.item(_value(value)), name))
    for name in TABLES:
        table = config.get(name)
        if table is None:
            continue
        if document.as_string():
            document.add(tomlkit.nl())
        if isinstance(table, Mapping):
            document.add(name, _noted(tomlkit.item(_value(table)), name))
            continue
        if not isinstance(table, list | tuple) or not all(isinstance(mark, Mapping) for mark in table):
            raise TrackError(f"{name} must be a table, or a list of them, to be written")
        marks = tomlkit.aot()
        for mark in table:
            item = tomlkit.item(_value(mark))
            marks.append(item if len(marks) else _noted(item, name))
        document.add(name, marks)
    return document.as_string()


def _plain(text: str) -> str:
    """Replace characters outside of TOML and UTF-8, which a file's name may hold, by question marks."""
    return "".join(c if c.isprintable() else "?" for c in text)


def _noted(item: Item, name: str) -> Item:
    note = FIELDS[name].metadata["note"]
    return item.comment(note) if note else item


def _value(value: Any) -> Any:
    """Plain Python instead of NumPy's numbers and arrays, of tuples and the like."""
    if isinstance(value, bool | str | int):
        return value
    if isinstance(value, Mapping):
        return {key: _value(x) for key, x in value.items()}
    if hasattr(value, "__len__"):
        return [_value(x) for x in value]
    return float(value)
