"""The projects of the video analysis program Tracker (.trk): XML with the marks in pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from udd._util.input_files import MemoryLimit
from udd.errors import MeasurementError

from .headings import headings
from .table import Table

_PACKAGES = "org.opensourcephysics."


_ELEMENT = 200  # bytes that one takes


def read(raw: bytes, given: list[str] | None, memory: MemoryLimit) -> list[Table]:
    """Read the point masses of a project in its own coordinates, as Tracker's tables show them.

    The time of a frame counts from the clip's first one. A single point has columns ``x`` and ``y``, several
    have ``mass A x`` and so on; a frame in which a point was not marked is NaN.
    """
    try:
        root = _tree(raw, memory)
    except MeasurementError:
        raise
    except (expat.ExpatError, ValueError, LookupError) as error:  # an unknown encoding
        raise MeasurementError(f"the Tracker project is not whole ({error})") from None
    if not root.get("class", "").startswith(f"{_PACKAGES}cabrillo.tracker.TrackerPanel"):
        raise MeasurementError("this XML file is not a project of Tracker (a single tab, .trk)")
    clip, clock = _first(root, "VideoClip"), _first(root, "ClipControl")
    coordinates = _coordinates(_first(root, "ImageCoordSystem"))
    start, step = round(_number(clip, "startframe", 0.0)), max(1, round(_number(clip, "stepsize", 1.0)))
    count = _number(clip, "stepcount", math.inf)
    duration = _number(clock, "delta_t", math.nan)
    if not duration > 0:
        raise MeasurementError("the Tracker project does not say how long a frame takes (delta_t)")
    points: dict[str, dict[int, tuple[float, float]]] = {}
    for track in root.iter("object"):
        if track.get("class") == f"{_PACKAGES}cabrillo.tracker.PointMass":
            marks = {
                n: _world(coordinates, n, _number(mark, "x", math.nan), _number(mark, "y", math.nan))
                for n, mark in _frames(track)
                if n >= start and (n - start) % step == 0 and (n - start) // step < count
            }
            if marks:
                points[_text(track, "name") or f"point {len(points) + 1}"] = marks
    if not points:
        raise MeasurementError("the Tracker project holds no marked point")
    frames = sorted(set().union(*points.values()))
    names = ["t"]
    columns: list[Any] = [
        np.array([_number(clip, "starttime", 0.0) + (n - start) * duration for n in frames]) / 1e3
    ]
    for name, marks in points.items():
        names += ["x", "y"] if len(points) == 1 else [f"{name} x", f"{name} y"]
        seen = np.array([marks.get(n, (math.nan, math.nan)) for n in frames])
        columns += [seen[:, 0].copy(), seen[:, 1].copy()]
    return [
        Table(
            headings(given if given is not None and len(given) == len(names) else names),
            columns,
            memory=memory,
        )
    ]


def _tree(raw: bytes, memory: MemoryLimit) -> ElementTree.Element:
    """Return the root of an XML file; refuse definitions, which may expand endlessly."""
    tree, parser = ElementTree.TreeBuilder(), expat.ParserCreate()

    def begin(name: str, attributes: dict[str, str]) -> None:
        memory.take(_ELEMENT + _ELEMENT * len(attributes))
        tree.start(name, attributes)

    def definition(*_: object) -> None:
        raise MeasurementError("the Tracker project holds XML entities, which are not read")

    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler = begin, tree.end
    parser.CharacterDataHandler = tree.data
    parser.EntityDeclHandler = definition
    parser.Parse(raw, True)
    return tree.close()


def _first(root: ElementTree.Element, name: str) -> ElementTree.Element:
    for one in root.iter("object"):
        if one.get("class", "").split(".")[-1] in (name, f"Stepper{name}"):
            return one
    raise MeasurementError(f"the Tracker project is not whole (no {name})")


def _text(owner: ElementTree.Element, name: str) -> str:
    return next((p.text or "" for p in owner.findall("property") if p.get("name") == name), "").strip()


def _number(owner: ElementTree.Element, name: str, default: float) -> float:
    text = _text(owner, name)
    try:
        value = float(text) if text else default
    except ValueError:
        value = math.nan
    if text and not math.isfinite(value):
        raise MeasurementError(f"the Tracker project says {text[:80]!r} where a number for {name} should be")
    return value


def _frames(owner: ElementTree.Element) -> Iterator[tuple[int, ElementTree.Element]]:
    """Yield the numbers of frames and the elements that are set there."""
    for data in owner.findall("property"):
        if data.get("name") == "framedata":
            for one in data.findall("property"):
                number, content = one.get("name", "").strip("[]"), one.find("object")
                if content is not None and number.isascii() and number.isdigit() and len(number) < 10:
                    yield int(number), content


def _coordinates(system: ElementTree.Element) -> list[tuple[int, list[float]]]:
    """Origin [px], angle [rad, counterclockwise], scales [px per unit], by the frames where they were set."""
    systems = []
    for n, element in _frames(system):
        origin = [_number(element, name, math.nan) for name in ("xorigin", "yorigin")]
        scales = [_number(element, name, math.nan) for name in ("xscale", "yscale")]
        if not all(scales) or not np.isfinite([*origin, *scales]).all():
            raise MeasurementError("the Tracker project has coordinates without an origin or a scale")
        systems.append((n, [*origin, math.radians(_number(element, "angle", 0.0)), *scales]))
    if not systems:
        raise MeasurementError("the Tracker project has no coordinates")
    return sorted(systems)


def _world(coordinates: list[tuple[int, list[float]]], n: int, x: float, y: float) -> tuple[float, float]:
    """Convert a pixel to the axes of the project; in a picture y points down."""
    holding = [values for first, values in coordinates if first <= n] or [coordinates[0][1]]
    x0, y0, angle, x_scale, y_scale = holding[-1]
    right, up = (x - x0) / x_scale, (y0 - y) / y_scale
    return (
        right * math.cos(angle) + up * math.sin(angle),
        up * math.cos(angle) - right * math.sin(angle),
    )
