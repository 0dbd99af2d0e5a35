"""Smoothed tracked motion, with the angular velocity that no single frame shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.measurement import Measurement
from udd.models import Disk
from udd.simulation.energy import angular_momentum

_FRAMES = 7  # of a window: 0.28 s at the paper's 25 frames per second
_ORDER = 4
_FINER = 5  # drawn points for each frame


@dataclass(frozen=True)
class Smoothed:
    """Smoothed motion; the functions of :mod:`udd.plot` draw it like a run.

    Attributes
    ----------
    t : ndarray, shape (n,)
        s, five for each frame.
    state : ndarray, shape (n, 4)
        [Omega, Y, Z, beta], Omega from the smoothed beta.
    model : Disk
        With the known drive and size.
    """

    t: NDArray[np.float64]
    state: NDArray[np.float64]
    model: Disk

    @property
    def J(self) -> NDArray[np.float64]:
        """Angular momentum about the contact per unit mass, ``I Omega - W Y`` [m^2/s]."""
        return angular_momentum(self.model, self.state)


def smoothed(measurement: Measurement, model: Disk) -> Smoothed:
    """Smooth by Savitzky and Golay's local polynomials, splines between frames, lines over gaps."""
    from scipy.interpolate import CubicSpline
    from scipy.signal import savgol_filter

    t, is_seen = measurement.t, measurement.seen
    step = float(np.median(np.diff(t)))
    columns = [np.interp(t, t[is_seen], measurement[name][is_seen]) for name in ("Y", "Z", "beta")]
    y, z, beta = (savgol_filter(column, _FRAMES, _ORDER) for column in columns)
    omega = savgol_filter(columns[2], _FRAMES, _ORDER, deriv=1, delta=step)
    fine = np.linspace(t[0], t[-1], _FINER * (len(t) - 1) + 1)
    return Smoothed(fine, CubicSpline(t, np.column_stack([omega, y, z, beta]))(fine), model)
