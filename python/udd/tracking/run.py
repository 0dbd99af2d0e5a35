"""The whole way from a film to a measurement."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.measurement import DISK, Measurement, check_length

from .acquire import colours_of
from .decode import Film, Picture, TrackError
from .disk import Outline, outline
from .exposure import at_middle, exposure
from .find import BODY, Sight, sightings
from .learn import first_look, places, refine
from .lens import Lens, calibrate
from .loop import Known, Tracks, follow
from .marks import MISFIT, Motion
from .noise import covariance
from .occluder import visible
from .pivot import Contact, rough_contact, support
from .pivot import pivot as rolling
from .pose import Look, Pose, align
from .result import Camera, metres
from .survey import Moving, Survey, moving, repeats_last, slowest, survey

FEWEST_SIGHTS = 3  # survey frames that must show all four marks
SHARP = 60  # slow frames from which the rim is measured
LENS_ROUNDS = 3  # the second and third time, marks are measured without the first's distortion
RIM_SMEAR = 3.0  # pixels by which lens and compression blur the rim
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
    disk_radius: float = 0.08,
    pivot: tuple[float, float] | None = None,
    progress: bool = False,
) -> Measurement:
    """Measure the motion of a disk with four coloured marks in a film.

    Parameters
    ----------
    video : path
        A film by a camera at rest, showing the whole disk with square marks red, orange, blue,
        green (clockwise) near its rim.
    disk_radius : float
        Radius of the disk [m]; it sets the scale.
    pivot : (u, v), optional
        The contact of wheel and disk in the picture [pixels, v down]. Found from the motion if not given.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Measurement
        ``Y, Z`` [m], ``beta`` [rad, unwrapped] at mid-exposure with standard errors and correlations,
        one row per frame; a frame that cannot be used holds NaN and says why in ``flag``. ``meta``
        holds the camera: ``px_per_m``, ``pivot_u``, ``pivot_v``, ``exposure``, ...

    Raises
    ------
    TrackError
        The file is missing, empty, not a film or too short; no marks are found; the radius is not a
        positive number.

    Notes
    -----
    The contact point comes from the rolling constraint dY/dT = Z Omega, dZ/dT = -Y Omega + W, with a
    drive of any constant velocity: a calibration that assumed no slip is never evidence about slip.

    Examples
    --------
    >>> import udd
    >>> m = udd.track("run.mp4", disk_radius=0.08)  # doctest: +SKIP
    >>> m.to_csv("run.csv")  # doctest: +SKIP
    """
    return track_in_detail(video, disk_radius=disk_radius, pivot=pivot, progress=progress).measurement


def track_in_detail(
    video: str | os.PathLike[str],
    *,
    disk_radius: float = 0.08,
    pivot: tuple[float, float] | None = None,
    progress: bool = False,
) -> Tracking:
    """As `track`, with everything that was found on the way, in pixels."""
    try:
        radius = float(disk_radius)
    except (TypeError, ValueError):
        raise TrackError(f"disk_radius must be a number of metres, not {disk_radius!r}") from None
    if not (math.isfinite(radius) and radius > 0):
        raise TrackError(f"disk_radius must be positive and finite, not {disk_radius!r}")
    film = Film(video)
    look_over = survey(film)
    sights = sightings(look_over.pictures)
    seen = slowest(look_over.bursts, sights)
    if len(seen) < FEWEST_SIGHTS:
        raise TrackError(
            f"{film.path}: no disk with marks in red, orange, blue and green (clockwise) was found: "
            f"{len(seen)} of {len(look_over.pictures)} frames looked at show all four"
        )
    known, rim = _prepare(film, look_over, sights, seen)
    tracks = _follow(film, known, look_over.frames, progress)
    centre, angle = at_middle(
        np.array(tracks.t), np.array(tracks.centre), np.array(tracks.angle), known.exposure
    )
    tracks = replace(tracks, centre=list(centre), angle=list(angle))
    camera = _camera(tracks, known, rim, radius, pivot)
    spread = covariance(tracks)
    values, sigma, rho = metres(tracks, spread, camera)
    meta = _meta(film, look_over, tracks, known, rim, camera, radius)
    measurement = Measurement(np.array(tracks.t), values, sigma, rho, np.array(tracks.flag), meta, DISK)
    try:
        check_length(measurement)
    except ValueError as error:
        raise TrackError(f"{film.path}: {error}") from None
    return Tracking(measurement, tracks, known, camera, rim)


def _prepare(
    film: Film, look_over: Survey, sights: list[Sight | None], seen: list[tuple[Picture, Sight]]
) -> tuple[Known, Outline]:
    view, white = visible(seen)
    look = first_look(seen, view, white, film.light)
    look = refine(look, [(p.y, Pose(s.centre, s.angle), Motion()) for p, s in seen], view)
    # a second time with frames whose speed is known, hence their blur
    in_motion = moving(look_over.bursts, sights)
    open_for = exposure(in_motion, look, view)
    in_motion.sort(key=lambda m: abs(m.rate) + abs(m.turning) * m.sight.reach)
    in_motion = repeats_last(in_motion, [m.sight for m in in_motion])
    frames = [
        (m.picture.y, Pose(m.sight.centre, m.sight.angle), Motion(m.rate * open_for, m.turning * open_for))
        for m in in_motion
    ]
    for _ in range(LENS_ROUNDS):
        lens = calibrate(places(look, frames, view), view.shape)
        if lens is None:
            break
        look = replace(look, lens=lens)
        for (_, pose, _), m in zip(frames, in_motion, strict=True):
            pose.centre, pose.angle = _in_plane(lens, m.sight)
        look = refine(look, frames, view)
    else:
        frames = frames[:0]
    if len(frames) >= FEWEST_SIGHTS:
        look = refine(look, frames, view, 2)
    sharp: list[tuple[Picture, Pose]] = []
    for picture, sight in seen[:SHARP]:
        pose = Pose(*_in_plane(look.lens, sight))
        if align(picture.y, view, look, pose, Motion(), [0.5, *[MISFIT] * 4], gain_slack=0.3) is not None:
            sharp.append((picture, pose))
    if not sharp:
        raise TrackError(f"{film.path}: the marks are found but never sharp enough to be measured")
    try:
        rim = outline(sharp, look, view)
    except TrackError as error:
        raise TrackError(f"{film.path}: {error}") from None
    colours = colours_of([p for p, _ in sharp], [q for _, q in sharp], look, view)
    look = replace(_centred(look, rim.centre), rim=rim.radius - RIM_SMEAR)
    return Known(look, view, colours, open_for, white, _contact(in_motion, look)), rim


def _contact(in_motion: list[Moving], look: Look) -> Contact | None:
    before, after, turn, dt = (np.array(x) for x in zip(*(m.step for m in in_motion), strict=True)) if in_motion else [np.empty(0)] * 4
    return rough_contact(look.lens.plane(before), look.lens.plane(after), turn, dt, abs(look.marks[0].place))


def _in_plane(lens: Lens, sight: Sight) -> tuple[complex, float]:
    """A sight in the picture as a pose in the plane of the disk."""
    arms = BODY * sight.reach * np.exp(1j * sight.angle)
    marks = lens.plane(sight.centre + arms)
    turn = float(np.angle(np.vdot(arms, marks - marks.mean())))
    return complex(marks.mean()), sight.angle + turn


def _centred(look: Look, centre: complex) -> Look:
    """Marks as seen from the disk's own centre, red exactly at beta."""
    red = look.marks[0].place - centre
    turn = red / abs(red) * 1j
    marks = [
        replace(m, place=(m.place - centre) / turn, turn=m.turn - float(np.angle(turn))) for m in look.marks
    ]
    return replace(look, marks=marks)


def _follow(film: Film, known: Known, frames: int, progress: bool) -> Tracks:
    if not progress:
        return follow(film.pictures(), known)
    from tqdm import tqdm

    with tqdm(total=frames, unit="frame", desc=f"track {film.path.name}") as bar:
        return follow(film.pictures(), known, lambda _: bar.update())


def _camera(
    tracks: Tracks, known: Known, rim: Outline, radius: float, given: tuple[float, float] | None
) -> Camera:
    scale = rim.radius / radius
    angle, centre = np.array(tracks.angle), np.array(tracks.centre)
    good = np.isfinite(angle)
    found = rolling(np.array(tracks.t), centre, angle, good, abs(known.look.marks[0].place))
    drive = complex(np.nan, np.nan) if found is None else np.conj(found.drive) / scale
    common = {"scale": scale, "scale_sigma": rim.sigma / radius, "drive": drive}
    if given is not None:
        place = complex(float(given[0]), float(given[1]))
        if not np.isfinite(place):
            raise TrackError(f"pivot must be two finite numbers, not {given!r}")
        return Camera(pivot=place, pivot_sigma=0.0, pivot_from="given", **common)
    if found is not None:
        sigma = float(np.sqrt(found.covariance[0, 0])) / scale
        return Camera(pivot=found.place, pivot_sigma=sigma, pivot_from="rolling constraint", **common)
    place_or_none = support(known.view)
    if place_or_none is None:
        raise TrackError(
            "the motion does not tell where the contact point is (the disk hardly turns, or turns steadily) "
            "and no support is seen: give pivot=(u, v) in pixels"
        )
    warnings.warn(
        "the motion does not tell where the contact point is; it is taken from the support, to about "
        f"{CLOSE_ENOUGH:.0f} mm",
        stacklevel=4,
    )
    return Camera(pivot=place_or_none, pivot_sigma=CLOSE_ENOUGH * 1e-3, pivot_from="support", **common)


def _meta(
    film: Film, look_over: Survey, tracks: Tracks, known: Known, rim: Outline, camera: Camera, radius: float
) -> dict[str, Any]:
    lost = sum(flag != "" for flag in tracks.flag)
    missing = max(0, film.promised - len(tracks.t))
    if missing or film.broken:
        warnings.warn(
            f"{film.path}: {missing or film.broken} frames are missing or do not decode; the film may be cut off",
            stacklevel=4,
        )
    return {
        "source": film.path.name,
        "R": radius,
        "fps": film.fps,
        "frames": len(tracks.t),
        "frames_missing": missing,
        "frames_lost": lost,
        "exposure": known.exposure,
        "px_per_m": camera.scale,
        "px_per_m_sigma": camera.scale_sigma,
        "pivot_u": camera.pivot.real,
        "pivot_v": camera.pivot.imag,
        "pivot_sigma": camera.pivot_sigma,
        "pivot_from": camera.pivot_from,
        "drive_seen": float(camera.drive.imag),
        "drive_lean": float(np.arctan2(camera.drive.real, camera.drive.imag)),
        "marks_px": [[m.place.real, m.place.imag] for m in known.look.marks],
        "psf_px": known.look.psf,
        "lens": list(astuple(known.look.lens)[2:]),
    }


def pictures_at(video: str | os.PathLike[str], frames: Sequence[int]) -> list[NDArray[np.uint8]]:
    """Frames of a film by their number, as RGB arrays (height, width, 3), for drawing upon."""
    wanted = {int(i) for i in frames}
    found: dict[int, NDArray[np.uint8]] = {}
    film = Film(video)
    for picture in film.pictures():
        if picture.index in wanted:
            found[picture.index] = _rgb(picture, film.full_range)
            if len(found) == len(wanted):
                break
    lost = wanted - set(found)
    if lost:
        raise TrackError(f"{video}: there is no frame {min(lost)}")
    return [found[int(i)] for i in frames]


def _rgb(picture: Picture, full_range: bool) -> NDArray[np.uint8]:
    import cv2

    h, w = picture.y.shape
    y, u, v = (
        cv2.resize(p, (w, h), interpolation=cv2.INTER_LINEAR).astype(np.float32)
        for p in (picture.y, picture.u, picture.v)
    )
    if not full_range:
        y, u, v = (y - 16) * (255 / 219), (u - 128) * (255 / 224) + 128, (v - 128) * (255 / 224) + 128
    planes = np.clip(np.round(np.dstack([y, v, u])), 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(planes, cv2.COLOR_YCrCb2RGB), dtype=np.uint8)
