"""A film of what a camera shows just now, each frame with the time at which it was taken."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain, islice, tee
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.one_line import link_to
from udd._util.progress import Progress, progress_bar
from udd._util.validation import number
from udd.errors import outside

from .reader import TrackError
from .writer import checked_path, require_video, write_film

RATE = 30  # frames per second in the encoder's settings; each frame has its time
TICKS = 3000  # per such frame: time stamps to 1/90000 s, as in MPEG
QUALITY = 16.0  # constant rate factor; a grain of 2 codes is kept
LATE = 1.5  # usual intervals: after a longer one a frame was lost
FEWEST = 10  # frames that make a film
PROBE = 5  # frames that show whether the camera has a clock
MILLISECONDS = 0  # cv2.CAP_PROP_POS_MSEC, the camera's own time


class Source(Protocol):
    """The part of `cv2.VideoCapture` that is used."""

    def isOpened(self) -> bool:
        """Return True if there is a camera."""

    def read(self) -> tuple[bool, Any]:
        """Wait for the next frame: whether there is one, and BGR (height, width, 3)."""

    def get(self, propId: int, /) -> float:
        """Return a property; 0 if the camera does not have it."""

    def release(self) -> None:
        """Let go of the camera."""


@dataclass(frozen=True, repr=False)
class Recording:
    """Recorded film, with its time stamps.

    Attributes
    ----------
    path : Path
        The film file.
    t : ndarray, shape (n,)
        Time stamps of the frames from the first one [s].
    clock : {"camera", "computer"}
        Source of the time stamps.

    See Also
    --------
    udd.record : makes it.
    udd.track : measures the film.
    """

    path: Path
    t: NDArray[np.float64]  # time stamps of the frames [s, from the first]
    clock: str  # "camera" or "computer": who says the times

    @property
    def interval(self) -> float:
        """The usual time between frames [s]."""
        return float(np.median(np.diff(self.t)))

    @property
    def gaps(self) -> NDArray[np.float64]:
        """Beginning and end of each gap, shape (k, 2) [s]."""
        late = np.flatnonzero(np.diff(self.t) > LATE * self.interval)
        return np.column_stack([self.t[late], self.t[late + 1]])

    @property
    def lost(self) -> int:
        """Number of frames missing in the gaps."""
        return int(np.sum(np.round(np.diff(self.gaps)[:, 0] / self.interval) - 1))

    def __repr__(self) -> str:
        return f"<Recording {self.path}: {self}>"

    def _repr_html_(self) -> str:
        return link_to(self.path, str(self))

    def __str__(self) -> str:
        """Return the recording in one sentence."""
        rate, last = 1 / self.interval, self.t[-1]
        what = f"{len(self.t)} frames in {last:.2f} s, {rate:.1f} a second by the {self.clock}'s clock"
        if not self.lost:
            return f"{what}; none was lost"
        share = 100 * self.lost / (len(self.t) + self.lost)
        longest = 1e3 * float(np.diff(self.gaps).max())
        gaps = f"{len(self.gaps)} gaps" if len(self.gaps) > 1 else "one gap"
        return f"{what}; {self.lost} lost ({share:.1f} %) in {gaps}, the longest of {longest:.0f} ms"


@checked_arguments
def record(
    path: str | os.PathLike[str],
    *,
    camera: int | Source = 0,
    seconds: float = 20.0,
    progress: bool | Callable[[str], object] | None = None,
) -> Recording:
    """Record a film from a webcam, with the time at which each frame was taken.

    Parameters
    ----------
    path : path
        Film to write (.mp4 or .mov, H.264); it appears complete or not at all.
    camera : int or cv2.VideoCapture
        Number of the camera (0: the first), or an opened one, set up as you like; it is released.
    seconds : float
        How long to record [s].
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. By default a
        bar shows after 2 s in a terminal or a notebook.

    Returns
    -------
    Recording
        ``path``, ``t`` (time stamps [s]), ``clock`` ("camera" where it says its times, else "computer"),
        ``interval``, ``gaps`` and ``lost`` (frames missing, from gaps in the time stamps); printed, it says
        so in a sentence.

    Raises
    ------
    TrackError
        There is no such camera, or it gives fewer than 10 frames.
    ModelError
        `seconds` is not a positive number.

    Warns
    -----
    UserWarning
        The camera stopped before the time was over.

    See Also
    --------
    udd.track : measures the film.
    udd.tracking.click : sets up the tracker by clicks.

    Notes
    -----
    A camera's frames come when they come (a dark room halves the rate), so the film has the true times of
    presentation, and a lost frame is a gap in them; `udd.track` reads them. The camera's clock tells when
    a frame was taken; the computer's when it arrived, later by a delay that wavers by some milliseconds.

    Ctrl-C ends the recording: the film holds what was recorded until then. A second Ctrl-C, or one before the
    tenth frame, leaves no film and raises ``KeyboardInterrupt``.

    Examples
    --------
    >>> import udd
    >>> made = udd.record("run.mp4", camera=0, seconds=20)  # doctest: +SKIP
    >>> print(made)  # doctest: +SKIP
    600 frames in 19.97 s, 30.0 a second by the camera's clock; none was lost
    >>> m = udd.track(made.path)  # doctest: +SKIP
    """
    target = checked_path(path)
    seconds = number("seconds", seconds, above=0.0)
    require_video()
    source, name = _opened(camera)
    by_hand = Stop()
    try:
        shots = _Shots(source, name, seconds, progress, by_hand)
        stream = iter(shots)
        start = list(islice(stream, FEWEST))
        if len(start) < FEWEST:
            if by_hand.asked:
                raise KeyboardInterrupt
            raise TrackError(f"{name} gave {len(start)} frames, at least {FEWEST} are needed")
        height, width = (side // 2 * 2 for side in start[0][1].shape[:2])  # colour is stored for 2 x 2 pixels
        first, second = tee(chain(start, stream))
        times = (round((t - start[0][0]) * RATE * TICKS) for t, _ in first)
        pictures = (np.ascontiguousarray(bgr[:height, :width, ::-1]) for _, bgr in second)
        write_film(target, pictures, (width, height), Fraction(RATE), QUALITY, numbers=times, ticks=TICKS)
    finally:
        by_hand.end()
        source.release()
    made = Recording(target, np.array(shots.t) - shots.t[0], shots.clock)
    if not by_hand.asked and made.t[-1] < seconds - max(1.0, 2 * LATE * made.interval):
        warnings.warn(f"{name} stopped after {made.t[-1]:.1f} of {seconds:g} s", stacklevel=outside())
    return made


def _opened(camera: int | Source) -> tuple[Source, str]:
    if not isinstance(camera, int):
        source, name = camera, "the camera"
    else:
        import cv2

        level = cv2.utils.logging.getLogLevel()
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # what is wrong is said below
        try:
            source, name = cv2.VideoCapture(camera), f"camera {camera}"
        finally:
            cv2.utils.logging.setLogLevel(level)
    if not source.isOpened():
        source.release()
        raise TrackError(f"{name} cannot be opened: there is none, or another program uses it")
    return source, name


class Stop:
    """Ctrl-C as a wish: the first ends the recording with the film whole, a second one ends all."""

    def __init__(self) -> None:
        self.asked = False
        self.before: Any = None
        if threading.current_thread() is threading.main_thread():
            self.before = signal.signal(signal.SIGINT, self._ask)

    def _ask(self, *_: object) -> None:
        self.asked = True
        self.end()

    def end(self) -> None:
        """Ctrl-C means again what it meant before."""
        if self.before is not None:
            signal.signal(signal.SIGINT, self.before)
            self.before = None


class _Shots:
    """Frames of a camera with their times, until the time is over or the camera stops."""

    def __init__(self, source: Source, name: str, seconds: float, progress: Progress, by_hand: Stop) -> None:
        self.by_hand = by_hand
        self.source, self.name, self.seconds, self.progress = source, name, seconds, progress
        self.t: list[float] = []
        self.clock = "camera"

    def __iter__(self) -> Iterator[tuple[float, NDArray[np.uint8]]]:
        raw = self._raw()
        probe = list(islice(raw, PROBE))
        if np.any(np.diff([clock for clock, _, _ in probe]) <= 0):  # it knows no time, or not for each frame
            self.clock = "computer"
        with progress_bar(self.seconds, "s", self.progress, title=f"record {self.name}", leave=True) as bar:
            for clock, arrived, picture in chain(probe, raw):
                t = clock if self.clock == "camera" else arrived
                if self.t and t - self.t[-1] < 1 / (RATE * TICKS):
                    continue  # a time that stands still shows no new instant
                if self.by_hand.asked or (self.t and t - self.t[0] > self.seconds):
                    return
                bar.update(t - self.t[-1] if self.t else 0.0)
                self.t.append(t)
                yield t, picture

    def _raw(self) -> Iterator[tuple[float, float, NDArray[np.uint8]]]:
        """Return the camera's time [s], the computer's, and the picture (BGR)."""
        shape: tuple[int, ...] | None = None
        while True:
            there, picture = self.source.read()
            arrived = time.monotonic()
            if not there:
                return
            shape = shape or picture.shape
            if picture.shape != shape or len(shape) != 3 or picture.dtype != np.uint8:
                raise TrackError(f"{self.name} gives no colour pictures of one size, but {picture.shape}")
            yield self.source.get(MILLISECONDS) / 1e3, arrived, picture
