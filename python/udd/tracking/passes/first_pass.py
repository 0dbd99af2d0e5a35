"""A disk with coloured marks as a target: fitted where it is predicted, or searched for by colours."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.calibration_items import Estimate
from udd.tracking.detection.candidates import candidates, classify
from udd.tracking.geometry.contact_point import Contact
from udd.tracking.geometry.pose import DiskAppearance, Motion, Pose
from udd.tracking.marks.localization import MISFIT
from udd.tracking.marks.pose_fit import Fit, align
from udd.video.reader import Box, Picture

from .frame_loop import Corrected, PoseSample, Prediction, Target
from .tracks import FrameTrack, found_in, lost_in

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
BESIDE, ASIDE = 1.4, 16.0  # of the marks' reach and pixels: what belongs to the disk in a picture


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

    def box(self, poses: Sequence[Pose], streak: float, shape: tuple[int, ...]) -> Box:
        """Return the part of a picture of this shape that shows the disk at some poses, to even numbers."""
        at = self.look.lens.picture(np.array([pose.centre for pose in poses]))
        margin = BESIDE * self.look.reach + streak + ASIDE

        def side(x: Array, size: int) -> tuple[int, int]:
            low, high = np.clip([x.min() - margin, x.max() + margin], 0, size).astype(int) & ~1
            return int(low), int(high)

        return *side(at.imag, shape[0]), *side(at.real, shape[1])


@dataclass(frozen=True)
class Located:
    """The marks fitted in a frame."""

    fit: Fit
    pose: Pose
    motion: Motion


class MarkedDisk(Target[Located, FrameTrack]):
    """A disk with coloured marks, as a target of the loop over the frames."""

    def __init__(self, state: TrackerState) -> None:
        self.state, self.contact = state, state.contact

    def surroundings(self, pose: Pose) -> tuple[NDArray[np.complex128], int, float]:
        """Return the marks' places, the pixels about each, and their reach [pixels]."""
        look = self.state.look
        places = look.lens.picture(pose.centre + look.places * np.exp(1j * pose.angle))
        return places, int(SURROUNDINGS * np.hypot(*look.marks[0].half)), look.reach

    def box(self, poses: Sequence[Pose], shape: tuple[int, ...]) -> Box | None:
        """Return the part of the picture in which the disk lies at these poses."""
        return self.state.box(poses, 0.0, shape)

    def attempts(
        self, corrected: Corrected, picture: Picture, expected: Prediction | None
    ) -> Iterator[Located | str]:
        """Fit the marks where they are predicted, then start afresh from their colours."""
        state = self.state
        if expected is not None and expected.age < FRESH:
            guess, past = expected.pose, expected.past
            pose = Pose(guess.centre, guess.angle)
            motion = _motion(past, guess, picture.t, state)
            fit = fit_and_check(picture, state, pose, motion, CLOSE)
            if fit is not None:
                better = _motion(past, pose, picture.t, state)
                if abs(state.look.streak(better) - state.look.streak(motion)) > 0.3:
                    motion = better
                    fit = fit_and_check(picture, state, pose, motion, [MISFIT, MISFIT]) or fit
                yield Located(fit, pose, motion)
        yield _reacquire(corrected(None), state, expected) or "fewer than two marks agree"

    def sample(self, seen: Located, expected: Prediction | None, t: float) -> PoseSample:
        """Return the pose of a result."""
        return PoseSample(t, seen.pose, seen.motion.spin)

    def row(self, t: float, flag: str, seen: Located | None) -> FrameTrack:
        """Return the row of a frame."""
        look = self.state.look
        if seen is None:
            return lost_in(t, flag, 0.0, len(look.marks))
        return found_in(t, seen.fit, seen.pose, look.streak(seen.motion), "fast")


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


def _reacquire(picture: Picture, state: TrackerState, expected: Prediction | None) -> Located | None:
    """Start afresh from blobs of the marks' colours, at several rates of turning where it is not known."""
    shape = picture.y.shape
    reach = state.look.reach
    box = (0, shape[0], 0, shape[1])
    guess = None if expected is None else expected.pose
    recent = expected if expected is not None and expected.age < FRESH else None
    if recent is not None:
        r, at = 2.0 * reach, complex(state.look.lens.picture(recent.pose.centre))
        box = (
            max(0, int(at.imag - r)),
            min(shape[0], int(at.imag + r)),
            max(0, int(at.real - r)),
            min(shape[1], int(at.real + r)),
        )
        if box[1] - box[0] < reach or box[3] - box[2] < reach:
            return None
    patches = classify(picture, state.colours, state.view, box)
    best: tuple[float, Located] | None = None
    for start in candidates(patches, state.look, None if recent is None else guess)[:MOST_TRIED]:
        if guess is not None:
            start.angle += 2 * np.pi * round((guess.angle - start.angle) / (2 * np.pi))
        for motion in _motions(recent, start, picture.t, state):
            pose = Pose(start.centre, start.angle)
            fit = fit_and_check(picture, state, pose, motion, FAR)
            if fit is not None:
                score = sum(s.complete for s, u in zip(fit.sightings, fit.used, strict=True) if u and s)
                if best is None or score > best[0]:
                    best = (score, Located(fit, pose, motion))
        if best is not None:
            break
    return None if best is None else best[1]


def _motions(recent: Prediction | None, pose: Pose, t: float, state: TrackerState) -> list[Motion]:
    if recent is not None:
        return [_motion(recent.past, pose, t, state)]
    if state.exposure <= 0:
        return [Motion()]
    step = 2 * STREAK_STEP / (state.look.reach * state.exposure)
    count = int(np.ceil(FASTEST / step))
    rates = step * np.arange(-count, count + 1)
    if state.contact is not None:
        return [along_contact(state, pose, r) for r in rates]
    return [Motion(0j, r * state.exposure, spin=r) for r in rates]


def _motion(past: Sequence[PoseSample], pose: Pose, t: float, state: TrackerState) -> Motion:
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
