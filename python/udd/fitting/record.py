"""A measurement as the estimator takes it: frames in a row, linked or not, and a guess of the states."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd.errors import FitError
from udd.measurement import Measurement

Array = NDArray[np.float64]

#: What a camera typically gets wrong, taken where a measurement does not say: m, m, rad; rad for a pendulum.
_SIGMA = {"disk": (5e-4, 5e-4, 7e-3), "pendulum": (5e-3,)}


@dataclass(frozen=True)
class Record:
    """Frames for the estimator.

    Attributes
    ----------
    t : ndarray (n,)
        Time of each frame since the measurement's first row, s. Frames that were missing in short gaps are
        put in, so that no flow runs for long.
    seen : ndarray (n, m)
        What was seen; 0 where it was not.
    sigma : ndarray (n, m)
        Standard deviation that the measurement states; infinite where a channel was not seen.
    rho : ndarray (n, m, m)
        Correlation of the channels' errors.
    linked : ndarray of bool (n - 1,)
        Whether frame i + 1 continues the motion of frame i.
    states : ndarray (n, d)
        A first guess of the states.
    row : ndarray of int (n,)
        The measurement's row that a frame came from; -1 where it was put in.
    origin : float
        The measurement's time of its first row, s, from which the model's time counts: a drift's drive and a
        ripple's phase are those at the record's start.
    """

    t: Array
    seen: Array
    sigma: Array
    rho: Array
    linked: NDArray[np.bool_]
    states: Array
    row: NDArray[np.int64]
    origin: float

    def part(self, frames: slice) -> Record:
        """The frames in a slice with step 1."""
        return replace(
            self,
            t=self.t[frames],
            seen=self.seen[frames],
            sigma=self.sigma[frames],
            rho=self.rho[frames],
            linked=self.linked[frames][: max(len(self.t[frames]) - 1, 0)],
            states=self.states[frames],
            row=self.row[frames],
        )

    @property
    def observed(self) -> NDArray[np.bool_]:
        """Which channels were seen in which frame, (n, m)."""
        return np.isfinite(self.sigma)


def record_of(measurement: Measurement) -> Record:
    """Lay a measurement out for the estimator.

    Raises
    ------
    FitError
        Where it is no measurement, or too few frames were seen.
    """
    if not isinstance(measurement, Measurement):
        raise FitError(f"a measurement is needed (udd.track or udd.read_measurement), not {measurement!r}")
    values, seen = measurement.values, measurement.seen
    if seen.sum() < 10:
        raise FitError(f"the measurement holds {int(seen.sum())} usable frames; a fit needs at least 10")
    origin = float(measurement.t[0])
    times = measurement.t[seen] - origin
    step = float(np.median(np.diff(times)))
    longest = max(0.5, 3.5 * step)
    t, row, linked = _fill(times, np.flatnonzero(seen), step, longest)

    channels = values.shape[1]
    there = row >= 0
    full = np.zeros((len(t), channels))
    full[there] = values[row[there]]
    sigma = np.full((len(t), channels), np.inf)
    rho = np.tile(np.eye(channels), (len(t), 1, 1))
    if measurement.sigma is None:
        sigma[there] = _SIGMA[measurement.kind]
    else:
        sigma[there] = measurement.sigma[row[there]]
        covariance = measurement.covariance()[row[there]]
        rho[there] = covariance / (sigma[there][:, :, None] * sigma[there][:, None, :])
    known = full[there].copy()
    if np.ptp(known[:, -1]) <= 2 * np.pi:  # an angle that was never unwrapped, or never went round
        known[:, -1] = np.unwrap(known[:, -1])
    guess = np.column_stack([np.interp(t, t[there], known[:, m]) for m in range(channels)])
    return Record(t, full, sigma, rho, linked, _states(t, guess, linked), row, origin)


def _fill(
    t: Array, rows: NDArray[np.int64], step: float, longest: float
) -> tuple[Array, NDArray[np.int64], NDArray[np.bool_]]:
    """Put frames into short gaps; cut at long ones."""
    times, origin, links = [t[:1]], [rows[:1]], []
    for a, b, r in zip(t[:-1], t[1:], rows[1:], strict=True):
        extra = 0 if b - a > longest else max(round((b - a) / step) - 1, 0)
        times += [np.linspace(a, b, extra + 2)[1:]]
        origin += [np.full(extra, -1), np.array([r])]
        links += [np.full(extra + 1, b - a <= longest)]
    return np.concatenate(times), np.concatenate(origin), np.concatenate(links)


def _states(t: Array, guess: Array, linked: NDArray[np.bool_]) -> Array:
    """First guess of the states: the rate of the angle from neighbouring frames, the rest as seen.

    It only starts the estimator, which never differentiates data.
    """
    omega = np.zeros(len(t))
    for run in np.split(np.arange(len(t)), np.flatnonzero(~linked) + 1):
        if len(run) > 1:
            omega[run] = np.gradient(guess[run, -1], t[run])
    return np.column_stack([omega, guess])
