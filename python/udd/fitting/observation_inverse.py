"""First guess of states from sensor readings: invert the output equation frame by frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from udd.errors import FitError
from udd.models.formula_model import FormulaModel

Array = NDArray[np.float64]

_STEP = 1e-5  # Step of a difference quotient.
_FIRST, _NEXT = 30, 3  # Gauss-Newton steps of the first frame, and of those after it.
_RESOLVED = 0.9  # Diagonal of the resolution matrix above which the sensors determine a state.
_SINGULAR = 1e-3  # A combination of states with a smaller relative singular value is not observed.
_FARTHEST = 1.0  # Longest step, in rad or the unit.


class Inverted(NamedTuple):
    """States as the sensors show them.

    Attributes
    ----------
    states : ndarray (n, d)
        States at each frame. They are zero, or their start values, if no sensor shows them.
    shown : ndarray of bool (d,)
        True for states that the sensors of a single frame determine.
    slopes : ndarray (n, d, c)
        Derivatives of each state by each sensor.
    """

    states: Array
    shown: NDArray[np.bool_]
    slopes: Array


def inverted(
    model: FormulaModel, t: Array, seen: dict[str, Array], noise: dict[str, float], start: Array
) -> Inverted:
    """Invert the output equation by Gauss-Newton steps of least length, each frame from the one before.

    Parameters
    ----------
    model : FormulaModel
    t : ndarray (n,)
    seen : dict of str to ndarray (n,)
        Readings of some of the sensors, without gaps.
    noise : dict of str to float
        Noise of the sensors, which determines their weights.
    start : ndarray (d,)
        First guess for the first frame.
    """
    model = model._with(delays=tuple(pair for pair in model.delays if pair[0] in model.inputs))
    columns = [model.channels.index(name) for name in seen]
    values = np.column_stack(list(seen.values()))
    weights = 1.0 / np.array([noise[name] for name in seen])
    n, d = len(t), len(start)
    steps = _STEP * np.vstack([np.eye(d), -np.eye(d)])
    states, slopes = np.empty((n, d)), np.empty((n, d, len(columns)))
    resolution = np.empty((n, d))
    now = start.astype(np.float64)
    for k in range(n):
        for _ in range(_NEXT if k else _FIRST):
            around = model.observed(t[k], now + np.vstack([np.zeros(d), steps]))[:, columns]
            if not np.isfinite(around).all():
                asked = ", ".join(f"'{name}': ..." for name in model.state_names)
                where = ", ".join(f"{n} = {x:.3g}" for n, x in zip(model.state_names, now, strict=True))
                raise FitError(
                    f"the sensors have no value around {where}: say where the motion starts, "
                    f"state0={{{asked}}}"
                )
            jacobian = (around[1 : d + 1] - around[d + 1 :]).T / (2.0 * _STEP) * weights[:, None]
            inverse = np.linalg.pinv(jacobian, rcond=_SINGULAR)
            change = inverse @ (weights * (values[k] - around[0]))
            now = now + change * min(1.0, _FARTHEST / max(float(np.abs(change).max()), 1e-300))
            if np.abs(change).max() < 1e-9:
                break
        states[k], slopes[k] = now, inverse * weights
        resolution[k] = np.diag(inverse @ jacobian)
    return Inverted(states, np.median(resolution, axis=0) > _RESOLVED, slopes)
