"""Many orbits of one model: their parameters and initial states."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._validate import array
from udd.errors import ModelError
from udd.exponents import default_start
from udd.models import Model

Floats = NDArray[np.float64]


def orbits_of(
    model: Model, parameters: Mapping[str, ArrayLike], state0: ArrayLike | None
) -> tuple[tuple[int, ...], Floats, Floats]:
    """The leading axes, the parameters of each orbit (or of all), and its start (or that of all)."""
    states = array("state0", default_start(model) if state0 is None else state0)
    names = model.state_names
    if state0 is None and states.shape != (len(names),):
        states = np.append(states, np.zeros(len(names) - len(states)))
    if states.ndim == 0 or states.shape[-1] != len(names):
        raise ModelError(
            f"state0 must have the {len(names)} components {', '.join(names)} along its last axis, "
            f"not shape {states.shape}"
        )
    values = {name: array(name, value) for name, value in parameters.items()}
    try:
        shape = np.broadcast_shapes(states.shape[:-1], *(value.shape for value in values.values()))
    except ValueError:
        shapes = ", ".join(str(a.shape) for a in (states, *values.values()))
        raise ModelError(f"state0 and parameters of the shapes {shapes} do not fit together") from None
    if 0 in shape:
        raise ModelError(f"there is no orbit to follow: the shape is {shape}")
    jobs = int(np.prod(shape, dtype=np.int64))
    base = np.array(list(model.parameters.values()))
    if values:
        for name, value in values.items():
            for extreme in (value.min(), value.max()):
                model.with_parameters({name: float(extreme)})
        rows = np.tile(base, (jobs, 1))
        for name, value in values.items():
            rows[:, list(model.parameters).index(name)] = np.broadcast_to(value, shape).ravel()
    else:
        rows = base[None]
    starts = states.reshape(1, -1) if states.ndim == 1 else np.broadcast_to(states, (*shape, len(names)))
    starts = np.ascontiguousarray(starts).reshape(-1, len(names))
    off = off_wheels(model, rows, starts)
    if off.any():
        raise ModelError(f"{int(off.sum())} of the starts are off the wheels: Y^2 + Z^2 must be below R^2")
    return shape, rows, starts


def off_wheels(model: Model, rows: Floats, starts: Floats) -> NDArray[np.bool_]:
    """Which starts have left the wheels already, where that ends a run.

    `rows` (n, parameters) and `starts` (n, dim) come one for each orbit, or one for all.
    """
    if getattr(model, "edge", "ignore") != "stop":
        return np.zeros(max(len(rows), len(starts)), dtype=bool)
    radius = rows[:, list(model.parameters).index("R")]
    Y, Z = (starts[:, model.state_names.index(name)] for name in ("Y", "Z"))
    off: NDArray[np.bool_] = np.hypot(Y, Z) >= radius
    return off
