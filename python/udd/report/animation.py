"""The page's moving picture: the measured motion next to free runs of the models."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd._util.data_uri import data_uri
from udd.errors import UddError
from udd.plot.frame_overlay import MARKS
from udd.plot.style import AFTER, BEFORE, MEASURED

from . import runs
from .document import Movie

if TYPE_CHECKING:
    from udd.discovery.results import Discovery
    from udd.measurement import Measurement
    from udd.models import Model

Array = NDArray[np.float64]

_SLOWER = 2  # times slower than it was, as the page says
_PANEL = 300  # pixels, or user units
_REACH = 2.05  # radii from the contact to the edge of a panel
_MARK_PLACE, _MARK_SIDE = 65 / 80, 16 / 80  # of the radius: the LEGO disk's


@dataclass(frozen=True)
class Panel:
    """One motion: its title, its colour, and what is seen of it in every frame, (n, m)."""

    title: str
    colour: str
    seen: Array


def side_by_side(discovery: Discovery, film: str | os.PathLike[str] | None) -> Movie:
    """Measured and modelled motion from the first held-out frame on: the film itself where there is one."""
    fit = discovery.fit
    times, measured, modelled = runs.side_by_side(discovery, fit.model.profile.shown.movie)
    panels = [
        Panel("measured", MEASURED, _with_gaps_filled(measured)),
        Panel("the known model", BEFORE, modelled[0]),
    ]
    if len(modelled) > 1:
        panels.append(Panel("with the added effect", AFTER, modelled[1]))
    if fit.model.profile.shown.contact:
        panels = [Panel(p.title, p.colour, _within(p.seen, fit.model.parameters["R"])) for p in panels]
    start, seconds = float(times[0]), float(times[-1] - times[0])
    if film is None:
        uri = data_uri("image/svg+xml", _svg(panels, fit.model, seconds * _SLOWER).encode())
    else:
        uri = data_uri("video/mp4", _mp4(panels, times, discovery.measurement, Path(film)))
    titles = tuple(p.title for p in panels)
    alt = f"A moving picture, over and over: {', '.join(titles)}, side by side"
    return Movie(uri, alt, _PANEL * len(panels), titles, start, seconds, film is not None)


def _with_gaps_filled(seen: Array) -> Array:
    """Frames that did not show it show what the one before showed."""
    result = seen.copy()
    there = np.isfinite(seen).all(axis=1)
    last = np.maximum.accumulate(np.where(there, np.arange(len(seen)), 0))
    return result[np.maximum(last, int(np.argmax(there)))]


def _within(seen: Array, radius: float) -> Array:
    """Cut the motion where the disk loses contact, so that it stays there."""
    gone = ~(np.hypot(seen[:, 0], seen[:, 1]) < 1.05 * radius)
    return seen[: int(np.argmax(gone))] if gone.any() and not gone[0] else seen


# --- a drawing that moves


def _svg(panels: list[Panel], model: Model, seconds: float) -> str:
    """Panels side by side, moved by the file itself: no script, and some tens of kilobytes."""
    size, n = _PANEL, len(panels)
    frames = max(len(p.seen) for p in panels)
    draw = _DRAWINGS[model.kind]
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {n * size} {size + 8}" '
        f'width="{n * size}" height="{size + 8}">'
    ]
    for k, panel in enumerate(panels):
        parts.append(
            f'<svg x="{k * size + 4}" y="0" width="{size - 8}" height="{size}" '
            f'viewBox="{-size / 2 + 4} {-size / 2} {size - 8} {size}">'
            f'<rect x="{-size / 2}" y="{-size / 2}" width="{size}" height="{size}" fill="#f6f6f4"/>'
            f"{draw(panel, model, seconds, frames)}</svg>"
        )
    parts.append(
        f'<rect x="4" y="{size + 4}" height="3" width="0" fill="#8a8a8a">'
        f'<animate attributeName="width" from="0" to="{n * size - 8}" dur="{seconds:g}s" '
        'repeatCount="indefinite"/></rect></svg>'
    )
    return "".join(parts)


def _animated(kind: str, values: list[str], seconds: float) -> str:
    return (
        f'<animateTransform attributeName="transform" type="{kind}" dur="{seconds:g}s" '
        f'repeatCount="indefinite" values="{";".join(values)}"/>'
    )


def _disk(panel: Panel, model: Model, seconds: float, frames: int) -> str:
    unit = _PANEL / 2 / _REACH  # of the radius
    seen = _padded(panel.seen, frames)
    radius = model.parameters["R"]
    x, y = unit * seen[:, 0] / radius, -unit * seen[:, 1] / radius
    moves = [f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True)]
    turns = [f"{math.degrees(beta):.1f}" for beta in seen[:, 2]]
    path = " ".join(moves)
    side, place = _MARK_SIDE * unit, _MARK_PLACE * unit
    marks = "".join(
        f'<rect x="{-side / 2:.1f}" y="{-place - side / 2:.1f}" width="{side:.1f}" height="{side:.1f}" '
        f'fill="{colour}" transform="rotate({90 * quarter})"/>'
        for quarter, colour in enumerate(MARKS)
    )
    return (
        f"<g>{_animated('translate', moves, seconds)}<g>{_animated('rotate', turns, seconds)}"
        f'<circle r="{unit:.1f}" fill="#fff" stroke="#777" stroke-width="1.5"/>{marks}</g>'
        f'<circle r="3" fill="{panel.colour}"/></g>'
        f'<polyline points="{path}" fill="none" stroke="{panel.colour}" stroke-width="1.2" opacity="0.45"/>'
        '<path d="M-6 0H6M0 -6V6" stroke="#000" stroke-width="1.6"/>'
    )


def _pendulum(panel: Panel, model: Model, seconds: float, frames: int) -> str:
    theta = _padded(panel.seen, frames)[:, 0]
    most = float(np.abs(theta).max())
    # One that never rises hangs from the top of its panel, as long as its swings leave room for.
    top, length = (-0.36, min(0.7, 0.44 / max(math.sin(most), 0.1))) if most < 1.0 else (0.0, 0.4)
    length *= _PANEL
    turns = [f"{-math.degrees(angle):.2f}" for angle in theta]
    return (
        f'<g transform="translate(0 {top * _PANEL:g})"><path d="M0 0V{length:g}" stroke="#ccc"/>'
        f"<g>{_animated('rotate', turns, seconds)}"
        f'<path d="M0 0V{length:g}" stroke="#555" stroke-width="2"/>'
        f'<circle cy="{length:g}" r="12" fill="{panel.colour}"/></g><circle r="3" fill="#000"/></g>'
    )


#: How the motion of a kind of model is drawn.
_DRAWINGS = {"disk": _disk, "pendulum": _pendulum}


def _padded(seen: Array, frames: int) -> Array:
    """Repeat the last row up to so many frames."""
    return seen[np.minimum(np.arange(frames), len(seen) - 1)]


# --- a film


def _mp4(panels: list[Panel], t: Array, measurement: Measurement, film: Path) -> bytes:
    """Make the film's frames next to drawn disks, at the scale of the film."""
    from udd.video.writer import require_video, write_film

    require_video()
    if "px_per_m" not in measurement.meta:
        raise UddError(
            f"the measurement was not tracked in a film, so {film} cannot be shown next to a model"
        )
    rate = Fraction((len(t) - 1) / float(t[-1] - t[0]) / _SLOWER).limit_denominator(1000)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "movie.mp4"
        frames = _composed(panels, t, measurement, film)
        write_film(target, frames, (_PANEL * len(panels), _PANEL), rate, 27.0)
        return target.read_bytes()


def _composed(
    panels: list[Panel], t: Array, measurement: Measurement, film: Path
) -> Iterator[NDArray[np.uint8]]:
    import cv2

    from udd.tracking import pictures_between, pixels

    geometry = pixels(measurement)
    (u, v), reach = geometry.pivot, _REACH * geometry.radius
    corner = np.array([[_PANEL / 2 / reach, 0.0, 0.0], [0.0, _PANEL / 2 / reach, 0.0]])
    corner[:, 2] = _PANEL / 2 - 0.5 - corner[:, :2] @ [u, v]
    drawn = [np.stack(list(_drawn(p, float(measurement.meta["R"]), len(t)))) for p in panels[1:]]
    for k, picture in enumerate(pictures_between(film, t, measurement)):
        cropped = cv2.warpAffine(
            picture, corner, (_PANEL, _PANEL), flags=cv2.INTER_AREA, borderValue=(246,) * 3
        )
        yield np.hstack([cropped, *(each[k] for each in drawn)])


def _drawn(panel: Panel, radius: float, frames: int) -> Iterator[NDArray[np.uint8]]:
    """Draw a disk, frame by frame."""
    import cv2

    unit, fine = _PANEL / 2 / _REACH, 16  # OpenCV takes fractions of a pixel as whole numbers
    seen = _padded(panel.seen, frames)
    middle = _PANEL / 2 - 0.5
    at = np.column_stack([middle + unit * seen[:, 0] / radius, middle - unit * seen[:, 1] / radius])

    def whole(points: Array) -> NDArray[np.int32]:
        return np.round(np.clip(points, -4 * _PANEL, 4 * _PANEL) * fine).astype(np.int32)

    side, place = _MARK_SIDE * unit / 2, _MARK_PLACE * unit
    square = np.array(
        [(-side, -place - side), (side, -place - side), (side, -place + side), (-side, side - place)]
    )
    path = [whole(at)]
    for centre, beta in zip(at, seen[:, 2], strict=True):
        picture = np.full((_PANEL, _PANEL, 3), 246, dtype=np.uint8)
        middle_of = tuple(int(c) for c in whole(centre))
        cv2.circle(picture, middle_of, round(unit * fine), (255, 255, 255), -1, lineType=cv2.LINE_AA, shift=4)
        cv2.circle(picture, middle_of, round(unit * fine), (119, 119, 119), 1, lineType=cv2.LINE_AA, shift=4)
        for quarter, colour in enumerate(MARKS):
            c, s = math.cos(beta + quarter * math.pi / 2), math.sin(beta + quarter * math.pi / 2)
            turned = centre + square @ np.array([[c, s], [-s, c]])
            cv2.fillPoly(picture, [whole(turned)], _rgb(colour), lineType=cv2.LINE_AA, shift=4)
        cv2.polylines(picture, path, False, _rgb(panel.colour), 1, lineType=cv2.LINE_AA, shift=4)
        cv2.circle(picture, middle_of, 3 * fine, _rgb(panel.colour), -1, lineType=cv2.LINE_AA, shift=4)
        cv2.drawMarker(picture, (_PANEL // 2, _PANEL // 2), (0, 0, 0), cv2.MARKER_CROSS, 12, 1)
        yield picture


def _rgb(colour: str) -> tuple[int, int, int]:
    value = int(colour[1:], 16)
    return value >> 16, value >> 8 & 255, value & 255
