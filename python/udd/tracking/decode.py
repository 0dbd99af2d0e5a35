"""Films as pictures with their true presentation times, decoded in a process of its own."""

from __future__ import annotations

import json
import math
import os
import select
import struct
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

Plane = NDArray[np.uint8]
PATIENCE = 60.0  # s for which the decoder may be silent
MEMORY = 4 << 30  # bytes of address space that it may take
PIPE = 1 << 20  # bytes that the pipe to it should hold
HEAD = struct.Struct("<qdIIII?")  # frame: number, time, height, width, chroma's height and width, damaged


class TrackError(UddError):
    """A film cannot be read, or shows no disk that can be tracked."""


@dataclass(frozen=True)
class Picture:
    """One frame: brightness at full resolution, colour differences at half (4:2:0)."""

    index: int
    t: float  # presentation time [s]
    y: Plane
    u: Plane
    v: Plane
    damaged: bool = False  # it, or one it was coded from, did not decode whole


def light_of_codes(full_range: bool) -> NDArray[np.float64]:
    """Amount of light, 0 to 255, for each brightness code of a film: the sRGB curve (IEC 61966-2-1).

    A shutter adds up light, not codes; a streak is only symmetric about its middle in light.
    """
    x = np.arange(256) / 255 if full_range else np.clip((np.arange(256) - 16) / 219, 0, 1.08)
    return np.asarray(255 * np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4))


class Film:
    """A film file that can be run through any number of times.

    Brightness and colour stay apart, as films store them: positions come from the brightness, which
    has the full resolution, and names of marks from the colour, whose samples lie half a pixel off.
    Decoders are large and films come from anywhere, so they run in a process of their own, with limits
    on memory, pixels and silence: a film that breaks it ends there, and is an error at worst.
    """

    def __init__(self, path: str | os.PathLike[str], *, fps: float | None = None) -> None:
        self.path = Path(path)
        if not self.path.exists():
            raise TrackError(f"{self.path}: there is no such file")
        if self.path.is_dir():
            raise TrackError(f"{self.path} is a folder, not a film")
        if self.path.stat().st_size == 0:
            raise TrackError(f"{self.path}: the file is empty")
        if fps is not None and not (math.isfinite(fps) and fps > 0):
            raise TrackError(f"fps must be positive and finite, not {fps!r}")
        if find_spec("av") is None:  # what decodes runs elsewhere, where nobody would be told
            raise ModuleNotFoundError("No module named 'av'", name="av")
        self.broken = 0  # packets that did not decode in the last run
        with _Decoder(self.path, 0.0, look_only=True) as decoder:
            said = decoder.header
        if "error" in said:
            raise TrackError(f"{self.path} {said['error']}")
        self.promised = int(said["frames"])  # 0 where the container does not say
        self.packets = int(said["packets"])  # coded frames that the file holds
        self.size = (int(said["width"]), int(said["height"]))
        self.forced = fps  # what the header says about time is not believed then
        self.fps = float(fps or said["fps"] or math.nan)
        self.full_range = bool(said["full_range"])
        self.light = light_of_codes(self.full_range)  # of each brightness code

    def pictures(self, since: float = 0.0) -> Iterator[Picture]:
        """All frames that decode, in order of presentation, with increasing times.

        Those from the last key frame up to `since` [s] on, where it is above 0; they are numbered from it.
        """
        self.broken = 0
        if self.forced is not None:
            since = 0.0  # the header's times are no help in seeking
        with _Decoder(self.path, since) as decoder:
            if "error" in decoder.header:
                raise TrackError(f"{self.path} {decoder.header['error']}")
            for picture in decoder.pictures():
                if self.forced is None:
                    yield picture
                else:
                    index = picture.index
                    yield Picture(
                        index, index / self.forced, picture.y, picture.u, picture.v, picture.damaged
                    )
            self.broken = decoder.broken


class _Decoder:
    """The process that decodes, and the pipe from it."""

    def __init__(self, path: Path, since: float, look_only: bool = False) -> None:
        self.broken = 0
        command = [sys.executable, "-m", "udd.tracking.decoder", str(path), repr(since), str(int(look_only))]
        paths = [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in paths if p)}
        self.process = subprocess.Popen(
            [*command, str(MEMORY)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            env=environment,
        )
        assert self.process.stdout is not None
        self.pipe: IO[bytes] = self.process.stdout
        _widen(self.pipe)
        try:
            line = self.pipe.readline() if _ready(self.pipe) else b""
            self.header: dict[str, Any] = json.loads(line) if line else {"error": _NO_FILM}
        except BaseException:
            self.__exit__()
            raise

    def __enter__(self) -> _Decoder:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.pipe.close()
        self.process.wait()

    def pictures(self) -> Iterator[Picture]:
        head = bytearray(HEAD.size)
        while _fill(self.pipe, head):
            index, t, height, width, rows, columns, damaged = HEAD.unpack(head)
            if index < 0:  # the end: what did not decode
                self.broken = height
                return
            shapes = ((height, width), (rows, columns), (rows, columns))
            y, u, v = (np.empty(shape, np.uint8) for shape in shapes)
            if not all(_fill(self.pipe, plane.data.cast("B")) for plane in (y, u, v)):
                break
            yield Picture(index, t, y, u, v, damaged)
        self.broken = 1  # it ended in the middle


_NO_FILM = "is not a film that can be decoded, or it is cut off"


def _fill(pipe: IO[bytes], room: Any) -> bool:
    """Read exactly as many bytes as there is room for; False where the pipe ends before."""
    view, done = memoryview(room), 0
    while done < len(view):
        if not _ready(pipe):
            return False
        got = pipe.readinto(view[done:])  # type: ignore[attr-defined]
        if not got:
            return False
        done += got
    return True


def _ready(pipe: IO[bytes]) -> bool:
    """Whether the decoder says something before patience ends (systems that cannot tell wait for ever)."""
    try:
        return bool(select.select([pipe], [], [], PATIENCE)[0])
    except (OSError, ValueError):  # Windows selects among sockets only
        return True


def _widen(pipe: IO[bytes]) -> None:
    try:
        import fcntl

        fcntl.fcntl(pipe.fileno(), fcntl.F_SETPIPE_SZ, PIPE)
    except (ImportError, AttributeError, OSError):
        pass  # not this system; it is only slower
