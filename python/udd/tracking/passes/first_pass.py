"""The first pass: the disk is followed from frame to frame."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.calibration_items import Estimate
from udd.tracking.detection.candidates import candidates, classify
from udd.tracking.detection.frame_flags import REPEATED, is_copy, lost, unusable
from udd.tracking.geometry.contact_point import Contact
from udd.tracking.geometry.pose import DiskAppearance, Motion, Pose
from udd.tracking.marks.localization import MISFIT
from udd.tracking.marks.pose_fit import Fit, align
from udd.video.reader import Picture

from .tracks import FrameTrack, Tracks, found_in, lost_in

Array = NDArray[np.float64]
CLOSE = [1.1, MISFIT, MISFIT, MISFIT]  # rounds from a prediction, good to a few pixels
FAR = [2.0, 1.0, MISFIT, MISFIT, MISFIT]  # rounds from blobs, good to ten
MOST_OFF = 2.0  # pixels by which a mark may disagree with the others before it is left out
STREAK_OFF = 0.05  # more for a streak, per pixel of its length
FRESH = 0.15  # s: how long the last pose tells where to look
MOST_TRIED = 3  # starting poses
FASTEST = 20.0  # rad/s: rates of turning tried when the last one is forgotten
STREAK_STEP = 8.0  # pixels of streak by which those rates may miss
BARE = np.concatenate([np.exp(2j * np.pi * np.arange(12) / 12), 0.5 * np.exp(2j * np.pi * np.arange(6) / 6)])
SURROUNDINGS = 1.3  # of half a mark's diagonal: what is compared with the last frame


@dataclass(frozen=True)
class TrackerState:
    """All that is known before the loop starts."""

    look: DiskAppearance
    view: NDArray[np.bool_]
    colours: Array
    exposure: float  # [s]
    white: float  # brightness code of the bare disk
    contact: Contact | None
    estimates: Mapping[str, Estimate]  # rows of the table of calibrations, for what is known by now


@dataclass(frozen=True)
class PoseSample:
    """A frame in which the disk was tracked."""

    t: float
    pose: Pose
    rate: float  # of turning [rad/s]


def follow(
    pictures: Iterable[Picture],
    state: TrackerState,
    tick: Callable[[Picture, Pose], object] = lambda _picture, _pose: None,
) -> Tracks:
    """Track the disk through `pictures`; one row per picture, flagged where the disk is not tracked.

    After each picture `tick` is called with the picture and the pose, NaN if the disk is not tracked.
    """
    frames: list[FrameTrack] = []
    past: list[PoseSample] = []
    last: NDArray[np.uint8] | None = None
    for picture in pictures:
        flag, fit, pose, motion = _track_frame(picture, state, past, last)
        # a disk that is not seen, as behind a hand, does not move: no copy is recognised by it
        last = picture.y if flag in ("", REPEATED) else None
        streak = state.look.streak(motion)
        if fit is None:
            frames.append(lost_in(picture.t, flag, streak, len(state.look.marks)))
        else:
            frames.append(found_in(picture.t, fit, pose, streak, "fast"))
            past = [*past[-2:], PoseSample(picture.t, pose, motion.spin)]
        tick(picture, pose)
    return Tracks.of(frames)


def _track_frame(
    picture: Picture, state: TrackerState, past: list[PoseSample], last: NDArray[np.uint8] | None
) -> tuple[str, Fit | None, Pose, Motion]:
    nowhere = Pose(complex(np.nan, np.nan), np.nan)
    flag = unusable(picture)
    if flag:
        return flag, None, nowhere, Motion()
    guess = predict(past, picture.t, state.contact)
    if last is not None and guess is not None and repeats(picture.y, last, guess, past[-1].pose, state.look):
        return REPEATED, None, nowhere, Motion()
    if guess is not None and picture.t - past[-1].t < FRESH:
        pose = Pose(guess.centre, guess.angle)
        motion = _motion(past, guess, picture.t, state)
        fit = fit_and_check(picture, state, pose, motion, CLOSE)
        if fit is not None:
            better = _motion(past, pose, picture.t, state)
            if abs(state.look.streak(better) - state.look.streak(motion)) > 0.3:
                motion = better
                fit = fit_and_check(picture, state, pose, motion, [MISFIT, MISFIT]) or fit
            return "", fit, pose, motion
    best = _reacquire(picture, state, guess, past)
    if best is None:
        return lost("fewer than two marks agree"), None, nowhere, Motion()
    fit, pose, motion = best
    return "", fit, pose, motion


def fit_and_check(
    picture: Picture, state: TrackerState, pose: Pose, motion: Motion, rounds: list[float]
) -> Fit | None:
    """Align and check; a mark that disagrees with three others is left out."""
    most_off = MOST_OFF + STREAK_OFF * state.look.streak(motion)
    start = Pose(pose.centre, pose.angle)
    fit = align(picture.y, state.view, state.look, pose, motion, rounds)
    if fit is not None and fit.used.sum() >= 4 and _worst(fit)[1] > most_off:
        pose.centre, pose.angle = start.centre, start.angle
        fit = align(picture.y, state.view, state.look, pose, motion, rounds, without=_worst(fit)[0])
    if fit is None or fit.moved > 0.5 + 0.1 * most_off or _worst(fit)[1] > most_off:
        return None
    return fit if _on_the_disk(picture, state, pose) else None


def _worst(fit: Fit) -> tuple[int, float]:
    off = np.where(fit.used, np.hypot(*fit.step.residuals.T), 0.0)
    k = int(np.argmax(off))
    return k, float(off[k])


def _on_the_disk(picture: Picture, state: TrackerState, pose: Pose) -> bool:
    """Return True if the marks enclose a bare and bright disk."""
    look = state.look
    half = np.hypot(*look.marks[0].half)
    inner = 0.7 * (look.reach - half) * BARE
    marks = look.places * np.exp(1j * pose.angle)
    bare = np.abs(inner[:, None] - marks[None, :]).min(axis=1) > 1.2 * half  # of the standard marks all
    points = look.lens.picture(pose.centre + inner[bare])
    r, c = np.round(points.imag).astype(int), np.round(points.real).astype(int)
    height, width = picture.y.shape
    ok = (r >= 0) & (r < height) & (c >= 0) & (c < width)
    r, c = r[ok], c[ok]
    clear = state.view[r, c]
    if clear.sum() < 5:
        return True
    level = picture.y[r[clear], c[clear]].astype(float)
    return bool(np.mean(np.abs(level - state.white) < 0.2 * state.white) > 0.7)


def _reacquire(
    picture: Picture, state: TrackerState, guess: Pose | None, past: list[PoseSample]
) -> tuple[Fit, Pose, Motion] | None:
    """Start afresh from blobs of the marks' colours, at several rates of turning where it is not known."""
    shape = picture.y.shape
    reach = state.look.reach
    box = (0, shape[0], 0, shape[1])
    fresh = guess is not None and picture.t - past[-1].t < FRESH
    if guess is not None and fresh:
        r, at = 2.0 * reach, complex(state.look.lens.picture(guess.centre))
        box = (
            max(0, int(at.imag - r)),
            min(shape[0], int(at.imag + r)),
            max(0, int(at.real - r)),
            min(shape[1], int(at.real + r)),
        )
        if box[1] - box[0] < reach or box[3] - box[2] < reach:
            return None
    patches = classify(picture, state.colours, state.view, box)
    best: tuple[float, Fit, Pose, Motion] | None = None
    for start in candidates(patches, state.look, guess if fresh else None)[:MOST_TRIED]:
        if guess is not None:
            start.angle += 2 * np.pi * round((guess.angle - start.angle) / (2 * np.pi))
        for motion in _motions(past, start, picture.t, state, fresh):
            pose = Pose(start.centre, start.angle)
            fit = fit_and_check(picture, state, pose, motion, FAR)
            if fit is not None:
                score = sum(s.complete for s, u in zip(fit.sightings, fit.used, strict=True) if u and s)
                if best is None or score > best[0]:
                    best = (score, fit, pose, motion)
        if best is not None:
            break
    return None if best is None else best[1:]


def _motions(past: list[PoseSample], pose: Pose, t: float, state: TrackerState, fresh: bool) -> list[Motion]:
    if fresh:
        return [_motion(past, pose, t, state)]
    if state.exposure <= 0:
        return [Motion()]
    step = 2 * STREAK_STEP / (state.look.reach * state.exposure)
    count = int(np.ceil(FASTEST / step))
    rates = step * np.arange(-count, count + 1)
    if state.contact is not None:
        return [along_contact(state, pose, r) for r in rates]
    return [Motion(0j, r * state.exposure, spin=r) for r in rates]


def predict(past: list[PoseSample], t: float, contact: Contact | None) -> Pose | None:
    """Predict the pose: the angle by extrapolation, the centre by rotation about the contact."""
    if not past:
        return None
    last = past[-1]
    dt = t - last.t
    recent = [h for h in past if t - h.t < 0.5] or [last]
    if len(recent) == 3 and dt > 1.6 * (last.t - recent[-2].t):
        recent = recent[-2:]  # a parabola does not reach across a gap
    times = np.array([h.t - t for h in recent])
    weights = np.array([np.prod([-b / (a - b) for b in times if b != a]) for a in times])  # Lagrange at 0
    if len(recent) == 1:
        angle = last.pose.angle + last.rate * min(dt, 0.5)
    else:
        angle = float(weights @ np.array([h.pose.angle for h in recent]))
    if contact is not None:
        return Pose(contact.carry(last.pose.centre, angle - last.pose.angle, dt), angle)
    return Pose(complex(weights @ np.array([h.pose.centre for h in recent])), angle)


def _motion(past: list[PoseSample], pose: Pose, t: float, state: TrackerState) -> Motion:
    """Movement during the exposure, from the derivative at `t` of the curve through the last poses."""
    points = [h for h in past[-2:] if t - h.t < 0.5]
    if not points:
        return Motion()
    t1, p1 = points[-1].t, points[-1].pose
    shift, turn = (pose.centre - p1.centre) / (t - t1), (pose.angle - p1.angle) / (t - t1)
    change = 0.0  # of the rate of turning [rad/s^2]
    if len(points) == 2:
        t0, p0 = points[0].t, points[0].pose
        s0, a0 = (p1.centre - p0.centre) / (t1 - t0), (p1.angle - p0.angle) / (t1 - t0)
        lean = (t - t1) / (t - t0)
        change = 2 * (turn - a0) / (t - t0)
        shift, turn = shift + (shift - s0) * lean, turn + (turn - a0) * lean
    else:
        turn = 2 * turn - points[-1].rate  # the mean rate over the step, and the rate at its beginning
    if state.contact is None:
        return Motion(shift * state.exposure, turn * state.exposure, rate=shift, spin=turn)
    return along_contact(state, pose, turn, change)


def along_contact(state: TrackerState, pose: Pose, spin: float, change: float = 0.0) -> Motion:
    """Return the path of a disk that rotates about the contact at the varying rate `spin`."""
    contact = state.contact
    assert contact is not None
    rate = contact.velocity(pose.centre, spin)
    bending = 1j * (change * (pose.centre - contact.place) + spin * rate)
    return Motion.of_rates(rate, spin, bending, change, state.exposure)


def repeats(
    y: NDArray[np.uint8], last: NDArray[np.uint8], guess: Pose, before: Pose, look: DiskAppearance
) -> bool:
    """Return True if a frame is a copy of the last although the disk should have moved."""
    reach = look.reach
    if abs(guess.centre - before.centre) + abs(guess.angle - before.angle) * reach < 1.0:
        return False
    places = look.lens.picture(before.centre + look.places * np.exp(1j * before.angle))
    return is_copy(y, last, places, int(SURROUNDINGS * np.hypot(*look.marks[0].half)))
