"""Coordinates of unknown curves, and the places where they may enter the equations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from udd.errors import FitError
from udd.models import Model
from udd.models.formula_model import FormulaModel
from udd.models.profile import Coordinate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Slot:
    """Place of a curve in the equations.

    Attributes
    ----------
    name : str
        ``"torque"``, ``"friction"``, ``"lateral"``, ``"vertical"``, the rate of a state: ``"v'"``, or a
        force: ``"force(x)"``.
    momentum : str or None
        For the contact's velocities: whether the angular momentum changes too. See :class:`udd.effects.Spec`.
    equation : str
        State whose equation it enters.
    forcing : callable
        ``(model, states, value, rate) -> (..., d)``: change of the states' rates by a curve of this value
        that changes at this rate.
    """

    name: str
    momentum: str | None
    equation: str
    forcing: Callable[[Model, Array, Array, Array], Array]

    @property
    def title(self) -> str:
        """Name of the slot for a reader."""
        return self.name + (f" ({self.momentum})" if self.momentum else "")


def coordinates(model: Model) -> tuple[Coordinate, ...]:
    """List the coordinates of a model's unknown curves: states, combinations of them, and time."""
    result = [
        Coordinate(name, partial(_state, k), partial(_change, k), name in model.angles, name)
        for k, name in enumerate(model.state_names)
    ]
    if "Omega" in model.state_names:
        k = model.state_names.index("Omega")
        result.append(Coordinate("|Omega|", partial(_size, k), partial(_growth, k), False, "abs(Omega)"))
    result += model.profile.discovery.coordinates(model)
    result.append(Coordinate("t", _time, _passing, False, "t"))
    return tuple(result)


def coordinate(model: Model, name: str) -> Coordinate:
    """Return the coordinate with that name."""
    named = {c.name: c for c in coordinates(model)}
    if name not in named:
        raise FitError(f"a curve can be a function of {', '.join(named)}, not of {name!r}")
    return named[name]


def _state(k: int, _t: Array, x: Array) -> Array:
    return x[..., k]


def _change(k: int, _x: Array, v: Array) -> Array:
    return v[..., k]


def _size(k: int, _t: Array, x: Array) -> Array:
    return np.abs(x[..., k])


def _growth(k: int, x: Array, v: Array) -> Array:
    result: Array = np.sign(x[..., k]) * v[..., k]
    return result


def _time(t: Array, _x: Array) -> Array:
    return t


def _passing(x: Array, _v: Array) -> Array:
    return np.ones(x.shape[:-1])


def slots(model: Model) -> tuple[Slot, ...]:
    """List the places of a model's unknown curves.

    For the disk they are those of the effects (the contact's velocities with and without the momentum that
    goes with them); for a pendulum torque and friction. For any other model they are the equations, except
    those in which one state is the rate of another.
    """
    named = model.profile.discovery.slots
    if named is not None:
        return tuple(Slot(*entry, _forcing(*entry)) for entry in named)
    kinematic = model.kinematic
    along = {v: x for x, v in model.speeds.items()} if isinstance(model, FormulaModel) and model.mass else {}
    return tuple(
        Slot(f"force({along[name]})", None, name, partial(_force, name))
        if name in along
        else Slot(f"{name}'", None, name, partial(_direct, k))
        for k, name in enumerate(model.state_names)
        if name not in kinematic
    )


def _forcing(name: str, momentum: str | None, equation: str) -> Callable[[Model, Array, Array, Array], Array]:
    """Return the function for the change of the rates by a curve in an effect's slot."""
    if name in ("torque", "friction"):
        return _torque if name == "torque" else _friction
    return partial(_moving, equation, momentum)


def _inertia(model: Model, x: Array) -> Array | float:
    inertia = model.profile.dynamics.inertia
    assert inertia is not None  # models whose effects enter by slots have it
    return inertia(model, x)


def _torque(model: Model, x: Array, value: Array, _rate: Array) -> Array:
    result = np.zeros(x.shape)
    result[..., 0] = value / _inertia(model, x)
    return result


def _friction(model: Model, x: Array, value: Array, rate: Array) -> Array:
    return _torque(model, x, -value * x[..., 0], rate)


def _moving(equation: str, momentum: str | None, model: Model, x: Array, value: Array, rate: Array) -> Array:
    result = np.zeros(x.shape)
    result[..., ("Omega", "Y", "Z").index(equation)] = value
    if momentum == "consistent":
        # I dOmega/dT = ... - (Y u + Z W_c) Omega + Y dW_c/dT - Z du/dT
        arm, other, sign = (1, 2, -1.0) if equation == "Y" else (2, 1, 1.0)
        torque = -x[..., arm] * value * x[..., 0] + sign * x[..., other] * rate
        result[..., 0] = torque / _inertia(model, x)
    return result


def _direct(k: int, _model: Model, x: Array, value: Array, _rate: Array) -> Array:
    result = np.zeros(x.shape)
    result[..., k] = value
    return result


def _force(speed: str, model: Model, x: Array, value: Array, _rate: Array) -> Array:
    assert isinstance(model, FormulaModel)
    speeds = list(model.speeds.values())
    unit = np.eye(len(speeds))[:, [speeds.index(speed)]]
    result = np.zeros(x.shape)
    at = [model.state_names.index(name) for name in speeds]
    result[..., at] = np.linalg.solve(model.mass_matrix(x), unit)[..., 0] * value[..., None]
    return result
