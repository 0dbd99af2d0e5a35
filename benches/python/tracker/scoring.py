"""Errors of a tracked film against the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from films import Case
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from udd.film import Film

WRONG = (2e-3, 2e-3, 0.1)  # m, m, rad: an error beyond is wrong unless the frame is flagged
SAID_WITHIN = 0  # frames after which it must be said that the disk has gone
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Score:
    """Result of a tracker on a film."""

    length: float  # rms (or 95th percentile over 1.96) of Y or Z, the worse [mm]
    angle: float  # [mrad]
    shape: float  # the same as `length` after a shift and a common factor [mm]
    lost: float  # share of the frames in which the disk is on the wheels
    wrong: int
    pivot: float  # error of the contact point [mm]
    drive: float  # relative error of W
    cover: float  # rms of the normalised errors after that shift and factor
    rate: float  # frames/s, wall clock

    def passes(self, case: Case) -> bool:
        """Whether the row's limits are met; of films whose contact nobody knows by the shape."""
        length, angle, lost = case.limits
        if case.name.startswith("shared"):
            return self.shape <= length and self.angle <= angle and self.lost <= lost
        return self.length <= length and self.angle <= angle and self.lost <= lost and self.wrong == 0


def matched(times: Array, film: Film, repeated: tuple[int, ...]) -> NDArray[np.intp]:
    """The film's frame for each row."""
    near = np.abs(times[:, None] - film.t[None, :])
    return np.asarray(near.argmin(axis=1))


def as_taken(case: Case, film: Film) -> Film:
    """Return the film with the camera's frames, if a converter mixed or repeated them."""
    t = film.t
    if "blended" in case.defects:
        rate = case.defects["blended"]
        t = np.arange(math.ceil(t[-1] * rate - 1e-6) + 1) / rate  # the last one is mixed in, too
    elif "copied" in case.defects:
        t = np.unique(t)
    else:
        return film
    _, rows = np.unique(film.t, return_index=True)
    state = CubicSpline(film.t[rows], film.state[rows])(t)
    return replace(film, t=t, state=state, held=np.ones(len(t), dtype=bool))


def size(e: Array, percentile: bool) -> float:
    """Rms, or the 95th percentile as a normal law would have it at 1.96 rms."""
    return float(np.percentile(np.abs(e), 95) if percentile else np.sqrt((e**2).mean()))


def shape_errors(e: Array, truth: Array, sigma: Array) -> Array:
    """Errors (n, 3) without the shift, and for Y and Z the factor, that frames so sure of themselves tell."""
    out = e.copy()
    for k, w in enumerate((1 / sigma).T):
        design = np.column_stack([np.ones(len(w)), truth[:, k]] if k < 2 else [np.ones(len(w))])
        out[:, k] -= design @ np.linalg.lstsq(design * w[:, None], e[:, k] * w, rcond=None)[0]
    return out


def score(
    case: Case,
    film: Film,
    t: Array,
    values: Array,
    covariance: Array | None,
    rate: float,
    pivot: float = math.nan,
    drive: float = math.nan,
) -> Score:
    """Compare the rows (t; Y, Z, beta; NaN: not given) with the film's truth."""
    film = as_taken(case, film)
    row = matched(t, film, ())
    truth = film.state[row, 1:]
    bad = np.isin(
        np.round(film.t[row] * 25).astype(int),
        [*case.defects.get("black", ()), *case.defects.get("repeated", ())],
    )
    visible = film.held[row] & ~bad
    seen = np.isfinite(values).all(axis=1)
    use = seen & film.held[row]
    e = values - truth
    turn = np.nanmedian(e[use, 2])
    if not np.isfinite(turn):
        return Score(math.nan, math.nan, math.nan, 1.0, 0, pivot, drive, math.nan, rate)
    e[:, 2] -= 2 * np.pi * np.round(turn / (2 * np.pi))
    if "mark_offsets" in case.defects or "mark_strength" in case.defects:
        e[:, 2] -= np.median(e[use, 2])  # where the angle's zero is, is a matter of the marks
    wrong = int((np.abs(e[seen]) > WRONG).any(axis=1).sum())
    invented = max(0, int((seen & ~film.held[row]).sum()) - SAID_WITHIN)
    fair = np.abs(e[use]).copy()
    free = shape_errors(e[use], truth[use], np.ones((int(use.sum()), 3)))
    cover = math.nan
    if covariance is not None:
        c = covariance[use]
        # fast frames tell the shift and the factor much less
        even = shape_errors(e[use], truth[use], np.sqrt(np.diagonal(c, axis1=1, axis2=2)))
        z2 = np.einsum("ni,nij,nj->n", even, np.linalg.inv(c), even) / 3
        # the first exposure begins before the run, and until then the film maker lets the disk move evenly
        z2 = z2[np.flatnonzero(use) > 0]
        cover = math.sqrt(float(np.mean(z2)))
    p = case.percentile
    lost = 1 - int((use & ~bad).sum()) / int(visible.sum())
    missing = len(film.t) - len(t)
    lost += max(0, missing) / len(film.t)
    return Score(
        1e3 * max(size(fair[:, k], p) for k in range(2)),
        1e3 * size(fair[:, 2], p),
        1e3 * max(size(free[:, k], p) for k in range(2)),
        lost,
        wrong + invented,
        pivot,
        drive,
        cover,
        rate,
    )
