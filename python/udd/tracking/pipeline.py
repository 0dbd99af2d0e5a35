"""The tracker's pipeline: from a film to a measurement."""

from __future__ import annotations

import os
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.progress import Count, Progress, progress_bar
from udd.calibration_items import Calibrate
from udd.errors import outside
from udd.markers.layout import Layout
from udd.measurement import DISK, Measurement, check_length
from udd.tracking.calibration.config import Config, read_options
from udd.tracking.calibration.exposure import at_middle
from udd.tracking.calibration.rim import Rim, outline
from udd.tracking.calibration.scale import scale as size_of
from udd.tracking.correction import Correction, applied, correction_of
from udd.tracking.detection.background import steadied
from udd.tracking.detection.camera_motion import CameraMotion
from udd.tracking.detection.frame_flags import GONE, VAGUE, lost
from udd.tracking.detection.recognition import placed, recognise
from udd.tracking.detection.survey import Survey, survey
from udd.tracking.geometry.pose import DiskAppearance, Pose
from udd.tracking.manual.clicked_options import with_clicks
from udd.tracking.metric.apparent_gravity import ApparentGravity, apparent_gravity
from udd.tracking.metric.calibration_report import camera_of, meta_of
from udd.tracking.metric.common_errors import common_mode_errors
from udd.tracking.metric.doubts import doubts, quarter_turns
from udd.tracking.metric.film_clock import slow_parts, text_of
from udd.tracking.metric.pixels_to_metres import Camera, left_the_wheels, metres, recount
from udd.tracking.metric.pose_covariance import add_shared_errors, covariance
from udd.tracking.metric.turns import count_turns
from udd.tracking.passes.first_pass import MarkedDisk, TrackerState
from udd.tracking.passes.frame_loop import follow
from udd.tracking.passes.frame_quality import quality, remarks
from udd.tracking.passes.pendulum_bob import track_bob
from udd.tracking.passes.preparation import SHARP, prepare, recalibrate, rim_span, upward
from udd.tracking.passes.second_pass import LocalMotion, drop_weak, interpolation_error, to_mid_exposure
from udd.tracking.passes.second_pass import refine as second_pass
from udd.tracking.passes.tag_tracking import follow_tags
from udd.tracking.passes.tracks import Tracks
from udd.tracking.passes.wobble import Wobble, wobble
from udd.tracking.passes.wobble_correction import WobbleCorrection, correct_wobble
from udd.video.frame_conversion import Conversion
from udd.video.reader import Film, Picture, TrackError
from udd.video.rgb_frames import rgb

from .options import MoreOptions, TrackOptions
from .tracked_frame import TrackedFrame

Array = NDArray[np.float64]
Watch = Callable[[TrackedFrame], object]
GLUED = 0.3e-3  # m: the marks' middle against the disk's, if the rim does not show
UNSURE = 0.005  # of the disk's radius: a position known no better is not given


@dataclass(frozen=True)
class Tracking:
    """Result of the tracker: the measurement, the tracks, the calibration and the camera.

    Attributes
    ----------
    measurement : Measurement
        Poses in metres and radians.
    tracks : Tracks
        Marks and poses in pixels.
    state : TrackerState
        Calibration of the last pass.
    camera : Camera
        Map from metres to pixels.
    outline : Rim or None
        The rim of the disk, if it was seen.

    See Also
    --------
    udd.tracking.track_disk : makes it.
    """

    measurement: Measurement
    tracks: Tracks
    state: TrackerState
    camera: Camera
    outline: Rim | None


@checked_arguments
def track(
    video: str | os.PathLike[str],
    *,
    disk_radius: float | None = None,
    fps: float | Sequence[Sequence[float]] | None = None,
    pivot: tuple[float, float] | None = None,
    refine: bool | None = None,
    layout: Layout | Sequence[Mapping[str, Any]] | None = None,
    scale: float | None = None,
    calibrate: Calibrate | Mapping[str, bool | float] | None = None,
    bob: str | Sequence[int] | Sequence[str | Sequence[int]] | None = None,
    config: Config | TrackOptions | None = None,
    progress: bool | Callable[[str], object] | None = None,
    **more: Unpack[MoreOptions],
) -> Measurement:
    """Measure the motion of a disk with coloured marks in a film.

    Parameters
    ----------
    video : path
        A film by a camera at rest, or a folder of its pictures by number (then give `fps`). It shows the
        whole disk, with square marks near its rim in red, orange, blue and green (clockwise), or with the
        marks of `layout`.
    disk_radius : float, optional
        Radius of the disk [m]. The default is 0.08. With the distance of the marks it sets the scale.
    fps : float or sequence of (int, float), optional
        Frames per second, if the film's header is wrong (slow motion). Pairs of a frame's number and the rate
        from this frame on are also possible: ``[(0, 30), (61, 240), (301, 30)]``. The first frame is 0.
    pivot : (u, v), optional
        The contact of wheel and disk in the picture [pixels, v down]. Found from the motion if not given.
    refine : bool, optional
        If True (the default), go over the film a second time. The blur of each frame then follows from its
        neighbours.
    layout : sequence of mappings, optional
        Two or more marks of another disk: ``{"at": [y, z], "colour": "red"}``, with the place [m] at
        beta = 0. The colour is a name or has sRGB codes ``[r, g, b]``. Marks are square or rectangular
        patches, with a margin of the disk around each. Or printed tags, one or more of one dictionary:
        ``{"tag": "4x4_50:7", "at": [y, z], "side": 0.03}``, upright at beta = 0.
    scale : float, optional
        Pixels per metre in the plane of the disk. Estimated from the film if not given.
    calibrate : mapping, optional
        Items to calibrate: ``layout, scale, lens, tilt, readout, exposure, pivot``. True (the default)
        estimates an item from the film. False takes it as given, or as absent. A number (lens, readout [s],
        exposure [s]) sets it.
    bob : str, (r, g, b) or two of these, optional
        Colour of the bob, if the film shows a plain pendulum. Then ``theta`` is measured from the picture's
        vertical, about the centre of the bob's path (or `pivot`). Two colours, the upper bob first, mean a
        double pendulum. Then ``th1`` and ``th2`` are measured from the vertical.
    config : path, mapping or TrackOptions, optional
        A TOML file (or its entries) with any of these arguments. Arguments of the call take precedence.
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. By default a
        bar shows after 2 s in a terminal or a notebook.
    **more
        ``mark_distance``: of the marks' centres from the disk's centre [m]. If not given, 65/80 of the radius
        where the film agrees with that to 1.5 %, otherwise the rim alone sets the scale.
        ``region``: (u0, v0, u1, v1), the part of the picture in which the disk moves [pixels]; nothing
        outside it is looked at.
        ``sigma``: standard errors of what is given: ``pivot`` [pixels], ``scale`` [pixels per metre],
        ``layout`` [m]. With one, the given value is a start that the film improves, and it stays if the film
        does not determine it. Without one, it is exact.
        ``apart``: (int, int, float), numbers of two marks (from 1; of the standard ones that is red) and the
        distance of their middles [m], measured on the disk: that sets the scale.
        ``length``: with `bob`, from the pendulum's pivot to the bob's middle [m]; sets the scale.
        ``leave_out``: numbers of frames, or pairs (first, last), that are not used (flag ``omitted``).
        ``clicks``: points clicked in one frame [pixels], a mapping: ``frame`` (its number), ``pivot``,
        ``marks`` (their middles), ``edge`` (three points of the disk's edge, or its centre), ``points`` (two)
        and their ``distance`` [m]. beta is 0 if the first mark is above the disk's centre. The film improves
        the clicked values within the errors of clicks.

    Returns
    -------
    Measurement
        One row per frame: ``Y, Z`` [m] and ``beta`` [rad, unwrapped] at mid-exposure, with standard errors
        and correlations. A frame that cannot be used holds NaN, with the reason in ``flag`` (``dup``,
        ``black``, ``damaged``, ``omitted``, ``vague``, ``lost``, ``gone``). The flags ``gap`` (frames are
        missing before it) and ``degraded`` are remarks. ``quality`` holds number of marks, completeness,
        residual, blur and method of each frame. ``meta`` holds the camera: ``px_per_m``, ``pivot_u``,
        ``pivot_v``, ``exposure``, ..., and in ``calibration`` every item as value, standard error and source.

    Raises
    ------
    TrackError
        The file is missing, empty, not a film or too short. No marks are seen. An option has a wrong key or
        value.

    See Also
    --------
    udd.tracking.click : makes a config by clicks.
    udd.tracking.page : a page on the quality of the tracking.
    udd.fit : fits a model to the measurement.
    udd.plot.overlay : draw the fitted disk into a frame.

    Notes
    -----
    The contact point comes from the rolling constraint dY/dT = Z Omega, dZ/dT = -Y Omega + W, with a drive of
    any constant velocity. This calibration assumes no slip, so it is no evidence about slip.

    References
    ----------
    The rolling constraint: L. Maas [1].

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
    result = run_tracker(
        video,
        config=config,
        progress=progress,
        disk_radius=disk_radius,
        fps=fps,
        pivot=pivot,
        refine=refine,
        layout=layout,
        scale=scale,
        calibrate=calibrate,
        bob=bob,
        **more,
    )
    return result.measurement if isinstance(result, Tracking) else result


def run_tracker(
    video: str | os.PathLike[str],
    *,
    config: Config | TrackOptions | None = None,
    progress: Progress = False,
    watch: Watch | None = None,
    **given: Any,
) -> Tracking | Measurement:
    """Track as `track` does, and return the poses in pixels as well if the film shows a disk."""
    options = read_options(config, **given)
    film = Film(video, fps=options.fps)
    film.left_out = options.leave_out
    if options.clicks is not None:
        options = with_clicks(film, options, options.clicks)
    if options.bob is not None:
        with _looking_over(film, progress):
            look_over, camera = steadied(film, survey(film))
        with _bar(film, film.packets, "track", progress) as bar:
            tell = _teller(film, None, film.promised or film.packets, bar, watch)
            return track_bob(film, look_over, camera, options, tell)
    if options.tags:
        return _track_tags(film, options, progress, watch)
    return _track_marks(film, options, progress, watch)


def track_disk(
    video: str | os.PathLike[str],
    *,
    progress: Progress = False,
    watch: Watch | None = None,
    **given: Any,
) -> Tracking:
    """Track a disk, and return the poses in pixels with the measurement.

    Parameters
    ----------
    video : path
        The film.
    progress : bool or callable, optional
        As for :func:`udd.track`.
    watch : callable, optional
        Called with each :class:`TrackedFrame`.
    **given
        Other options of :func:`udd.track`.

    Returns
    -------
    Tracking
        Fields ``measurement``, ``tracks``, ``state``, ``camera`` and ``outline``.

    Raises
    ------
    TrackError
        The film cannot be read or tracked, or shows a pendulum.

    See Also
    --------
    udd.track : returns the measurement alone.

    Examples
    --------
    >>> from udd import tracking
    >>> tracking.track_disk("run.mp4").measurement  # doctest: +SKIP
    """
    result = run_tracker(video, progress=progress, watch=watch, **given)
    if not isinstance(result, Tracking):
        raise TrackError("a pendulum's film has no marks, so there is no detail; use udd.track")
    return result


def _bar(film: Film, frames: int, verb: str, progress: Progress) -> AbstractContextManager[Count]:
    return progress_bar(frames, "frame", progress, title=f"{verb} {film.path.name}", leave=True)


@contextmanager
def _looking_over(film: Film, progress: Progress) -> Iterator[None]:
    """Show the progress through a film before it is tracked: once for a survey, once for the camera."""
    with _bar(film, 2 * film.packets, "look over", progress) as bar:
        film.tick = bar.update
        try:
            yield
        finally:
            film.tick = lambda: None


def _track_marks(film: Film, options: TrackOptions, progress: Progress, watch: Watch | None) -> Tracking:
    """Track coloured marks: survey, calibrate, follow, refine, convert to metres, flag."""
    with _looking_over(film, progress):
        look_over, camera = steadied(film, survey(film))
    result = _measured(film, look_over, camera, options, progress, watch)
    if _retimed(film, result):
        result = _measured(film, survey(film), camera, options, progress, watch)
    turns = quarter_turns(_gravity(result.measurement), result.camera)
    if not turns:
        return _with_doubts(film, result)
    film.correct = applied(film).then_turned(turns)
    film_is = "upside down" if turns == 2 else "on its side"
    warnings.warn(f"{film.path}: the film is {film_is}; it is turned upright", stacklevel=outside())
    options = placed(options, Correction(turns=turns), film.size)
    return _with_doubts(film, _measured(film, survey(film), camera, options, progress, watch))


def _retimed(film: Film, result: Tracking) -> bool:
    """Return True if the drive shows that parts are slowed down; the clock then follows the drive."""
    tracks = result.tracks
    if film.forced or film.slower:
        return False
    radius, scale = float(result.measurement.meta["R"]), result.camera.scale
    parts = slow_parts(tracks.t, tracks.centre, tracks.angle, radius, scale)
    if not parts:
        return False
    film.slower = tuple((float(tracks.t[part.first]), part.factor) for part in parts)
    film.clock_note = f"times by the drive, which the film slows down by a factor of {text_of(parts)}"
    warnings.warn(f"{film.path}: {film.clock_note}", stacklevel=outside())
    return True


def _gravity(m: Measurement) -> ApparentGravity | None:
    return apparent_gravity(m.t, m.values, float(m.meta["R"]))


def _with_doubts(film: Film, result: Tracking) -> Tracking:
    """Add the doubts about a film to the header of its measurement, and warn of each."""
    m, gravity = result.measurement, _gravity(result.measurement)
    said = doubts(gravity, result.camera, film.fps, int(m.meta["turns_doubtful"]))
    for doubt in said:
        warnings.warn(f"{film.path}: {doubt}", stacklevel=outside())
    shown = {} if gravity is None else {"gravity_seen": abs(gravity.value), "gravity_sigma": gravity.sigma}
    return replace(result, measurement=m.with_meta(**shown, **({"doubts": said} if said else {})))


def _measured(
    film: Film,
    look_over: Survey,
    camera: CameraMotion | None,
    options: TrackOptions,
    progress: Progress,
    watch: Watch | None,
) -> Tracking:
    """Run the tracker once over a film with its present corrections."""
    there = recognise(film, look_over, options)
    look_over, options = there.look_over, there.options
    state, rim = prepare(film, look_over, there.sights, there.seen, options, there.clear)
    tracks = _follow(film, state, look_over.frames, progress, watch)
    # with a known contact the paths were curved, and poses lie in their middle
    tracks = _unwrap(tracks, state.exposure if state.contact is None else 0.0)
    if options.refine:
        state = recalibrate(state, look_over, tracks, options)
        tracks = _refine(film, state, tracks, progress)
    tracks = drop_weak(tracks)
    return _to_metres(film, tracks, state, options, rim, options.refine, look_over, camera)


def _track_tags(film: Film, options: TrackOptions, progress: Progress, watch: Watch | None) -> Tracking:
    """Track printed tags: each frame by itself, in one pass."""
    frames = film.promised or film.packets
    with _bar(film, frames, "track", progress) as bar:
        tell = _teller(film, None, frames, bar, watch)
        tracks, state = follow_tags(film, options, tell)
    return _with_doubts(film, _to_metres(film, _unwrap(tracks, state.exposure), state, options, None, False))


def _teller(
    film: Film, look: DiskAppearance | None, frames: int, bar: Count, watch: Watch | None
) -> Callable[[Picture, Pose], None]:
    """Return the function that a pass calls after each picture: it moves the bar and calls `watch`."""
    shown = DiskAppearance([], 0.0, 1.0, film.light, np.inf) if look is None else look

    def tell(picture: Picture, pose: Pose) -> None:
        bar.update()
        if watch is not None:
            watch(TrackedFrame(film.corrected(picture), pose, shown, frames, film.full_range))

    return tell


def _unwrap(tracks: Tracks, open_for: float) -> Tracks:
    """Move means over the exposure to its middle, and count whole turns by the rates at gaps."""
    centre, angle = tracks.centre, tracks.angle
    if open_for:
        centre, angle = at_middle(tracks.t, centre, angle, open_for)
    return replace(tracks, centre=centre, angle=recount(tracks.t, angle)[0])


@dataclass(frozen=True)
class _Upright:
    """Poses of a disk that stays in its plane, with camera, rim and shared errors."""

    tracks: Tracks
    state: TrackerState
    camera: Camera
    rim: Rim | None
    wobble: Wobble
    shared: list[Array]  # standard errors (n, 3) of u, v and beta of one cause each, signed alike


def _to_metres(
    film: Film,
    tracks: Tracks,
    state: TrackerState,
    options: TrackOptions,
    rim: Rim | None,
    twice: bool,
    look_over: Survey | None = None,
    moved: CameraMotion | None = None,
) -> Tracking:
    """Return the measurement in metres, without vague and gone frames; `twice`: of two passes."""
    if moved is not None and not moved.steady:
        why = lost("the background is not seen, and the camera moves")
        tracks = tracks.without(~moved.is_measured[: len(tracks)], why)
    disk = _upright(film, tracks, state, options, rim, twice, look_over)
    tracks, camera = disk.tracks, disk.camera
    drive = complex(np.conj(camera.drive)) * camera.scale
    turns = count_turns(tracks.t, tracks.centre, tracks.angle, camera.pivot, drive, disk.state.look.reach)
    tracks = replace(tracks, angle=turns.angle)
    # where the layout is taken as said, so is the centre
    by_hand = 0.0 if rim is not None and options.calibrate.layout else options.sigma.layout
    if rim is None and options.layout.standard:
        by_hand = GLUED
    centre_sigma = by_hand * camera.scale
    if disk.rim is not None and options.calibrate.layout:
        centre_sigma = disk.rim.centre_sigma
    if moved is not None and not moved.steady:
        disk = replace(disk, shared=[*disk.shared, *moved.errors(tracks.centre)])
    own_errors = to_mid_exposure(tracks, covariance(tracks, disk.state.look), disk.state.exposure**2 / 12)
    alike = common_mode_errors(tracks, add_shared_errors(own_errors, 0.0, disk.shared), camera)
    shared = [*disk.shared, *(alike[:, None] * np.eye(3)[axis] for axis in (0, 1))]  # u and v: two causes
    values, sigma, rho = metres(tracks, add_shared_errors(own_errors, centre_sigma, shared), camera)
    gone = left_the_wheels(tracks.t, values, options.disk_radius, camera.pivot_sigma, camera.drive)
    # all frames share the error of a centre that was given: it makes none of them vague
    spread = (sigma[:, :2] ** 2).sum(axis=1) - 2 * by_hand**2
    vague = ~gone & (spread > (UNSURE * options.disk_radius) ** 2)
    for table in (values, sigma, rho):
        table[gone | vague] = np.nan
    flags = [GONE if g else VAGUE if v else f for g, v, f in zip(gone, vague, tracks.flag, strict=True)]
    tracks = replace(tracks, flag=tuple(flags))
    meta = meta_of(film, tracks, disk.state, camera, options, len(turns.doubtful), disk.wobble)
    seen_how = quality(tracks, np.asarray(np.isfinite(values).all(axis=1)))
    correct = applied(film)
    meta |= correct.meta
    seen_how |= {name: column[: len(tracks)] for name, column in correct.columns.items()}
    if moved is not None:
        meta |= moved.meta
    open_questions = [(int(k), "a whole turn may be missing") for k in turns.doubtful[:1]]
    if camera.pivot_from == "support":
        open_questions.append((0, "the contact is not determined"))
    tracks = replace(tracks, flag=tuple(remarks(tracks.t, tracks.flag, seen_how, twice, open_questions)))
    m = Measurement(tracks.t, values, sigma, rho, np.array(tracks.flag), meta, DISK, seen_how)
    try:
        check_length(m)
    except ValueError as error:
        raise TrackError(f"{film.path}: {error}{_commonest(flags)}") from None
    return Tracking(m, tracks, disk.state, camera, disk.rim)


def _commonest(flags: Sequence[str]) -> str:
    """Return the reason that most frames without a position have, as the end of a message."""
    reasons = Counter(flag for flag in flags if flag)
    if not reasons:
        return ""
    reason, count = reasons.most_common(1)[0]
    return f"; in {count} of {len(flags)} frames: {reason}"


def _upright(
    film: Film,
    tracks: Tracks,
    state: TrackerState,
    options: TrackOptions,
    rim: Rim | None,
    twice: bool,
    look_over: Survey | None,
) -> _Upright:
    """Find scale and contact, and undo a wobble if there is one."""

    def camera() -> Camera:
        return camera_of(tracks, state, size_of(state.look.places, rim, options), options)

    before = camera()
    shared = [interpolation_error(tracks, state.exposure**2 / 12)]
    turned = wobble(tracks, state.look)
    stood = correct_wobble(tracks, state.look, turned) if turned.amplitude else None
    if stood is None:
        return _Upright(tracks, state, before, rim, turned, shared)
    if twice:  # a mark is placed best where it is looked for ("wobble": 7 rather than 35 micrometres)
        state = replace(state, look=stood.look)
        tracks = second_pass(film, state, stood.tracks, look_at=stood.look_at)
        stood = correct_wobble(tracks, state.look, turned, stood) or stood
    if rim is not None and options.calibrate.layout and look_over is not None:
        rim = _rim_upright(look_over, stood, state, rim, options)
        stood = stood.centred(rim.centre, upward(stood.look.places - rim.centre, options))
    tracks, lean = stood.about(before.pivot)
    state = replace(state, look=stood.look)
    return _Upright(tracks, state, camera(), rim, turned, [*shared, lean])


def _rim_upright(
    look_over: Survey, stood: WobbleCorrection, state: TrackerState, rim: Rim, options: TrackOptions
) -> Rim:
    """Measure the rim again, from frames with a known foreshortening; its centre from its former place."""
    tracks, around = stood.tracks, LocalMotion(stood.tracks)
    frames = []
    for picture in look_over.pictures:
        here = around.at(picture.index) if picture.index < len(tracks) else None
        if here is not None and here.tracked:
            frames.append((picture, here.pose, here.motion(state.exposure)))
    frames.sort(key=lambda f: stood.look.streak(f[2]))
    frames = frames[:SHARP]
    short = [float(stood.short[picture.index]) for picture, _, _ in frames]
    try:
        return outline(frames, stood.look, state.view, rim_span(options), short=short, across=stood.across)
    except TrackError:  # it was seen once, but not now
        return replace(rim, centre=0j)


def _follow(film: Film, state: TrackerState, frames: int, progress: Progress, watch: Watch | None) -> Tracks:
    with _bar(film, frames, "track", progress) as bar:
        (rows,) = follow(film, [MarkedDisk(state)], _teller(film, state.look, frames, bar, watch))
        return Tracks.of(rows)


def _refine(film: Film, state: TrackerState, tracks: Tracks, progress: Progress) -> Tracks:
    with _bar(film, len(tracks), "refine", progress) as bar:
        return second_pass(film, state, tracks, lambda _: bar.update(), again=True)


def pictures_at(
    video: str | os.PathLike[str], frames: Sequence[int], tracked: Measurement | None = None
) -> list[NDArray[np.uint8]]:
    """Return frames of a film by their number, as RGB arrays.

    With `tracked` they are corrected as the tracker corrected them: steadied and turned upright.

    Parameters
    ----------
    video : path
        The film.
    frames : sequence of int
        Numbers of the frames, counted from 0.
    tracked : Measurement, optional
        Result of :func:`udd.track` for this film.

    Returns
    -------
    list of ndarray of uint8, shape (height, width, 3)
        In the order of `frames`.

    See Also
    --------
    udd.tracking.pictures_between : frames by their times.
    udd.plot.overlay : draw the fitted disk into a frame.

    Examples
    --------
    >>> from udd import tracking
    >>> first, later = tracking.pictures_at("run.mp4", [0, 100])  # doctest: +SKIP
    """
    wanted = {int(i) for i in frames}
    images: dict[int, NDArray[np.uint8]] = {}
    film = _as_tracked(video, tracked)
    for picture in film.pictures():
        if picture.index in wanted:
            images[picture.index] = rgb(picture, film.full_range)
            if len(images) == len(wanted):
                break
    lost = wanted - set(images)
    if lost:
        raise TrackError(f"{video}: there is no frame {min(lost)}")
    return [images[int(i)] for i in frames]


def _as_tracked(video: str | os.PathLike[str], tracked: Measurement | None) -> Film:
    """Open a film with the corrections of a measurement."""
    # Pictures have no times: a folder of them takes its rate from the measurement.
    rate = (1.0 if tracked is None else float(tracked.meta["fps"])) if Path(video).is_dir() else None
    film = Film(video, fps=rate)
    if tracked is not None:
        if "conversion" in tracked.meta:
            film.conversion = Conversion(*tracked.meta["conversion"])
        film.correct = correction_of(tracked.meta, tracked.quality, film.full_range)
    return film


def pictures_between(
    video: str | os.PathLike[str], t: NDArray[np.float64], tracked: Measurement | None = None
) -> Iterator[NDArray[np.uint8]]:
    """Yield the frames nearest to increasing times, as RGB arrays.

    Frames long before them are not decoded.

    Parameters
    ----------
    video : path
        The film.
    t : ndarray, shape (n,)
        Increasing times [s].
    tracked : Measurement, optional
        Result of :func:`udd.track`; frames are corrected as the tracker corrected them.

    Yields
    ------
    ndarray of uint8, shape (height, width, 3)
        One frame for each time.

    See Also
    --------
    udd.tracking.pictures_at : frames by their numbers.

    Examples
    --------
    >>> from udd import tracking
    >>> frames = tracking.pictures_between("run.mp4", np.array([0.5, 1.0]))  # doctest: +SKIP
    """
    film, wanted = _as_tracked(video, tracked), iter(t.tolist())
    want = next(wanted, None)
    before: Picture | None = None
    # a camera's motion is known by the frames' numbers, which count from where decoding begins
    for picture in film.pictures(float(t[0]) if film.correct is None else 0.0):
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
