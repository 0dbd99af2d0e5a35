"""The whole way from a film to a measurement."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.measurement import DISK, Measurement, check_length

from .config import Config, settings
from .decode import Film, Picture, TrackError
from .disk import Outline
from .exposure import at_middle
from .find import COLOURS, FEWEST, sightings
from .glimpse import Glimpse
from .lens import Lens
from .look import Pose
from .loop import Known, Tracks, follow
from .noise import covariance
from .pivot import pivot as rolling
from .pivot import support
from .prepare import prepare
from .quality import quality, remarks
from .readout import readout
from .refine import LONG, Around, drop_weak
from .refine import refine as second_pass
from .result import Camera, left_the_wheels, metres, recount
from .rgb import rgb
from .scale import Scale, scale
from .survey import Survey, slowest, survey

VAGUE = 0.005  # of the disk's radius: a position known no better is not given
VAGUE_SAYS = "vague: too blurred or hidden to be placed"
GONE_SAYS = "gone: the disk has left the wheels"
CLOSE_ENOUGH = 6.0  # mm: how well the support alone tells where the contact is


@dataclass(frozen=True)
class Tracking:
    """A measurement, and what it was made from."""

    measurement: Measurement
    tracks: Tracks
    known: Known
    camera: Camera
    outline: Outline


def track(
    video: str | os.PathLike[str],
    *,
    disk_radius: float | None = None,
    mark_distance: float | None = None,
    fps: float | None = None,
    pivot: tuple[float, float] | None = None,
    refine: bool | None = None,
    config: Config | None = None,
    progress: bool = False,
) -> Measurement:
    """Measure the motion of a disk with four coloured marks in a film.

    Parameters
    ----------
    video : path
        A film by a camera at rest, showing the whole disk with square marks red, orange, blue,
        green (clockwise) near its rim.
    disk_radius : float, optional
        Radius of the disk [m], 0.08 if not given; with the marks' distance it sets the scale.
    mark_distance : float, optional
        Distance of the marks' centres from the disk's centre [m]. If not given, 65/80 of the radius where
        the film agrees with that to 1.5 %, otherwise the rim alone sets the scale.
    fps : float, optional
        Frames per second, where the film's header does not tell the truth (slow motion).
    pivot : (u, v), optional
        The contact of wheel and disk in the picture [pixels, v down]. Found from the motion if not given.
    refine : bool, optional
        Go over the film a second time, with each frame's blur known from its neighbours; so if not given.
    config : path or mapping, optional
        A TOML file (or what would stand in one) with any of the arguments above; what is given here wins.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Measurement
        ``Y, Z`` [m], ``beta`` [rad, unwrapped] at mid-exposure with standard errors and correlations,
        one row per frame; a frame that cannot be used holds NaN and says why in ``flag`` (``dup``,
        ``black``, ``damaged``, ``vague``, ``lost``, ``gone``); ``gap`` (frames are missing before it) and
        ``degraded`` are remarks. ``quality`` holds number of marks, completeness, residual, blur and
        method of each frame, ``meta`` the camera: ``px_per_m``, ``pivot_u``, ``pivot_v``, ``exposure``, ...

    Raises
    ------
    TrackError
        The file is missing, empty, not a film or too short; no marks are found; the radius is not a
        positive number; the config holds an unknown key or a value of the wrong kind.

    Notes
    -----
    The contact point comes from the rolling constraint dY/dT = Z Omega, dZ/dT = -Y Omega + W, with a
    drive of any constant velocity: a calibration that assumed no slip is never evidence about slip.

    Examples
    --------
    >>> import udd
    >>> m = udd.track("run.mp4", disk_radius=0.08)  # doctest: +SKIP
    >>> m.to_csv("run.csv")  # doctest: +SKIP
    >>> m = udd.track("run.mp4", config={"fps": 240.0, "pivot": [275, 310.5]})  # doctest: +SKIP
    """
    given = {
        "disk_radius": disk_radius,
        "mark_distance": mark_distance,
        "fps": fps,
        "pivot": pivot,
        "refine": refine,
    }
    known = settings({} if config is None else config, **given)
    return track_in_detail(video, **known, progress=progress).measurement


def track_in_detail(
    video: str | os.PathLike[str],
    *,
    disk_radius: float = 0.08,
    mark_distance: float | None = None,
    fps: float | None = None,
    pivot: tuple[float, float] | None = None,
    refine: bool = True,
    progress: bool = False,
    watch: Callable[[Glimpse], object] | None = None,
) -> Tracking:
    """As `track`, with everything that was found on the way, in pixels; `watch` is told of each frame."""
    radius = _length(disk_radius, "disk_radius")
    distance = None if mark_distance is None else _length(mark_distance, "mark_distance")
    film = Film(video, fps=fps)
    look_over = survey(film)
    sights, missing = sightings(look_over.pictures)
    seen = slowest(look_over.bursts, sights)
    if len(seen) < FEWEST:
        raise TrackError(
            f"{film.path}: no disk with marks in red, orange, blue and green (clockwise) was found: "
            f"{len(seen)} of {len(look_over.pictures)} frames looked at show all four"
        )
    if missing is not None:
        warnings.warn(
            f"{film.path}: no {COLOURS[missing]} mark is seen; the other three are used", stacklevel=3
        )
    known, rim = prepare(film, look_over, sights, seen)
    tracks = _follow(film, known, look_over.frames, progress, watch)
    centre, angle = np.array(tracks.centre), np.array(tracks.angle)
    if known.contact is None:  # else the paths were curved, and poses stand in their middle
        centre, angle = at_middle(np.array(tracks.t), centre, angle, known.exposure)
    angle, doubtful = recount(np.array(tracks.t), angle)
    tracks = replace(tracks, centre=list(centre), angle=list(angle))
    if refine:
        if known.readout.value:
            known = _timed(known, look_over, tracks)
        tracks = _again(film, known, tracks, progress)
    drop_weak(tracks)
    size = scale(known.look.places, rim, radius, distance)
    camera = _camera(tracks, known, size, pivot)
    values, sigma, rho = metres(tracks, covariance(tracks), camera)
    gone = left_the_wheels(values, radius, camera.pivot_sigma)
    for table in (values, sigma, rho):
        table[gone] = np.nan
    vague = np.hypot(sigma[:, 0], sigma[:, 1]) > VAGUE * radius
    for table in (values, sigma, rho):
        table[vague] = np.nan
    tracks.flag = [VAGUE_SAYS if v else flag for v, flag in zip(vague, tracks.flag, strict=True)]
    tracks.flag = [GONE_SAYS if g else flag for g, flag in zip(gone, tracks.flag, strict=True)]
    meta = _meta(film, look_over, tracks, known, camera, radius, doubtful)
    seen_how = quality(tracks, np.asarray(np.isfinite(values).all(axis=1)))
    tracks.flag = remarks(np.array(tracks.t), tracks.flag, seen_how, refine)
    flag = np.array(tracks.flag)
    measurement = Measurement(np.array(tracks.t), values, sigma, rho, flag, meta, DISK, seen_how)
    try:
        check_length(measurement)
    except ValueError as error:
        raise TrackError(f"{film.path}: {error}") from None
    return Tracking(measurement, tracks, known, camera, rim)


def _length(value: float, name: str) -> float:
    try:
        length = float(value)
    except (TypeError, ValueError):
        raise TrackError(f"{name} must be a number of metres, not {value!r}") from None
    if not (math.isfinite(length) and length > 0):
        raise TrackError(f"{name} must be positive and finite, not {value!r}")
    return length


def _follow(
    film: Film, known: Known, frames: int, progress: bool, watch: Callable[[Glimpse], object] | None
) -> Tracks:
    from tqdm import tqdm

    with tqdm(total=frames, unit="frame", desc=f"track {film.path.name}", disable=not progress) as bar:

        def tick(picture: Picture, pose: Pose) -> None:
            bar.update()
            if watch is not None:
                watch(Glimpse(picture, pose, known.look, frames, film.full_range))

        return follow(film.pictures(), known, tick)


def _timed(known: Known, look_over: Survey, tracks: Tracks) -> Known:
    """The readout once more, now that every frame's motion is known from its neighbours."""
    around = Around(tracks)
    frames = []
    for picture in look_over.pictures:
        here = around.at(picture.index) if picture.index < len(tracks.t) else None
        if here is not None and here.held and not tracks.flag[picture.index]:
            frames.append((picture.y, here.pose, here.motion(known.exposure)))
    again = readout(frames, known.look, known.view, around.interval)
    if not again.value:
        return known
    return replace(known, look=replace(known.look, readout=again.value), readout=again)


def _again(film: Film, known: Known, tracks: Tracks, progress: bool) -> Tracks:
    streaks = [
        s > LONG or flag.startswith("lost") for s, flag in zip(tracks.streak, tracks.flag, strict=True)
    ]
    for streaks_only in (False, True) if any(streaks) else (False,):
        if not progress:
            tracks = second_pass(film.pictures(), known, tracks, streaks_only=streaks_only)
            continue
        from tqdm import tqdm

        with tqdm(total=len(tracks.t), unit="frame", desc=f"refine {film.path.name}") as bar:
            tracks = second_pass(film.pictures(), known, tracks, lambda _: bar.update(), streaks_only)
    return tracks


def _camera(tracks: Tracks, known: Known, size: Scale, given: tuple[float, float] | None) -> Camera:
    angle, centre = np.array(tracks.angle), np.array(tracks.centre)
    good = np.isfinite(angle)
    found = rolling(np.array(tracks.t), centre, angle, good, abs(known.look.marks[0].place))
    drive = complex(np.nan, np.nan) if found is None else complex(np.conj(found.drive) / size.value)

    def camera(place: complex, sigma: float, origin: str) -> Camera:
        return Camera(size.value, size.sigma, size.origin, place, sigma, origin, drive)

    if given is not None:
        place = complex(float(given[0]), float(given[1]))
        if not np.isfinite(place):
            raise TrackError(f"pivot must be two finite numbers, not {given!r}")
        return camera(complex(known.look.lens.plane(place)), 0.0, "given")
    if found is not None:
        return camera(found.place, float(np.sqrt(found.covariance[0, 0])) / size.value, "rolling constraint")
    guess = support(known.view)
    if guess is None:
        raise TrackError(
            "the motion does not tell where the contact point is (the disk hardly turns, or turns steadily) "
            "and no support is seen: give pivot=(u, v) in pixels"
        )
    warnings.warn(
        "the motion does not tell where the contact point is; it is taken from the support, to about "
        f"{CLOSE_ENOUGH:.0f} mm",
        stacklevel=4,
    )
    return camera(complex(known.look.lens.plane(guess)), CLOSE_ENOUGH * 1e-3, "support")


def _meta(
    film: Film, look_over: Survey, tracks: Tracks, known: Known, camera: Camera, radius: float, doubtful: int
) -> dict[str, Any]:
    lost = sum(flag != "" for flag in tracks.flag)
    missing = max(0, film.promised - len(tracks.t))
    if missing or film.broken:
        warnings.warn(
            f"{film.path}: {missing or film.broken} frames are missing or do not decode; "
            "the film may be cut off",
            stacklevel=4,
        )
    return {
        "source": film.path.name,
        "R": radius,
        "fps": film.fps,
        "frames": len(tracks.t),
        "frames_missing": missing,
        "frames_lost": lost,
        "turns_doubtful": doubtful,
        "exposure": known.exposure,
        "readout": known.readout.value,
        "readout_sigma": known.readout.sigma,
        "px_per_m": camera.scale,
        "px_per_m_sigma": camera.scale_sigma,
        "px_per_m_from": camera.scale_from,
        "pivot_u": camera.pivot.real,
        "pivot_v": camera.pivot.imag,
        "pivot_sigma": camera.pivot_sigma,
        "pivot_from": camera.pivot_from,
        "drive_seen": float(camera.drive.imag),
        "drive_lean": float(np.arctan2(camera.drive.real, camera.drive.imag)),
        "marks_px": [[m.place.real, m.place.imag] for m in known.look.marks],
        "psf_px": known.look.psf,
        "lens": _numbers(known.look.lens),
    }


def _numbers(lens: Lens) -> list[float]:
    return [] if lens.plain else [lens.middle.real, lens.middle.imag, *astuple(lens)[1:]]


def pictures_at(video: str | os.PathLike[str], frames: Sequence[int]) -> list[NDArray[np.uint8]]:
    """Frames of a film by their number, as RGB arrays (height, width, 3), for drawing upon."""
    wanted = {int(i) for i in frames}
    found: dict[int, NDArray[np.uint8]] = {}
    film = Film(video)
    for picture in film.pictures():
        if picture.index in wanted:
            found[picture.index] = rgb(picture, film.full_range)
            if len(found) == len(wanted):
                break
    lost = wanted - set(found)
    if lost:
        raise TrackError(f"{video}: there is no frame {min(lost)}")
    return [found[int(i)] for i in frames]


def pictures_between(video: str | os.PathLike[str], t: NDArray[np.float64]) -> Iterator[NDArray[np.uint8]]:
    """The frames nearest to increasing times, as RGB arrays; what comes long before them is not decoded."""
    film, wanted = Film(video), iter(t.tolist())
    want = next(wanted, None)
    before: Picture | None = None
    for picture in film.pictures(float(t[0])):
        while want is not None and before is not None and picture.t > want:
            nearest = before if want - before.t < picture.t - want else picture
            yield rgb(nearest, film.full_range)
            want = next(wanted, None)
        if want is None:
            return
        before = picture
    while want is not None and before is not None:
        yield rgb(before, film.full_range)
        want = next(wanted, None)
