"""All that is learned from a film before its disk is followed: marks, lens, exposure, rim, contact."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd.calibration_items import Calibrate, Estimate
from udd.errors import outside
from udd.markers.layout import similarity
from udd.tracking.calibration.exposure import Exposure, exposure
from udd.tracking.calibration.exposure import again as retimed
from udd.tracking.calibration.rim import SPAN, Rim, outline
from udd.tracking.calibration.rolling_shutter import Readout, readout
from udd.tracking.calibration.scale import REACH
from udd.tracking.detection.candidates import colours_of
from udd.tracking.detection.colour_blobs import Sight
from udd.tracking.detection.colour_mixing import mixed
from udd.tracking.detection.evidence import shown
from udd.tracking.detection.illumination import evenness
from udd.tracking.detection.occluder import visible
from udd.tracking.detection.survey import Moving, Survey, moving, repeats_last
from udd.tracking.geometry.contact_point import Contact, rough_contact
from udd.tracking.geometry.lens import Lens, LensFit, calibrate
from udd.tracking.geometry.pose import DiskAppearance, Motion, Pose
from udd.tracking.marks.learning import MOST, first_look, places, refine
from udd.tracking.marks.localization import MISFIT
from udd.tracking.marks.pose_fit import align
from udd.tracking.options import TrackOptions
from udd.video.reader import Film, Picture, Plane, TrackError

from .first_pass import TrackerState
from .local_motion import LocalMotion
from .tracks import Tracks

AGAIN = 3  # rounds in which marks are learned from slow frames when their motion is known
FEWEST = 3  # frames in motion from which marks are learned a second time
SHARP = 60  # slow frames from which the rim is measured
FOR_LENS = 90  # frames from which tilt and lens are measured
LENS_ROUNDS = 3  # the second and third time, marks are measured without the first's distortion
FEWEST_POSES = 12  # from which marks are learned
SAME = 0.7  # pixels: the disk is where it was before
SQUARE = 0.4  # pixels by which marks at right angles may seem to be off
RIM_SMEAR = 3.0  # pixels by which lens and compression blur the rim
SURE = 4.0  # standard errors of the layout by which it may be further off, up to as much again
NEAR_RIM = 0.12  # of the radius by which the rim may be off where a layout says it is


def prepare(
    film: Film,
    look_over: Survey,
    sights: list[Sight | None],
    seen: list[tuple[Picture, Sight]],
    options: TrackOptions,
    clear: NDArray[np.bool_] | None = None,
) -> tuple[TrackerState, Rim | None]:
    """Learn from the survey's pictures, in which the disk was found at `sights` (`seen`: slowest first).

    `clear` is False where something looks like the disk's marks but is not.

    Raises
    ------
    TrackError
        No picture is sharp enough, or the rim does not stand out from the background and is needed.
    """
    body, wanted = options.layout.unit, options.calibrate
    fixed = None if wanted.layout else body
    view, white = visible(seen, body)
    view = view & options.view(view.shape)
    if clear is not None:
        view &= clear
    look = first_look(seen, view, white, film.light, body)
    colours = colours_of([p for p, _ in seen], [Pose(s.centre, s.angle) for _, s in seen], look, view)
    even = evenness(seen, view, body, film.light)
    bright = float(film.light[round(white)])
    look = replace(
        look,
        even=even,
        mixed=np.stack(
            [
                mixed(film.light, bright, bright + m.level, colour, film.full_range)
                for m, colour in zip(look.marks, colours, strict=True)
            ]
        ),
    )
    look = refine(look, [(p.y, Pose(s.centre, s.angle), Motion()) for p, s in seen], view, fixed=fixed)
    # a second time with frames whose speed is known, hence their blur
    in_motion = moving(look_over.bursts, sights)
    given = wanted.given("exposure")
    open_for = exposure(in_motion, look, view) if given is None else Exposure(given, 0.0)
    in_motion.sort(key=lambda m: abs(m.rate) + abs(m.turning) * m.sight.reach)
    in_motion = repeats_last(in_motion, [m.sight for m in in_motion])
    frames = [
        (
            m.picture.y,
            Pose(m.sight.centre, m.sight.angle),
            Motion(m.rate * open_for.value, m.turning * open_for.value, rate=m.rate, spin=m.turning),
        )
        for m in in_motion
    ]
    paths = {m.picture.index: path for m, (_, _, path) in zip(in_motion, frames, strict=True)}
    interval = float(np.median([m.interval for m in in_motion])) if in_motion else 0.0
    given = wanted.given("readout")
    rolling = readout(frames, look, view, interval) if given is None else Readout(given, 0.0)
    if rolling.value:
        look = replace(look, readout=rolling.value)
        look = refine(look, frames, view, fixed=fixed)
    for _ in range(LENS_ROUNDS):
        at = places(look, frames[:FOR_LENS], view)
        lens_fit = calibrate(at, view.shape, body, wanted.given("lens"), wanted.given("tilt"))
        if lens_fit.lens.plain:
            break
        look = replace(look, lens=lens_fit.lens)
        for (_, pose, _), m in zip(frames, in_motion, strict=True):
            pose.centre, pose.angle = _in_plane(lens_fit.lens, m.sight, body)
        look = refine(look, frames, view, fixed=fixed)
    else:
        frames = frames[:0]
    if len(frames) >= FEWEST:
        look = refine(look, frames, view, 2, fixed)
    sharp: list[tuple[Picture, Pose, Motion]] = []
    for picture, sight in seen[:SHARP]:
        pose, motion = Pose(*_in_plane(look.lens, sight, body)), paths.get(picture.index, Motion())
        if align(picture.y, view, look, pose, motion, [0.5, *[MISFIT] * 4], gain_slack=0.3) is not None:
            sharp.append((picture, pose, motion))
    if not sharp:
        first, sight = seen[0]
        raise TrackError(
            f"{film.path}: what has the marks' colours, at ({sight.centre.real:.0f}, "
            f"{sight.centre.imag:.0f}) in frame {first.index}, has no sharp edges of marks; "
            f"{shown(look_over.pictures, options)}"
        )
    rim = _rim(film, sharp, look, view, options)
    if rim is not None:
        look = replace(look, rim=rim.radius - RIM_SMEAR)
    look = _centred(look, 0j if rim is None or fixed is not None else rim.centre, options)
    contact = _contact(in_motion, look)
    estimates = {
        **lens_estimates(lens_fit, look.lens, wanted),
        **readout_estimate(rolling, wanted),
        **exposure_estimate(open_for, wanted),
    }
    return TrackerState(look, view, colours, open_for.value, white, contact, estimates), rim


def lens_estimates(lens_fit: LensFit, lens: Lens, wanted: Calibrate) -> dict[str, Estimate]:
    """Lens and tilt as rows of the table."""
    names = ("lens", "tilt across", "tilt upward", "aspect", "shear")
    values = (lens.curve, lens.tilt_u, lens.tilt_v, lens.aspect, lens.shear)
    how = "found" if lens_fit.is_significant else "none found"
    items = ("lens", *["tilt"] * 4)
    return {
        name: wanted.estimate(item, value, float(sigma), how)
        for name, item, value, sigma in zip(names, items, values, lens_fit.sigma, strict=True)
    }


def readout_estimate(readout: Readout, wanted: Calibrate) -> dict[str, Estimate]:
    """Return the readout as a row of the table."""
    how = "found" if readout.value else "none found"
    return {"readout": wanted.estimate("readout", readout.value, readout.sigma, how)}


def exposure_estimate(exposure: Exposure, wanted: Calibrate) -> dict[str, Estimate]:
    """Return the exposure as a row of the table."""
    how = "found" if exposure.value or np.isfinite(exposure.sigma) else "too slow to tell"
    return {"exposure": wanted.estimate("exposure", exposure.value, exposure.sigma, how)}


def recalibrate(
    state: TrackerState, look_over: Survey, tracks: Tracks, options: TrackOptions
) -> TrackerState:
    """Exposure, readout and marks once more, now that every frame's motion is known from its neighbours."""
    around, wanted = LocalMotion(tracks), options.calibrate
    frames = []
    for picture in look_over.pictures:
        here = around.at(picture.index) if picture.index < len(tracks) else None
        if here is not None and here.tracked and not tracks.flag[picture.index]:
            frames.append((picture.y, here))
    if not frames:
        return state
    if state.look.readout and wanted.given("readout") is None:
        moving = [(y, here.pose, here.motion(state.exposure)) for y, here in frames]
        rolling = readout(moving, state.look, state.view, around.interval)
        if rolling.value:
            estimates = {**state.estimates, **readout_estimate(rolling, wanted)}
            state = replace(state, look=replace(state.look, readout=rolling.value), estimates=estimates)
    if state.exposure and wanted.given("exposure") is None:
        paths = [(y, here.pose, here.motion) for y, here in frames]
        value = retimed(paths, state.exposure, state.look, state.view)
        exposure = Exposure(value, state.estimates["exposure"].sigma)
        state = replace(
            state, exposure=value, estimates={**state.estimates, **exposure_estimate(exposure, wanted)}
        )
    moving = [(y, Pose(here.pose.centre, here.pose.angle), here.motion(state.exposure)) for y, here in frames]
    moving.sort(key=lambda f: state.look.streak(f[2]))
    moving = _with_new_poses(moving, state.look)
    slower = moving[: -(-len(moving) // 2)]
    fixed = None if wanted.layout else options.layout.unit
    look = refine(state.look, slower[:: -(-len(slower) // MOST)], state.view, AGAIN, fixed)
    return replace(state, look=look)


def _with_new_poses(
    frames: list[tuple[Plane, Pose, Motion]], look: DiskAppearance
) -> list[tuple[Plane, Pose, Motion]]:
    """Return the frames that show the disk as no earlier one does; all of them if these are too few.

    A mark's place that is learned from a disk at rest has the error of that one pose.
    """
    new: dict[tuple[int, int, int], tuple[Plane, Pose, Motion]] = {}
    for frame in frames:
        pose = frame[1]
        turned = (pose.angle % (2 * np.pi)) * look.reach
        at = (pose.centre.real, pose.centre.imag, turned)
        new.setdefault((round(at[0] / SAME), round(at[1] / SAME), round(at[2] / SAME)), frame)
    return list(new.values()) if len(new) >= FEWEST_POSES else frames


def _rim(
    film: Film,
    sharp: list[tuple[Picture, Pose, Motion]],
    look: DiskAppearance,
    view: NDArray[np.bool_],
    options: TrackOptions,
) -> Rim | None:
    """Fit the disk's outline; None if it is not visible, and then the marks give the centre."""
    try:
        return outline(sharp, look, view, rim_span(options))
    except TrackError:
        if options.layout.standard:
            reach = options.mark_distance or REACH * options.disk_radius
            warnings.warn(
                f"{film.path}: the disk's rim is not seen against the background; its centre and scale are "
                f"those of the marks, {1e3 * reach:.3g} mm from it",
                stacklevel=outside(),
            )
        return None


def rim_span(options: TrackOptions) -> tuple[float, float]:
    """Return the search range of the rim, in units of the marks' reach."""
    if options.layout.standard:
        return SPAN
    ratio = options.disk_radius / options.layout.reach
    margin = NEAR_RIM + min(SURE * options.sigma.layout / options.disk_radius, NEAR_RIM)
    return (1 - margin) * ratio, (1 + margin) * ratio


def _contact(in_motion: list[Moving], look: DiskAppearance) -> Contact | None:
    if not in_motion:
        return None
    before = look.lens.plane(np.array([m.step[0] for m in in_motion], dtype=np.complex128))
    after = look.lens.plane(np.array([m.step[1] for m in in_motion], dtype=np.complex128))
    turn, dt = np.array([m.step[2] for m in in_motion]), np.array([m.step[3] for m in in_motion])
    return rough_contact(before, after, turn, dt, look.reach)


def _in_plane(lens: Lens, sight: Sight, body: NDArray[np.complex128]) -> tuple[complex, float]:
    """Return a sight in the picture as a pose in the plane of the disk."""
    arms = body * sight.reach * np.exp(1j * sight.angle)
    centre, factor = similarity(arms, lens.plane(sight.centre + arms))
    return centre, sight.angle + float(np.angle(factor))


def _centred(look: DiskAppearance, centre: complex, options: TrackOptions) -> DiskAppearance:
    """Marks as seen from the disk's own centre, turned to beta = 0."""
    turn = upward(look.places - centre, options)
    marks = [
        replace(m, place=(m.place - centre) / turn, turn=m.turn - float(np.angle(turn))) for m in look.marks
    ]
    return replace(look, marks=marks)


def upward(places: NDArray[np.complex128], options: TrackOptions) -> complex:
    """Return the turn of marks at `places` from the disk's centre; of the standard ones red is at beta.

    If all four are at right angles within their errors, all four define beta, as do all the marks of any
    other layout. The first mark defines beta of a layout that is given with an error.
    """
    body = options.layout.unit
    if options.sigma.layout and options.calibrate.layout:
        first = options.layout.first
        turn = complex(places[first] / body[first])
        return turn / abs(turn)
    if not options.layout.standard:
        turn = complex(np.vdot(body - body.mean(), places - places.mean()))
        return turn / abs(turn)
    turns = places / np.abs(places) / body
    off = np.angle(turns / turns.mean()) * np.abs(places)
    if np.abs(off).max() < SQUARE:
        return complex(turns.mean() / abs(turns.mean()))
    return complex(turns[0])
