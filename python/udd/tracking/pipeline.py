"""The tracker's pipeline: from a film to a measurement."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.progress import Count, Progress, progress_bar
from udd.calibration_items import Calibrate
from udd.errors import outside
from udd.markers.layout import Layout
from udd.measurement import Measurement
from udd.tracking.calibration.config import Config, read_options
from udd.tracking.calibration.exposure import at_middle
from udd.tracking.correction import Correction, applied
from udd.tracking.detection.background import steadied
from udd.tracking.detection.camera_motion import CameraMotion
from udd.tracking.detection.recognition import placed, recognise
from udd.tracking.detection.survey import Survey, survey
from udd.tracking.geometry.pose import DiskAppearance, Pose
from udd.tracking.manual.clicked_options import with_clicks
from udd.tracking.metric.apparent_gravity import ApparentGravity, apparent_gravity
from udd.tracking.metric.doubts import doubts, quarter_turns
from udd.tracking.metric.film_clock import slow_parts, text_of
from udd.tracking.metric.pixels_to_metres import recount
from udd.tracking.passes.first_pass import MarkedDisk, TrackerState
from udd.tracking.passes.frame_loop import follow
from udd.tracking.passes.pendulum_bob import track_bob
from udd.tracking.passes.preparation import prepare, recalibrate
from udd.tracking.passes.second_pass import drop_weak
from udd.tracking.passes.second_pass import refine as second_pass
from udd.tracking.passes.tag_tracking import follow_tags
from udd.tracking.passes.tracks import Tracks
from udd.video.reader import Film, Picture, TrackError

from .options import MoreOptions, TrackOptions
from .tracked_frame import TrackedFrame
from .tracking_result import Tracking, to_metres

Array = NDArray[np.float64]
Watch = Callable[[TrackedFrame], object]


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
    return to_metres(film, tracks, state, options, rim, options.refine, look_over, camera)


def _track_tags(film: Film, options: TrackOptions, progress: Progress, watch: Watch | None) -> Tracking:
    """Track printed tags: each frame by itself, in one pass."""
    frames = film.promised or film.packets
    with _bar(film, frames, "track", progress) as bar:
        tell = _teller(film, None, frames, bar, watch)
        tracks, state = follow_tags(film, options, tell)
    return _with_doubts(film, to_metres(film, _unwrap(tracks, state.exposure), state, options, None, False))


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


def _follow(film: Film, state: TrackerState, frames: int, progress: Progress, watch: Watch | None) -> Tracks:
    with _bar(film, frames, "track", progress) as bar:
        (rows,) = follow(film, [MarkedDisk(state)], _teller(film, state.look, frames, bar, watch))
        return Tracks.of(rows)


def _refine(film: Film, state: TrackerState, tracks: Tracks, progress: Progress) -> Tracks:
    with _bar(film, len(tracks), "refine", progress) as bar:
        return second_pass(film, state, tracks, lambda picture, pose: bar.update(), again=True)
