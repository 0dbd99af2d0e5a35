"""The kinematic residual of a whole clip: how nearly the disk rolls about one point, driven evenly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from udd.measurement import Measurement
from udd.tracking.geometry.contact_point import pivot, windows

Array = NDArray[np.float64]
REACH = 0.8  # of the radius: the size to compare a contact's uncertainty with


@dataclass(frozen=True)
class Health:
    """Residual of the rolling constraint in each frame, (n, 2) [m], NaN if it cannot be judged."""

    t: Array
    rest: Array
    rms: float  # per coordinate [m]
    noise: float  # that the frames' standard errors alone would leave [m]


def health(m: Measurement) -> Health | None:
    """Check a tracked disk against dY/dT = Z Omega, dZ/dT = -Y Omega + W, in its integrated form.

    None where the motion does not determine contact and drive (too short, or steady rotation). Slip, a wrong
    clock and a wrong model of the camera leave more than the noise.
    """
    good, radius = m.seen, float(m.meta["R"])
    centre = m["Y"] - 1j * m["Z"]
    contact = pivot(m.t, centre, m["beta"], good, REACH * radius)
    if contact is None:
        return None
    rest = np.full(len(m), complex(np.nan, np.nan))
    for a, b in windows(m.t, good):
        turn = np.exp(-1j * m["beta"][a:b])
        dt = m.t[a:b] - m.t[a]
        swept = CubicSpline(dt, turn).antiderivative()(dt)
        off = centre[a:b] * turn - contact.place * turn - contact.drive * swept
        rest[a:b] = (off - off.mean()) / turn
    judged = np.isfinite(rest)
    if not judged.any():
        return None
    noise = float("nan")
    if m.sigma is not None:
        lever = np.abs(centre[judged]) ** 2 * m["sigma_beta"][judged] ** 2
        noise = float(np.sqrt(np.mean((m["sigma_Y"][judged] ** 2 + m["sigma_Z"][judged] ** 2 + lever) / 2)))
    rms = float(np.sqrt(np.mean(np.abs(rest[judged]) ** 2) / 2))
    return Health(m.t, np.column_stack([rest.real, -rest.imag]), rms, noise)
