"""Conversion from pixels to metres: scale, contact point, errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.markers.layout import STANDARD
from udd.measurement import Measurement
from udd.tracking.geometry.intervals import usual_interval
from udd.tracking.geometry.lens import PLAIN, Lens
from udd.tracking.passes.tracks import Tracks

from .apparent_gravity import STANDARD as GRAVITY

Array = NDArray[np.float64]
OUTSIDE = 0.005  # of the radius by which the contact must lie outside the disk
NEAR_EDGE = 0.8  # of the radius; a disk that was last seen farther in is lost, not gone
LEAP = 3.0  # times as fast as nearly all the time; a disk near its edge that moves so has been let go
FAR = 0.02  # of the radius, that a leap goes at least
CLOSE = 2.5  # usual intervals: over a longer step the rotation is unknown
FEWEST = 20  # steps that show how far they usually are from rolling
UNSEEN = 3  # frames without the disk at the end of a film
ODD = 8.0  # times the usual misfit of a step
ALIKE = 0.8  # cosine of the angle between two steps' misfits that point the same way
LONG = 1.0  # s: over a longer gap the rate may have done anything


@dataclass(frozen=True)
class Camera:
    """Map from the picture to the plane of the disk."""

    scale: float  # pixels per metre
    scale_sigma: float
    scale_from: str  # "marks", "rim" or both
    pivot: complex  # contact point [pixels, u + iv]
    pivot_sigma: float  # [m]
    pivot_from: str  # "rolling constraint", "support" or "given"
    drive: complex  # velocity of the driven material that goes with it [m/s, Y + iZ], NaN if unknown
    drive_sigma: float = np.nan


@dataclass(frozen=True)
class Pixels:
    """Fitted disk in picture coordinates (pixels: u to the right, v down; NaN where not seen).

    Attributes
    ----------
    centre : ndarray, shape (n, 2)
        The centre of the disk.
    angle : ndarray, shape (n,)
        The orientation beta [rad].
    marks : ndarray, shape (n, marks, 2)
        The marks; those of the standard disk are red, orange, blue, green.
    rim : ndarray, shape (n, 73, 2)
        A closed line along the rim.
    radius : float
        Radius of the disk [pixels].
    pivot : ndarray, shape (2,)
        The contact.
    scale : float
        Pixels per metre.
    colours : tuple of (int, int, int)
        Colours of the marks, sRGB.

    See Also
    --------
    udd.tracking.pixels : makes it.
    udd.plot.overlay : draw it into a frame.
    """

    centre: Array  # (n, 2)
    angle: Array  # (n,) beta [rad]
    marks: Array  # (n, marks, 2); of the standard disk red, orange, blue, green
    rim: Array  # (n, 73, 2): a closed line; a circle but for tilt and lens
    radius: float
    pivot: Array  # (2,)
    scale: float  # pixels per metre
    colours: tuple[tuple[int, int, int], ...]  # of the marks, sRGB


def pixels(m: Measurement) -> Pixels:
    """Compute the fitted disk in picture coordinates, from the camera of a tracked measurement.

    Parameters
    ----------
    m : Measurement
        From `udd.track`, or read back from its file.

    Returns
    -------
    Pixels
        Fields ``centre``, ``angle``, ``marks``, ``rim``, ``radius``, ``pivot``, ``scale``, ``colours``.

    Raises
    ------
    KeyError
        The measurement does not come from a film.

    See Also
    --------
    udd.track : makes the measurement.
    udd.plot.overlay : draw the disk into a frame.

    Examples
    --------
    >>> from udd import tracking
    >>> m = udd.track("run.mp4")  # doctest: +SKIP
    >>> tracking.pixels(m).centre[0]  # doctest: +SKIP
    """
    if "length_px" in m.meta:
        return _of_pendulum(m)
    scale = float(m.meta["px_per_m"])
    pivot = complex(float(m.meta["pivot_u"]), float(m.meta["pivot_v"]))
    terms = [float(x) for x in m.meta["lens"]]
    lens = Lens(complex(terms[0], terms[1]), *terms[2:]) if terms else PLAIN
    places = np.array(m.meta["marks_px"], dtype=float) @ [1, 1j]
    radius = scale * float(m.meta["R"])
    codes = m.meta.get("marks_rgb", STANDARD.colours)  # an older file says nothing
    colours = tuple((int(r), int(g), int(b)) for r, g, b in codes)
    ring = radius * np.exp(2j * np.pi * np.arange(73) / 72)
    centre = pivot + scale * (m["Y"] - 1j * m["Z"])
    marks = centre[:, None] + places * np.exp(1j * m["beta"])[:, None]

    def show(z: Any) -> Array:
        at = lens.picture(z)
        return np.stack([at.real, at.imag], axis=-1)

    rim = show(centre[:, None] + ring)
    return Pixels(show(centre), m["beta"], show(marks), rim, radius, show(np.array(pivot)), scale, colours)


def _of_pendulum(m: Measurement) -> Pixels:
    """Return the first bob as a disk; the marks are the middles of the bobs."""
    pivot = np.array([float(m.meta["pivot_u"]), float(m.meta["pivot_v"])])
    long, radius, theta = float(m.meta["length_px"]), float(m.meta["bob_px"]), m.values[:, 0]
    centre = pivot + long * np.column_stack([np.sin(theta), np.cos(theta)])
    bobs = [centre]
    if "lower_length_px" in m.meta:
        lower = m.values[:, 1]
        arm = np.column_stack([np.sin(lower), np.cos(lower)])
        bobs.append(centre + float(m.meta["lower_length_px"]) * arm)
    ring = 2 * np.pi * np.arange(73) / 72
    rim = centre[:, None] + radius * np.column_stack([np.cos(ring), np.sin(ring)])
    colours = tuple((int(red), int(green), int(blue)) for red, green, blue in m.meta["marks_rgb"])
    scale = float(m.meta["px_per_m"] or np.nan)
    return Pixels(centre, theta, np.stack(bobs, axis=1), rim, radius, pivot, scale, colours)


def metres(tracks: Tracks, covariance: Array, camera: Camera) -> tuple[Array, Array, Array]:
    """Values (n, 3), standard errors (n, 3) and correlations (n, 3) of Y, Z [m] and beta [rad]."""
    centre, angle = tracks.centre, tracks.angle
    away = (centre - camera.pivot) / camera.scale
    values = np.column_stack([away.real, -away.imag, angle])
    to = np.array([1 / camera.scale, -1 / camera.scale, 1.0])
    c = covariance * to[:, None] * to[None, :]
    sigma = np.sqrt(np.einsum("nii->ni", c))
    rho = np.stack([c[:, a, b] / (sigma[:, a] * sigma[:, b]) for a, b in ((0, 1), (0, 2), (1, 2))], axis=1)
    return values, sigma, np.clip(rho, -0.999999, 0.999999)


def left_the_wheels(
    t: Array, values: Array, radius: float, pivot_sigma: float, drive: complex = complex(np.nan, np.nan)
) -> NDArray[np.bool_]:
    """Find the frames after the disk has lost contact with the wheels.

    The contact lies outside of the disk then, or its distance from the centre leaps, or the disk falls: see
    `_release`. The frames after the last one with a pose count as well, if the contact was near the edge.

    Parameters
    ----------
    t : ndarray (n,)
        Times [s].
    values : ndarray (n, 3)
        Y, Z [m] and beta [rad]; NaN if the disk was not tracked.
    radius, pivot_sigma : float
        Radius of the disk and standard error of the contact [m].
    drive : complex
        Velocity of the driven material, Y + iZ [m/s]; NaN if it is not known.

    Returns
    -------
    ndarray of bool (n,)
    """
    gone = np.zeros(len(values), dtype=bool)
    away = np.hypot(values[:, 0], values[:, 1])
    outside = away > radius * (1 + OUTSIDE) + 3 * pivot_sigma
    seen = np.flatnonzero(np.isfinite(away))
    if len(seen) > 1:
        change, time = np.abs(np.diff(away[seen])), np.diff(t[seen])
        most = np.maximum(LEAP * float(np.quantile(change / time, 0.95)) * time, FAR * radius)
        outside[seen[1:]] |= (away[seen[:-1]] > NEAR_EDGE * radius) & (change > most)
        if np.isfinite(drive):
            unseen_after = len(away) - seen[-1] > UNSEEN
            outside |= t > _release(t[seen], values[seen], radius, drive, unseen_after)
    if outside.any():
        gone[np.argmax(outside) :] = True
    elif len(seen) and away[seen[-1]] > NEAR_EDGE * radius and len(away) - seen[-1] > UNSEEN:
        gone[seen[-1] + 1 :] = True
    return gone


def _release(t: Array, values: Array, radius: float, drive: complex, unseen_after: bool) -> float:
    """Return the time at which the wheels lose the disk [s]; infinity if they do not.

    In a step, a disk that rolls goes from a to (a + d (exp(i turn) - 1) dt / (i turn)) exp(-i turn); d is the
    drive. A falling disk misses this by a velocity that grows with time. At the release two steps in a row
    miss in the same direction, by far more than usual; gravity sets the increase from the first to the
    second. The first one must be near the edge, and its miss gives the time of the fall. With `unseen_after`,
    the
    disk is not seen after the last step, which counts alone.
    """
    at, turn, step = values[:, 0] + 1j * values[:, 1], np.diff(values[:, 2]), np.diff(t)
    swept = drive * step * np.exp(0.5j * turn) * np.sinc(turn / (2 * np.pi))
    off = at[1:] - (at[:-1] + swept) * np.exp(-1j * turn)
    close = step < CLOSE * usual_interval(t)
    if close.sum() < FEWEST:
        return float("inf")
    usual = float(np.median(np.abs(off[close])))
    # gravity bends the path of a falling disk, rolling that of the other
    rate = turn / step
    bend = np.abs(-1j * GRAVITY + rate**2 * at[:-1] + 1j * rate * drive)
    first, then = np.abs(off[:-1]), np.abs(off[1:])
    alike = (off[:-1].conj() * off[1:]).real > ALIKE * first * then
    most, later = ODD * usual, (bend * step**2)[:-1]
    falls = (first > most) & (then > most) & alike & (np.abs(then - first - later) < 0.5 * later + most)
    falls = np.append(falls & close[1:], unseen_after and abs(off[-1]) > most)
    falls &= close & (np.abs(at[:-1]) > NEAR_EDGE * radius)
    if not falls.any():
        return float("inf")
    k = int(np.argmax(falls))
    return float(t[k] + 0.5 * step[k] - (abs(off[k]) + 2 * usual) / step[k] / bend[k])


def recount(t: Array, angle: Array) -> tuple[Array, int]:
    """Whole turns across gaps, from the rates of turning on both sides; how many gaps leave doubt.

    A frame shows the angle but for whole turns. Across a gap the mean of the rates before and after decides.
    If their difference allows an error of half a turn, the gap is doubtful.
    """
    angle, doubtful = angle.copy(), 0
    seen = np.flatnonzero(np.isfinite(angle))
    if len(seen) < 4:
        return angle, doubtful
    usual = usual_interval(t)
    for k in range(1, len(seen) - 2):
        i, j = seen[k], seen[k + 1]
        gap = t[j] - t[i]
        if gap < 3.5 * usual:
            continue
        before = (angle[i] - angle[seen[k - 1]]) / (t[i] - t[seen[k - 1]])
        after = (angle[seen[k + 2]] - angle[j]) / (t[seen[k + 2]] - t[j])
        expected = 0.5 * (before + after) * gap
        angle[j:] += 2 * np.pi * np.round((expected - (angle[j] - angle[i])) / (2 * np.pi))
        doubtful += bool(abs(after - before) * gap / 4 > np.pi / 2 or gap > LONG)
    return angle, doubtful
