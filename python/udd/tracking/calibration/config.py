"""Options of the tracker from a TOML file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from udd._util.tables import read, table
from udd.tracking.options import FIELDS, TrackOptions, read_option
from udd.video.reader import TrackError

Config = str | os.PathLike[str] | Mapping[str, Any]


def settings(config: Config, **given: Any) -> dict[str, Any]:
    """Arguments of `udd.track`: those of a config, and those given (not None), which win.

    Parameters
    ----------
    config : path or mapping
        A TOML file or its entries: the fields of `TrackOptions` by name, each as `udd.track` takes it.
    **given
        The same by name; None is not given.

    Raises
    ------
    TrackError
        No such file, no TOML, a key that there is not, or a value of the wrong kind.

    Examples
    --------
    >>> settings({"disk_radius": 0.08, "pivot": [275, 310.5]}, disk_radius=0.075)
    {'disk_radius': 0.075, 'pivot': (275.0, 310.5)}
    """
    where, said = as_said(config)
    entries = {}
    for key, value in table(f"{where}: a config", said, FIELDS, error=TrackError).items():
        try:
            entries[key] = read_option(key, value)
        except TrackError as error:
            raise TrackError(f"{where}: {error}") from None
    return {**entries, **{key: value for key, value in given.items() if value is not None}}


def read_options(config: Config | TrackOptions | None, **given: Any) -> TrackOptions:
    """Read all options from a config and arguments; arguments (not None) take precedence."""
    if isinstance(config, TrackOptions):
        arguments = {name: value for name, value in given.items() if value is not None}
        return config.changed(arguments) if arguments else config
    return TrackOptions(**settings({} if config is None else config, **given))


def as_said(config: Config) -> tuple[str, Mapping[str, Any]]:
    """Return the name of a config and its entries, unread."""
    if isinstance(config, Mapping):
        return "config", config
    if not isinstance(config, str | os.PathLike):
        raise TrackError(f"config must be a file or a table of names and values, not {config!r}")
    return str(config), read(Path(config), toml=True, error=TrackError)
