"""From pixels to metres: scale, contact point, honest errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.measurement import Measurement

from .loop import Tracks

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """How the picture maps to the plane of the disk."""

    scale: float  # pixels per metre
    scale_sigma: float
    pivot: complex  # contact point [pixels, u + iv]
    pivot_sigma: float  # [m]
    pivot_from: str  # "rolling constraint", "support" or "given"
    drive: complex  # velocity of the driven material that goes with it [m/s, Y + iZ], NaN if unknown


@dataclass(frozen=True)
class Pixels:
    """Where to draw the fitted disk in the picture (pixels: u to the right, v down)."""

    centre: Array  # (n, 2)
    angle: Array  # (n,) beta [rad]
    marks: Array  # (n, 4, 2): red, orange, blue, green
    radius: float
    pivot: Array  # (2,)
    scale: float  # pixels per metre


def pixels(m: Measurement) -> Pixels:
    """The fitted disk in picture coordinates, from what a tracked measurement says about its camera.

    Parameters
    ----------
    m : Measurement
        From `udd.track`, or read back from its file.

    Raises
    ------
    KeyError
        The measurement does not come from a film.
    """
    scale = float(m.meta["px_per_m"])
    pivot = np.array([float(m.meta["pivot_u"]), float(m.meta["pivot_v"])])
    centre = pivot + scale * np.column_stack([m["Y"], -m["Z"]])
    places = np.array(m.meta["marks_px"], dtype=float)
    z = (places[:, 0] + 1j * places[:, 1])[None, :] * np.exp(1j * m["beta"])[:, None]
    marks = centre[:, None, :] + np.stack([z.real, z.imag], axis=-1)
    return Pixels(centre, m["beta"], marks, scale * float(m.meta["R"]), pivot, scale)


def metres(tracks: Tracks, covariance: Array, camera: Camera) -> tuple[Array, Array, Array]:
    """Values (n, 3), standard errors (n, 3) and correlations (n, 3) of Y, Z [m] and beta [rad]."""
    centre, angle = np.array(tracks.centre), np.array(tracks.angle)
    away = (centre - camera.pivot) / camera.scale
    values = np.column_stack([away.real, -away.imag, angle])
    to = np.array([1 / camera.scale, -1 / camera.scale, 1.0])
    c = covariance * to[:, None] * to[None, :]
    sigma = np.sqrt(np.einsum("nii->ni", c))
    rho = np.stack([c[:, a, b] / (sigma[:, a] * sigma[:, b]) for a, b in ((0, 1), (0, 2), (1, 2))], axis=1)
    return values, sigma, np.clip(rho, -0.999999, 0.999999)
