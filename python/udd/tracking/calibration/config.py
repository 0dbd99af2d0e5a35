"""What is known of a film, from a TOML file."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from udd._util.tables import read, table
from udd.markers.layout import read_bob, read_layout
from udd.markers.tags import is_tags, read_tags
from udd.tracking.options import FIELDS, TrackOptions, read_apart, read_calibrate, read_region, read_sigma
from udd.video.reader import TrackError

Config = str | os.PathLike[str] | Mapping[str, Any]


def settings(config: Config, **given: Any) -> dict[str, Any]:
    """Arguments of `udd.track`: those of a config, and those given (not None), which win.

    Parameters
    ----------
    config : path or mapping
        A TOML file, or what would stand in one: the fields of `TrackOptions` by name, each as `udd.track`
        takes it.
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
    found = {}
    for key, value in table(f"{where}: a config", said, _READERS, error=TrackError).items():
        try:
            found[key] = _READERS[key](value)
        except TrackError as error:
            raise TrackError(f"{where}: {error}") from None
        except (TypeError, ValueError, OverflowError):
            raise TrackError(
                f"{where}: {key} must be {FIELDS[key].metadata['kind']}, not {value!r}"
            ) from None
    return {**found, **{key: value for key, value in given.items() if value is not None}}


def read_options(config: Config | TrackOptions | None, **given: Any) -> TrackOptions:
    """All options, of a config and of arguments (not None), which win."""
    if isinstance(config, TrackOptions):
        more = {name: value for name, value in given.items() if value is not None}
        return config.changed(more) if more else config
    return TrackOptions(**settings({} if config is None else config, **given))


def as_said(config: Config) -> tuple[str, Mapping[str, Any]]:
    """The name of a config, and what stands in it, unread."""
    if isinstance(config, Mapping):
        return "config", config
    if not isinstance(config, str | os.PathLike):
        raise TrackError(f"config must be a file or a table of names and values, not {config!r}")
    return str(config), read(Path(config), toml=True, error=TrackError)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise TypeError
    return float(value)


def _positive(value: Any) -> float:
    if not _number(value) > 0:
        raise ValueError
    return float(value)


def _place(value: Any) -> tuple[float, float]:
    if not isinstance(value, list | tuple):
        raise TypeError
    u, v = value
    return _number(u), _number(v)


def _switch(value: Any) -> bool:
    if not isinstance(value, bool):
        raise TypeError
    return value


def _bob(value: Any) -> Any:
    read_bob(value)
    return value


def _layout(value: Any) -> Any:
    return read_tags(value) if is_tags(value) else read_layout(value)


_READERS: dict[str, Callable[[Any], Any]] = {
    "disk_radius": _positive,
    "mark_distance": _positive,
    "fps": _positive,
    "pivot": _place,
    "refine": _switch,
    "scale": _positive,
    "region": read_region,
    "layout": _layout,
    "calibrate": read_calibrate,
    "sigma": read_sigma,
    "apart": read_apart,
    "bob": _bob,
    "length": _positive,
}
