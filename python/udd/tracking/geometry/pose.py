"""Pose, marks and appearance of the disk in a picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .lens import PLAIN, Lens


@dataclass(frozen=True)
class Mark:
    """A rectangular mark in the body frame of the disk (pixels; u + iv at beta = 0)."""

    place: complex  # centre
    half: tuple[float, float]  # half side lengths
    turn: float  # orientation of its first side against the body frame [rad]
    level: float  # brightness minus that of the disk

    @property
    def row(self) -> NDArray[np.float64]:
        """Return the six numbers: place u, v, half sides, turn, level."""
        return np.array([self.place.real, self.place.imag, *self.half, self.turn, self.level])


@dataclass(frozen=True)
class Motion:
    """Motion of the disk during the exposure, about its pose in the middle of it.

    At the share s of the exposure (-1/2 to 1/2) it is off by s shift + s^2 bend [pixels] and
    s turn + s^2 twist [rad]. `rate` [pixels/s], `spin` [rad/s] and their derivatives `bending` and
    `twisting` are for rows that are exposed at times of their own.
    """

    shift: complex = 0j
    turn: float = 0.0
    bend: complex = 0j
    twist: float = 0.0
    rate: complex = 0j
    spin: float = 0.0
    bending: complex = 0j
    twisting: float = 0.0

    @classmethod
    def of_rates(
        cls, rate: complex, spin: float, bending: complex, twisting: float, open_for: float
    ) -> Motion:
        """Make the motion in an exposure from the derivatives of the path."""
        half = 0.5 * open_for**2
        shift, turn = rate * open_for, spin * open_for
        return cls(shift, turn, bending * half, twisting * half, rate, spin, bending, twisting)

    @property
    def row(self) -> NDArray[np.float64]:
        """Return the six numbers: shift u, v, turn, bend u, v, twist."""
        shift, bend = complex(self.shift), complex(self.bend)
        return np.array([shift.real, shift.imag, self.turn, bend.real, bend.imag, self.twist])

    @property
    def rolling(self) -> tuple[float, ...]:
        """Derivatives for rows of other times, as six numbers: rate u, v, spin, bending u, v, twisting."""
        rate, bending = complex(self.rate), complex(self.bending)
        return (rate.real, rate.imag, self.spin, bending.real, bending.imag, self.twisting)


@dataclass(frozen=True)
class DiskAppearance:
    """Appearance of the marked disk in this film."""

    marks: list[Mark]
    psf: float  # blur of lens and pixels, standard deviation [pixels]
    noise: float  # of the light on a flat part of the disk
    light: NDArray[np.float64]  # amount of light for each code of the picture, (256,), where it is grey
    rim: float  # distance from the centre up to which the picture shows the disk [pixels]
    lens: Lens = PLAIN  # from the picture to the plane of the disk
    readout: float = 0.0  # time from the exposure of the first row to that of the last [s]
    mixed: NDArray[np.float64] | None = None  # (marks, 256) light about each mark, None: as where it is grey
    even: NDArray[np.float32] | None = None  # (height, width) by which to multiply light, None: it is even

    @cached_property
    def table(self) -> NDArray[np.float64]:
        """The marks as rows of six numbers, (n, 6)."""
        return np.array([m.row for m in self.marks])

    @cached_property
    def lights(self) -> NDArray[np.float64]:
        """Amount of light for each code about each mark, (n, 256)."""
        return np.tile(self.light, (len(self.marks), 1)) if self.mixed is None else self.mixed

    def streak(self, motion: Motion) -> float:
        """Return an upper limit of the outermost mark's motion during the exposure [pixels]."""
        return abs(motion.shift) + abs(motion.turn) * self.reach

    @cached_property
    def reach(self) -> float:
        """Distance of the outermost mark [pixels]."""
        return float(np.abs(self.places).max())

    @cached_property
    def places(self) -> NDArray[np.complex128]:
        """The marks' centres, (n,)."""
        return np.array([m.place for m in self.marks])


@dataclass
class Pose:
    """The disk in its plane: its centre [pixels, u + iv] and angle [rad]."""

    centre: complex
    angle: float


def moved_by_pose(arms: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the derivatives of points at `arms` (n,) from the disk's centre by its pose, (n, 2, 3)."""
    maps = np.zeros((len(arms), 2, 3))
    maps[:, 0, 0] = maps[:, 1, 1] = 1.0
    maps[:, 0, 2], maps[:, 1, 2] = -arms.imag, arms.real
    return maps
