"""How the marked disk looks, where it is and how it moves: the words the tracker speaks in."""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True)
class Motion:
    """How the disk moves during the exposure: displacement [pixels] and turn [rad] over the whole of it."""

    shift: complex = 0j
    turn: float = 0.0


@dataclass(frozen=True)
class Look:
    """How the marked disk looks in this film."""

    marks: list[Mark]
    psf: float  # blur of lens and pixels, standard deviation [pixels]
    noise: float  # of the light on a flat part of the disk
    light: NDArray[np.float64]  # amount of light for each code of the picture, (256,)
    rim: float  # distance from the centre up to which the picture shows the disk [pixels]
    lens: Lens = PLAIN  # from the picture to the plane of the disk


@dataclass
class Pose:
    """The disk in its plane: its centre [pixels, u + iv] and angle [rad]."""

    centre: complex
    angle: float
