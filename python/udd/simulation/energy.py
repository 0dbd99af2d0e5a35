"""The energy books of a run: what the motor puts in, what friction takes out, what is stored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.errors import ModelError
from udd.models import DLE, Disk, Model, Pendulum

from .trajectory import Trajectory

__all__ = ["EnergyBalance", "energy_balance"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """Powers per unit mass over a run; ``stored' = motor - friction + effects`` holds exactly.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Times of the run's states.
    stored : ndarray, shape (n,)
        The energy, kinetic and potential [m^2/s^2].
    motor, friction, effects : ndarray, shape (n,)
        What the motor puts in, what the plain model's friction takes out, and what all added effects put in
        [m^2/s^3]. The DLE's are dimensionless, and its damping counts as an effect.
    """

    t: Array
    stored: Array
    motor: Array
    friction: Array
    effects: Array

    def work(self, name: str) -> Array:
        """A power's work from the start of the run on, by the trapezoidal rule.

        Parameters
        ----------
        name : {"motor", "friction", "effects"}

        Returns
        -------
        ndarray, shape (n,)
        """
        power: Array = getattr(self, name)
        return np.append(0.0, np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(self.t)))


def energy_balance(run: Trajectory) -> EnergyBalance:
    """Motor power against friction power along a run.

    Parameters
    ----------
    run : Trajectory
        Of a disk, a pendulum or the DLE.

    Returns
    -------
    EnergyBalance

    Raises
    ------
    ModelError
        The model is a user's own, of which no energy is known.

    Notes
    -----
    With ``I = R^2/2 + Y^2 + Z^2`` the disk's energy ``I Omega^2/2 + g Z`` changes by ``g W - k Omega^2``,
    plus what the effects put in; so on every bounded orbit the time averages of motor and friction power are
    the same without effects. Likewise ``omega^2/2 + z`` of the DLE changes by ``w - omega^2``. All powers are
    read off the model's own rates.

    Examples
    --------
    >>> import numpy as np
    >>> import udd
    >>> run = udd.simulate(udd.DLE(10.0), np.arange(0, 400, 0.01), [1.0, 1.0, 0.01])
    >>> books = udd.energy_balance(run)
    >>> print(round(float(books.friction.mean()), 1), round(float(books.motor.mean()), 1))
    10.0 10.0
    """
    model, t, state = run.model, run.t, run.state
    rates = model.rates(t, state)
    if isinstance(model, DLE):
        omega = state[:, 0]
        stored, motor = omega**2 / 2 + state[:, 2], model.w
        change, friction = omega * rates[:, 0] + rates[:, 2], omega**2
    elif isinstance(model, Disk):
        omega, y, z = state[:, :3].T
        inertia = model.R**2 / 2 + y**2 + z**2
        stored, motor = inertia * omega**2 / 2 + model.g * z, model.g * model.W
        turning = inertia * omega * rates[:, 0] + (y * rates[:, 1] + z * rates[:, 2]) * omega**2
        change = turning + model.g * rates[:, 2]
        friction = _friction(model, model.R**2 / 2, omega)
    elif isinstance(model, Pendulum):
        omega, theta = state[:, :2].T
        weight = model.g * model.length
        stored, motor = model.inertia * omega**2 / 2 - weight * np.cos(theta), 0.0
        change = model.inertia * omega * rates[:, 0] + weight * np.sin(theta) * rates[:, 1]
        friction = _friction(model, model.inertia, omega)
    else:
        raise ModelError("no energy is known of a model of your own")
    effects = change - motor + friction
    if not model.effects and getattr(model, "B", 0.0) == 0.0:
        effects = np.zeros(len(t))  # but for rounding it is so
    return EnergyBalance(t, stored, np.full(len(t), motor), friction, effects)


def _friction(model: Model, inertia: float, omega: Array) -> Array:
    """``k Omega^2`` of the plain law, from its rates where neither gravity nor the drive exerts a torque."""
    plain = model.with_effects(())
    state = np.zeros((len(omega), len(plain.state_names)))
    state[:, 0] = omega
    result: Array = -inertia * omega * plain.rates(0.0, state)[:, 0]
    return result


def angular_momentum(model: Disk, state: Array) -> Array:
    """``J = I Omega - W Y`` of states [Omega, Y, Z, ...], shape (..., 4), per unit mass [m^2/s]."""
    omega, y, z = state[..., 0], state[..., 1], state[..., 2]
    result: Array = (model.R**2 / 2 + y**2 + z**2) * omega - model.W * y
    return result
