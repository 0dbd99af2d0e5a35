"""The tracker's pipeline: from a film to a measurement."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.markers.layout import STANDARD, read_bob
from udd.markers.tags import Tag, is_tags, layout_of, read_tags
from udd.measurement import DISK, Measurement, check_length
from udd.tracking.calibration.config import Config, settings
from udd.tracking.calibration.exposure import again as retimed
from udd.tracking.calibration.exposure import at_middle
from udd.tracking.calibration.rim import Rim, outline
from udd.tracking.calibration.rolling_shutter import readout
from udd.tracking.calibration.scale import scale as size_of
from udd.tracking.calibration.setup import (
    Calibrate,
    Layout,
    MarkSeparation,
    Region,
    Setup,
    Sigma,
    length_of,
    read_apart,
    read_calibrate,
    read_layout,
    read_region,
    read_sigma,
)
from udd.tracking.detection.colour_blobs import COLOURS, FEWEST, sightings
from udd.tracking.detection.frame_flags import GONE, VAGUE, is_lost
from udd.tracking.detection.layout_matching import sightings as matching
from udd.tracking.detection.survey import Survey, slowest, survey
from udd.tracking.geometry.pose import DiskAppearance, Pose
from udd.tracking.marks.learning import MOST
from udd.tracking.marks.learning import refine as learn
from udd.tracking.metric.calibration_report import camera_of, meta_of
from udd.tracking.metric.common_errors import in_common
from udd.tracking.metric.pixels_to_metres import Camera, left_the_wheels, metres, recount
from udd.tracking.metric.pose_covariance import covariance, with_causes
from udd.tracking.passes.first_pass import TrackerState, Tracks, follow
from udd.tracking.passes.frame_quality import quality, remarks
from udd.tracking.passes.pendulum_bob import track_bob
from udd.tracking.passes.preparation import SHARP, prepare, rim_span, upward
from udd.tracking.passes.second_pass import LONG, LocalMotion, drop_weak, taken_to_middle, unforeseen
from udd.tracking.passes.second_pass import refine as second_pass
from udd.tracking.passes.tag_tracking import follow_tags
from udd.tracking.passes.wobble import wobble
from udd.tracking.passes.wobble_correction import WobbleCorrection, correct_wobble
from udd.video.reader import Film, Picture, TrackError
from udd.video.rgb_frames import rgb

from .tracked_frame import TrackedFrame

AGAIN = 3  # rounds in which marks are learned from slow frames when their motion is known
UNSURE = 0.005  # of the disk's radius: a position known no better is not given


@dataclass(frozen=True)
class Tracking:
    """A measurement, and what it was made from."""

    measurement: Measurement
    tracks: Tracks
    known: TrackerState
    camera: Camera
    outline: Rim | None


def track(
    video: str | os.PathLike[str],
    *,
    disk_radius: float | None = None,
    mark_distance: float | None = None,
    fps: float | None = None,
    pivot: tuple[float, float] | None = None,
    refine: bool | None = None,
    layout: Layout | Sequence[Mapping[str, Any]] | None = None,
    scale: float | None = None,
    region: Region | None = None,
    calibrate: Calibrate | Mapping[str, bool | float] | None = None,
    sigma: Sigma | Mapping[str, float] | None = None,
    apart: MarkSeparation | None = None,
    bob: str | Sequence[int] | None = None,
    length: float | None = None,
    config: Config | None = None,
    progress: bool = False,
) -> Measurement:
    """Measure the motion of a disk with coloured marks in a film.

    Parameters
    ----------
    video : path
        A film by a camera at rest, showing the whole disk with square marks red, orange, blue,
        green (clockwise) near its rim, or with those of `layout`.
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
    layout : sequence of mappings, optional
        Marks of another disk, two or more: ``{"at": [y, z], "colour": "red"}``, with the place [m] when
        beta = 0 and the colour by name or as sRGB codes ``[r, g, b]``. Square or rectangular patches, each
        with a margin of the disk about it. Or printed tags, one or more of one dictionary:
        ``{"tag": "4x4_50:7", "at": [y, z], "side": 0.03}``, upright at beta = 0.
    scale : float, optional
        Pixels per metre in the disk's plane, given instead of found.
    region : (u0, v0, u1, v1), optional
        The part of the picture in which the disk moves [pixels]; nothing outside it is looked at.
    calibrate : mapping, optional
        What the film is asked for: ``layout, scale, lens, tilt, readout, exposure, pivot``. True: found (so
        if not given); False: as given, or not there; a number (lens, readout [s], exposure [s]): just that.
    sigma : mapping, optional
        Standard errors of what is given: ``pivot`` [pixels], ``scale`` [pixels per metre], ``layout`` [m].
        With one, it is a beginning that the film improves; where the film does not tell, it stands. Without,
        it is exact.
    apart : (int, int, float), optional
        Numbers of two marks (from 1; of the standard ones that is red) and the distance of their middles [m],
        measured on the disk: that sets the scale.
    bob : str or (r, g, b), optional
        The film is one of a plain pendulum with a bob of this colour: ``theta`` is measured, from the
        picture's vertical, about the centre of the bob's path (or `pivot`).
    length : float, optional
        Of that pendulum, from the pivot to the bob's middle [m]; sets the scale.
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
        method of each frame. ``meta`` holds the camera: ``px_per_m``, ``pivot_u``, ``pivot_v``,
        ``exposure``, ..., and in ``calibration`` every item as value, standard error and how it is known.

    Raises
    ------
    TrackError
        The file is missing, empty, not a film or too short; no marks are found; the radius is not a
        positive number; the layout or the config holds an unknown key or a value of the wrong kind.

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
    >>> m = udd.track("run.mp4", calibrate={"lens": False, "readout": 0.02})  # doctest: +SKIP
    >>> three = [{"at": [0.0, 0.06], "colour": "red"}, {"at": [0.05, -0.03], "colour": "blue"}]
    >>> three += [{"at": [-0.05, -0.03], "colour": [112, 48, 160]}]
    >>> m = udd.track("run.mp4", layout=three)  # doctest: +SKIP
    >>> tag = {"tag": "apriltag_36h11:7", "at": [0.0, 0.0], "side": 0.05}
    >>> m = udd.track("run.mp4", layout=[tag])  # doctest: +SKIP
    >>> swing = udd.track("clock.mp4", bob="red", length=0.8)  # doctest: +SKIP
    """
    given = {
        "disk_radius": disk_radius,
        "mark_distance": mark_distance,
        "fps": fps,
        "pivot": pivot,
        "refine": refine,
        "layout": layout,
        "scale": scale,
        "region": region,
        "calibrate": calibrate,
        "sigma": sigma,
        "apart": apart,
    }
    found = run_tracker(video, config=config, progress=progress, **given, bob=bob, length=length)
    return found.measurement if isinstance(found, Tracking) else found


def run_tracker(
    video: str | os.PathLike[str], *, config: Config | None = None, progress: bool = False, **given: Any
) -> Tracking | Measurement:
    """As `track`, with what was found on the way where the film is a disk's."""
    known = settings({} if config is None else config, **given)
    if known.get("bob") is not None:
        return _pendulum(video, progress=progress, **known)
    if known.pop("length", None) is not None:
        raise TrackError("length is a pendulum's: say its bob's colour too")
    return track_in_detail(video, **known, progress=progress)


def _pendulum(
    video: str | os.PathLike[str],
    *,
    bob: Any,
    progress: bool,
    length: float | None = None,
    fps: float | None = None,
    pivot: tuple[float, float] | None = None,
    scale: float | None = None,
    region: Region | None = None,
    calibrate: Calibrate | Mapping[str, bool | float] | None = None,
    refine: bool = False,
    **more: Any,
) -> Measurement:
    """A plain pendulum's film; there is one pass whatever `refine` says."""
    from tqdm import tqdm

    if more:
        raise TrackError(f"{', '.join(more)}: not for a pendulum, which has a bob and a length alone")
    setup = Setup(
        pivot=pivot,
        layout=read_bob(bob),
        scale=None if scale is None else length_of(scale, "scale", "pixels per metre"),
        region=None if region is None else read_region(region),
        calibrate=read_calibrate({} if calibrate is None else calibrate),
    )
    film = Film(video, fps=fps)
    metres_long = None if length is None else length_of(length, "length")
    with tqdm(total=film.packets, unit="frame", desc=f"track {film.path.name}", disable=not progress) as bar:
        return track_bob(film, metres_long, setup, lambda _: bar.update())


def track_in_detail(
    video: str | os.PathLike[str],
    *,
    disk_radius: float = 0.08,
    mark_distance: float | None = None,
    fps: float | None = None,
    pivot: tuple[float, float] | None = None,
    refine: bool = True,
    layout: Layout | Sequence[Mapping[str, Any]] = STANDARD,
    scale: float | None = None,
    region: Region | None = None,
    calibrate: Calibrate | Mapping[str, bool | float] | None = None,
    sigma: Sigma | Mapping[str, float] | None = None,
    apart: MarkSeparation | None = None,
    progress: bool = False,
    watch: Callable[[TrackedFrame], object] | None = None,
) -> Tracking:
    """As `track`, with everything that was found on the way, in pixels; `watch` is told of each frame."""
    tags = read_tags(layout) if is_tags(layout) and not isinstance(layout, Layout) else ()
    setup = Setup(
        length_of(disk_radius, "disk_radius"),
        None if mark_distance is None else length_of(mark_distance, "mark_distance"),
        pivot,
        layout_of(tags) if tags else read_layout(layout),
        None if scale is None else length_of(scale, "scale", "pixels per metre"),
        None if region is None else read_region(region),
        read_calibrate({} if calibrate is None else calibrate),
        read_sigma({} if sigma is None else sigma),
        None if apart is None else read_apart(apart),
    )
    film = Film(video, fps=fps)
    if tags:
        return _by_tags(film, tags, setup, progress, watch)
    look_over = survey(film)
    known, rim = _learn(film, look_over, setup)
    tracks = _follow(film, known, look_over.frames, progress, watch)
    # where the contact was known the paths were curved, and poses stand in their middle
    tracks, doubtful = _settled(tracks, known.exposure if known.contact is None else 0.0)
    if refine:
        known = _timed(known, look_over, tracks, setup)
        tracks = _again(film, known, tracks, progress)
    drop_weak(tracks)
    return _tracking(film, tracks, known, setup, rim, doubtful, refine, look_over)


def _by_tags(
    film: Film,
    tags: Sequence[Tag],
    setup: Setup,
    progress: bool,
    watch: Callable[[TrackedFrame], object] | None,
) -> Tracking:
    """Printed tags: each frame by itself, in one pass."""
    from tqdm import tqdm

    frames = film.promised or film.packets
    with tqdm(total=frames, unit="frame", desc=f"track {film.path.name}", disable=not progress) as bar:

        def tick(picture: Picture, pose: Pose) -> None:
            bar.update()
            if watch is not None:
                look = DiskAppearance([], 0.0, 1.0, film.light, np.inf)
                watch(TrackedFrame(picture, pose, look, frames, film.full_range))

        tracks, known = follow_tags(film, film.pictures(), tags, setup, tick)
    tracks, doubtful = _settled(tracks, known.exposure)
    return _tracking(film, tracks, known, setup, None, doubtful, False)


def _settled(tracks: Tracks, open_for: float) -> tuple[Tracks, int]:
    """Means over the exposure taken to its middle, whole turns counted; how many of these are in doubt."""
    t, centre, angle = np.array(tracks.t), np.array(tracks.centre), np.array(tracks.angle)
    if open_for:
        centre, angle = at_middle(t, centre, angle, open_for)
    angle, doubtful = recount(t, angle)
    return replace(tracks, centre=list(centre), angle=list(angle)), doubtful


def _learn(film: Film, look_over: Survey, setup: Setup) -> tuple[TrackerState, Rim | None]:
    """Find the disk in the survey, and learn all that is needed to follow it."""
    inside = [setup.inside(p) for p in look_over.pictures]
    missing, what = None, "red, orange, blue and green (clockwise)"
    if setup.layout.standard:
        sights, missing = sightings(inside)
    else:
        sights, what = matching(inside, setup.layout, setup.scale), "the layout's colours"
    seen = slowest(look_over.bursts, sights)
    if len(seen) < FEWEST:
        raise TrackError(
            f"{film.path}: no disk with marks in {what} was found: "
            f"{len(seen)} of {len(look_over.pictures)} frames looked at show all {len(setup.layout.places)}"
        )
    if missing is not None:
        warnings.warn(
            f"{film.path}: no {COLOURS[missing]} mark is seen; the other three are used", stacklevel=4
        )
    return prepare(film, look_over, sights, seen, setup)


def _tracking(
    film: Film,
    tracks: Tracks,
    known: TrackerState,
    setup: Setup,
    rim: Rim | None,
    doubtful: int,
    twice: bool,
    look_over: Survey | None = None,
) -> Tracking:
    """The measurement in metres, without what is vague or has left the wheels; `twice`: of two passes."""
    camera = camera_of(tracks, known, size_of(known.look.places, rim, setup), setup)
    # Where the layout is taken as said, so is the centre.
    by_hand = 0.0 if rim is not None and setup.calibrate.layout else setup.sigma.layout
    centre_sigma = rim.centre_sigma if rim is not None and setup.calibrate.layout else by_hand * camera.scale
    shared = [unforeseen(tracks, known.exposure**2 / 12)]
    turned = wobble(tracks, known.look)
    stood = correct_wobble(tracks, known.look, turned) if turned.amplitude else None
    if stood is not None:
        if twice:  # a mark is placed best where it is looked for
            known = replace(known, look=stood.look)
            tracks = second_pass(film.pictures(), known, stood.tracks, look_at=stood.look_at)
            stood = correct_wobble(tracks, known.look, turned, stood) or stood
        if rim is not None and setup.calibrate.layout and look_over is not None:
            rim = _rim_upright(look_over, stood, known, rim, setup)
            stood = stood.centred(rim.centre, upward(stood.look.places - rim.centre, setup))
            centre_sigma = rim.centre_sigma
        tracks, lean = stood.about(camera.pivot)
        known, shared = replace(known, look=stood.look), [*shared, lean]
        camera = camera_of(tracks, known, size_of(known.look.places, rim, setup), setup)
    own = taken_to_middle(tracks, covariance(tracks, known.look), known.exposure**2 / 12)
    alike = in_common(tracks, with_causes(own, 0.0, shared), camera)
    shared += [alike[:, None] * np.eye(3)[axis] for axis in (0, 1)]  # u and v have causes of their own
    values, sigma, rho = metres(tracks, with_causes(own, centre_sigma, shared), camera)
    gone = left_the_wheels(np.array(tracks.t), values, setup.radius, camera.pivot_sigma)
    for table in (values, sigma, rho):
        table[gone] = np.nan
    # by how much the centre is off that was said, all frames are: that makes none of them vague
    vague = (sigma[:, :2] ** 2).sum(axis=1) - 2 * by_hand**2 > (UNSURE * setup.radius) ** 2
    for table in (values, sigma, rho):
        table[vague] = np.nan
    tracks.flag = [VAGUE if v else flag for v, flag in zip(vague, tracks.flag, strict=True)]
    tracks.flag = [GONE if g else flag for g, flag in zip(gone, tracks.flag, strict=True)]
    meta = meta_of(film, tracks, known, camera, setup, doubtful, turned)
    seen_how = quality(tracks, np.asarray(np.isfinite(values).all(axis=1)))
    tracks.flag = remarks(np.array(tracks.t), tracks.flag, seen_how, twice)
    flag = np.array(tracks.flag)
    measurement = Measurement(np.array(tracks.t), values, sigma, rho, flag, meta, DISK, seen_how)
    try:
        check_length(measurement)
    except ValueError as error:
        raise TrackError(f"{film.path}: {error}") from None
    return Tracking(measurement, tracks, known, camera, rim)


def _rim_upright(
    look_over: Survey, stood: WobbleCorrection, known: TrackerState, rim: Rim, setup: Setup
) -> Rim:
    """The rim again, from frames whose foreshortening is known; its centre from where it was."""
    tracks, around = stood.tracks, LocalMotion(stood.tracks)
    frames = []
    for picture in look_over.pictures:
        here = around.at(picture.index) if picture.index < len(tracks.t) else None
        if here is not None and here.held:
            frames.append((picture, here.pose, here.motion(known.exposure)))
    frames.sort(key=lambda f: stood.look.streak(f[2]))
    frames = frames[:SHARP]
    short = [float(stood.short[picture.index]) for picture, _, _ in frames]
    try:
        return outline(frames, stood.look, known.view, rim_span(setup), short=short, across=stood.across)
    except TrackError:  # it was seen once, but not now
        return replace(rim, centre=0j)


def _follow(
    film: Film,
    known: TrackerState,
    frames: int,
    progress: bool,
    watch: Callable[[TrackedFrame], object] | None,
) -> Tracks:
    from tqdm import tqdm

    with tqdm(total=frames, unit="frame", desc=f"track {film.path.name}", disable=not progress) as bar:

        def tick(picture: Picture, pose: Pose) -> None:
            bar.update()
            if watch is not None:
                watch(TrackedFrame(picture, pose, known.look, frames, film.full_range))

        return follow(film.pictures(), known, tick)


def _timed(known: TrackerState, look_over: Survey, tracks: Tracks, setup: Setup) -> TrackerState:
    """Exposure, readout and marks once more, now that every frame's motion is known from its neighbours."""
    around = LocalMotion(tracks)
    frames = []
    for picture in look_over.pictures:
        here = around.at(picture.index) if picture.index < len(tracks.t) else None
        if here is not None and here.held and not tracks.flag[picture.index]:
            frames.append((picture.y, here))
    if known.readout.value and setup.calibrate.given("readout") is None:
        moving = [(y, here.pose, here.motion(known.exposure)) for y, here in frames]
        again = readout(moving, known.look, known.view, around.interval)
        if again.value:
            known = replace(known, look=replace(known.look, readout=again.value), readout=again)
    if known.exposure and setup.calibrate.given("exposure") is None:
        paths = [(y, here.pose, here.motion) for y, here in frames]
        known = replace(known, exposure=retimed(paths, known.exposure, known.look, known.view))
    moving = [(y, Pose(here.pose.centre, here.pose.angle), here.motion(known.exposure)) for y, here in frames]
    moving.sort(key=lambda f: known.look.streak(f[2]))
    slower = moving[: -(-len(moving) // 2)]
    fixed = None if setup.calibrate.layout else setup.layout.unit
    look = learn(known.look, slower[:: -(-len(slower) // MOST)], known.view, AGAIN, fixed)
    return replace(known, look=look)


def _again(film: Film, known: TrackerState, tracks: Tracks, progress: bool) -> Tracks:
    streaks = [s > LONG or is_lost(flag) for s, flag in zip(tracks.streak, tracks.flag, strict=True)]
    for streaks_only in (False, True) if any(streaks) else (False,):
        if not progress:
            tracks = second_pass(film.pictures(), known, tracks, streaks_only=streaks_only)
            continue
        from tqdm import tqdm

        with tqdm(total=len(tracks.t), unit="frame", desc=f"refine {film.path.name}") as bar:
            tracks = second_pass(film.pictures(), known, tracks, lambda _: bar.update(), streaks_only)
    return tracks


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
