"""Many orbits of one model: their parameters and initial states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._util.validation import array
from udd.errors import ModelError

from .base import Model

Floats = NDArray[np.float64]


def default_state(model: Model) -> list[float]:
    """Return an initial state from which orbits reach the main attractor."""
    start = model.profile.dynamics.start
    if start is None:
        raise ModelError(
            "a model of your own has no usual initial state: give state0=[...], or for a bifurcation diagram "
            "initial_states=[[...]]"
        )
    return [*start, *[0.0] * (len(model.state_names) - len(start))]  # bristles are at rest


@dataclass(frozen=True, eq=False)
class ParameterBatch:
    """A model with other values of some parameters in each of many orbits.

    Attributes
    ----------
    model : Model
    values : dict of str to ndarray
        Their values, of shapes that broadcast to `shape`.
    shape : tuple of int
        That of the orbits.
    """

    model: Model
    values: dict[str, Floats]
    shape: tuple[int, ...]

    def __len__(self) -> int:
        return int(np.prod(self.shape, dtype=np.int64))

    def rows(self, part: slice = slice(None)) -> Floats:
        """Return all parameters of some of the orbits, shape (orbits, parameters)."""
        first, last, _ = part.indices(len(self))
        names = list(self.model.parameters)
        rows = np.tile(np.array(list(self.model.parameters.values())), (last - first, 1))
        for name, value in self.values.items():
            rows[:, names.index(name)] = np.broadcast_to(value, self.shape).flat[first:last]
        return rows


def parameter_batch(
    model: Model, parameters: Mapping[str, ArrayLike], states: tuple[int, ...] = ()
) -> ParameterBatch:
    """Check the parameters of orbits; `states` are the leading axes of their initial states."""
    values = {name: array(name, value) for name, value in parameters.items()}
    try:
        shape = np.broadcast_shapes(states, *(value.shape for value in values.values()))
    except ValueError:
        shapes = ", ".join(
            str(array_shape) for array_shape in (states, *(value.shape for value in values.values()))
        )
        raise ModelError(f"state0 and parameters of the shapes {shapes} do not fit together") from None
    for name, value in values.items():
        for extreme in (value.min(), value.max()) if value.size else ():
            model.with_parameters({name: float(extreme)})
    return ParameterBatch(model, values, shape)


def orbits_of(
    model: Model, parameters: Mapping[str, ArrayLike], state0: ArrayLike | None
) -> tuple[tuple[int, ...], Floats, Floats]:
    """Return the leading axes, the parameters of each orbit (or of all), and its start (or that of all)."""
    states = array("state0", default_state(model) if state0 is None else state0)
    names = model.state_names
    if states.ndim == 0 or states.shape[-1] != len(names):
        raise ModelError(
            f"state0 must have the {len(names)} components {', '.join(names)} along its last axis, "
            f"not shape {states.shape}"
        )
    orbits = parameter_batch(model, parameters, states.shape[:-1])
    shape = orbits.shape
    if 0 in shape:
        raise ModelError(f"there is no orbit to follow: the shape is {shape}")
    rows = orbits.rows() if orbits.values else orbits.rows(slice(1))
    starts = states.reshape(1, -1) if states.ndim == 1 else np.broadcast_to(states, (*shape, len(names)))
    starts = np.ascontiguousarray(starts).reshape(-1, len(names))
    off = outside_domain(model, rows, starts)
    if off.any():
        raise ModelError(f"{int(off.sum())} of the starts are off the wheels: Y^2 + Z^2 must be below R^2")
    return shape, rows, starts


def outside_domain(model: Model, rows: Floats, starts: Floats) -> NDArray[np.bool_]:
    """Find the starts that have no contact with the wheels, if that ends a run.

    `rows` (n, parameters) and `starts` (n, dim) come one for each orbit, or one for all.
    """
    inside = model.profile.dynamics.inside
    if inside is None or getattr(model, "edge", "ignore") != "stop":
        return np.zeros(max(len(rows), len(starts)), dtype=bool)
    return ~inside(dict(zip(model.parameters, rows.T, strict=True)), starts)
