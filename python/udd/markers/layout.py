"""Places and colours of the marks on the disk: the standard four, or any two or more by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.video.reader import TrackError

BODY = np.array([-1j, 1, 1j, -1])  # directions of the marks in the body frame; picture points are u + iv
NAMED = {
    "red": (200, 38, 44),
    "orange": (240, 134, 36),
    "yellow": (238, 214, 40),
    "green": (34, 138, 62),
    "cyan": (30, 170, 190),
    "blue": (30, 78, 186),
    "purple": (112, 48, 160),
    "magenta": (200, 40, 150),
}
#: Colours of bobs only: brightness must help to distinguish them.
PALE = {
    "black": (24, 24, 26),
    "grey": (128, 128, 128),
    "white": (235, 235, 230),
    "wood": (150, 105, 65),
    "brass": (181, 148, 72),
}
PALEST = 12.0  # of 127: chroma of a mark below which it is grey
SAME = 0.985  # cosine between two colours' directions above which they are one
SLACK = 0.12  # of the arm by which a mark may miss its place
MIDDLE = 0.2  # of the marks' reach: nearer to the centre a mark has no direction worth telling


@dataclass(frozen=True)
class Layout:
    """Coloured marks on a disk.

    Attributes
    ----------
    places : tuple of complex
        Centres of the marks at beta = 0 [m from the disk's centre, u to the right, v down]. The standard
        layout has directions only.
    colours : tuple of (int, int, int)
        sRGB codes.
    standard : bool
        True for the four marks of the paper's disk.
    """

    places: tuple[complex, ...]
    colours: tuple[tuple[int, int, int], ...]
    standard: bool = False

    @cached_property
    def reach(self) -> float:
        """Distance of the outermost mark [m]."""
        return float(np.abs(self.places).max())

    @cached_property
    def unit(self) -> NDArray[np.complex128]:
        """The places in units of `reach`."""
        return np.array(self.places, dtype=np.complex128) / self.reach

    @cached_property
    def first(self) -> int:
        """Number of the first mark that is far enough from the centre to have a direction."""
        return int(np.argmax(np.abs(self.unit) > MIDDLE))

    @cached_property
    def chroma(self) -> NDArray[np.float64]:
        """Colour differences (U, V) of each mark, (n, 2), of 127 (BT.601)."""
        red, green, blue = np.array(self.colours, dtype=float).T / 255
        light = 0.299 * red + 0.587 * green + 0.114 * blue
        return np.column_stack([0.564 * (blue - light), 0.713 * (red - light)]) * 224


STANDARD = Layout(
    tuple(complex(d) for d in BODY), tuple(NAMED[c] for c in ("red", "orange", "blue", "green")), True
)


def read_layout(said: Any) -> Layout:
    """Read a layout from marks as ``{"at": [y, z], "colour": "red"}`` (m at beta = 0; or an sRGB triple).

    Raises
    ------
    TrackError
        Fewer than two marks, two in one place, no colour, or a layout that looks the same turned.
    """
    if isinstance(said, Layout):
        return said
    if isinstance(said, str | Mapping) or not isinstance(said, Sequence) or len(said) < 2:
        raise TrackError("layout must be a list of two marks or more, each with at = [y, z] and colour")
    places, colours = [], []
    for number, mark in enumerate(said, start=1):
        if not isinstance(mark, Mapping) or set(mark) != {"at", "colour"}:
            raise TrackError(f"layout: mark {number} must say at = [y, z] and colour, and nothing else")
        places.append(read_place(mark["at"], number))
        colours.append(_colour(mark["colour"], f"layout: colour of mark {number}"))
    layout = Layout(tuple(places), tuple(colours))
    _check(layout)
    return layout


def read_place(at: Any, number: int) -> complex:
    """Read a place [m], u to the right and v down, from [y, z]."""
    try:
        y, z = (float(x) for x in at)
        place = complex(y, -z)
    except (TypeError, ValueError):
        place = complex(np.nan, np.nan)
    if not np.isfinite(place):
        raise TrackError(f"layout: at of mark {number} must be two numbers of metres [y, z], not {at!r}")
    return place


def _colour(said: Any, what: str, named: Mapping[str, tuple[int, int, int]] = NAMED) -> tuple[int, int, int]:
    if isinstance(said, str):
        if said not in named:
            raise TrackError(
                f"{what} must be one of {', '.join(named)} or three codes [r, g, b], not {said!r}"
            )
        return named[said]
    try:
        red, green, blue = (int(c) for c in said)
    except (TypeError, ValueError):
        raise TrackError(f"{what} must be a name or [r, g, b], not {said!r}") from None
    if not all(0 <= c <= 255 for c in (red, green, blue)):
        raise TrackError(f"{what} must have codes from 0 to 255, not {said!r}")
    return red, green, blue


def read_bob(said: Any) -> Layout:
    """Read the colour of a pendulum's bob, or of the upper and the lower one of a double pendulum.

    Parameters
    ----------
    said : str, sequence of three int, or sequence of two such
        Names of `NAMED` or `PALE`, or sRGB codes; or a text of one or two, such as ``red,150,105,65``.

    Raises
    ------
    TrackError
        No such name, codes outside of 0 to 255, or more than two colours.
    """
    bobs: Sequence[Any] = said if isinstance(said, Sequence) and len(said) == 2 else [said]
    if isinstance(said, str):
        bobs = _colours_in(said)
    colours = tuple(_colour(each, "bob", NAMED | PALE) for each in bobs)
    if len(colours) > 2:
        raise TrackError(f"bob must be one colour, or those of the upper and the lower bob, not {said!r}")
    if len(set(colours)) < len(colours):
        raise TrackError(f"bob: two bobs need two colours, not {bobs[0]!r} twice")
    return Layout(tuple(complex(k + 1) for k in range(len(colours))), colours)


def _colours_in(text: str) -> list[Any]:
    """Return the colours in a text: names and codes, three for each colour."""
    parts, colours = text.split(","), list[Any]()
    while parts:
        is_code = parts[0].strip()[:1].isdigit()
        colours.append(parts[:3] if is_code else parts[0])
        parts = parts[3 if is_code else 1 :]
    return colours


def _check(layout: Layout) -> None:
    places = np.array(layout.places)
    distance = np.abs(places[:, None] - places[None, :]) + np.eye(len(places)) * 1e9
    if distance.min() < 0.05 * layout.reach:
        raise TrackError("layout: two marks are in the same place")
    for number, chroma in enumerate(np.hypot(*layout.chroma.T), start=1):
        if chroma < PALEST:
            raise TrackError(
                f"layout: mark {number} has no colour; grey, black and white marks are not recognised"
            )
    alike = same_colour(layout.chroma)
    middle = places - places.mean()
    # turned about their mean, marks of like colours must not fall upon each other: the angle would be a guess
    first = int(np.argmax(np.abs(middle)))
    for k in np.flatnonzero(alike[first]):
        if k == first or abs(abs(middle[k]) - abs(middle[first])) > 2 * SLACK * layout.reach:
            continue
        turned = middle * middle[k] / middle[first]
        close = (np.abs(turned[:, None] - middle[None, :]) < SLACK * layout.reach) & alike
        if close.any(axis=1).all():
            raise TrackError("layout: the marks look the same when the disk is turned; use another colour")


def same_colour(chroma: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return a mask (n, n) of the marks with equal colours."""
    unit = chroma / np.hypot(*chroma.T)[:, None]
    return np.asarray(unit @ unit.T > SAME)


def similarity(body: NDArray[np.complex128], seen: NDArray[np.complex128]) -> tuple[complex, complex]:
    """Fit the centre and the complex factor (size, turn) that map a body's points to observed points."""
    spread = body - body.mean()
    turn = complex(np.vdot(spread, seen - seen.mean()) / np.vdot(spread, spread).real)
    return complex(seen.mean() - turn * body.mean()), turn
