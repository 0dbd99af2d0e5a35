"""Following the disk from frame to frame."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .acquire import candidates, classify
from .decode import Picture
from .marks import MISFIT, Motion
from .pose import Fit, Look, Pose, align

Array = NDArray[np.float64]
CLOSE = [1.1, MISFIT, MISFIT, MISFIT]  # rounds from a prediction, good to a few pixels
FAR = [2.0, 1.0, MISFIT, MISFIT, MISFIT]  # rounds from blobs, good to ten
MOST_OFF = 2.0  # pixels by which a mark may disagree with the others before it is left out
FLAT = 6.0  # brightness contrast of a black frame


@dataclass
class Tracks:
    """What the pictures say, frame by frame, in pixels and radians."""

    t: list[float]
    centre: list[complex]
    angle: list[float]  # unwrapped
    information: list[Array]  # (3, 3) of (u, v, beta) for the assumed pixel noise
    leftover: list[Array]  # (4, 2) misfit of each mark [pixels], NaN where not used
    chi2: list[Array]  # (4,)
    complete: list[Array]  # (4,) share of each mark's edges in view
    streak: list[float]  # blur length at the marks [pixels]
    flag: list[str]


@dataclass
class Known:
    """All that is known before the loop starts."""

    look: Look
    view: NDArray[np.bool_]
    colours: Array
    exposure: float


def follow(pictures: Iterable[Picture], known: Known, tick: Callable[[int], None] = lambda _: None) -> Tracks:
    """Track the disk through `pictures`; one row per picture, flagged where the disk is not held."""
    tracks = Tracks([], [], [], [], [], [], [], [], [])
    past: list[tuple[float, Pose]] = []
    last: NDArray[np.uint8] | None = None
    for picture in pictures:
        flag, fit, pose, streak = _one(picture, known, past, last)
        last = picture.y
        _append(tracks, picture.t, flag, fit, pose, streak)
        if fit is not None:
            past = [*past[-2:], (picture.t, pose)]
        tick(picture.index)
    return tracks


def _one(
    picture: Picture, known: Known, past: list[tuple[float, Pose]], last: NDArray[np.uint8] | None
) -> tuple[str, Fit | None, Pose, float]:
    nowhere = Pose(complex(np.nan, np.nan), np.nan)
    if picture.damaged:
        return "damaged: the frame does not decode whole", None, nowhere, 0.0
    if float(picture.y[::8, ::8].std()) < FLAT:
        return "black: the frame shows nothing", None, nowhere, 0.0
    guess = predict(past, picture.t)
    if last is not None and guess is not None and _repeats(picture.y, last, guess, past[-1][1], known.look):
        return "dup: the frame repeats the one before", None, nowhere, 0.0
    motion = _motion(past, guess, picture.t, known.exposure)
    if guess is not None:
        pose = Pose(guess.centre, guess.angle)
        fit = _hold(picture, known, pose, motion, CLOSE)
        if fit is not None:
            better = _motion(past, pose, picture.t, known.exposure)
            if abs(_streak(better, known.look) - _streak(motion, known.look)) > 0.3:
                motion = better
                fit = _hold(picture, known, pose, motion, [MISFIT, MISFIT]) or fit
            return "", fit, pose, _streak(motion, known.look)
    best = _anywhere(picture, known, guess, past)
    if best is None:
        return "lost: fewer than two marks agree", None, nowhere, 0.0
    fit, pose, motion = best
    return "", fit, pose, _streak(motion, known.look)


def _hold(picture: Picture, known: Known, pose: Pose, motion: Motion, rounds: list[float]) -> Fit | None:
    """Align and check; a mark that disagrees with two or more others is left out."""
    fit = align(picture.y, known.view, known.look, pose, motion, rounds)
    if fit is None or fit.moved > 0.5 or not _agree(fit):
        return None
    return fit


def _agree(fit: Fit) -> bool:
    off = np.hypot(*fit.step.leftover[fit.used].T)
    return bool(np.all(off < MOST_OFF))


def _anywhere(
    picture: Picture, known: Known, guess: Pose | None, past: list[tuple[float, Pose]]
) -> tuple[Fit, Pose, Motion] | None:
    shape = picture.y.shape
    reach = abs(known.look.marks[0].place)
    box = (0, shape[0], 0, shape[1])
    recent = bool(past) and picture.t - past[-1][0] < 0.5
    if guess is not None and recent:
        r, at = 2.0 * reach, complex(known.look.lens.picture(guess.centre))
        box = (
            max(0, int(at.imag - r)),
            min(shape[0], int(at.imag + r)),
            max(0, int(at.real - r)),
            min(shape[1], int(at.real + r)),
        )
        if box[1] - box[0] < reach or box[3] - box[2] < reach:
            return None
    patches = classify(picture, known.colours, known.view, box)
    best: tuple[float, Fit, Pose, Motion] | None = None
    for pose in candidates(patches, known.look, guess if recent else None)[:6]:
        if guess is not None:
            pose.angle += 2 * np.pi * round((guess.angle - pose.angle) / (2 * np.pi))
        motion = _motion(past, pose if recent else None, picture.t, known.exposure)
        fit = _hold(picture, known, pose, motion, FAR)
        if fit is not None:
            score = float(
                np.nansum([s.complete for s, u in zip(fit.sightings, fit.used, strict=True) if u and s])
            )
            if best is None or score > best[0]:
                best = (score, fit, pose, motion)
    return None if best is None else best[1:]


def predict(past: list[tuple[float, Pose]], t: float) -> Pose | None:
    """Extrapolate through the last poses: a parabola through three, a line through two."""
    if not past:
        return None
    recent = [p for p in past if t - p[0] < 0.5] or past[-1:]
    times = np.array([p[0] - t for p in recent])
    value = np.array([[p.centre.real, p.centre.imag, p.angle] for _, p in recent])
    weights = np.array([np.prod([-b / (a - b) for b in times if b != a]) for a in times])  # Lagrange at 0
    u, v, angle = weights @ value
    return Pose(complex(u, v), float(angle))


def _motion(past: list[tuple[float, Pose]], pose: Pose | None, t: float, exposure: float) -> Motion:
    """Movement during the exposure, from the derivative at `t` of the curve through the last poses."""
    if pose is None or not past or exposure <= 0:
        return Motion()
    points = [p for p in past[-2:] if t - p[0] < 0.5]
    if not points:
        return Motion()
    t1, p1 = points[-1]
    shift, turn = (pose.centre - p1.centre) / (t - t1), (pose.angle - p1.angle) / (t - t1)
    if len(points) == 2:
        t0, p0 = points[0]
        s0, a0 = (p1.centre - p0.centre) / (t1 - t0), (p1.angle - p0.angle) / (t1 - t0)
        lean = (t - t1) / (t - t0)
        shift, turn = shift + (shift - s0) * lean, turn + (turn - a0) * lean
    return Motion(shift * exposure, turn * exposure)


def _streak(motion: Motion, look: Look) -> float:
    return abs(motion.shift) + abs(motion.turn * look.marks[0].place)


def _repeats(y: NDArray[np.uint8], last: NDArray[np.uint8], guess: Pose, before: Pose, look: Look) -> bool:
    """Whether a frame is a copy of the last although the disk should have moved."""
    reach = abs(look.marks[0].place)
    if abs(guess.centre - before.centre) + abs(guess.angle - before.angle) * reach < 1.0:
        return False
    r, c, n = int(before.centre.imag), int(before.centre.real), int(1.3 * reach)
    a = y[max(0, r - n) : r + n, max(0, c - n) : c + n]
    b = last[max(0, r - n) : r + n, max(0, c - n) : c + n]
    return a.size > 0 and float(np.abs(a.astype(np.int16) - b).mean()) < 0.1


def _append(tracks: Tracks, t: float, flag: str, fit: Fit | None, pose: Pose, streak: float) -> None:
    tracks.t.append(t)
    tracks.flag.append(flag)
    tracks.centre.append(pose.centre)
    tracks.angle.append(pose.angle)
    tracks.streak.append(streak)
    if fit is None:
        tracks.information.append(np.full((3, 3), np.nan))
        tracks.leftover.append(np.full((4, 2), np.nan))
        tracks.chi2.append(np.full(4, np.nan))
        tracks.complete.append(np.zeros(4))
        return
    used = fit.used[:, None]
    tracks.information.append(fit.step.information)
    tracks.leftover.append(np.where(used, fit.step.leftover, np.nan))
    tracks.chi2.append(np.where(fit.used, fit.step.chi2, np.nan))
    tracks.complete.append(
        np.array([s.complete if s and u else 0.0 for s, u in zip(fit.sightings, fit.used, strict=True)])
    )
