"""The energy balance of a run: what the motor puts in, what friction takes out, what is stored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.one_line import OneLine
from udd.errors import ModelError
from udd.models import Disk

from .trajectory import Trajectory

__all__ = ["EnergyBalance", "energy_balance"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class EnergyBalance(Drawable, OneLine):
    """Powers per unit mass over a run; ``stored' = motor - friction + effects`` holds exactly.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Times of the states of the run.
    stored : ndarray, shape (n,)
        Kinetic and potential energy [m^2/s^2].
    motor, friction, effects : ndarray, shape (n,)
        Powers [m^2/s^3]. `motor` and `effects` increase the energy, and the friction of the plain model
        decreases it. Those of the DLE are dimensionless, and its damping counts as an effect.
    """

    t: Array
    stored: Array
    motor: Array
    friction: Array
    effects: Array

    def work(self, name: str) -> Array:
        """Integrate a power from the start of the run, by the trapezoidal rule.

        Parameters
        ----------
        name : {"motor", "friction", "effects"}
            The power.

        Returns
        -------
        ndarray, shape (n,)
            Work [m^2/s^2] up to each time.
        """
        power: Array = getattr(self, name)
        return np.append(0.0, np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(self.t)))


@checked_arguments
def energy_balance(run: Trajectory) -> EnergyBalance:
    """Compute the work of motor and friction, and the stored energy, along a run.

    Parameters
    ----------
    run : Trajectory
        Run of a disk, a pendulum or the DLE.

    Returns
    -------
    EnergyBalance
        Fields ``t``, ``stored``, ``motor``, ``friction`` and ``effects``, each of shape (n,).

    Raises
    ------
    ModelError
        The model is a user's own, of which no energy is known.

    See Also
    --------
    udd.simulate : makes the run.
    udd.plot.energy : draw the balance.

    Notes
    -----
    With ``I = R^2/2 + Y^2 + Z^2`` the disk's energy ``I Omega^2/2 + g Z`` changes by ``g W - k Omega^2``,
    plus the power of the effects. Without effects the time averages of motor and friction power are therefore
    equal on every bounded orbit. Likewise ``omega^2/2 + z`` of the DLE changes by ``w - omega^2``. All powers
    are computed from the rates of the model.

    References
    ----------
    L. Maas [1].

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
    energy = model.profile.dynamics.energy
    if energy is None:
        raise ModelError("no energy is known of a model of your own")
    stored, motor, change, friction = energy(model, state, rates)
    effects = change - motor + friction
    if not model.effects and getattr(model, "B", 0.0) == 0.0:
        effects = np.zeros(len(t))  # but for rounding it is so
    return EnergyBalance(t, stored, np.full(len(t), motor), friction, effects)


def angular_momentum(model: Disk, state: Array) -> Array:
    """``J = I Omega - W Y`` of states [Omega, Y, Z, ...], shape (..., 4), per unit mass [m^2/s]."""
    omega, y, z = state[..., 0], state[..., 1], state[..., 2]
    result: Array = (model.R**2 / 2 + y**2 + z**2) * omega - model.W * y
    return result
