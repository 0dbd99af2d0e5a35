"""Two bobs of a double pendulum: the angle of the upper one about the pivot, of the lower one about it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd.measurement import Measurement
from udd.tracking.geometry.turns import count_turns_over_the_top, in_doubt
from udd.video.reader import TrackError

NAMES = ("th1", "th2")
ASTRAY = 8.0  # times the usual scatter of the distance, beyond ...
HIDDEN = 0.2  # ... of the bob's radius, as a bob that is partly hidden: something else
RIGID = 0.03  # of the distance of the bobs by which it may change


def scatter(rest: NDArray[np.float64]) -> float:
    """Return the usual scatter of distances [pixels], which outliers do not change; NaN are left out."""
    return 1.48 * float(np.nanmedian(np.abs(rest - np.nanmedian(rest))))


def is_astray(rest: NDArray[np.float64], area: float) -> NDArray[np.bool_]:
    """Return True for distances, less the usual one, at which a bob with this area [pixels] cannot be."""
    return np.asarray(np.abs(rest) > HIDDEN * np.sqrt(area / np.pi) + ASTRAY * scatter(rest))


def with_lower_bob(
    upper: Measurement, first: NDArray[np.complex128], second: NDArray[np.complex128], area: float, name: str
) -> Measurement:
    """Add the angle of the lower bob to the measurement of the upper one.

    Parameters
    ----------
    upper : Measurement
        ``theta`` of the upper bob.
    first, second : ndarray of complex (n,)
        Places of the bobs [pixels, v down], NaN if not seen.
    area : float
        Area of the lower bob [pixels].
    name : str
        Name of the film, for messages.

    Returns
    -------
    Measurement
        ``th1, th2`` [rad, from the vertical], each with standard errors.

    Raises
    ------
    TrackError
        The bobs do not keep their distance.
    """
    seen = upper.seen & np.isfinite(second) & np.isfinite(first)
    if seen.sum() < 10:
        raise TrackError(f"{name}: both bobs are seen in {seen.sum()} frames only, at least 10 are needed")
    arm = second - first
    length = float(np.median(np.abs(arm[seen])))
    off = np.abs(arm) - length
    spread = scatter(off[seen])
    if spread > RIGID * length:
        raise TrackError(
            f"{name}: the distance of the bobs changes by {spread:.1f} of {length:.0f} pixels: are they the "
            "two bobs of one double pendulum, the upper one named first?"
        )
    seen &= ~is_astray(off, area)
    turns = count_turns_over_the_top(upper.t, np.where(seen, np.arctan2(arm.real, arm.imag), np.nan))
    values = np.column_stack([upper["theta"], turns.angle])
    sigma = np.column_stack([upper["sigma_theta"], np.where(seen, max(spread, 0.01) / length, np.nan)])
    values[~seen] = sigma[~seen] = np.nan
    flag = [
        said or ("" if ok else "lost: a bob is not seen, or partly hidden, or something else has its colour")
        for ok, said in zip(seen, upper.flag, strict=True)
    ]
    for first_doubtful, why in in_doubt(turns):
        flag[first_doubtful:] = [said or f"degraded: {why}" for said in flag[first_doubtful:]]
    meta = {
        **upper.meta,
        "frames_lost": int((~seen).sum()),
        "lower_length_px": length,
        "lower_bob_px": float(np.sqrt(area / np.pi)),
    }
    return replace(upper, values=values, sigma=sigma, rho=None, flag=np.array(flag), meta=meta, names=NAMES)
