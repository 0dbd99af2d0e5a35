"""Learning the marks from the film: their places on the disk, sizes, orientation, contrast, sharpness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd.tracking.detection.colour_blobs import Sight
from udd.tracking.geometry.pose import DiskAppearance, Mark, Motion, Pose
from udd.video.reader import Picture, Plane

from .localization import MISFIT, Sighting, beyond_place, coverage, seen_at
from .pose_fit import align
from .rigid_fit import solve

ROUNDS = 6
MOST = 40  # frames to learn from
WHOLE = 0.97  # share of its edges that is in view for a mark to learn from
HALF_SEEN = 0.5  # and that looks as expected
STEADY = 0.005  # pixels; shapes that change less have settled
FAR_OFF = 1.0  # pixels; a mark further off its expected place says less about the layout


Array = NDArray[np.float64]
Frame = tuple[Plane, Pose, Motion]
Seen = tuple[Pose, Motion, list[Sighting | None]]


def first_look(
    seen: Sequence[tuple[Picture, Sight]],
    view: NDArray[np.bool_],
    white: float,
    light: NDArray[np.float64],
    body: NDArray[np.complex128],
) -> DiskAppearance:
    """Equal squares at the places `body` (in units of the outermost's distance): what the blobs say."""
    frames = [(p.y, Pose(s.centre, s.angle)) for p, s in seen[:MOST]]
    reach = float(np.median([s.reach for _, s in seen]))
    half = float(np.sqrt(np.median([s.area for _, s in seen]))) / 2
    marks = [
        Mark(complex(d) * reach, (half, half), 0.0, _level(frames, complex(d) * reach, view, white, light))
        for d in body
    ]
    # the true rim is found later, with these marks
    return DiskAppearance(marks, 0.8, _noise(seen, view, light, white), light, reach + 1.3 * half)


def refine(
    look: DiskAppearance,
    frames: Sequence[Frame],
    view: NDArray[np.bool_],
    rounds: int = ROUNDS,
    fixed: NDArray[np.complex128] | None = None,
) -> DiskAppearance:
    """Fit shape, place and contrast of the four marks to frames whose pose is roughly known.

    Poses and shapes are found in turns: poses (changed in place) from the present shapes, then one
    joint least-squares step per mark for its shape with the pose of every frame left free. With `fixed`
    places they keep these, at a scale of their own.
    """
    for turn in range(rounds):
        fits: list[Seen] = []
        for y, pose, motion in frames[:MOST]:
            steps = [1.0, 0.5] if turn == 0 else [0.5 if turn < rounds // 2 else MISFIT]
            fit = align(y, view, look, pose, motion, steps, gain_slack=1.0, keep=True)
            if fit is not None:
                fits.append((pose, motion, fit.sightings))
        marks, psf = _reshape(fits, look, view.shape[0])
        if fixed is not None:
            marks = _like(marks, fixed)
        change = max(
            abs(m.place - n.place) + abs(m.half[0] - n.half[0])
            for m, n in zip(marks, look.marks, strict=True)
        )
        look = replace(look, marks=marks, psf=psf)
        if change < STEADY and turn > rounds // 2:
            break
    return look


def _like(marks: list[Mark], body: NDArray[np.complex128]) -> list[Mark]:
    """Return the marks at the places of `body`, with their sizes."""
    now = np.array([m.place for m in marks])
    factor = float(np.vdot(body, now).real / np.vdot(body, body).real)
    return [replace(m, place=complex(factor * z)) for m, z in zip(marks, body, strict=True)]


def places(look: DiskAppearance, frames: Sequence[Frame], view: NDArray[np.bool_]) -> NDArray[np.complex128]:
    """Measure the places of the marks in the picture, shape (frames, 4); NaN for poor views."""
    out = np.full((len(frames), len(look.marks)), np.nan, dtype=np.complex128)
    for row, (y, pose, motion) in zip(out, frames, strict=True):
        fit = align(y, view, look, pose, motion, [1.6, 0.8, 0.5, 0.3], gain_slack=0.5)
        if fit is None:
            continue
        for k, (mark, s) in enumerate(zip(look.marks, fit.sightings, strict=True)):
            if s is not None and fit.used[k] and s.complete > 0.6:
                left = complex(fit.step.residuals[k][0], fit.step.residuals[k][1])
                at = pose.centre + mark.place * np.exp(1j * pose.angle) + left
                row[k] = complex(look.lens.picture(at))
    return out


def _noise(
    seen: Sequence[tuple[Picture, Sight]], view: NDArray[np.bool_], light: NDArray[np.float64], white: float
) -> float:
    """Standard deviation of the light on bare parts near the disk's centre: grain, compression, stains."""
    levels = []
    for picture, sight in seen[:20]:
        r, c, n = int(sight.centre.imag), int(sight.centre.real), int(0.4 * sight.reach)
        patch = light[picture.y[max(0, r - n) : r + n, max(0, c - n) : c + n]]
        bare = patch[view[max(0, r - n) : r + n, max(0, c - n) : c + n]]
        if len(bare) > 200:
            levels.append(1.48 * float(np.median(np.abs(bare - np.median(bare)))))
    code = float(light[min(255, round(white) + 1)] - light[round(white)])
    return max(1.5 * code, float(np.median(levels)) if levels else 0.0)  # compression flattens, wrongly


def _level(
    frames: Sequence[tuple[Plane, Pose]],
    place: complex,
    view: NDArray[np.bool_],
    white: float,
    light: NDArray[np.float64],
) -> float:
    """Light of a mark's middle against the disk's."""
    values = []
    for y, pose in frames:
        at = pose.centre + place * np.exp(1j * pose.angle)
        r, c = round(at.imag), round(at.real)
        if 2 <= r < y.shape[0] - 2 and 2 <= c < y.shape[1] - 2 and view[r - 2 : r + 3, c - 2 : c + 3].all():
            values.append(float(np.median(y[r - 2 : r + 3, c - 2 : c + 3])))
    codes = [round(float(np.median(values))) if values else round(0.5 * white), round(white)]
    return float(light[codes[0]] - light[codes[1]])


def _reshape(fits: list[Seen], look: DiskAppearance, height: int) -> tuple[list[Mark], float]:
    marks, psfs = [], []
    views = [seen_at(look, pose, motion, height) for pose, motion, _ in fits]
    for k, mark in enumerate(look.marks):
        normal, right = np.zeros((4, 4)), np.zeros(4)
        gains = []
        for (_, motion, sightings), (poses, locals_) in zip(fits, views, strict=True):
            s = sightings[k]
            if s is None or s.in_view < WHOLE or s.complete < HALF_SEEN:
                continue
            n, r = _shape_step(mark, poses[k], locals_[k], motion, look, s)
            normal, right = normal + n, right + r
            gains.append(s.gain)
        if not gains:
            marks.append(mark)
            continue
        change = np.linalg.solve(normal + 1e-6 * np.trace(normal) * np.diag([1e-3, 1, 1, 1]), right)
        change = np.clip(change, [-0.2, -2, -2, -0.3], [0.2, 2, 2, 0.3])
        marks.append(
            replace(
                mark,
                half=(float(mark.half[0] + change[1]), float(mark.half[1] + change[2])),
                turn=float(mark.turn + change[0]),
                level=mark.level * float(np.median(gains)),
            )
        )
        psfs.append(change[3])
    psf = float(np.clip(look.psf + (np.median(psfs) if psfs else 0.0), 0.35, 4.0))
    return _replace_places(marks, fits), psf


def _shape_step(
    mark: Mark, pose: Array, local: Array, motion: Motion, look: DiskAppearance, s: Sighting
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normal equations for (turn, half sides, psf) after the local unknowns have taken what they can."""
    psf, centre, angle = look.psf, complex(pose[0], pose[1]), float(pose[2])
    assert s.weight is not None and s.residual is not None  # kept

    def cover(m: Mark, blur: float) -> NDArray[np.float64]:
        return coverage(m, centre, angle, motion, blur, s.box, local).ravel()

    base = cover(mark, psf)
    shape = np.stack(
        [
            (cover(replace(mark, turn=mark.turn + 0.01), psf) - base) / 0.01,
            (cover(replace(mark, half=(mark.half[0] + 0.1, mark.half[1])), psf) - base) / 0.1,
            (cover(replace(mark, half=(mark.half[0], mark.half[1] + 0.1)), psf) - base) / 0.1,
            (cover(mark, psf + 0.05) - base) / 0.05,
        ]
    )
    shape = mark.level * beyond_place(shape, base, s)
    w = s.weight
    return (shape * w) @ shape.T, (shape * w) @ s.residual


def _replace_places(marks: list[Mark], fits: list[Seen]) -> list[Mark]:
    """Move the marks on the disk to their best places for all frames together.

    Linear least squares for the eight coordinates with the pose of every frame free (eliminated frame
    by frame); half-hidden marks count by what they inform. The three motions of all marks together
    are left at zero.
    """
    size = 2 * len(marks)
    normal, right = np.zeros((size, size)), np.zeros(size)
    for pose, _, sightings in fits:
        turn = np.array([[np.cos(pose.angle), -np.sin(pose.angle)], [np.sin(pose.angle), np.cos(pose.angle)]])
        weight, by_pose, by_place = np.zeros((size, size)), np.zeros((size, 3)), np.zeros((size, size))
        offset = np.zeros(size)
        used = np.array([float(s is not None and s.complete > HALF_SEEN) for s in sightings])
        step = solve(marks, sightings, pose.angle, used)
        if step is None or used.sum() < 3:
            continue
        for k, (mark, s) in enumerate(zip(marks, sightings, strict=True)):
            at = slice(2 * k, 2 * k + 2)
            arm = 1j * mark.place * np.exp(1j * pose.angle)
            by_pose[at] = [[1, 0, arm.real], [0, 1, arm.imag]]
            by_place[at, at] = turn
            if s is not None and used[k]:
                away = float(np.hypot(*step.residuals[k]))
                weight[at, at] = s.information / (1 + (away / FAR_OFF) ** 2)
                offset[at] = s.offset
        seen = weight @ by_pose
        left = weight - seen @ np.linalg.solve(by_pose.T @ seen, seen.T)
        normal += by_place.T @ left @ by_place
        right += by_place.T @ left @ offset
    if not normal.any():
        return marks
    change = np.linalg.pinv(normal, rcond=1e-6, hermitian=True) @ right
    return [
        replace(m, place=m.place + complex(du, dv))
        for m, (du, dv) in zip(marks, change.reshape(-1, 2), strict=True)
    ]
