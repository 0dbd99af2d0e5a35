"""The process that decodes a film for `udd.video.reader` (PyAV): pictures out through a pipe.

    python -P decoder_process.py PATH MEMORY

It reads one request per line: `look`, or the time [s] of the first picture. It answers with
a line of JSON: what the header says, or an error. For a look the times of all frames follow, in ticks of the
container: as many whole numbers of 8 bytes as `stamps` says. Else each picture's head and planes follow, and
an end. Run as a script, it imports nothing but PyAV: it is there in a fifth of the time that the
package takes.
"""

from __future__ import annotations

import json
import math
import os
import re
import struct
import sys
import tempfile
from array import array
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

HEAD = struct.Struct(
    "<qdIIIII?"
)  # number, time, height, width, chroma's height and width, quarter turns, damaged
NO_FILM = "is not a film that can be decoded, or it is cut off"
LOOK = "look"
MOST_BROKEN = 200  # consecutive undecodable packets after which a film is given up
MOST_PIXELS = 1 << 26  # of a picture
#: Endings of pictures, a folder of which is a film.
IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")
#: Formats that are lists of other files, which a film that came from anywhere must not have read.
LISTS = {"concat", "dash", "hls", "imf", "lavfi", "rtsp", "sdp"}


class Refused(Exception):
    """Error with the reason why the file is no film."""


def main(path: str, memory: int) -> None:
    """Do what the standard input says, until it ends."""
    limit(memory)
    for line in sys.stdin:
        answer(path, line.strip())


def answer(path: str, request: str) -> None:
    """Look at the film, or decode it."""
    try:
        if os.path.isdir(path):
            answer_of_folder(path, request)
            return
        with opened(path) as container:
            stream = container.streams.video[0]
            said = facts(stream)
            stamps = array("q")
            if request == LOOK:
                said["packets"], outside, stamps = packets(container, stream)
                said["frames"] = max(0, said["frames"] - outside)
                said["capture_fps"] = capture_rate(container)
                said |= {"stamps": len(stamps), "tick": float(stream.time_base or 0)}
            put(json.dumps(said).encode() + b"\n")
            if request == LOOK:
                put(stamps.tobytes())
            else:
                send(container, stream, float(request))
    except Refused as error:
        put(json.dumps({"error": str(error)}).encode() + b"\n")


def answer_of_folder(path: str, request: str) -> None:
    """Look at a folder of pictures, or decode them; their times are their numbers."""
    import av

    files = images_in(path)
    if not files:
        raise Refused("is a folder without films or pictures")
    first, said = image(files[0])
    said |= {"frames": len(files), "packets": len(files), "fps": None}
    if request == LOOK:
        put(json.dumps(said | {"capture_fps": None, "stamps": 0, "tick": 0.0}).encode() + b"\n")
        return
    put(json.dumps(said).encode() + b"\n")
    broken = 0
    for number, file in enumerate(files):
        try:
            frame, damaged = image(file)[0], False
        except Refused:
            frame, damaged, broken = av.VideoFrame(first.width, first.height, "yuv420p"), True, broken + 1
        put_frame(number, float(number), frame, damaged, 0)
    put(HEAD.pack(-1, 0.0, broken, 0, 0, 0, 0, False))


def images_in(folder: str) -> list[str]:
    """Return the pictures in a folder, in the order of the numbers in their names."""
    names = [name for name in os.listdir(folder) if name.lower().endswith(IMAGES)]
    names.sort(key=lambda name: [int(x) if x.isdigit() else x for x in re.split("([0-9]+)", name)])
    return [os.path.join(folder, name) for name in names]


def image(path: str) -> tuple[Any, dict[str, Any]]:
    """Return a picture from its file, and the entries of its header."""
    import av

    try:
        with av.open(path, metadata_errors="ignore", options={"pattern_type": "none"}) as container:
            stream = container.streams.video[0]
            if stream.width * stream.height > MOST_PIXELS:
                raise Refused(
                    f"has pictures of {stream.width} x {stream.height} pixels, more than can be tracked"
                )
            said = facts(stream)
            return next(container.decode(stream)), said
    except (av.error.FFmpegError, OSError, ValueError, IndexError, StopIteration):
        raise Refused(f"holds {os.path.basename(path)}, which is not a picture that can be decoded") from None


def put(data: Any) -> None:
    """Write every byte to the standard output; a buffered output loses bytes if the process is paused."""
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(1, rest) :]


def limit(memory: int) -> None:
    """Keep the process from taking the machine's memory."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, ValueError, OSError):
        pass  # a system without such limits


def opened(path: str) -> Any:
    """Open the container, if it holds a video of a reasonable size."""
    import av

    formats = ",".join(name for name in sorted(av.formats_available) if LISTS.isdisjoint(name.split(",")))
    try:
        container = av.open(path, metadata_errors="ignore", options={"format_whitelist": formats})
    except (av.error.FFmpegError, OSError, ValueError):
        raise Refused(NO_FILM) from None
    if not container.streams.video:
        raise Refused("holds no video")
    stream = container.streams.video[0]
    if stream.width * stream.height > MOST_PIXELS:
        raise Refused(f"has pictures of {stream.width} x {stream.height} pixels, more than can be tracked")
    return container


def facts(stream: Any) -> dict[str, Any]:
    """Return the entries of the header."""
    rate = stream.average_rate or stream.guessed_rate
    pixel = stream.codec_context.pix_fmt or ""
    full = stream.codec_context.color_range == 2 or pixel.startswith(("yuvj", "rgb", "bgr", "gbr"))
    full = full and stream.codec_context.color_trc not in HDR  # which `StandardLight` makes limited
    return {
        "frames": int(stream.frames),
        "fps": float(rate) if rate else None,
        "full_range": full,
        "width": int(stream.width),
        "height": int(stream.height),
    }


def capture_rate(container: Any) -> float | None:
    """Frames per second at which an Android phone filmed in slow motion, by its tag."""
    try:
        rate = float(container.metadata.get("com.android.capture.fps", "nan"))
    except ValueError:
        return None
    return rate if 0 < rate < math.inf else None


def packets(container: Any, stream: Any) -> tuple[int, int, array[int]]:
    """Count the coded frames of the file and those outside its edit list; return also the first times.

    Times are in ticks from the first. Nothing is decoded.
    """
    import av

    count, outside, stamps, origin = 0, 0, array("q"), stream.start_time or 0
    try:
        for packet in container.demux(stream):
            if packet.size > 0 and packet.is_discard:
                outside += 1
            elif packet.size > 0 and not packet.is_corrupt:
                count += 1
                if packet.pts is not None:
                    stamps.append(packet.pts - origin)
    except av.error.FFmpegError:
        pass  # cut off in the middle of one
    return count, outside, stamps


def send(container: Any, stream: Any, since: float) -> None:
    """Write all pictures, then the end with the number of packets that did not decode."""
    broken, standard = [0], StandardLight(stream)
    for index, t, frame, damaged in pictures(container, stream, since, broken):
        turns = round((frame.rotation or 0) / 90) % 4  # phones note their orientation
        put_frame(index, t, standard(frame), damaged, turns)
    put(HEAD.pack(-1, 0.0, broken[0], 0, 0, 0, 0, False))


def put_frame(index: int, t: float, frame: Any, damaged: bool, turns: int) -> None:
    """Write one picture: its head and its planes."""
    if frame.format.name not in ("yuv420p", "yuvj420p"):
        frame = frame.reformat(format="yuv420p")
    y, u, v = frame.planes[:3]
    put(HEAD.pack(index, t, y.height, y.width, u.height, u.width, turns, damaged))
    for plane in (y, u, v):
        put(pixels(plane))


def pixels(plane: Any) -> memoryview | bytearray:
    """Return a plane's rows, without their padding in memory."""
    rows = memoryview(plane)
    if plane.line_size == plane.width:
        return rows[: plane.width * plane.height]
    out = bytearray()
    for k in range(plane.height):
        out += rows[k * plane.line_size : k * plane.line_size + plane.width]
    return out


def pictures(
    container: Any, stream: Any, since: float, broken: list[int]
) -> Iterator[tuple[int, float, Any, bool]]:
    """Yield all frames that decode, in order of presentation, with increasing times."""
    import av

    rate = stream.average_rate or stream.guessed_rate
    fps = float(rate) if rate else math.nan
    index, last, row, damaged = 0, -math.inf, 0, False
    origin = stream.start_time or 0
    if since > 0 and stream.time_base:
        container.seek(origin + int(since / stream.time_base), stream=stream)
    packets, fields = container.demux(stream), Fields(stream)
    while row < MOST_BROKEN:
        try:
            packet = next(packets)
            frames = packet.decode()
            row = 0
        except StopIteration:
            return
        except av.error.FFmpegError:
            broken[0], row, damaged = broken[0] + 1, row + 1, True
            continue
        for frame in fields(frames):
            wrong = bool(frame.is_corrupt or packet.is_corrupt)
            # frames are coded as changes: after a broken one all are wrong up to the next whole one
            damaged = wrong or (damaged and not frame.key_frame)
            if frame.pts is None or frame.time_base is None:
                t = index / fps
            else:
                t = float((frame.pts - origin) * frame.time_base)
            if not t > last or frame.width * frame.height > MOST_PIXELS:
                broken[0] += 1  # a time stamp that stands still carries no new instant
                continue
            broken[0] += wrong
            yield index, t, frame, damaged
            index, last = index + 1, t


class Fields:
    """Frames as they are; of interlaced ones each half by itself, its missing rows filled in by bwdif.

    The rows of such a frame are of two instants, half a frame apart: a moving disk is a comb.
    """

    def __init__(self, stream: Any) -> None:
        self.stream = stream
        self.graph: Any = None

    def __call__(self, frames: list[Any]) -> Iterator[Any]:
        """Yield the pictures of a packet in order; the last half frame of a film stays in the filter."""
        import av

        for frame in frames:
            if self.graph is None and not frame.interlaced_frame:
                yield frame
                continue
            if self.graph is None:
                self.graph = av.filter.Graph()
                source = self.graph.add_buffer(template=self.stream)
                halves = self.graph.add("bwdif", "mode=send_field:parity=auto:deint=interlaced")
                source.link_to(halves)
                halves.link_to(self.graph.add("buffersink"))
                self.graph.configure()
            self.graph.push(frame)
            while True:
                try:
                    yield self.graph.pull()
                except (av.error.BlockingIOError, av.error.EOFError):
                    break


class StandardLight:
    """Frames with the light of a standard screen: those of HDR films (PQ, HLG) are mapped to sRGB.

    The same code is another amount of light there, and the primaries of BT.2020 make colours paler.
    """

    def __init__(self, stream: Any) -> None:
        self.stream = stream
        self.light = HDR.get(stream.codec_context.color_trc)
        self.graph: Any = None

    def __call__(self, frame: Any) -> Any:
        """Return the frame, mapped if the film is HDR."""
        if self.light is None:
            return frame
        if self.graph is None:
            self.graph = self._graph(self.light)
        self.graph.push(frame)
        return self.graph.pull()

    def _graph(self, light: Callable[[float], float]) -> Any:
        import av

        graph = av.filter.Graph()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "light.cube")
            with open(path, "w", encoding="ascii") as file:
                file.write(light_cube(light))
            steps = [
                graph.add_buffer(template=self.stream),
                graph.add("scale", in_color_matrix="bt2020"),
                graph.add("format", pix_fmts="gbrp10le"),
                graph.add("lut3d", file=path),
                graph.add("scale", out_color_matrix="bt601", out_range="tv"),
                graph.add("format", pix_fmts="yuv420p"),
                graph.add("buffersink"),
            ]
            for a, b in pairwise(steps):
                a.link_to(b)
            graph.configure()
        return graph


def light_of_pq(code: float) -> float:
    """Return the light of a PQ code from 0 to 1 (SMPTE ST 2084); 1 is diffuse white, 203 cd/m^2 (BT.2408)."""
    root = code ** (32 / 2523)
    power = max(root - 107 / 128, 0.0) / (2413 / 128 - 2392 / 128 * root)
    return 10000 / 203 * math.pow(power, 8192 / 1305)


def light_of_hlg(code: float) -> float:
    """Return the light of an HLG code from 0 to 1 (BT.2100); 1 is diffuse white, code 0.75 (BT.2408)."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    scene = code * code / 3 if code <= 0.5 else (math.exp((code - c) / a) + b) / 12
    return scene / 0.26496256


#: Curves of HDR films by their number in the header (ITU-T H.273).
HDR = {16: light_of_pq, 18: light_of_hlg}
#: From the primaries of BT.2020 to those of BT.709 (BT.2087).
NARROWER = ((1.6605, -0.5876, -0.0728), (-0.1246, 1.1329, -0.0083), (-0.0182, -0.1006, 1.1187))
CUBE = 33  # codes of each colour in the table


def light_cube(light: Callable[[float], float]) -> str:
    """Return a table (.cube) from codes of BT.2020 with this curve to sRGB."""
    codes = [light(k / (CUBE - 1)) for k in range(CUBE)]
    rows = [f"LUT_3D_SIZE {CUBE}"]
    for blue in codes:
        for green in codes:
            for red in codes:
                rows.append(" ".join(f"{srgb(r * red + g * green + b * blue):.5f}" for r, g, b in NARROWER))
    return "\n".join(rows) + "\n"


def srgb(light: float) -> float:
    """Return the sRGB code (IEC 61966-2-1), from 0 to 1, of an amount of light."""
    x = min(max(light, 0.0), 1.0)
    return 12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
