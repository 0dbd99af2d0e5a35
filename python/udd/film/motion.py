"""Place of the disk at any time: a smooth curve through the samples of a trajectory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

Array = NDArray[np.float64]
Motion = Callable[[Array], Array]


class TrajectoryLike(Protocol):
    """A run of the disk: times `t` (n,) in s, `state` (n, 4) [Omega, Y, Z, beta] in rad/s, m, m, rad.

    A `model` with `R` and `rates(t, state)`, and dense output (calling it with times), are used where there.
    """

    @property
    def t(self) -> Any:
        """Times, s, increasing."""
        ...

    @property
    def state(self) -> Any:
        """States of the disk at these times."""
        ...


def checked(trajectory: TrajectoryLike) -> tuple[Array, Array]:
    """Return a trajectory's times (n,) and states (n, 4), or say in one sentence what is wrong with them."""
    try:
        t = np.ascontiguousarray(trajectory.t, dtype=np.float64)
        state = np.ascontiguousarray(trajectory.state, dtype=np.float64)
    except AttributeError:
        raise UddError(
            f"a film needs a trajectory with t and state, got {type(trajectory).__name__}"
        ) from None
    if t.ndim != 1 or state.shape != (t.size, 4):
        raise UddError(
            "a film shows one disk: t must be (n,) and state (n, 4), [Omega, Y, Z, beta], "
            f"got {t.shape} and {state.shape}"
        )
    if t.size < 2:
        raise UddError(f"a film needs a trajectory of at least two samples, got {t.size}")
    if not (np.isfinite(t).all() and np.isfinite(state).all()):
        raise UddError("the trajectory holds a time or a state that is not finite")
    if not (np.diff(t) > 0).all():
        raise UddError("the trajectory's times must increase strictly")
    return t, state


def motion_of(trajectory: TrajectoryLike) -> Motion:
    """Interpolate the motion: a function of time, (m,) s -> (m, 4).

    It is the run's dense output if there is one. Otherwise it is a cubic through the samples, with the slopes
    of the model's right-hand side (Hermite) or, without a model, those of a spline. Before the
    first and after the last sample the disk moves on uniformly: the shutter opens half an exposure before the
    first frame's time.
    """
    t, state = checked(trajectory)
    curve = dense_output(trajectory) or _cubic(t, state, getattr(trajectory, "model", None))
    step = 1e-4 * (t[-1] - t[0]) / (t.size - 1)  # so short that the chord is the slope
    ends = curve(np.array([t[0], t[0] + step, t[-1] - step, t[-1]]))
    first, last = (ends[1] - ends[0]) / step, (ends[3] - ends[2]) / step

    def motion(times: Array) -> Array:
        before, after = np.minimum(times - t[0], 0.0), np.maximum(times - t[-1], 0.0)
        inside = curve(np.clip(times, t[0], t[-1]))
        return np.asarray(inside + before[:, None] * first + after[:, None] * last, dtype=np.float64)

    return motion


def then_falling(motion: Motion, end: float, g: float = 9.81) -> Motion:
    """Let the wheels lose the disk at the time `end`: from there on it falls and turns on evenly."""
    step = 1e-5
    before, last = motion(np.array([end - step, end]))
    rate = (last - before) / step
    rate[0], rate[3] = 0.0, last[0]

    def falling(times: Array) -> Array:
        late = np.maximum(times - end, 0.0)
        state = motion(np.minimum(times, end)) + late[:, None] * rate
        state[:, 2] -= 0.5 * g * late**2
        return np.asarray(state, dtype=np.float64)

    return falling


def dense_output(trajectory: TrajectoryLike) -> Motion | None:
    """Return the trajectory as a function of time where it was made with dense output."""
    if not callable(trajectory):
        return None
    try:
        trajectory(np.asarray(trajectory.t, dtype=np.float64)[[0, -1]])
    except UddError:  # made without
        return None
    return trajectory


def _cubic(t: Array, state: Array, model: Any) -> Motion:
    from scipy.interpolate import CubicHermiteSpline, CubicSpline

    rates = getattr(model, "rates", None)
    if rates is None:
        return cast(Motion, CubicSpline(t, state))
    return cast(Motion, CubicHermiteSpline(t, state, np.asarray(rates(t, state), dtype=np.float64)))


def spacing_error(trajectory: TrajectoryLike, radius: float) -> float:
    """Estimate the largest error of a mark's place between the samples, in m.

    Every second sample is left out and predicted from the others. A cubic's error falls by 2^4 when the
    spacing halves, so the error between all samples is a sixteenth of the misfit.
    """
    if dense_output(trajectory) is not None:
        return 0.0
    t, state = checked(trajectory)
    if t.size < 9:
        raise UddError(
            f"a film needs a trajectory of at least nine samples (or with dense output), got {t.size}"
        )
    n = t.size - (t.size + 1) % 2  # odd, so that the last sample that is kept comes after the last left away
    coarse = _cubic(t[:n:2], state[:n:2], getattr(trajectory, "model", None))
    miss = coarse(t[1:n:2]) - state[1:n:2]
    return float(np.max(np.hypot(miss[:, 1], miss[:, 2]) + radius * np.abs(miss[:, 3])) / 16)
