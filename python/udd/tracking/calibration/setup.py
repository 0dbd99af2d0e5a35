"""What is said by hand before a film is tracked, and which calibrations are left to the film."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.markers.layout import STANDARD, Layout, read_layout
from udd.video.reader import Picture, TrackError

Region = tuple[float, float, float, float]
MarkSeparation = tuple[
    int, int, float
]  # numbers of two marks, from 1, and how far apart their middles are [m]


@dataclass(frozen=True)
class Calibrate:
    """What the film itself is asked for. True: find it; False: not there, or as given; a number: it is that.

    Attributes
    ----------
    layout : bool
        Where the marks sit on the disk; False: just where the layout says.
    scale : bool
        Pixels per metre; False needs `scale`.
    lens : bool or float
        Relative displacement at the picture's corner.
    tilt : bool
        How the camera stands to the disk's plane.
    readout : bool or float
        Time that a rolling shutter takes from the first row to the last [s].
    exposure : bool or float
        Time for which the shutter is open [s].
    pivot : bool
        Where the wheels hold the disk; False needs `pivot`.
    """

    layout: bool = True
    scale: bool = True
    lens: bool | float = True
    tilt: bool = True
    readout: bool | float = True
    exposure: bool | float = True
    pivot: bool = True

    def given(self, name: str) -> float | None:
        """The value to take where an item is not to be found; None where it is."""
        value = getattr(self, name)
        return None if value is True else float(value)


@dataclass(frozen=True)
class Sigma:
    """How well is known what is said: standard errors. 0: it is just that, and nothing in the film moves it.

    Attributes
    ----------
    pivot : float
        Of each of its coordinates [pixels].
    scale : float
        [pixels per metre]
    layout : float
        Of each coordinate of a mark [m].
    """

    pivot: float = 0.0
    scale: float = 0.0
    layout: float = 0.0


@dataclass(frozen=True)
class Setup:
    """All that may be said by hand."""

    radius: float = 0.08
    distance: float | None = None
    pivot: tuple[float, float] | None = None
    layout: Layout = STANDARD
    scale: float | None = None  # pixels per metre
    region: Region | None = None  # u from, v from, u to, v to [pixels]
    calibrate: Calibrate = Calibrate()
    sigma: Sigma = Sigma()
    apart: MarkSeparation | None = None

    def __post_init__(self) -> None:
        """Refuse what contradicts itself."""
        if self.distance is not None and not self.layout.standard:
            raise TrackError("mark_distance is of the standard marks: a layout says where its own are")
        for name in ("scale", "pivot"):
            if not getattr(self.calibrate, name) and getattr(self, name) is None:
                raise TrackError(f"{name} is not to be found in the film, so it must be given")
            if getattr(self.sigma, name) and getattr(self, name) is None:
                raise TrackError(f"sigma says how well {name} is known, but {name} is not given")
        if self.apart is not None and max(self.apart[:2]) > len(self.layout.places):
            raise TrackError(
                f"apart: there is no mark {max(self.apart[:2])}: there are {len(self.layout.places)}"
            )
        if self.sigma.layout and self.layout.standard:
            raise TrackError("sigma says how well layout is known, but layout is not given")

    def view(self, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Pixels inside the region, (height, width)."""
        inside = np.zeros(shape, dtype=bool)
        u0, v0, u1, v1 = self.region or (0, 0, shape[1], shape[0])
        inside[max(0, math.floor(v0)) : math.ceil(v1), max(0, math.floor(u0)) : math.ceil(u1)] = True
        if not inside.any():
            raise TrackError(
                f"region {self.region} lies outside the picture of {shape[1]} x {shape[0]} pixels"
            )
        return inside

    def inside(self, picture: Picture) -> Picture:
        """The picture without colours outside the region."""
        if self.region is None:
            return picture
        here = self.view(picture.y.shape)[::2, ::2][: picture.u.shape[0], : picture.u.shape[1]]
        grey = np.uint8(128)
        return replace(picture, u=np.where(here, picture.u, grey), v=np.where(here, picture.v, grey))


def read_calibrate(said: Any) -> Calibrate:
    """From a mapping of names to true, false or numbers.

    Raises
    ------
    TrackError
        An item that there is not, or a value that it cannot have.
    """
    if isinstance(said, Calibrate):
        return said
    for name, value in _items(said, "calibrate", _ITEMS):
        if isinstance(value, bool):
            continue
        low, high, unit = _RANGES.get(name, (math.nan, math.nan, ""))
        if math.isnan(low):
            raise TrackError(f"calibrate: {name} must be true or false, not {value!r}")
        if not (isinstance(value, int | float) and low <= value <= high):
            raise TrackError(
                f"calibrate: {name} must be true, false or from {low:g} to {high:g}{unit}, not {value!r}"
            )
    return Calibrate(**said)


def read_sigma(said: Any) -> Sigma:
    """From a mapping of names to standard errors.

    Raises
    ------
    TrackError
        A name that there is not, or a value that is no standard error.
    """
    if isinstance(said, Sigma):
        return said
    for name, value in _items(said, "sigma", _SIGMAS):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and math.isfinite(value) and value >= 0):
            raise TrackError(f"sigma: {name} must be a standard error in {_SIGMAS[name]}, not {value!r}")
    return Sigma(**{name: float(value) for name, value in said.items()})


def read_apart(said: Any) -> MarkSeparation:
    """Two marks' numbers and their distance.

    Raises
    ------
    TrackError
        It is something else.
    """
    try:
        one, other, distance = said
        numbers = all(isinstance(n, int) and not isinstance(n, bool) and n > 0 for n in (one, other))
        if not numbers or one == other or not 0 < float(distance) < math.inf:
            raise ValueError
    except (TypeError, ValueError):
        raise TrackError(
            f"apart must be the numbers of two marks (from 1) and their distance in m, not {said!r}"
        ) from None
    return one, other, float(distance)


def read_region(said: Any) -> Region:
    """Four numbers: u and v of the upper left corner, and of the lower right [pixels]."""
    try:
        u0, v0, u1, v1 = (float(x) for x in said)
    except (TypeError, ValueError):
        u0 = v0 = u1 = v1 = math.nan
    if not (math.isfinite(u0 + v0 + u1 + v1) and u0 < u1 and v0 < v1):
        raise TrackError(f"region must be four numbers of pixels [u0, v0, u1, v1], growing, not {said!r}")
    return u0, v0, u1, v1


_ITEMS = tuple(f.name for f in fields(Calibrate))
_SIGMAS = {"pivot": "pixels", "scale": "pixels per metre", "layout": "m"}
_RANGES = {"lens": (-0.3, 0.3, ""), "readout": (-0.1, 0.1, " s"), "exposure": (0.0, 0.1, " s")}


def _items(said: Any, table: str, known: Collection[str]) -> Iterator[tuple[str, Any]]:
    """The items of a table by name, each one that there is."""
    if not isinstance(said, Mapping):
        raise TrackError(f"{table} must be a table of {', '.join(known)}, not {said!r}")
    for name, value in said.items():
        if name not in known:
            raise TrackError(f"{table}: there is no item {name!r}; there are {', '.join(known)}")
        yield name, value


def length_of(value: float, name: str, unit: str = "metres") -> float:
    """A positive, finite number."""
    try:
        length = float(value)
    except (TypeError, ValueError):
        raise TrackError(f"{name} must be a number of {unit}, not {value!r}") from None
    if not (math.isfinite(length) and length > 0):
        raise TrackError(f"{name} must be positive and finite, not {value!r}")
    return length


__all__ = [
    "Calibrate",
    "Layout",
    "MarkSeparation",
    "Region",
    "Setup",
    "Sigma",
    "length_of",
    "read_apart",
    "read_calibrate",
    "read_layout",
    "read_region",
    "read_sigma",
]
