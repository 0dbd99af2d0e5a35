"""A measurement with the noise of its frames averaged away: the Rauch-Tung-Striebel smoother."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.validation import number

from . import DISK, Measurement, MeasurementError, check_length
from .unwrapping import unwrapped

Array = NDArray[np.float64]

# Rows from which the roughness of the motion is estimated.
LEARN = 2000

# Trial values of the roughness, as shares of its largest value by the third differences.
TRIED = np.logspace(-12, 1, 53)

# Variance of the third difference of white jerk of density 1 per frame: a B-spline's square.
THIRD = 11 / 20

# Variance of the unknown first state over that of a frame's step.
WIDE = 100.0

# Linearisations of the rolling constraint about the last estimate.
ROUNDS = 3


@dataclass(frozen=True)
class _Stretch:
    """Rows without a long gap, times in frames; `what` is NaN where a row shows nothing."""

    rows: slice
    t: Array
    what: Array
    noise: Array  # (n, m, m)


@checked_arguments(error=MeasurementError)
def smooth(
    measurement: Measurement, *, gap: float = 0.1, slip: float | None = None, angles: Collection[str] = ()
) -> Measurement:
    """Smooth a measurement over neighbouring rows, and estimate the remaining noise.

    Parameters
    ----------
    measurement : Measurement
        With standard errors; of a disk, a pendulum or any other coordinates.
    gap : float
        Longest time between two usable rows that is bridged [s]. A longer gap is not filled in, and its two
        sides are smoothed separately.
    slip : float, optional
        If given, the disk rolls, dY/dT = Z Omega, up to a random slip of this standard error [m/s] in each
        row. The error of the contact, ``meta["pivot_sigma"]``, times Omega is added.
    angles : collection of str
        Columns of a model of your own that are angles: they are made continuous first, as those of a disk and
        a pendulum are in any case.

    Returns
    -------
    Measurement
        The same rows and flags, smoothed, with the standard errors and correlations that remain. A row in a
        short gap is filled in but keeps its flag, so that no fit counts it; before the first usable row,
        after the last and in long gaps there is NaN.

    Raises
    ------
    MeasurementError
        No standard errors; fewer than 10 usable rows; `slip` for what is not a disk; `angles` that are no
        columns.
    ModelError
        `gap` or `slip` is not a positive number.

    See Also
    --------
    udd.fit : takes the record without smoothing.
    udd.plot.time_series : draw the columns.

    Notes
    -----
    Every coordinate has a position, a rate and an acceleration that white jerk drives. The strength of the
    jerk has the highest likelihood (Kalman filter, Rauch, Tung and Striebel, AIAA J. 3, 1965 [41]).

    The errors of neighbouring rows are correlated afterwards: fit and discover with the original record, and
    never test a record for slip that was smoothed with `slip`.

    Examples
    --------
    >>> import numpy as np, udd
    >>> t = np.arange(400) / 100
    >>> noise = np.random.default_rng(1).normal(0, 0.01, t.size)
    >>> m = udd.Measurement(t, {"theta": np.sin(2 * t) + noise}, sigma=np.full(t.size, 0.01))
    >>> quiet = udd.smooth(m)
    >>> error = np.std(quiet["theta"] - np.sin(2 * t))
    >>> bool(error < 0.004), bool(np.median(quiet["sigma_theta"]) < 0.004)
    (True, True)
    """
    gap = number("gap", gap, above=0.0)
    if slip is not None:
        slip = number("slip", slip, above=0.0)
        if measurement.names != DISK:
            raise MeasurementError(f"slip is for a disk with columns {DISK}, not {measurement.names}")
    check_length(measurement)
    if isinstance(angles, str) or not set(angles) <= set(measurement.names):
        names = ", ".join(measurement.names)
        raise MeasurementError(f"angles must be a list of columns, not {angles!r:.80}: there are {names}")
    measurement = unwrapped(measurement, angles)
    frame = float(np.median(np.diff(measurement.t)))
    stretches = _stretches(measurement, gap, frame)
    if max(len(stretch.t) for stretch in stretches) < 2:
        raise MeasurementError(
            f"gap is {gap:.3g} s, but usable rows are {frame:.3g} s apart: give a longer one"
        )
    jerk, step = _learn(stretches)
    contact = float(measurement.meta.get("pivot_sigma", 0.0)) if slip is not None else 0.0
    values = np.full_like(measurement.values, np.nan)
    spread = np.full((*values.shape, values.shape[1]), np.nan)
    for stretch in stretches:
        x, p = _smoothed(stretch, jerk, step, None)
        for _ in range(ROUNDS if slip is not None else 0):
            assert slip is not None
            off = np.hypot(slip * frame, contact * x[:, 7])
            x, p = _smoothed(stretch, jerk, step, _rolling(x, off))
        values[stretch.rows], spread[stretch.rows] = x[:, ::3], p[:, ::3, ::3]
    sigma = np.sqrt(np.einsum("nii->ni", spread))
    pairs = list(combinations(range(values.shape[1]), 2))
    rho = (
        np.column_stack([spread[:, a, b] / (sigma[:, a] * sigma[:, b]) for a, b in pairs]) if pairs else None
    )
    said = {"smoothed_gap": gap} if slip is None else {"smoothed_gap": gap, "smoothed_slip": slip}
    return Measurement(
        measurement.t,
        values,
        sigma,
        None if rho is None else np.clip(rho, -0.999999, 0.999999),
        measurement.flag,
        {**measurement.meta, **said},
        measurement.names,
        measurement.quality,
        measurement.inputs,
    )


def _stretches(m: Measurement, gap: float, frame: float) -> list[_Stretch]:
    seen = np.flatnonzero(m.seen)
    # a gap that is just as long as was said is bridged, whatever the last bit of the times
    cuts = np.flatnonzero(np.diff(m.t[seen]) > gap * (1 + 1e-9)) + 1
    what, noise = np.where(m.seen[:, None], m.values, np.nan), m.covariance()
    stretches = []
    for part in np.split(seen, cuts):
        rows = slice(int(part[0]), int(part[-1]) + 1)
        stretches.append(_Stretch(rows, m.t[rows] / frame, what[rows], noise[rows]))
    return stretches


def _learn(stretches: list[_Stretch]) -> tuple[Array, Array]:
    """Estimate the density of the jerk and the mean square of a step of each coordinate, from `TRIED`."""
    some, count = [], 0
    for stretch in sorted(stretches, key=lambda s: len(s.t), reverse=True):
        some.append(stretch)
        count += len(stretch.t)
        if count > LEARN:
            break
    m = some[0].what.shape[1]
    noise = np.concatenate([np.einsum("nii->ni", s.noise)[np.isfinite(s.what[:, 0])] for s in some])
    floor = noise.mean(axis=0)

    def square(order: int) -> Array:
        steps = np.concatenate([np.diff(s.what, order, axis=0) for s in some if len(s.t) > order])
        steps = steps[np.isfinite(steps).all(axis=1)]
        return np.asarray((steps**2).mean(axis=0)) if len(steps) else np.zeros(m)

    step = square(1) + floor
    tried = (square(3) + floor) / THIRD * TRIED[:, None]  # (tried, m)
    cost = np.zeros_like(tried)
    for stretch in some:
        cost += _surprise(stretch, tried, step)
    return tried[np.argmin(cost, axis=0), np.arange(m)], step


def _surprise(stretch: _Stretch, jerk: Array, step: Array) -> Array:
    """Minus twice the logarithm of the likelihood of each coordinate by itself, for many jerks at once."""
    x = np.zeros((*jerk.shape, 3))
    x[..., 0] = stretch.what[0]
    p = np.broadcast_to(WIDE * step[:, None, None] * np.eye(3), (*jerk.shape, 3, 3))
    cost = np.zeros_like(jerk)
    for k in range(min(len(stretch.t), LEARN)):
        if k:
            f, q = _motion(stretch.t[k] - stretch.t[k - 1])
            x, p = x @ f.T, f @ p @ f.T + jerk[..., None, None] * q
        if np.isnan(stretch.what[k, 0]):
            continue
        off, s = stretch.what[k] - x[..., 0], p[..., 0, 0] + np.diagonal(stretch.noise[k])
        gain = p[..., :, 0] / s[..., None]
        x = x + gain * off[..., None]
        p = p - gain[..., :, None] * p[..., None, 0, :]
        cost += np.log(s) + off**2 / s
    return cost


def _motion(h: float) -> tuple[Array, Array]:
    """Transition of (position, rate, acceleration) over the time h, and the covariance of unit white jerk."""
    f = np.array([[1, h, h * h / 2], [0, 1, h], [0, 0, 1]])
    q = np.array([[h**5 / 20, h**4 / 8, h**3 / 6], [h**4 / 8, h**3 / 3, h**2 / 2], [h**3 / 6, h**2 / 2, h]])
    return f, q


def _rolling(x: Array, off: Array) -> tuple[Array, Array, Array]:
    """Y' - Z Omega = 0 about a known motion, as one more measurement: row, value and standard error."""
    row = np.zeros_like(x)  # Y, Y', Y'', Z, Z', Z'', beta, Omega, Omega'
    row[:, 1], row[:, 3], row[:, 7] = 1.0, -x[:, 7], -x[:, 3]
    return row, -x[:, 3] * x[:, 7], off


def _smoothed(
    stretch: _Stretch, jerk: Array, step: Array, rolling: tuple[Array, Array, Array] | None
) -> tuple[Array, Array]:
    """States (n, 3 m) and their covariances: forth by Kalman, back by Rauch, Tung and Striebel."""
    n, m = stretch.what.shape
    x, p = np.zeros((n, 3 * m)), np.zeros((n, 3 * m, 3 * m))
    ahead_x, ahead_p, moves = x.copy(), p.copy(), np.zeros((n, 3 * m, 3 * m))
    shows = np.eye(3 * m)[::3]  # the positions
    for k in range(n):
        if k:
            f, q = _motion(stretch.t[k] - stretch.t[k - 1])
            moves[k] = np.kron(np.eye(m), f)
            ahead_x[k] = moves[k] @ x[k - 1]
            ahead_p[k] = moves[k] @ p[k - 1] @ moves[k].T + np.kron(np.diag(jerk), q)
        else:
            ahead_x[0, ::3], ahead_p[0] = stretch.what[0], np.kron(np.diag(WIDE * step), np.eye(3))
        x[k], p[k] = ahead_x[k], ahead_p[k]
        if np.isfinite(stretch.what[k, 0]):
            x[k], p[k] = _update(x[k], p[k], shows, stretch.what[k], stretch.noise[k])
        if rolling is not None:
            row, value, off = (part[k : k + 1] for part in rolling)
            x[k], p[k] = _update(x[k], p[k], row, value, off[:, None] ** 2)
    for k in range(n - 2, -1, -1):
        back = np.linalg.solve(ahead_p[k + 1], moves[k + 1] @ p[k]).T
        x[k] += back @ (x[k + 1] - ahead_x[k + 1])
        p[k] += back @ (p[k + 1] - ahead_p[k + 1]) @ back.T
    return x, p


def _update(x: Array, p: Array, shows: Array, what: Array, noise: Array) -> tuple[Array, Array]:
    """One measurement taken in; Joseph's form, which keeps a covariance positive."""
    gain = np.linalg.solve(shows @ p @ shows.T + noise, shows @ p).T
    rest = np.eye(len(x)) - gain @ shows
    return x + gain @ (what - shows @ x), rest @ p @ rest.T + gain @ noise @ gain.T
