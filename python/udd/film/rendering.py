"""`udd.render`: a film of a simulated run."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.keywords import renamed, with_defaults
from udd._util.memory import require_memory
from udd._util.one_line import link_to
from udd._util.progress import Progress, progress_bar
from udd._util.random_generator import Rng, generator
from udd.errors import UddError
from udd.measurement import Measurement
from udd.video.writer import CODECS, checked_path, require_video, write_film

from .camera import CAMERA_OPTIONS, Camera, CameraOptions, make_camera
from .defects import Defects, hung, real_times, with_poster
from .exposure import Scene
from .light import Noise, Picture, to_light
from .motion import Array, Motion, TrajectoryLike, checked, motion_of, spacing_error, then_falling
from .processing import Denoiser, converter
from .scene import room
from .sprite import Patch

# Farther off than this between the samples, a mark would be seen in the wrong place.
_COARSE = 0.25  # pixels


@dataclass(frozen=True, repr=False)
class Film(Drawable):
    """Rendered film, with the motion that it shows.

    Attributes
    ----------
    path : Path
        The film file.
    t : ndarray, shape (n,)
        Time of the middle of each frame's exposure, s. For frame k it is k / fps. The file has the same time
        stamps, unless a defect (`clock`, `flat`, `copied`) changes the clock.
    state : ndarray, shape (n, 4)
        [Omega, Y, Z, beta] of the disk in the middle of each exposure, rad/s, m, m, rad.
    held : ndarray of bool, shape (n,)
        True if the wheels hold the disk. Otherwise it falls freely.
    size : (int, int)
        Width and height of the picture, in pixels.
    scale : float
        Pixels per metre.
    pivot : (float, float)
        Pixel (x, y) at which the wheels hold the disk; the centre of the top left pixel is (0, 0).
    radius : float
        Radius of the disk, m.

    See Also
    --------
    udd.render : makes it.
    udd.track : measures it.
    udd.plot.overlay : draw the fitted disk into a frame.
    """

    path: Path
    t: NDArray[np.float64]
    state: NDArray[np.float64]
    held: NDArray[np.bool_]
    size: tuple[int, int]
    scale: float
    pivot: tuple[float, float]
    radius: float

    def __repr__(self) -> str:
        lasts = f", {self.t[-1] - self.t[0]:.4g} s" if len(self.t) else ""
        width, height = self.size
        return f"<Film {self.path}: {len(self.t)} frames{lasts}, {width} x {height} pixels>"

    def _repr_html_(self) -> str:
        return link_to(self.path, repr(self)[1:-1].rpartition(": ")[2])

    @property
    def truth(self) -> Measurement:
        """The measurement of a perfect tracker: Y, Z, beta in the middle of each exposure."""
        new = np.diff(self.t, prepend=-np.inf) > 0  # without copies
        values = np.where(self.held[:, None], self.state[:, 1:], np.nan)
        return Measurement(self.t[new], values[new], meta={"R": self.radius, "source": self.path.name})


@renamed(seed="rng")
@checked_arguments
def render(
    trajectory: TrajectoryLike,
    path: str | os.PathLike[str],
    *,
    support: float = 1.0,
    background: ArrayLike | None = None,
    noise: float = 2.0,
    quality: float = 20.0,
    codec: str = "h264",
    defects: Defects | None = None,
    layout: Sequence[Mapping[str, Any]] | None = None,
    rng: Rng = 0,
    progress: bool | Callable[[str], object] | None = None,
    **camera: Unpack[CameraOptions],
) -> Film:
    """Render a simulated run as a film, as a camera in front of the device would see it.

    A white disk with four square marks (side R/5, centres 65/80 R from the disk's centre; clockwise red,
    orange, blue, green, with red at the angle beta) hangs between two wheels, before a wall. The support is
    in front: it hides the middle of the disk and sometimes a mark. Each frame is the average, in
    linear light, of as many sub-frames as the exposure needs for smooth streaks. Frame k is exposed
    symmetrically about ``trajectory.t[0] + k / fps``. The exposure of the last frame ends within the run, so
    a disk that loses contact is filmed until then.

    Parameters
    ----------
    trajectory : Trajectory
        A run of the disk, from `udd.simulate`: times `t` (n,) in s and `state` (n, 4), [Omega, Y, Z, beta].
        Between the samples the motion is the dense output, if the run has one. Otherwise it is a cubic, with
        the rates of the model if the trajectory has a model. Samples too far apart for a cubic are refused.
    path : path-like
        File to write, ``.mp4`` or ``.mov``. An older film is replaced once the new one is complete.
    support : float
        Width of the black support relative to the real one (26 mm for R = 0.08 m). With 0 the disk is filmed
        alone.
    background : array_like, optional
        Background: a picture (height, width, 3) of codes 0 to 255 in red, green, blue, or a colour (3,). The
        default is a grey wall and a table.
    noise : float
        Standard deviation of the sensor noise, in codes of 255.
    quality : float
        H.264's constant rate factor: 20 is good, and 35 is poor. With 0 only the coarser grid of the colours
        loses information.
    codec : str
        ``"h264"``, ``"hevc"``, or ``"mp4v"`` for MPEG-4 as OpenCV's ``VideoWriter`` writes it (without a
        choice of quality).
    defects : udd.film.Defects, optional
        Defects of scene and camera, such as clutter, an oblique camera, a rolling shutter, uneven light or
        dropped frames. By default there are none.
    layout : sequence of mappings, optional
        Square marks instead of the four: ``{"at": [y, z], "colour": "red"}`` or ``{"at": [y, z], "tag":
        "4x4_50:7"}`` as for `udd.track`, with ``"side"`` in m (R/5 if not given).
        Sides are upright at beta = 0.
    rng : int, Generator or None
        Random generator of the noise. The same whole number gives the same film; None takes fresh entropy.
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. By default a
        bar shows after 2 s in a terminal or a notebook.
    **camera
        ``fps`` (25), frames per second; ``exposure`` (0.010), the time in s for which the shutter is open,
        at most ``1 / fps``; ``size`` ((550, 700)), width and height of the picture in pixels, both even;
        ``scale``, pixels per metre, by default 1750 for R = 0.08 m and the paper's 550 x 700 pixels, and in
        proportion; ``pivot``, the pixel (x, y) of the point where the wheels hold the disk, by default
        (275, 330) of 550 x 700, where the centre of the top left pixel is (0, 0); ``tilt`` (0), the angle
        in rad by which the camera shows everything turned clockwise.

    Returns
    -------
    Film
        The file's path and, as the truth to compare with, time and state of the disk per frame.

    Raises
    ------
    UddError
        The trajectory is empty, not finite or too coarsely sampled. A value is out of its range, such as an
        exposure longer than a frame. The file cannot be written, or the extra ``track`` is not installed.
        Nothing is left behind then.

    See Also
    --------
    udd.track : measures the film.
    udd.film.Defects : faults of scene and camera.
    udd.plot.overlay : draw the fitted disk into a frame.

    Examples
    --------
    >>> import numpy as np, udd
    >>> t = np.arange(0, 10, 0.005)
    >>> run = udd.simulate(udd.Disk(W=0.039), t, [0.0, 1e-3, 0.04, 0.0])  # doctest: +SKIP
    >>> film = udd.render(run, "disk.mp4")  # doctest: +SKIP
    >>> film.t[1]  # doctest: +SKIP
    0.04
    """
    require_video()
    target = checked_path(path)
    t, _ = checked(trajectory)
    radius = float(getattr(getattr(trajectory, "model", None), "R", 0.08))
    defects = Defects() if defects is None else defects
    view = make_camera(radius, with_defaults("render", CAMERA_OPTIONS, camera))
    _check_rest(support, noise, quality)
    random = generator(rng)
    if codec not in CODECS:
        raise UddError(f"codec must be one of {', '.join(CODECS)}, got {codec!r}")
    if codec == "mp4v" and defects.dropped and not defects.flat:
        raise UddError("codec mp4v has frames at even times; use another one for a film with dropped frames")
    motion = motion_of(trajectory)
    if defects.after:
        motion = then_falling(motion, float(t[-1]))
    error = spacing_error(trajectory, radius) * view.scale
    if error > _COARSE:
        raise UddError(
            "the trajectory's samples are too far apart to film: "
            f"a mark would be off by about {error:.2g} pixels; "
            "simulate more times (200 per second are plenty) or with dense=True"
        )
    stamps = frame_times(t, view, defects.after)
    camera_rate = defects.blended or defects.copied
    last = float(t[-1] - t[0]) + defects.after - view.exposure / 2
    if camera_rate:  # a mixture needs the frame after it
        last = math.floor(last * camera_rate + 1e-6) / camera_rate
    stamps = stamps[real_times(stamps, defects.clock) <= last + 1e-6]
    numbers = np.setdiff1d(np.arange(len(stamps)), np.asarray(defects.dropped, dtype=int))
    wall = _background(background, view, radius)
    if defects.clutter:
        wall = hung(wall, view, defects.clutter, radius / 0.08)
    if defects.poster:
        wall = with_poster(wall, view, defects)
    scene = Scene(view, radius, wall, support, defects, _patches(layout, radius))
    upright = defects.turned % 2 == 0
    real = real_times(stamps, defects.clock)
    if defects.copied:  # of each picture that is shown
        stamps_shown = np.floor(stamps * defects.copied + 0.5 - 1e-9) / defects.copied
        real = real_times(stamps_shown, defects.clock)
    shown = t[0] + real
    write_film(
        target,
        _frames(scene, motion, shown, t[0] + stamps, numbers, defects, Noise(noise, random), progress),
        view.size if upright else view.size[::-1],
        view.rate,
        quality,
        codec,
        None if defects.flat else numbers.tolist(),
    )
    times = real[numbers]
    on_wheels = shown[numbers] <= t[-1]
    state = motion(shown[numbers])
    return Film(target, times, state, on_wheels, view.size, view.scale, view.pivot, radius)


def frame_times(t: Array, camera: Camera, after: float = 0.0) -> Array:
    """Stamp the frames that fit, k / fps; what is missing by rounding alone does not count."""
    n = math.floor((t[-1] + after - t[0] - camera.exposure / 2) * camera.rate + 1e-6) + 1
    if n < 1:
        raise UddError(f"the trajectory lasts {t[-1] - t[0]:.3g} s, which is shorter than one exposure")
    require_memory(f"the stamps of {n} frames", n, itemsize=32)
    return np.arange(n) / float(camera.rate)


def _frames(
    scene: Scene,
    motion: Motion,
    times: Array,
    stamps: Array,
    numbers: NDArray[np.intp],
    defects: Defects,
    noise: Noise,
    progress: Progress,
) -> Iterator[NDArray[np.uint8]]:
    denoise = Denoiser(defects.denoise)

    def take(time: float, stamp: float) -> NDArray[np.uint8]:
        return denoise(noise.on(scene.expose(motion, time, stamp)))

    start = float(stamps[0])

    def take_at_camera_rate(number: int) -> NDArray[np.uint8]:
        stamp = number / (defects.blended or defects.copied)
        return take(start + float(real_times(np.array([stamp]), defects.clock)[0]), start + stamp)

    convert = converter(take_at_camera_rate, defects)
    last: NDArray[np.uint8] | None = None
    with progress_bar(len(numbers), "frame", progress, title="film") as bar:
        for number in numbers.tolist():
            if number not in defects.repeated or last is None:
                time, stamp = float(times[number]), float(stamps[number])
                last = take(time, stamp) if convert is None else convert.at(stamp - start)
                if defects.mirrored:
                    last = np.ascontiguousarray(last[:, ::-1])
                if defects.turned:
                    last = np.ascontiguousarray(np.rot90(last, -defects.turned))
            yield np.zeros_like(last) if number in defects.black else last
            bar.update()


def _patches(layout: Sequence[Mapping[str, Any]] | None, radius: float) -> list[Patch] | None:
    """Return the marks of a layout as patches in units of the disk's radius."""
    if layout is None:
        return None
    from udd.markers.layout import read_layout
    from udd.markers.tags import cells_of, is_tags, read_tags

    side = radius / 5
    if is_tags(layout):
        tags = read_tags(layout)
        return [
            Patch((t.at.real / radius, -t.at.imag / radius), t.side / radius, tag=cells_of(t)) for t in tags
        ]
    marks = read_layout([{key: value for key, value in mark.items() if key != "side"} for mark in layout])
    return [
        Patch((at.real / radius, -at.imag / radius), float(mark.get("side", side)) / radius, colour)
        for at, colour, mark in zip(marks.places, marks.colours, layout, strict=True)
    ]


def _background(background: ArrayLike | None, camera: Camera, radius: float) -> Picture:
    if background is None:
        return room(camera, radius / 0.08)
    width, height = camera.size
    codes = np.asarray(background, dtype=np.float64)
    if (
        codes.shape not in ((3,), (height, width, 3))
        or not (np.isfinite(codes) & (codes >= 0) & (codes <= 255)).all()
    ):
        raise UddError(
            f"background must be one colour (3,) or a picture ({height}, {width}, 3) of codes 0 to 255, "
            f"got shape {codes.shape}"
        )
    return np.ascontiguousarray(np.broadcast_to(to_light(codes), (height, width, 3)))


def _check_rest(support: float, noise: float, quality: float) -> None:
    for name, value, top in (("support", support, 10.0), ("noise", noise, 100.0), ("quality", quality, 51.0)):
        if not (math.isfinite(value) and 0 <= value <= top):
            raise UddError(f"{name} must be from 0 to {top:g}, got {value!r}")
