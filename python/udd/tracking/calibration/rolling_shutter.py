"""Readout time of a rolling shutter, from the rigidity of the disk alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import DiskAppearance, Motion, Pose, moved_by_pose
from udd.tracking.marks.pose_fit import align
from udd.video.reader import Plane

ROUNDS = 5
MOST = 36  # frames to judge by
FEWEST = 6
CERTAIN = 5.0  # standard errors
LEAST = 0.02  # of the frame interval: what is less does no harm
FAR = 3.0  # pixels; frames whose marks disagree by more say less
STEPS = [2.5, 1.2, 0.6]


@dataclass(frozen=True)
class Readout:
    """Time from the first row to the last, with its standard error [s]."""

    value: float
    sigma: float


def readout(
    frames: Sequence[tuple[Plane, Pose, Motion]],
    look: DiskAppearance,
    view: NDArray[np.bool_],
    interval: float,
) -> Readout:
    """Find the readout under which the marks of the moving disk keep their distances; 0 if none is needed.

    A mark in a row that is exposed by dt later is displaced by its velocity times dt. The part of these
    displacements that is no rigid motion is compared with the disagreement of the marks.
    """
    total, sigma = 0.0, np.inf
    fastest = sorted(frames, key=lambda f: -_speed(f[2], look))[:MOST]
    for _ in range(ROUNDS):
        now = replace(look, readout=total)
        each = np.array([_compare(*f, now, view) for f in fastest]).reshape(-1, 2)
        each = each[each[:, 1] > 0]
        if len(each) < FEWEST:
            return Readout(0.0, np.inf)
        step = float(each[:, 0].sum() / each[:, 1].sum())
        sigma = float(np.sqrt(((each[:, 0] - step * each[:, 1]) ** 2).sum()) / each[:, 1].sum())
        total = float(np.clip(total + step, -interval, interval))
        if abs(step) < 0.3 * sigma:
            break
    if abs(total) < max(CERTAIN * sigma, LEAST * interval):
        return Readout(0.0, sigma)
    return Readout(total, sigma)


def _speed(motion: Motion, look: DiskAppearance) -> float:
    return abs(motion.rate) + abs(motion.spin) * look.reach


def _compare(
    y: Plane, pose: Pose, motion: Motion, look: DiskAppearance, view: NDArray[np.bool_]
) -> tuple[float, float]:
    """Weighted product of disagreement and displacement per second of readout, and the latter's square."""
    here = Pose(pose.centre, pose.angle)
    fit = align(y, view, look, here, motion, STEPS, gain_slack=0.5)
    if fit is None or fit.used.sum() < 3:
        return 0.0, 0.0
    arms = look.places * np.exp(1j * here.angle)
    rows = look.lens.picture(here.centre + arms).imag
    speed = (motion.rate + 1j * motion.spin * arms) * ((rows + 0.5) / y.shape[0] - 0.5)
    moved = np.column_stack([speed.real, speed.imag])
    maps = moved_by_pose(arms)
    left = np.where(fit.used[:, None], fit.step.residuals, 0.0)
    weight = fit.information
    # pixels that are known too well would drown the others
    weight = (
        np.minimum(1.0, 400.0 / np.maximum(np.abs(weight).max(axis=(1, 2)), 1e-9))[:, None, None] * weight
    )
    weight /= 1 + (np.abs(left).max() / FAR) ** 2
    seen = weight @ maps
    normal = np.einsum("kai,kaj->ij", maps, seen)
    free = moved - maps @ np.linalg.solve(normal, np.einsum("kai,ka->i", seen, moved))
    left = left - maps @ np.linalg.solve(normal, np.einsum("kai,ka->i", seen, left))
    pulled = np.einsum("kab,kb->ka", weight, free)
    return float((pulled * left).sum()), float((pulled * free).sum())
