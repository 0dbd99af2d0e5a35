"""The pose of the disk in one picture, refined from a nearby one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .decode import Plane
from .look import Look, Motion, Pose
from .marks import Sighting, locate
from .rigid import Step, solve

LEAST = 0.15  # share of a mark's edges below which it is not used
STREAKY = 0.01  # share of a streak's length by which its ends are not where they should be
SETTLED = 0.04  # pixels; Gauss-Newton's next correction would be far smaller


@dataclass(frozen=True)
class Fit:
    """The last correction made to a pose, and the marks it came from."""

    step: Step
    sightings: list[Sighting | None]
    used: NDArray[np.bool_]
    moved: float  # size of the last correction, in pixels at the marks


def align(
    y: Plane,
    view: NDArray[np.bool_],
    look: Look,
    pose: Pose,
    motion: Motion,
    rounds: list[float],
    gain_slack: float = 0.1,
    without: int | None = None,
    keep: bool = False,
) -> Fit | None:
    """Move `pose` onto a picture by Gauss-Newton steps; None if fewer than two marks hold it.

    Each round has its misfit tolerance [pixels]; a large one reaches further. The mark `without` is
    left out; with `keep`, sightings carry their pixels.
    """
    fit = None
    path = abs(motion.shift) + abs(motion.turn) * look.reach
    for each in rounds:
        misfit = float(np.hypot(each, STREAKY * path))
        psf = float(np.hypot(look.psf, 3 * max(0.0, each - 0.5)))
        sightings = locate(
            y, view, look, pose, motion, psf=psf, gain_slack=gain_slack, misfit=misfit, keep=keep
        )
        used = np.array([s is not None and s.complete > LEAST and abs(s.gain - 1) < 0.5 for s in sightings])
        if without is not None:
            used[without] = False
        step = solve(look.marks, sightings, pose.angle, used.astype(float))
        if step is None or used.sum() < 2:
            return None
        pose.centre += complex(step.change[0], step.change[1])
        pose.angle += float(step.change[2])
        moved = float(np.hypot(np.hypot(*step.change[:2]), step.change[2] * look.reach))
        fit = Fit(step, sightings, used, moved)
        if moved < SETTLED and each == rounds[-1]:
            break
    return fit
