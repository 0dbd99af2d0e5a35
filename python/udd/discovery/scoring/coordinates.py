"""What an unknown curve may depend on, and where it may enter the equations."""

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
    """Where a curve enters the equations.

    Attributes
    ----------
    name : str
        ``"torque"``, ``"friction"``, ``"lateral"``, ``"vertical"``, the rate of a state: ``"v'"``, or a
        force: ``"force(x)"``.
    momentum : str or None
        For the contact's velocities: whether the momentum follows. See :class:`udd.effects.Spec`.
    equation : str
        The state in whose equation it stands.
    forcing : callable
        ``(model, states, value, rate) -> (..., d)``: what a curve of this value, changing at this rate, adds
        to the rates of the states.
    """

    name: str
    momentum: str | None
    equation: str
    forcing: Callable[[Model, Array, Array, Array], Array]

    @property
    def title(self) -> str:
        """What a reader calls it."""
        return self.name + (f" ({self.momentum})" if self.momentum else "")


def coordinates(model: Model) -> tuple[Coordinate, ...]:
    """What a model's unknown curves are tried against: its states and what is made of them, and time."""
    own = [
        Coordinate(name, partial(_state, k), partial(_change, k), name in model.angles, name)
        for k, name in enumerate(model.state_names)
    ]
    if "Omega" in model.state_names:
        k = model.state_names.index("Omega")
        own.append(Coordinate("|Omega|", partial(_size, k), partial(_growth, k), False, "abs(Omega)"))
    own += model.profile.discovery.coordinates(model)
    own.append(Coordinate("t", _time, _passing, False, "t"))
    return tuple(own)


def coordinate(model: Model, name: str) -> Coordinate:
    """The coordinate of that name.

    Raises
    ------
    FitError
        The model has none.
    """
    for one in coordinates(model):
        if one.name == name:
            return one
    known = ", ".join(c.name for c in coordinates(model))
    raise FitError(f"a curve can be a function of {known}, not of {name!r}")


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
    """Where a model's unknown curves are tried.

    The disk's are those of the effects (the contact's velocities with and without the momentum that goes with
    them), a pendulum's torque and friction; any other model's are the equations themselves, but
    for those that only say that one state is the rate of another.
    """
    named = model.profile.discovery.slots
    if named is not None:
        return tuple(Slot(*own, _forcing(*own)) for own in named)
    known = model.kinematic
    along = {v: x for x, v in model.speeds.items()} if isinstance(model, FormulaModel) and model.mass else {}
    return tuple(
        Slot(f"force({along[name]})", None, name, partial(_force, name))
        if name in along
        else Slot(f"{name}'", None, name, partial(_direct, k))
        for k, name in enumerate(model.state_names)
        if name not in known
    )


def _forcing(name: str, momentum: str | None, equation: str) -> Callable[[Model, Array, Array, Array], Array]:
    """What a curve in an effect's slot adds to the rates."""
    if name in ("torque", "friction"):
        return _torque if name == "torque" else _friction
    return partial(_moving, equation, momentum)


def _inertia(model: Model, x: Array) -> Array | float:
    inertia = model.profile.dynamics.inertia
    assert inertia is not None  # of a model whose effects enter by slots
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
