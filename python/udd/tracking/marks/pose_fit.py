"""Least-squares alignment of the disk's pose in one picture, from a nearby pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import DiskAppearance, Motion, Pose
from udd.video.reader import Plane

from .localization import Sighting, locate
from .rigid_fit import Step


@dataclass(frozen=True)
class Fit:
    """The last correction made to a pose, and the marks it came from."""

    step: Step
    sightings: list[Sighting | None]
    used: NDArray[np.bool_]
    moved: float  # size of the last correction, in pixels at the marks

    @property
    def information(self) -> NDArray[np.float64]:
        """(marks, 2, 2) of each mark's place, 0 where it is not used."""
        nothing = np.zeros((2, 2))
        seen = zip(self.sightings, self.used, strict=True)
        return np.array([s.information if s is not None and used else nothing for s, used in seen])


def align(
    y: Plane,
    view: NDArray[np.bool_],
    look: DiskAppearance,
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
    at, sightings, used, step, moved = locate(
        y, view, look, pose, motion, rounds, gain_slack=gain_slack, without=without, keep=keep
    )
    if step is None:
        return None
    pose.centre, pose.angle = complex(at[0], at[1]), at[2]
    return Fit(Step(*(np.array(x) for x in step)), sightings, np.array(used), moved)
