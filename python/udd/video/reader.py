"""Films as pictures with their true presentation times, decoded in a process of its own."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.child_process import ChildProcess
from udd._util.steady_clock import steady_clock
from udd.errors import TrackError as TrackError

from .decoder_process import HEAD, LOOK, NO_FILM, images_in
from .srgb import light_of

if TYPE_CHECKING:
    from .frame_conversion import Conversion

Plane = NDArray[np.uint8]
Box = tuple[int, int, int, int]  # rows from, to, columns from, to [pixels]
Rates = float | Sequence[Sequence[float]]  # frames per second, or pairs of a frame and the rate from it on
PATIENCE = 60.0  # s for which the decoder may be silent
DECODER = str(Path(__file__).with_name("decoder_process.py"))
SLOWED = 1.5  # times the header's rate: a film of a higher one was taken in slow motion
MEMORY = 4 << 30  # bytes of address space that it may take


@dataclass(frozen=True)
class Picture:
    """One frame: brightness at full resolution, colour differences at half (4:2:0)."""

    index: int
    t: float  # presentation time [s]
    y: Plane
    u: Plane
    v: Plane
    damaged: bool = False  # it, or one it was coded from, did not decode whole
    left_out: bool = False  # by the user; it counts as damaged then


def light_of_codes(full_range: bool) -> NDArray[np.float64]:
    """Amount of light, 0 to 255, for each brightness code of a film: the sRGB curve (IEC 61966-2-1).

    A shutter adds up light, not codes; a streak is only symmetric about its middle in light.
    """
    x = np.arange(256) / 255 if full_range else np.clip((np.arange(256) - 16) / 219, 0, 1.08)
    return np.asarray(255 * light_of(x))


def frame_rates(said: Any) -> tuple[tuple[int, float], ...]:
    """Read frames per second: a number, or pairs of a frame's number and the rate from it on.

    Raises
    ------
    TrackError
        It is something else.
    """
    if isinstance(said, int | float) and not isinstance(said, bool):
        said = [(0, said)]
    try:
        pairs = tuple((int(first), float(rate)) for first, rate in said)
        whole = all(int(first) == first for first, _ in said)
    except (TypeError, ValueError, OverflowError):
        pairs, whole = (), False
    growing = all(a[0] < b[0] for a, b in pairwise(pairs))
    good = all(math.isfinite(rate) and rate > 0 for _, rate in pairs)
    if not (pairs and whole and growing and good and pairs[0][0] == 0):
        raise TrackError(
            f"fps must be positive and finite, or pairs [first frame, rate] from frame 0 on, not {said!r}"
        )
    return pairs


def time_of(frame: int, rates: Sequence[tuple[int, float]]) -> float:
    """Return the time [s] of a frame, at rates that hold from some frames on.

    Examples
    --------
    >>> time_of(3, ((0, 1.0), (2, 4.0)))
    2.25
    """
    time = 0.0
    for (first, rate), (last, _) in pairwise([*rates, (frame, 1.0)]):
        time += max(0, min(last, frame) - first) / rate
    return time


def real_time(t: float, slower: Sequence[tuple[float, float]]) -> float:
    """Convert the time [s] of a clock that runs too slowly by factors, each from some time on.

    Examples
    --------
    >>> real_time(3.0, ((0.0, 1.0), (2.0, 4.0)))
    2.25
    """
    real = 0.0
    for (begin, factor), end in zip(slower, [*(b for b, _ in slower[1:]), math.inf], strict=True):
        real += max(0.0, min(t, end) - begin) / factor
    return real


class Film:
    """Film file whose frames can be read any number of times.

    Brightness and colour stay apart, as films store them: positions come from the brightness, which
    has the full resolution, and names of marks from the colour, whose samples lie half a pixel off.
    A container that counts milliseconds (Matroska, WebM, FLV) rounds the times of a constant rate: they are
    those of the rate then, see :attr:`clock`. Times that truly vary stay as they are.
    Decoders are large and films come from anywhere, so they run in another process, with limits on memory,
    pixels and silence. A film that breaks the decoder is an error here.

    See Also
    --------
    udd.tracking.pictures_at : frames as RGB arrays.
    """

    def __init__(self, path: str | os.PathLike[str], *, fps: Rates | None = None) -> None:
        self.path = Path(path)
        if not self.path.exists():
            raise TrackError(f"{self.path}: there is no such file")
        folder = self.path.is_dir()
        if folder and not images_in(str(self.path)):
            raise TrackError(f"{self.path} is a folder, not a film, and holds no pictures")
        if folder and fps is None:
            raise TrackError(f"{self.path} is a folder of pictures, which have no times: give fps")
        if not folder and not self.path.is_file():
            raise TrackError(f"{self.path} is a device or a pipe, not a regular file: save the film first")
        if not folder and self.path.stat().st_size == 0:
            raise TrackError(f"{self.path}: the file is empty")
        rates = None if fps is None else frame_rates(fps)
        if find_spec("av") is None:  # the decoder runs in another process, which could not raise this
            raise ModuleNotFoundError("No module named 'av'", name="av")
        self.broken = 0  # packets that did not decode in the last run
        self._idle: _Decoder | None = None  # between runs
        decoder = self._decoder()
        said = decoder.ask(LOOK)
        if "error" in said:
            raise TrackError(f"{self.path} {said['error']}")
        stamps = decoder.stamps(int(said["stamps"]))
        self._idle = decoder
        self.promised = int(said["frames"])  # 0 where the container does not say
        self.packets = int(said["packets"])  # coded frames that the file holds
        #: Width and height [pixels]: of the upright pictures as soon as one is read, until then as coded.
        self.size = (int(said["width"]), int(said["height"]))
        self.clock_note = ""  # where times come from, if not from the header alone
        self.forced = rates  # what the header says about time is not believed then
        #: The constant rate that the container's times show, if it only rounded them; None else.
        self.clock = None if fps else steady_clock(np.unique(stamps) * said["tick"], said["tick"])
        fastest = max(rate for _, rate in rates) if rates else 0.0
        self.fps = float(fastest or said["fps"] or (1 / self.clock.period if self.clock else math.nan))
        self.full_range = bool(said["full_range"])
        self.light = light_of_codes(self.full_range)  # of each brightness code
        #: Times (begin, factor) by the header's clock from which on it runs so many times too slowly.
        self.slower: tuple[tuple[float, float], ...] = ()
        captured = said["capture_fps"]
        if fps is None and captured and captured > SLOWED * self.fps:
            self.slower = ((0.0, captured / self.fps),)
            self.clock_note = f"times by the tag com.android.capture.fps: {captured:g} frames per second"
            self.fps = float(captured)
        #: Correction of each picture, at least inside a box if one is given.
        self.correct: Callable[[Picture, Box | None], Picture] | None = None
        self.tick: Callable[[], object] = lambda: None  # called for each picture that is read
        self.left_out: tuple[tuple[int, int], ...] = ()  # first and last frames of the parts without use
        self.conversion: Conversion | None = None  # what a converter did, to be undone

    @property
    def clock_meta(self) -> dict[str, Any]:
        """Entries of a measurement's header on the clock."""
        said: dict[str, Any] = {"clock": self.clock_text} if self.clock_text else {}
        c = self.conversion
        return said if c is None else said | {"conversion": [c.sources, c.frames, c.how, c.phase]}

    @property
    def clock_text(self) -> str:
        """Source of the times if they are not the container's own; otherwise empty."""
        texts = (
            self.clock.text if self.clock else "",
            self.clock_note,
            self.conversion.text if self.conversion else "",
        )
        return "; ".join(text for text in texts if text)

    def corrected(self, picture: Picture, box: Box | None = None) -> Picture:
        """Correct a picture for the camera, at least inside a box.

        Parameters
        ----------
        picture : Picture
            One of :meth:`uncorrected`.
        box : Box, optional
            The part that is needed; by default all of the picture.

        Returns
        -------
        Picture
            The same picture if the film has no correction.
        """
        return picture if self.correct is None else self.correct(picture, box)

    def pictures(self, since: float = 0.0) -> Iterator[Picture]:
        """Yield all frames that decode, corrected; see :meth:`uncorrected`.

        Parameters
        ----------
        since : float
            If above 0, begin with the last key frame up to this time [s].

        Yields
        ------
        Picture
            Brightness, colour differences and time of a frame.
        """
        for picture in self.uncorrected(since):
            yield self.corrected(picture)

    def uncorrected(self, since: float = 0.0) -> Iterator[Picture]:
        """Yield all frames that decode, in order of presentation, with increasing times.

        Frames are numbered from the first one that is yielded. If a converter changed the frame rate, the
        frames are those of the camera.

        Parameters
        ----------
        since : float
            If above 0, begin with the last key frame up to this time [s].

        Yields
        ------
        Picture
            Brightness, colour differences and time of a frame.
        """
        if self.forced is not None or self.slower or self.conversion is not None:
            since = 0.0  # the header's times are no help in seeking
        pictures = self._decoded(since)
        for picture in pictures if self.conversion is None else self.conversion.undo(pictures):
            yield replace(picture, t=real_time(picture.t, self.slower)) if self.slower else picture

    def _decoded(self, since: float) -> Iterator[Picture]:
        """Yield the frames as they are coded, at the times of the header or of the given rates."""
        self.broken = 0
        decoder = self._decoder()
        try:
            said = decoder.ask(repr(since))
            if "error" in said:
                raise TrackError(f"{self.path} {said['error']}")
            for picture in decoder.pictures():
                height, width = picture.y.shape
                self.size = (width, height)
                if self.forced is not None:
                    picture = replace(picture, t=time_of(picture.index, self.forced))
                elif self.clock is not None:
                    # The halves of interlaced frames are half a period apart.
                    picture = replace(picture, t=self.clock.at(picture.t, parts=2))
                if any(first <= picture.index <= last for first, last in self.left_out):
                    picture = replace(picture, damaged=True, left_out=True)
                self.tick()
                yield picture
            self.broken = decoder.broken
        finally:
            if decoder.whole:
                self._idle = decoder
            else:
                decoder.end()

    def _decoder(self) -> _Decoder:
        """Return the process that is left from the last run, or a new one."""
        idle, self._idle = self._idle, None
        return _Decoder(self.path) if idle is None or idle.child.process.poll() is not None else idle


class _Decoder:
    """The process that decodes, and the pipes to and from it. It ends with this object."""

    def __init__(self, path: Path) -> None:
        self.broken, self.whole = 0, False
        self.child = ChildProcess(DECODER, str(path), str(MEMORY), patience=PATIENCE)
        self.end = self.child.end

    def ask(self, request: str) -> dict[str, Any]:
        """Return the entries of the header or an error; pictures follow if a time was requested."""
        self.broken, self.whole = 0, False
        try:
            self.child.send(request.encode() + b"\n")
            line = self.child.line()
        except OSError:
            line = b""
        return json.loads(line) if line else {"error": NO_FILM}

    def stamps(self, count: int) -> NDArray[np.int64]:
        """Yield the times of so many frames, in ticks, which follow the answer to a look."""
        room = np.empty(count, np.int64)
        return room if self.child.fill(room) else room[:0]

    def pictures(self) -> Iterator[Picture]:
        head = bytearray(HEAD.size)
        while self.child.fill(head):
            index, t, height, width, rows, columns, turns, damaged = HEAD.unpack(head)
            if index < 0:  # the end: what did not decode
                self.broken, self.whole = height, True
                return
            full, half = height * width, rows * columns
            room = np.empty(full + 2 * half, np.uint8)
            if not self.child.fill(room.data):
                break
            y, u, v = room[:full], room[full : full + half], room[full + half :]
            y, u, v = y.reshape(height, width), u.reshape(rows, columns), v.reshape(rows, columns)
            if turns:
                y, u, v = (np.ascontiguousarray(np.rot90(p, turns)) for p in (y, u, v))
            yield Picture(index, t, y, u, v, damaged)
        self.broken = 1  # it ended in the middle
