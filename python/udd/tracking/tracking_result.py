"""Result of the tracker: a measurement in metres from tracks in pixels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd.measurement import DISK, Measurement, check_length
from udd.tracking.calibration.rim import Rim, outline
from udd.tracking.calibration.scale import scale as size_of
from udd.tracking.correction import applied
from udd.tracking.detection.camera_motion import CameraMotion
from udd.tracking.detection.frame_flags import GONE, VAGUE, lost
from udd.tracking.detection.survey import Survey
from udd.tracking.geometry.turns import count_turns, in_doubt
from udd.tracking.metric.calibration_report import camera_of, meta_of
from udd.tracking.metric.common_errors import common_mode_errors
from udd.tracking.metric.pixels_to_metres import Camera, left_the_wheels, metres
from udd.tracking.metric.pose_covariance import add_shared_errors, covariance
from udd.tracking.passes.copied_pixels import without_lag
from udd.tracking.passes.first_pass import TrackerState
from udd.tracking.passes.frame_quality import quality, remarks
from udd.tracking.passes.local_motion import LocalMotion, interpolation_error, to_mid_exposure
from udd.tracking.passes.preparation import SHARP, rim_span, upward
from udd.tracking.passes.second_pass import refine as second_pass
from udd.tracking.passes.tracks import Tracks
from udd.tracking.passes.wobble import Wobble, wobble
from udd.tracking.passes.wobble_correction import WobbleCorrection, correct_wobble
from udd.video.reader import Film, TrackError

from .options import TrackOptions

Array = NDArray[np.float64]
GLUED = 0.3e-3  # m: error of the marks' middle as the disk's centre, if the rim is not seen
UNSURE = 0.005  # share of the disk's radius: a position with a larger standard error is vague


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


@dataclass(frozen=True)
class _Upright:
    """Poses of a disk that stays in its plane, with camera, rim and shared errors."""

    tracks: Tracks
    state: TrackerState
    camera: Camera
    rim: Rim | None
    wobble: Wobble
    shared: list[Array]  # for each cause the errors (n, 3) of u, v and beta, with signs: fully correlated


def to_metres(
    film: Film,
    tracks: Tracks,
    state: TrackerState,
    options: TrackOptions,
    rim: Rim | None,
    twice: bool,
    look_over: Survey | None = None,
    moved: CameraMotion | None = None,
) -> Tracking:
    """Return the measurement in metres, without vague and gone frames; `twice` is True after two passes."""
    if moved is not None and not moved.steady:
        why = lost("the background is not seen, and the camera moves")
        tracks = tracks.without(~moved.is_measured[: len(tracks)], why)
    disk = _upright(film, tracks, state, options, rim, twice, look_over)
    camera = disk.camera
    tracks, late = without_lag(disk.tracks, disk.state.look.reach)
    drive = complex(np.conj(camera.drive)) * camera.scale
    turns = count_turns(tracks.t, tracks.centre, tracks.angle, camera.pivot, drive, disk.state.look.reach)
    tracks = replace(tracks, angle=turns.angle)
    # a given layout also gives the centre
    by_hand = 0.0 if rim is not None and options.calibrate.layout else options.sigma.layout
    if rim is None and options.layout.standard:
        by_hand = GLUED
    centre_sigma = by_hand * camera.scale
    if disk.rim is not None and options.calibrate.layout:
        centre_sigma = disk.rim.centre_sigma
    disk = replace(disk, shared=[*disk.shared, late])
    if moved is not None and not moved.steady:
        disk = replace(disk, shared=[*disk.shared, *moved.errors(tracks.centre)])
    own_errors = covariance(tracks, disk.state.look) * _separation_noise(film, len(tracks))[:, None, None]
    own_errors = to_mid_exposure(tracks, own_errors, disk.state.exposure**2 / 12)
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
    open_questions = in_doubt(turns)
    if camera.pivot_from == "support":
        open_questions.append((0, "the contact is not determined"))
    tracks = replace(tracks, flag=tuple(remarks(tracks.t, tracks.flag, seen_how, twice, open_questions)))
    m = Measurement(tracks.t, values, sigma, rho, np.array(tracks.flag), meta, DISK, seen_how)
    try:
        check_length(m)
    except ValueError as error:
        raise TrackError(f"{film.path}: {error}{_commonest(flags)}") from None
    return Tracking(m, tracks, disk.state, camera, disk.rim)


def _separation_noise(film: Film, count: int) -> Array:
    """Return the variance of each frame's errors relative to a coded frame's, (count,).

    The errors of coded frames are independent, so those of separated frames add up.
    """
    if film.conversion is None:
        return np.ones(count)
    noise = np.maximum(film.conversion.noise(film.packets), 1.0)[:count]
    return np.pad(noise, (0, count - len(noise)), constant_values=1.0)


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
    """Estimate scale and contact, and correct a wobble if it is significant."""

    def camera() -> Camera:
        return camera_of(tracks, state, size_of(state.look.places, rim, options), options)

    before = camera()
    shared = [interpolation_error(tracks, state.exposure**2 / 12)]
    turned = wobble(tracks, state.look)
    stood = correct_wobble(tracks, state.look, turned) if turned.amplitude else None
    if stood is None:
        return _Upright(tracks, state, before, rim, turned, shared)
    if twice:  # marks are fitted where the wobble puts them: errors of 7 in place of 35 micrometres
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
    """Measure the rim again, with the foreshortening of each frame; the centre is relative to the former."""
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
