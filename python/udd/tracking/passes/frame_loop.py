"""The loop over the frames of a film: each target is predicted, then searched for by several attempts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from udd.tracking.detection.frame_flags import REPEATED, is_copy, lost, unusable
from udd.tracking.geometry.contact_point import Contact
from udd.tracking.geometry.pose import Pose
from udd.video.reader import Box, Film, Picture, Plane

Seen = TypeVar("Seen")  # a target in a frame
Row = TypeVar("Row")  # of a target's table
RECENT = 0.5  # s: earlier poses predict nothing
NOWHERE = Pose(complex(np.nan, np.nan), np.nan)


@dataclass(frozen=True)
class PoseSample:
    """A frame in which a target was located."""

    t: float
    pose: Pose
    rate: float = 0.0  # of turning [rad/s]


@dataclass(frozen=True)
class Prediction:
    """Expected pose in the next frame, from the last ones."""

    t: float
    past: Sequence[PoseSample]
    pose: Pose

    @property
    def age(self) -> float:
        """Time since the last pose [s]."""
        return self.t - self.past[-1].t


Corrected = Callable[[Box | None], Picture]  # a frame, corrected at least in a box


class Target(ABC, Generic[Seen, Row]):
    """An object to be followed through a film: a disk with marks or tags, or a bob.

    Attributes
    ----------
    contact : Contact or None
        Point about which it rotates, if this is known.
    least_move : float
        Motion [pixels] below which a frame may look like a copy of the last.
    """

    contact: Contact | None = None
    least_move: float = 1.0

    def unusable(self, picture: Picture) -> str:
        """Return the flag of a picture that shows nothing; empty if it may show something."""
        return unusable(picture)

    def box(self, poses: Sequence[Pose], shape: tuple[int, ...]) -> Box | None:
        """Return the part of the picture in which it lies at these poses; None for all of the picture."""
        return None

    @abstractmethod
    def surroundings(self, pose: Pose) -> tuple[NDArray[np.complex128], int, float]:
        """Return places that show if the target moves, the pixels about each, and its reach [pixels]."""

    @abstractmethod
    def attempts(
        self, corrected: Corrected, picture: Picture, expected: Prediction | None
    ) -> Iterator[Seen | str]:
        """Locate it in one way after another: yield a result, or the reason of a failure as text."""

    @abstractmethod
    def sample(self, seen: Seen, expected: Prediction | None, t: float) -> PoseSample:
        """Return the pose of a result."""

    @abstractmethod
    def row(self, t: float, flag: str, seen: Seen | None) -> Row:
        """Return the row of a frame in the target's table; `seen` is None if it was not located."""


class Observer(ABC):
    """A part of a pass that looks at each frame of a film in turn."""

    @abstractmethod
    def look(self, corrected: Corrected, t: float, shape: tuple[int, ...]) -> Pose:
        """Look at the next frame, and return the pose of the target; NaN if it is not located."""

    def end(self) -> None:
        """Finish after the last frame."""
        return


class Follower(Observer, Generic[Seen, Row]):
    """A target with its last poses and the rows of its table."""

    def __init__(self, target: Target[Seen, Row]) -> None:
        self.target = target
        self.rows: list[Row] = []
        self.past: list[PoseSample] = []
        self.last: Plane | None = None

    def look(self, corrected: Corrected, t: float, shape: tuple[int, ...]) -> Pose:
        """Locate the target in the next frame, and return its pose; NaN if it is not located."""
        target = self.target
        guess = predict(self.past, t, target.contact)
        expected = None if guess is None else Prediction(t, self.past, guess)
        picture = corrected(None if guess is None else target.box([guess, self.past[-1].pose], shape))
        flag = target.unusable(picture)
        seen: Seen | None = None
        if not flag and expected is not None and self._repeats(picture.y, expected):
            flag = REPEATED
        if not flag:
            for attempt in target.attempts(corrected, picture, expected):
                if not isinstance(attempt, str):
                    seen, flag = attempt, ""
                    break
                flag = lost(attempt)
        # a target that is not seen, as behind a hand, does not move: no copy is recognised by it
        self.last = picture.y if flag in ("", REPEATED) else None
        self.rows.append(target.row(t, flag, seen))
        if seen is None:
            return NOWHERE
        self.past = [*self.past[-2:], target.sample(seen, expected, t)]
        return self.past[-1].pose

    def _repeats(self, y: Plane, expected: Prediction) -> bool:
        """Return True if a frame is a copy of the last although the target should have moved."""
        before, guess = expected.past[-1].pose, expected.pose
        places, about, reach = self.target.surroundings(before)
        moved = abs(guess.centre - before.centre) + abs(guess.angle - before.angle) * reach
        if self.last is None or moved < self.target.least_move:
            return False
        return is_copy(y, self.last, places, about)


def observe(film: Film, observers: Sequence[Observer], tick: Callable[[Picture, Pose], object]) -> None:
    """Show each frame of a film to observers.

    After each picture `tick` is called with the uncorrected picture and the pose that the first observer
    returns.
    """
    for picture in film.uncorrected():
        corrected = partial(film.corrected, picture)
        poses = [each.look(corrected, picture.t, picture.y.shape) for each in observers]
        tick(picture, poses[0])
    for each in observers:
        each.end()


def follow(
    film: Film, targets: Sequence[Target[Seen, Row]], tick: Callable[[Picture, Pose], object]
) -> list[list[Row]]:
    """Follow targets through a film, and return the rows of each."""
    followers = [Follower(target) for target in targets]
    observe(film, followers, tick)
    return [each.rows for each in followers]


def predict(past: Sequence[PoseSample], t: float, contact: Contact | None) -> Pose | None:
    """Predict the pose: the angle by extrapolation, the centre by rotation about the contact."""
    if not past:
        return None
    last = past[-1]
    dt = t - last.t
    recent = [h for h in past if t - h.t < RECENT] or [last]
    if len(recent) == 3 and dt > 1.6 * (last.t - recent[-2].t):
        recent = recent[-2:]  # a parabola does not reach across a gap
    times = np.array([h.t - t for h in recent])
    weights = np.array([np.prod([-b / (a - b) for b in times if b != a]) for a in times])  # Lagrange at 0
    if len(recent) == 1:
        angle = last.pose.angle + last.rate * min(dt, RECENT)
    else:
        angle = float(weights @ np.array([h.pose.angle for h in recent]))
    if contact is not None:
        return Pose(contact.carry(last.pose.centre, angle - last.pose.angle, dt), angle)
    return Pose(complex(weights @ np.array([h.pose.centre for h in recent])), angle)
