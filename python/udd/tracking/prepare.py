"""All that is learned from a film before its disk is followed: marks, lens, exposure, rim, contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .acquire import colours_of
from .decode import Film, Picture, TrackError
from .disk import Outline, outline
from .exposure import exposure
from .find import BODY, Sight
from .learn import first_look, places, refine
from .lens import Lens, calibrate
from .look import Look, Motion, Pose
from .loop import Known
from .marks import MISFIT
from .occluder import visible
from .pivot import Contact, rough_contact
from .pose import align
from .readout import readout
from .survey import Moving, Survey, moving, repeats_last

FEWEST = 3  # frames in motion from which marks are learned a second time
SHARP = 60  # slow frames from which the rim is measured
FOR_LENS = 90  # frames from which tilt and lens are measured
LENS_ROUNDS = 3  # the second and third time, marks are measured without the first's distortion
SQUARE = 0.15  # pixels by which marks at right angles may seem to be off
RIM_SMEAR = 3.0  # pixels by which lens and compression blur the rim


def prepare(
    film: Film, look_over: Survey, sights: list[Sight | None], seen: list[tuple[Picture, Sight]]
) -> tuple[Known, Outline]:
    """Learn from the survey's pictures, in which the disk was found at `sights` (`seen`: slowest first).

    Raises
    ------
    TrackError
        No picture is sharp enough, or the rim does not stand out from the background.
    """
    view, white = visible(seen)
    look = first_look(seen, view, white, film.light)
    look = refine(look, [(p.y, Pose(s.centre, s.angle), Motion()) for p, s in seen], view)
    # a second time with frames whose speed is known, hence their blur
    in_motion = moving(look_over.bursts, sights)
    open_for = exposure(in_motion, look, view)
    in_motion.sort(key=lambda m: abs(m.rate) + abs(m.turning) * m.sight.reach)
    in_motion = repeats_last(in_motion, [m.sight for m in in_motion])
    frames = [
        (
            m.picture.y,
            Pose(m.sight.centre, m.sight.angle),
            Motion(m.rate * open_for, m.turning * open_for, rate=m.rate, spin=m.turning),
        )
        for m in in_motion
    ]
    paths = {m.picture.index: path for m, (_, _, path) in zip(in_motion, frames, strict=True)}
    interval = float(np.median([m.interval for m in in_motion])) if in_motion else 0.0
    rolling = readout(frames, look, view, interval)
    if rolling.value:
        look = replace(look, readout=rolling.value)
        look = refine(look, frames, view)
        rolling = readout(frames, look, view, interval)
        look = replace(look, readout=rolling.value)
    for _ in range(LENS_ROUNDS):
        lens = calibrate(places(look, frames[:FOR_LENS], view), view.shape)
        if lens is None:
            break
        look = replace(look, lens=lens)
        for (_, pose, _), m in zip(frames, in_motion, strict=True):
            pose.centre, pose.angle = _in_plane(lens, m.sight)
        look = refine(look, frames, view)
    else:
        frames = frames[:0]
    if len(frames) >= FEWEST:
        look = refine(look, frames, view, 2)
    sharp: list[tuple[Picture, Pose, Motion]] = []

    for picture, sight in seen[:SHARP]:
        pose, motion = Pose(*_in_plane(look.lens, sight)), paths.get(picture.index, Motion())
        if align(picture.y, view, look, pose, motion, [0.5, *[MISFIT] * 4], gain_slack=0.3) is not None:
            sharp.append((picture, pose, motion))
    if not sharp:
        raise TrackError(f"{film.path}: the marks are found but never sharp enough to be measured")
    try:
        rim = outline(sharp, look, view)
    except TrackError as error:
        raise TrackError(f"{film.path}: {error}") from None
    colours = colours_of([p for p, _, _ in sharp], [q for _, q, _ in sharp], look, view)
    look = replace(_centred(look, rim.centre), rim=rim.radius - RIM_SMEAR)
    return Known(look, view, colours, open_for, white, _contact(in_motion, look), rolling), rim


def _contact(in_motion: list[Moving], look: Look) -> Contact | None:
    if not in_motion:
        return None
    before = look.lens.plane(np.array([m.step[0] for m in in_motion], dtype=np.complex128))
    after = look.lens.plane(np.array([m.step[1] for m in in_motion], dtype=np.complex128))
    turn, dt = np.array([m.step[2] for m in in_motion]), np.array([m.step[3] for m in in_motion])
    return rough_contact(before, after, turn, dt, abs(look.marks[0].place))


def _in_plane(lens: Lens, sight: Sight) -> tuple[complex, float]:
    """A sight in the picture as a pose in the plane of the disk."""
    arms = BODY * sight.reach * np.exp(1j * sight.angle)
    marks = lens.plane(sight.centre + arms)
    turn = float(np.angle(np.vdot(arms, marks - marks.mean())))
    return complex(marks.mean()), sight.angle + turn


def _centred(look: Look, centre: complex) -> Look:
    """Marks as seen from the disk's own centre, red at beta.

    Where all four stand at right angles as nearly as they are known, all four say where beta is.
    """
    places = look.places - centre
    turns = places / np.abs(places) / BODY
    off = np.angle(turns / turns.mean()) * np.abs(places)
    turn = complex(turns[0])
    if np.abs(off).max() < SQUARE:
        turn = complex(turns.mean() / abs(turns.mean()))
    marks = [
        replace(m, place=(m.place - centre) / turn, turn=m.turn - float(np.angle(turn))) for m in look.marks
    ]
    return replace(look, marks=marks)
