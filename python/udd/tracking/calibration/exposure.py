"""Exposure time from the length of the streaks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.tracking.detection.survey import Moving
from udd.tracking.geometry.intervals import usual_interval
from udd.tracking.geometry.pose import DiskAppearance, Motion, Pose
from udd.tracking.marks.localization import MISFIT, beyond_place, coverage, seen_at
from udd.tracking.marks.pose_fit import align
from udd.video.reader import Plane

SHARES = np.linspace(0.0, 1.0, 9)  # of the frame interval
FASTEST = 12
MOST = 36  # frames from which it is measured again
ROUNDS = 20
STEP = 0.1  # of the exposure's logarithm in one of them: the first estimate may be off by half
SMALL = 0.02  # relative change over which slopes are taken
WORSE = 5.0  # times the least misfit
PARABOLA = 0.2  # of the step between shares, to which its vertex is good
LEAST_PATH = 6.0  # pixels between frames below which a frame says nothing about the exposure
STREAK = 2.5  # pixels: shorter streaks look like the lens's blur


@dataclass(frozen=True)
class Exposure:
    """Exposure time and its standard error [s], from leaving out frames in turn and from the steps tried."""

    value: float
    sigma: float


def exposure(moving: Sequence[Moving], look: DiskAppearance, view: NDArray[np.bool_]) -> Exposure:
    """Exposure time: what explains the fastest survey frames best; 0 if none is fast."""
    reach = look.reach
    paths = [abs(m.rate) * m.interval + abs(m.turning) * m.interval * reach for m in moving]
    order = np.argsort(-np.array(paths), kind="stable")[:FASTEST]
    fast = [moving[k] for k in order if paths[k] > LEAST_PATH]
    if not fast:
        return Exposure(0.0, np.inf)
    costs = []
    for m in fast:
        each = np.array([_misfit(m, share, look, view) for share in SHARES])
        if np.isfinite(each).any():
            costs.append(np.minimum(each / each.min(), WORSE))  # one frame never outvotes the others
    if not costs:
        return Exposure(0.0, np.inf)
    cost = np.sum(costs, axis=0)
    interval, n = float(np.median([m.interval for m in fast])), len(costs)
    others = np.array([_best(cost - one) for one in costs])  # delete-one jackknife
    sigma = float(np.sqrt((n - 1) * others.var())) if n > 1 else np.inf
    return Exposure(_best(cost) * interval, float(np.hypot(sigma, PARABOLA * SHARES[1])) * interval)


def _best(cost: NDArray[np.float64]) -> float:
    """Share of the interval at which the cost is least."""
    k = int(np.argmin(cost))
    best = float(SHARES[k])
    if 0 < k < len(SHARES) - 1:  # the vertex of the parabola through the lowest three
        a, b, c = cost[k - 1 : k + 2]
        best += float(0.5 * (a - c) / (a - 2 * b + c) * SHARES[1])
    return best


def again(
    frames: Sequence[tuple[Plane, Pose, Callable[[float], Motion]]],
    open_for: float,
    look: DiskAppearance,
    view: NDArray[np.bool_],
) -> float:
    """Estimate the exposure again, from frames whose neighbours give the motion for any exposure.

    Gauss-Newton steps of its logarithm on the pixels about the marks, white, contrast and place left free.
    """
    long = np.array([look.streak(motion(open_for)) for _, _, motion in frames])
    fast = [frames[k] for k in np.argsort(-long, kind="stable")[:MOST] if long[k] > STREAK]
    best = open_for
    for _ in range(ROUNDS):
        each = np.array([_pull(y, pose, motion, best, look, view) for y, pose, motion in fast]).reshape(-1, 2)
        if not each[:, 1].sum() > 0:
            return open_for
        step = float(each[:, 0].sum() / each[:, 1].sum())
        best *= float(np.exp(np.clip(step, -STEP, STEP)))
        if abs(step) < 1e-3:
            break
    return best


def _pull(
    y: Plane,
    pose: Pose,
    motion: Callable[[float], Motion],
    open_for: float,
    look: DiskAppearance,
    view: NDArray[np.bool_],
) -> tuple[float, float]:
    """Product of the residual and the light's slope in the exposure's logarithm, and that slope's square."""
    now, here = motion(open_for), Pose(pose.centre, pose.angle)
    fit = align(y, view, look, here, now, [MISFIT, MISFIT], gain_slack=0.3, keep=True)
    if fit is None:
        return 0.0, 0.0
    pull = information = 0.0
    poses, locals_ = seen_at(look, here, now, y.shape[0])
    for mark, s, used, (u, v, angle), local in zip(
        look.marks, fit.sightings, fit.used, poses, locals_, strict=True
    ):
        if s is None or not used or s.weight is None or s.residual is None:
            continue
        base, longer, less = (
            coverage(mark, complex(u, v), angle, motion(f * open_for), look.psf, s.box, local).ravel()
            for f in (1.0, 1 + SMALL, 1 - SMALL)
        )
        slope = mark.level * s.gain * beyond_place((longer - less)[None] / (2 * SMALL), base, s)[0]
        pull += float((s.weight * slope) @ s.residual)
        information += float((s.weight * slope) @ slope)
    return pull, information


def _misfit(m: Moving, share: float, look: DiskAppearance, view: NDArray[np.bool_]) -> float:
    """Sum of squares over fixed windows around the marks, so that shares compare on the same pixels."""
    picture, whole = m.picture, Motion(m.rate * m.interval, m.turning * m.interval)
    motion = Motion(whole.shift * share, whole.turn * share)
    pose = Pose(m.sight.centre, m.sight.angle)
    if align(picture.y, view, look, pose, motion, [1.0, 0.5, MISFIT], gain_slack=0.3) is None:
        return np.inf
    total = 0.0
    at = pose.centre + look.places * np.exp(1j * pose.angle)
    where = zip(look.lens.locals(at), look.lens.picture(at), strict=True)
    for mark, light, (local, point) in zip(look.marks, look.lights, where, strict=True):
        middle = complex(point)
        reach = np.hypot(*mark.half) + 0.3 * (abs(whole.shift) + abs(whole.turn * mark.place)) + 4
        r0, r1 = max(0, int(middle.imag - reach)), min(view.shape[0], int(middle.imag + reach))
        c0, c1 = max(0, int(middle.real - reach)), min(view.shape[1], int(middle.real + reach))
        if r1 - r0 < 4 or c1 - c0 < 4:
            continue
        cover = coverage(mark, pose.centre, pose.angle, motion, look.psf, (r0, r1, c0, c1), local)
        ok = view[r0:r1, c0:c1]
        rest = light[picture.y[r0:r1, c0:c1]] - mark.level * cover
        rest = rest[ok] - np.median(rest[ok]) if ok.any() else np.zeros(1)
        total += float((np.clip(rest, -60, 60) ** 2).sum())
    return total


def at_middle(
    t: NDArray[np.float64], centre: NDArray[np.complex128], angle: NDArray[np.float64], open_for: float
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Turn means over the exposure into values at its middle.

    Over an exposure T the mean of x is x + x'' T^2 / 24 (to fourth order); x'' comes from the
    neighbouring frames, whose errors this small share hardly carries over. A frame without two
    neighbours close by stays as it is.
    """
    centre, angle = centre.copy(), angle.copy()
    if len(t) < 3:
        return centre, angle
    before, after = t[1:-1] - t[:-2], t[2:] - t[1:-1]
    close = (np.maximum(before, after) < 2.5 * usual_interval(t)).astype(float)
    for x in (centre, angle):
        bend = 2 * ((x[2:] - x[1:-1]) / after - (x[1:-1] - x[:-2]) / before) / (before + after)
        shift = close * bend * open_for**2 / 24
        x[1:-1] -= np.where(np.isfinite(shift), shift, 0.0)
    return centre, angle
