"""Pictures to a film file, with one exact time stamp per frame."""

from __future__ import annotations

import os
from collections.abc import Iterable
from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._util.atomic_files import replacing
from udd.errors import UddError

SUFFIXES = (".mp4", ".mov")
CODECS = ("h264", "hevc", "mp4v")


def require_video() -> Any:
    """Return PyAV, or say in one sentence about how to get what films need."""
    try:
        import av
        import cv2  # noqa: F401
    except ImportError as error:
        raise UddError(f"films need the extra 'track' ({error}): pip install 'udd[track]'") from None
    return av


def checked_path(path: str | os.PathLike[str]) -> Path:
    """Return the path, if a film can be written there."""
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise UddError(f"a film's name must end in {' or '.join(SUFFIXES)}, got '{target.name}'")
    if not target.parent.is_dir():
        raise UddError(f"cannot write the film {target}: there is no folder {target.parent}")
    if target.is_dir():
        raise UddError(f"cannot write the film {target}: it is a folder")
    if not os.access(target.parent, os.W_OK):
        raise UddError(f"cannot write the film {target}: the folder {target.parent} is not writable")
    return target


def write_film(
    target: Path,
    frames: Iterable[NDArray[np.uint8]],
    size: tuple[int, int],
    rate: Fraction,
    quality: float,
    codec: str = "h264",
    numbers: Iterable[int] | None = None,
    ticks: int = 1,
) -> None:
    """Encode RGB frames (height, width, 3) and put the film in place; a failed one leaves nothing.

    Frame k of them has the time stamp numbers[k] / (rate ticks), without `numbers` k / rate.
    """
    try:
        with replacing(target, target.suffix.lower()) as name:
            if codec == "mp4v":
                _encode_as_opencv(name, frames, size, rate)
            else:
                stamps = count(0, ticks) if numbers is None else numbers
                _encode(name, frames, stamps, size, rate, quality, codec, ticks)
    except OSError as error:
        raise UddError(f"cannot write the film {target}: {error.strerror or error}") from None


def _encode(
    name: str,
    frames: Iterable[NDArray[np.uint8]],
    numbers: Iterable[int],
    size: tuple[int, int],
    rate: Fraction,
    quality: float,
    codec: str,
    ticks: int,
) -> None:
    av = require_video()
    with av.open(name, "w", options={"movflags": "+faststart"}) as container:
        stream = _stream(container, rate, quality, codec)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        stream.time_base = stream.codec_context.time_base = 1 / (rate * ticks)
        # one thread: x264's choices depend on their number, and the same call must give the same film
        stream.codec_context.thread_count = 1
        for number, picture in zip(numbers, frames, strict=False):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = number, 1 / (rate * ticks)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def _encode_as_opencv(
    name: str, frames: Iterable[NDArray[np.uint8]], size: tuple[int, int], rate: Fraction
) -> None:
    import cv2

    writer = cv2.VideoWriter(name, cv2.VideoWriter.fourcc(*"mp4v"), float(rate), size)
    if not writer.isOpened():
        raise UddError("this OpenCV cannot write MPEG-4 films")
    try:
        for picture in frames:
            writer.write(np.ascontiguousarray(picture[..., ::-1]))
    finally:
        writer.release()


def _stream(container: Any, rate: Fraction, quality: float, codec: str) -> Any:
    """H.264 where the library has it, else MPEG-4; without B-frames, so that stored and shown order agree."""
    from av.codec.codec import UnknownCodecError

    if codec == "hevc":
        try:
            options = {"crf": f"{quality:g}", "preset": "veryfast", "x265-params": "bframes=0:log-level=none"}
            return container.add_stream("libx265", rate=rate, options=options)
        except UnknownCodecError:
            raise UddError("this PyAV cannot write HEVC films") from None
    try:
        # With its macroblock tree x264 looks at memory that it never wrote: one film in fifty came out with
        # other bytes.
        options = {"crf": f"{quality:g}", "preset": "veryfast", "bf": "0", "x264-params": "mbtree=0"}
        return container.add_stream("libx264", rate=rate, options=options)
    except UnknownCodecError:
        # MPEG-4's quantiser runs from 1 to 31 where H.264's quality runs from 0 to 51
        q = f"{min(max(quality / 5, 1), 31):g}"
        return container.add_stream("mpeg4", rate=rate, options={"qmin": q, "qmax": q, "bf": "0"})
