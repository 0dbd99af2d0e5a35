"""A config file for the tracker, written."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from udd.tracking.options import FIELDS
from udd.video.reader import TrackError

from .config import settings

TABLES = ("calibrate", "sigma", "layout")  # TOML wants them after the rest


def write_config(path: str | os.PathLike[str], config: Mapping[str, Any], *, comment: str = "") -> None:
    """Write what is known of a film as a TOML file, for `udd.track(..., config=path)`.

    Parameters
    ----------
    path : path
        File to write; one that stands there is replaced, by all of the new one or not at all.
    config : mapping
        Arguments of `udd.track` by name: ``pivot``, ``scale``, ``layout``, ..., each as it is given there.
    comment : str, optional
        What to say at the head of the file.

    Raises
    ------
    TrackError
        A name that there is not, or a value of the wrong kind.
    UddError
        There is no such folder, or the file cannot be written.

    Examples
    --------
    >>> import tempfile, pathlib, udd.tracking
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "disk.toml"
    >>> udd.tracking.write_config(path, {"pivot": [275, 310.5], "sigma": {"pivot": 3.0}})
    >>> print(path.read_text())
    pivot = [275, 310.5]  # where the wheels hold the disk, pixels (u, v down)
    <BLANKLINE>
    [sigma]  # standard errors of what is given (pixels, pixels per metre, m): the film improves it
    pivot = 3.0
    """
    from udd._util.atomic_files import write_whole

    settings(config)
    write_whole(Path(path), as_toml(config, comment).encode())


def as_toml(config: Mapping[str, Any], comment: str = "") -> str:
    """The text of the file."""
    blocks = [[f"# {_plain(line)}".rstrip() for line in comment.splitlines()]]
    blocks.append([_line(name, config[name]) for name in config if name not in TABLES])
    for name in TABLES:
        table = config.get(name)
        if table is None:
            continue
        note = _note(name)
        if isinstance(table, Mapping):
            blocks.append([f"[{name}]{note}", *(f"{key} = {_value(value)}" for key, value in table.items())])
            continue
        if not isinstance(table, list | tuple) or not all(isinstance(mark, Mapping) for mark in table):
            raise TrackError(f"{name} must be a table, or a list of them, to be written")
        for mark in table:
            blocks.append([f"[[{name}]]{note}", *(f"{key} = {_value(x)}" for key, x in mark.items())])
            note = ""
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _plain(text: str) -> str:
    """What TOML and UTF-8 have no room for (a file's name may hold anything) as question marks."""
    return "".join(c if c.isprintable() else "?" for c in text)


def _line(name: str, value: Any) -> str:
    return f"{name} = {_value(value)}{_note(name)}"


def _note(name: str) -> str:
    note = FIELDS[name].metadata["note"]
    return f"  # {note}" if note else ""


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):
        return str(value)
    if hasattr(value, "__len__"):
        return f"[{', '.join(_value(x) for x in value)}]"
    return repr(float(value))
