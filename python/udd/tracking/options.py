"""Options of `udd.track`: one record, read and checked once."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from udd._util.tables import table
from udd.calibration_items import SWITCHES, Calibrate
from udd.markers.layout import STANDARD, Layout, read_bob, read_layout
from udd.markers.tags import Tag, is_tags, layout_of, read_tags
from udd.video.reader import Picture, Rates, TrackError, frame_rates

from .clicks import Clicks, read_clicks, read_stretches

Region = tuple[float, float, float, float]
MarkSeparation = tuple[int, int, float]  # numbers of two marks, from 1, and their distance [m]


@dataclass(frozen=True)
class Sigma:
    """Standard errors of the given values. With error 0 a value is fixed.

    Attributes
    ----------
    pivot : float
        Standard error of each of its coordinates [pixels].
    scale : float
        [pixels per metre]
    layout : float
        Standard error of each coordinate of a mark [m].
    """

    pivot: float = 0.0
    scale: float = 0.0
    layout: float = 0.0


def _entry(kind: str, note: str = "") -> dict[str, str]:
    """Return the form of an option in a config file, and the remark with which one is written."""
    return {"kind": kind, "note": note}


class MoreOptions(TypedDict, total=False):
    """The options that few films need."""

    mark_distance: float | None
    region: Region | None
    sigma: Sigma | Mapping[str, float] | None
    apart: MarkSeparation | None
    length: float | None
    leave_out: Sequence[int | Sequence[int]] | None
    clicks: Clicks | Mapping[str, Any] | None


@dataclass(frozen=True)
class TrackOptions:
    """Checked options of a film; :func:`udd.track` explains each of them.

    Attributes
    ----------
    tags : tuple of Tag
        The layout's printed tags, empty for coloured marks.

    See Also
    --------
    udd.track : takes them.
    udd.tracking.write_config : writes them to a file.
    """

    disk_radius: float = field(default=0.08, metadata=_entry("a positive number of metres", "m"))
    mark_distance: float | None = field(default=None, metadata=_entry("a positive number of metres", "m"))
    fps: Rates | None = field(
        default=None, metadata=_entry("a positive number of frames per second", "frames per second")
    )
    pivot: tuple[float, float] | None = field(
        default=None,
        metadata=_entry("two numbers of pixels [u, v]", "where the wheels hold the disk, pixels (u, v down)"),
    )
    refine: bool = field(default=True, metadata=_entry("true or false"))
    scale: float | None = field(
        default=None, metadata=_entry("a positive number of pixels per metre", "pixels per metre")
    )
    region: Region | None = field(
        default=None,
        metadata=_entry(
            "four numbers of pixels [u0, v0, u1, v1]",
            "u0, v0, u1, v1: nothing outside is looked at, pixels",
        ),
    )
    layout: Layout = field(
        default=STANDARD,
        metadata=_entry(
            "a list of marks", "m right of and above the disk's centre when beta is 0; sRGB codes"
        ),
    )
    calibrate: Calibrate = field(
        default=Calibrate(),
        metadata=_entry("a table", "true: found in the film; false: as given, or not there"),
    )
    sigma: Sigma = field(
        default=Sigma(),
        metadata=_entry(
            "a table of standard errors",
            "standard errors of what is given (pixels, pixels per metre, m): the film improves it",
        ),
    )
    apart: MarkSeparation | None = field(
        default=None,
        metadata=_entry(
            "two marks' numbers and a distance",
            "two marks, by their numbers from 1, and how far apart their middles are, m",
        ),
    )
    bob: Any = field(default=None, metadata=_entry("the colour of a pendulum's bob"))
    length: float | None = field(default=None, metadata=_entry("a positive number of metres", "m"))
    leave_out: tuple[tuple[int, int], ...] = field(
        default=(),
        metadata=_entry("numbers of frames, or pairs [first, last]", "frames that are not used, from 0"),
    )
    clicks: Clicks | None = field(
        default=None, metadata=_entry("a table of clicked points", "points clicked in a frame, pixels")
    )
    tags: tuple[Tag, ...] = field(default=(), init=False)

    def __post_init__(self) -> None:
        """Read each option, and refuse what contradicts itself."""
        for name in FIELDS:
            value = getattr(self, name)
            if value is not None:
                self._set(name, read_option(name, value))
        if is_tags(self.layout):
            self._set("tags", self.layout)
            self._set("layout", layout_of(self.tags))
        if self.bob is not None:
            self._as_pendulum()
        elif self.length is not None:
            raise TrackError("length is a pendulum's: say its bob's colour too")
        self._check()

    def changed(self, changes: Mapping[str, Any]) -> TrackOptions:
        """Return the options with other values of some of them.

        Parameters
        ----------
        changes : mapping of str to value
            Options by name.

        Returns
        -------
        TrackOptions
            Checked.
        """
        said = {name: getattr(self, name) for name in FIELDS}
        if self.tags or self.bob is not None:  # from which the layout was made
            del said["layout"]
        made = TrackOptions(**{**said, **changes})
        if self.tags and "layout" not in changes:
            made._set("tags", self.tags)
            made._set("layout", self.layout)
            made._check()
        return made

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _as_pendulum(self) -> None:
        """Return the options for a pendulum, whose bob is the only mark."""
        disk_options = [
            f.name for f in fields(self) if f.name in _OF_A_DISK and getattr(self, f.name) != f.default
        ]
        if disk_options:
            raise TrackError(
                f"{', '.join(disk_options)}: not for a pendulum, which has a bob and a length alone"
            )
        self._set("layout", read_bob(self.bob))

    def _check(self) -> None:
        for name in ("calibrate", "sigma"):
            if getattr(self, name) is None:
                raise TrackError(f"{name} must be a table of names and values, not None")
        if self.mark_distance is not None and not self.layout.standard:
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
        """Return the pixels inside the region.

        Parameters
        ----------
        shape : (int, int)
            Height and width of the picture [pixels].

        Returns
        -------
        ndarray of bool, shape (height, width)
            True inside the region.
        """
        inside = np.zeros(shape, dtype=bool)
        u0, v0, u1, v1 = self.region or (0, 0, shape[1], shape[0])
        inside[max(0, math.floor(v0)) : math.ceil(v1), max(0, math.floor(u0)) : math.ceil(u1)] = True
        if not inside.any():
            raise TrackError(
                f"region {self.region} lies outside the picture of {shape[1]} x {shape[0]} pixels"
            )
        return inside

    def inside(self, picture: Picture) -> Picture:
        """Return the picture without colours outside the region.

        Parameters
        ----------
        picture : Picture
            A frame of the film.

        Returns
        -------
        Picture
            With grey outside the region.
        """
        if self.region is None:
            return picture
        here = self.view(picture.y.shape)[::2, ::2][: picture.u.shape[0], : picture.u.shape[1]]
        grey = np.uint8(128)
        return replace(picture, u=np.where(here, picture.u, grey), v=np.where(here, picture.v, grey))


def read_calibrate(said: Any) -> Calibrate:
    """Read a mapping of names to true, false or numbers.

    Raises
    ------
    TrackError
        An item that there is not, or a value that it cannot have.
    """
    said = asdict(said) if isinstance(said, Calibrate) else said
    switches = {item.name: item for item in SWITCHES}
    for name, value in table("calibrate", said, tuple(switches), error=TrackError).items():
        if isinstance(value, bool):
            continue
        numbers = switches[name].numbers
        if numbers is None:
            raise TrackError(f"calibrate: {name} must be true or false, not {value!r}")
        (low, high), unit = numbers, switches[name].unit and f" {switches[name].unit}"
        if not (isinstance(value, int | float) and low <= value <= high):
            raise TrackError(
                f"calibrate: {name} must be true, false or from {low:g} to {high:g}{unit}, not {value!r}"
            )
    return Calibrate(**said)


def read_sigma(said: Any) -> Sigma:
    """Read a mapping of names to standard errors.

    Raises
    ------
    TrackError
        A name that there is not, or a value that is no standard error.
    """
    said = asdict(said) if isinstance(said, Sigma) else said
    for name, value in table("sigma", said, _SIGMAS, error=TrackError).items():
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
        first, other, distance = said
        numbers = all(isinstance(n, int) and not isinstance(n, bool) and n > 0 for n in (first, other))
        if not numbers or first == other or not 0 < float(distance) < math.inf:
            raise ValueError
    except (TypeError, ValueError):
        raise TrackError(
            f"apart must be the numbers of two marks (from 1) and their distance in m, not {said!r}"
        ) from None
    return first, other, float(distance)


def read_region(said: Any) -> Region:
    """Four numbers: u and v of the upper left corner, and of the lower right [pixels]."""
    try:
        u0, v0, u1, v1 = (float(x) for x in said)
    except (TypeError, ValueError):
        u0 = v0 = u1 = v1 = math.nan
    if not (math.isfinite(u0 + v0 + u1 + v1) and u0 < u1 and v0 < v1):
        raise TrackError(f"region must be four numbers of pixels [u0, v0, u1, v1], growing, not {said!r}")
    return u0, v0, u1, v1


_SIGMAS = {"pivot": "pixels", "scale": "pixels per metre", "layout": "m"}


def read_option(name: str, value: Any) -> Any:
    """One option, as an argument or a config file says it.

    Raises
    ------
    TrackError
        A value of the wrong kind.
    """
    try:
        return _READERS[name](value)
    except TrackError:
        raise
    except (TypeError, ValueError, OverflowError):
        raise TrackError(f"{name} must be {FIELDS[name].metadata['kind']}, not {value!r}") from None


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or not math.isfinite(value):
        raise TypeError
    return float(value)


def positive(value: Any) -> float:
    """Check a positive, finite number; raise TypeError or ValueError for others."""
    if not _number(value) > 0:
        raise ValueError
    return float(value)


def _place(value: Any) -> tuple[float, float]:
    u, v = value
    return _number(u), _number(v)


def _rates(value: Any) -> Any:
    return frame_rates(value) if isinstance(value, list | tuple) else positive(value)


def _switch(value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise TypeError
    return bool(value)


def _bob(value: Any) -> Any:
    read_bob(value)
    return value


def _layout(value: Any) -> Any:
    return read_tags(value) if is_tags(value) else read_layout(value)


_READERS: dict[str, Callable[[Any], Any]] = {
    "disk_radius": positive,
    "mark_distance": positive,
    "fps": _rates,
    "pivot": _place,
    "refine": _switch,
    "scale": positive,
    "region": read_region,
    "layout": _layout,
    "calibrate": read_calibrate,
    "sigma": read_sigma,
    "apart": read_apart,
    "bob": _bob,
    "length": positive,
    "leave_out": read_stretches,
    "clicks": read_clicks,
}
FIELDS = {f.name: f for f in fields(TrackOptions) if f.init}
_OF_A_DISK = ("disk_radius", "mark_distance", "layout", "sigma", "apart")
