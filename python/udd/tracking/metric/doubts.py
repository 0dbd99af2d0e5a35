"""Doubts about a film in sentences: its clock, its orientation, its contact and its turns."""

from __future__ import annotations

import numpy as np

from .apparent_gravity import STANDARD, ApparentGravity
from .pixels_to_metres import Camera

GRAVITY_LIMIT = 4.0  # standard errors by which gravity may differ
OFF = 0.1  # relative difference of times from which on clock or scale are in doubt
DRIVEN = 8.0  # standard errors by which a drive's direction is known
SLOWEST = 0.004  # m/s: a slower drive has no direction worth a name
ROLLED = 0.35  # rad from a quarter turn within which the orientation is clear

#: Why a contact is not determined.
NO_CONTACT = (
    "the motion does not determine the contact point (the disk hardly turns, turns steadily, or the camera "
    "moves)"
)


def quarter_turns(gravity: ApparentGravity | None, camera: Camera) -> int:
    """Quarter turns counter-clockwise that bring a film upright; 0 if it is, or if nothing shows it clearly.

    Gravity says which way is down; the drive, which goes upward, if gravity is not known.
    """
    by_drive = _turns_of(float(np.angle(-1j * camera.drive))) if _driven(camera) else None
    if gravity is not None and gravity.is_known:
        by_gravity = _turns_of(gravity.lean)
        return by_gravity if by_gravity is not None and by_drive in (None, by_gravity) else 0
    return by_drive or 0


def _driven(camera: Camera) -> bool:
    speed = abs(camera.drive)
    return bool(np.isfinite(speed) and speed > SLOWEST and speed > DRIVEN * camera.drive_sigma)


def _turns_of(lean: float) -> int | None:
    """Quarter turns that undo an angle; None if it is between two."""
    turns = round(lean / (np.pi / 2))
    return -turns % 4 if abs(lean - turns * np.pi / 2) < ROLLED else None


def doubts(gravity: ApparentGravity | None, camera: Camera, fps: float, turns: int) -> list[str]:
    """Sentences about what makes a track doubtful.

    Parameters
    ----------
    gravity : ApparentGravity or None
        As the film shows it.
    camera : Camera
    fps : float
        Frames per second by the film's header, or as given.
    turns : int
        Gaps across which the number of whole turns is in doubt.
    """
    sentences = []
    if camera.pivot_from == "support":
        sentences.append(
            f"{NO_CONTACT}; it is taken from the support, to about {1e3 * camera.pivot_sigma:.0f} mm: give "
            "pivot=(u, v) in pixels"
        )
        gravity = None  # its lever is the distance from the contact
    if turns:
        gaps = "a gap" if turns == 1 else f"{turns} gaps"
        sentences.append(
            f"beta may be whole turns off after {gaps} in which the disk turned unseen: see the flags"
        )
    if gravity is not None and gravity.is_known:
        sentences += _by_gravity(gravity, camera, fps)
    elif _driven(camera) and _turns_of(float(np.angle(-1j * camera.drive))) != 0:
        sentences.append("the drive does not go upward in the picture: is the film turned?")
    return sentences


def _by_gravity(gravity: ApparentGravity, camera: Camera, fps: float) -> list[str]:
    sentences = []
    slower, sigma = gravity.slower, 0.5 * gravity.slower * gravity.sigma / abs(gravity.value)
    if abs(np.log(slower)) > max(OFF, GRAVITY_LIMIT * sigma / slower):
        sentences.append(
            f"gravity is {abs(gravity.value):.3g} m/s^2 by the film's clock and scale, not {STANDARD:g}: its "
            f"times are {slower:.2f} ± {sigma:.2g} times too long (then say fps={fps * slower:.4g}), or the "
            "disk's radius is another"
        )
    if _turns_of(gravity.lean) != 0:
        sentences.append(
            f"gravity points {np.degrees(abs(gravity.lean)):.0f} degrees off the picture's vertical: is the "
            "film turned?"
        )
    elif _driven(camera) and _turns_of(float(np.angle(-1j * camera.drive))) != 0:
        sentences.append("the drive does not go upward, against gravity: is the wheel driven the other way?")
    return sentences
