"""Films as pictures with their true presentation times (PyAV)."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

Plane = NDArray[np.uint8]
MOST_BROKEN = 200  # consecutive undecodable packets after which a film is given up


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
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if not self.path.exists():
            raise TrackError(f"{self.path}: there is no such file")
        if self.path.is_dir():
            raise TrackError(f"{self.path} is a folder, not a film")
        if self.path.stat().st_size == 0:
            raise TrackError(f"{self.path}: the file is empty")
        self.broken = 0  # packets that did not decode in the last run
        with self._open() as container:
            stream = container.streams.video[0]
            self.promised = int(stream.frames)  # 0 where the container does not say
            self.size = (int(stream.codec_context.width), int(stream.codec_context.height))
            rate = stream.average_rate or stream.guessed_rate
            self.fps = float(rate) if rate else math.nan
            pixel = stream.codec_context.pix_fmt or ""
            self.full_range = stream.codec_context.color_range == 2 or pixel.startswith(
                ("yuvj", "rgb", "bgr", "gbr")
            )
            self.light = light_of_codes(self.full_range)  # of each brightness code

    def _open(self) -> Any:
        import av

        try:
            container = av.open(str(self.path), metadata_errors="ignore")
        except (av.error.FFmpegError, OSError, ValueError):
            raise TrackError(f"{self.path} is not a film that can be decoded, or it is cut off") from None
        if not container.streams.video:
            container.close()
            raise TrackError(f"{self.path} holds no video")
        return container

    def packets(self) -> int:
        """Count the coded frames that the file holds, without decoding any."""
        import av

        count = 0
        with self._open() as container:
            try:
                for packet in container.demux(container.streams.video[0]):
                    count += packet.size > 0 and not packet.is_corrupt
            except av.error.FFmpegError:
                pass  # cut off in the middle of one
        return count

    def pictures(self, since: float = 0.0) -> Iterator[Picture]:
        """All frames that decode, in order of presentation, with increasing times.

        Those from the last key frame up to `since` [s] on, where it is above 0; they are numbered from it.
        """
        import av

        self.broken = 0
        index, last, row, damaged = 0, -math.inf, 0, False
        with self._open() as container:
            stream = container.streams.video[0]
            origin = stream.start_time or 0
            if since > 0 and stream.time_base:
                container.seek(origin + int(since / stream.time_base), stream=stream)
            packets = container.demux(stream)
            while row < MOST_BROKEN:
                try:
                    packet = next(packets)
                    frames = packet.decode()
                    row = 0
                except StopIteration:
                    return
                except av.error.FFmpegError:
                    self.broken, row, damaged = self.broken + 1, row + 1, True
                    continue
                for frame in frames:
                    broken = bool(frame.is_corrupt or packet.is_corrupt)
                    # frames are coded as changes: after a broken one all are wrong up to the next whole one
                    damaged = broken or (damaged and not frame.key_frame)
                    if frame.pts is None or frame.time_base is None:
                        t = index / self.fps
                    else:
                        t = float((frame.pts - origin) * frame.time_base)
                    if not t > last:  # a time stamp that stands still carries no new instant
                        self.broken += 1
                        continue
                    self.broken += broken
                    yield _picture(frame, index, t, damaged)
                    index, last = index + 1, t


def _picture(frame: Any, index: int, t: float, damaged: bool) -> Picture:
    if frame.format.name not in ("yuv420p", "yuvj420p"):
        frame = frame.reformat(format="yuv420p")
    planes = []
    for plane in frame.planes[:3]:
        pixels = np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)
        planes.append(pixels[: plane.height, : plane.width].copy())
    turns = round((frame.rotation or 0) / 90) % 4  # phones note how they were held
    if turns:
        planes = [np.ascontiguousarray(np.rot90(p, turns)) for p in planes]
    return Picture(index, t, planes[0], planes[1], planes[2], damaged)
