"""Points that a person clicked in a frame of a film, and frames that a person leaves out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from numbers import Integral
from operator import index
from typing import Any

from udd._util.tables import table
from udd.video.reader import TrackError

Point = tuple[float, float]  # u, v [pixels, v down]
Stretch = tuple[int, int]  # first and last frame
MOST = 64  # points of a kind


@dataclass(frozen=True)
class Clicks:
    """Clicked points (u, v) in pixels; :func:`udd.track` explains each of them.

    Attributes
    ----------
    frame : int
        Number of the frame, counted from 0.
    pivot : (float, float), optional
        The contact of wheel and disk.
    marks, edge, points : tuple of (float, float)
        Middles of marks, points of the disk's edge, two points of known distance.
    distance : float, optional
        Distance of the two points [m].

    See Also
    --------
    udd.track : takes them.
    """

    frame: int = 0
    pivot: Point | None = None
    marks: tuple[Point, ...] = ()
    edge: tuple[Point, ...] = ()
    points: tuple[Point, ...] = ()
    distance: float | None = None


_NAMES = tuple(f.name for f in fields(Clicks))
_LISTS = ("marks", "edge", "points")


def read_clicks(said: Any) -> Clicks:
    """Read clicked points from a mapping or a text.

    Raises
    ------
    TrackError
        A name that there is not, a value that is no point, or two points without their distance.

    Examples
    --------
    >>> read_clicks("frame=12,pivot=275:310.5")
    Clicks(frame=12, pivot=(275.0, 310.5), marks=(), edge=(), points=(), distance=None)
    """
    if isinstance(said, Clicks):
        return said
    entries = dict(
        table("clicks", _of_text(said) if isinstance(said, str) else said, _NAMES, error=TrackError)
    )
    for name in _LISTS:
        entries[name] = tuple(_point(name, place) for place in _several(name, entries.get(name, ())))
    if entries.get("pivot") is not None:
        entries["pivot"] = _point("pivot", entries["pivot"])
    frame, distance = entries.get("frame", 0), entries.get("distance")
    if isinstance(frame, bool) or not isinstance(frame, int) or frame < 0:
        raise TrackError(f"clicks: frame must be the number of a frame, from 0 on, not {frame!r}")
    if distance is not None and not (_is_number(distance) and distance > 0):
        raise TrackError(f"clicks: distance must be a positive number of metres, not {distance!r}")
    if (len(entries["points"]) == 2) != (distance is not None) or len(entries["points"]) not in (0, 2):
        raise TrackError("clicks: points must be two, with their distance in metres")
    return Clicks(**entries)


def read_stretches(said: Any) -> tuple[Stretch, ...]:
    """Read frames to leave out: numbers, pairs (first, last), or a text like 3,10-20.

    Raises
    ------
    TrackError
        It is something else.

    Examples
    --------
    >>> read_stretches([3, (10, 20)]), read_stretches("3,10-20")
    (((3, 3), (10, 20)), ((3, 3), (10, 20)))
    """
    try:
        parts = [part.split("-") for part in said.split(",")] if isinstance(said, str) else list(said)
        out = tuple(_stretch(part) for part in parts)
    except (TypeError, ValueError):
        out = ((1, 0),)
    if any(not 0 <= first <= last for first, last in out):
        raise TrackError(
            "leave_out must be numbers of frames from 0 on or pairs [first, last], like 3 or 10-20, "
            f"not {said!r}"[:250]
        )
    return out


def _stretch(part: Any) -> Stretch:
    ends = [part] if isinstance(part, Integral) else list(part)
    if not 1 <= len(ends) <= 2:
        raise ValueError
    first, last = (int(end) if isinstance(end, str) else index(end) for end in (ends[0], ends[-1]))
    return first, last


def _of_text(said: str) -> Mapping[str, Any]:
    """Return the entries of a text such as ``frame=12,pivot=275:310,mark=200:100,mark=300:100``."""
    singular = {"mark": "marks", "point": "points", "edge": "edge"}
    entries: dict[str, Any] = {}
    for part in said.split(","):
        name, equals, value = (x.strip() for x in part.partition("="))
        try:
            values = [float(x) for x in value.split(":")]
            if not equals:
                raise ValueError
        except ValueError:
            raise TrackError(
                f"clicks must be like frame=12,pivot=275:310,mark=200:100, not {part!r}"[:250]
            ) from None
        if name in singular:
            entries.setdefault(singular[name], []).append(values)
        else:
            entries[name] = values if len(values) > 1 else values[0]
    if isinstance(frame := entries.get("frame"), float) and frame.is_integer():
        entries["frame"] = int(frame)
    return entries


def _several(name: str, places: Any) -> Sequence[Any]:
    if not isinstance(places, list | tuple) or len(places) > MOST:
        raise TrackError(f"clicks: {name} must be a list of at most {MOST} points, not {places!r}"[:250])
    return places


def _point(name: str, place: Any) -> Point:
    if not (isinstance(place, list | tuple) and len(place) == 2 and all(map(_is_number, place))):
        raise TrackError(f"clicks: {name} must have places u, v in pixels, not {place!r}"[:250])
    return float(place[0]), float(place[1])


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
