"""How long the shutter is open, from the length of the streaks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .decode import Picture
from .find import Sight
from .marks import MISFIT, Motion, coverage
from .pose import Look, Pose, align

SHARES = np.linspace(0.0, 1.0, 11)  # of the frame interval
FASTEST = 24
STREAK = 6.0  # pixels between frames below which a frame says nothing about the exposure


def exposure(
    bursts: list[list[Picture]], sights: list[Sight | None], look: Look, view: NDArray[np.bool_]
) -> float:
    """Exposure time [s]: what explains the fastest survey frames best; 0 if none is fast."""
    fast = _fast(bursts, sights, abs(look.marks[0].place))[:FASTEST]
    if not fast:
        return 0.0
    cost = np.zeros(len(SHARES))
    for picture, sight, motion, _ in fast:
        each = np.array([_misfit(picture, sight, motion, share, look, view) for share in SHARES])
        if np.isfinite(each).all():
            cost += each / each.min()
    if not cost.any():
        return 0.0
    k = int(np.argmin(cost))
    best = float(SHARES[k])
    if 0 < k < len(SHARES) - 1:  # the vertex of the parabola through the lowest three
        a, b, c = cost[k - 1 : k + 2]
        best += float(0.5 * (a - c) / (a - 2 * b + c) * SHARES[1])
    return best * float(np.median([dt for *_, dt in fast]))


def _fast(
    bursts: list[list[Picture]], sights: list[Sight | None], reach: float
) -> list[tuple[Picture, Sight, Motion, float]]:
    found = []
    at = iter(sights)
    for burst in bursts:
        here = [next(at) for _ in burst]
        if len(burst) < 3 or here[0] is None or here[1] is None or here[2] is None:
            continue
        before, now, after = here[0], here[1], here[2]
        turn = float(
            np.angle(np.exp(1j * (after.angle - now.angle)))
            + np.angle(np.exp(1j * (now.angle - before.angle)))
        )
        motion = Motion((after.centre - before.centre) / 2, turn / 2)
        path = abs(motion.shift) + abs(motion.turn) * reach
        if path > STREAK:
            found.append((path, burst[1], now, motion, (burst[2].t - burst[0].t) / 2))
    return [tuple(item[1:]) for item in sorted(found, key=lambda item: -item[0])]  # type: ignore[misc]


def _misfit(
    picture: Picture, sight: Sight, whole: Motion, share: float, look: Look, view: NDArray[np.bool_]
) -> float:
    """Sum of squares over fixed windows around the marks, so that shares compare on the same pixels."""
    motion = Motion(whole.shift * share, whole.turn * share)
    pose = Pose(sight.centre, sight.angle)
    if align(picture.y, view, look, pose, motion, [1.0, 0.5, MISFIT], gain_slack=0.3) is None:
        return np.inf
    total = 0.0
    for mark in look.marks:
        middle = pose.centre + mark.place * np.exp(1j * pose.angle)
        reach = np.hypot(*mark.half) + 0.3 * (abs(whole.shift) + abs(whole.turn * mark.place)) + 4
        r0, r1 = max(0, int(middle.imag - reach)), min(view.shape[0], int(middle.imag + reach))
        c0, c1 = max(0, int(middle.real - reach)), min(view.shape[1], int(middle.real + reach))
        if r1 - r0 < 4 or c1 - c0 < 4:
            continue
        cover = coverage(mark, pose.centre, pose.angle, motion, look.psf, (r0, r1, c0, c1))
        ok = view[r0:r1, c0:c1]
        rest = look.light[picture.y[r0:r1, c0:c1]] - mark.level * cover
        rest = rest[ok] - np.median(rest[ok]) if ok.any() else np.zeros(1)
        total += float((np.clip(rest, -60, 60) ** 2).sum())
    return total


def at_middle(
    t: NDArray[np.float64], centre: NDArray[np.complex128], angle: NDArray[np.float64], open_for: float
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Turn means over the exposure into values at its middle.

    Over an exposure T the mean of x is x + x'' T^2 / 24 (to fourth order); x'' comes from the
    neighbouring frames, whose errors this small share hardly carries over. A frame without two
    neighbours close by stays as it is.
    """
    centre, angle = centre.copy(), angle.copy()
    if len(t) < 3:
        return centre, angle
    before, after = t[1:-1] - t[:-2], t[2:] - t[1:-1]
    close = (np.maximum(before, after) < 2.5 * np.median(np.diff(t))).astype(float)
    for x in (centre, angle):
        bend = 2 * ((x[2:] - x[1:-1]) / after - (x[1:-1] - x[:-2]) / before) / (before + after)
        shift = close * bend * open_for**2 / 24
        x[1:-1] -= np.where(np.isfinite(shift), shift, 0.0)
    return centre, angle
