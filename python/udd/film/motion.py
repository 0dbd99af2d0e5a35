"""Where the disk is at any time: a smooth curve through the samples of a trajectory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

Array = NDArray[np.float64]
Motion = Callable[[Array], Array]


class TrajectoryLike(Protocol):
    """A run of the disk: times `t` (n,) in s, `state` (n, 4) [Omega, Y, Z, beta] in rad/s, m, m, rad.

    A `model` with `R` and `rates(t, state)` is used where there is one.
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

    It is a cubic through the samples, with the slopes of the model's right-hand side where the trajectory has
    a model (Hermite, error of order h^4), otherwise those of a cubic spline. Before the first and after the
    last sample the disk moves on uniformly: the shutter opens half an exposure before the first frame's time.
    """
    from scipy.interpolate import CubicHermiteSpline, CubicSpline

    t, state = checked(trajectory)
    rates = getattr(getattr(trajectory, "model", None), "rates", None)
    if rates is not None:
        curve: Any = CubicHermiteSpline(t, state, np.asarray(rates(t, state), dtype=np.float64))
    elif t.size >= 4:
        curve = CubicSpline(t, state)
    else:
        raise UddError(f"a film of a trajectory without a model needs at least four samples, got {t.size}")
    slope = curve.derivative()(t[[0, -1]])

    def motion(times: Array) -> Array:
        inside = np.clip(times, t[0], t[-1])
        before, after = np.minimum(times - t[0], 0.0), np.maximum(times - t[-1], 0.0)
        return np.asarray(
            curve(inside) + before[:, None] * slope[0] + after[:, None] * slope[1], dtype=np.float64
        )

    return motion


def spacing_error(trajectory: TrajectoryLike, radius: float) -> float:
    """Estimate the largest error of a mark's place between the samples, in m.

    Every second sample is left away and predicted from the others: a cubic's error falls by 2^4 when the
    spacing halves, so a sixteenth of the misfit is what stands between the samples that are there.
    """
    from types import SimpleNamespace

    t, state = checked(trajectory)
    if t.size < 8:
        return 0.0
    keep = slice(0, t.size - (t.size + 1) % 2, 2)
    left = slice(1, t.size - (t.size + 1) % 2, 2)
    coarse = motion_of(
        SimpleNamespace(t=t[keep], state=state[keep], model=getattr(trajectory, "model", None))
    )
    miss = coarse(t[left]) - state[left]
    return float(np.max(np.hypot(miss[:, 1], miss[:, 2]) + radius * np.abs(miss[:, 3])) / 16)
