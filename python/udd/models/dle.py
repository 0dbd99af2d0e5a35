"""The diffusionless Lorenz equations: the model and its profile."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from udd._util.validation import number
from udd.effects import Effect
from udd.errors import ModelError

from .compiled import CompiledModel
from .profile import DynamicsProfile, Floats, ModelProfile, Parameters, Powers, ShownProfile


@dataclass(frozen=True)
class DLE(CompiledModel):
    """The diffusionless Lorenz equations, dimensionless, for the state ``[omega, y, z]``.

    ::

        omega' = y - omega
        y'     = omega z
        z'     = -omega y + w - B w z

    Parameters
    ----------
    w : float
        The drive, not negative.
    B : float
        The damping of the rolling constraint (the paper's B; 0.2 there), not negative.

    Raises
    ------
    ModelError
        A parameter that is negative or not finite.

    See Also
    --------
    udd.Disk : the disk with its dimensions.
    udd.related_systems.scaled_lorenz : the Lorenz system in these variables.
    udd.plot.phase_space : draw an orbit.

    Notes
    -----
    With ``L = 2 k0^2/(g R^2)`` and ``tau = R^2/(2 k0)`` the disk has ``w = tau W/L``. Time averages on every
    bounded orbit are exact: ``<omega y> = <omega^2> = w`` and ``<z> = 0`` for ``B = 0``.

    References
    ----------
    L. Maas, "The upward-driven disk, a steadily forced chaotic pendulum" [1].

    Examples
    --------
    >>> import udd
    >>> udd.DLE(1.0).rates(0.0, [1.0, 1.0, 0.0])
    array([0., 0., 0.])
    """

    kind: ClassVar[str] = "dle"
    state_names: ClassVar[tuple[str, ...]] = ("omega", "y", "z")
    state_units: ClassVar[tuple[str, ...]] = ("", "", "")
    _plain: ClassVar[tuple[str, ...]] = ("w", "B")
    _options: ClassVar[tuple[str, ...]] = ()

    w: float
    B: float = 0.0
    effects: tuple[Effect, ...] = field(default=(), init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "w", number("w", self.w, least=0.0))
        object.__setattr__(self, "B", number("B", self.B, least=0.0))

    def with_effects(self, effects: Iterable[Effect]) -> Self:
        """Refuse effects: the dimensionless equations have none.

        Parameters
        ----------
        effects : iterable of Effect
            Must be empty.

        Returns
        -------
        DLE
            The model itself.

        Raises
        ------
        ModelError
            There are effects; use :class:`Disk`.
        """
        if tuple(effects):
            raise ModelError("the dimensionless equations take no effects; use udd.Disk")
        return self


def _crossing_rate(p: Parameters) -> Floats:
    rate: Floats = np.sqrt(p["w"]) / 10.0  # the symmetric orbit at strong drive takes 10.6 / sqrt(w)
    return rate


def _sizes(p: Parameters) -> tuple[dict[str, float], float]:
    # Rotation at sqrt(w); half the figure-eight takes 5.3 / sqrt(w).
    size = math.sqrt(p["w"]) or 1.0
    return dict.fromkeys(DLE.state_names, size), 4.0 / size


def _energy(model: DLE, state: Floats, rates: Floats) -> Powers:
    """``omega^2/2 + z`` changes by ``w - omega^2``."""
    omega = state[:, 0]
    return Powers(omega**2 / 2 + state[:, 2], model.w, omega * rates[:, 0] + rates[:, 2], omega**2)


def _averages(model: DLE, exponents: Floats, mean: Floats, product: Floats) -> dict[str, float]:
    w, B = model.w, model.B
    z, zz = mean[2], product[2, 2]
    return {
        "sum of exponents + 1 + B w": float(exponents.sum() + 1.0 + B * w),
        "<omega y> - w (1 - B <z>)": float(product[0, 1] - w * (1.0 - B * z)),
        "<omega^2> - <omega y>": float(product[0, 0] - product[0, 1]),
        "<omega z>": float(product[0, 2]),
        "<z> - B <z^2>": float(z - B * zz),
    }


DLE.profile = ModelProfile(
    dynamics=DynamicsProfile(
        time_scale=1.0,
        time_unit="",
        drive="w",
        start=(1.0, 1.0, 0.01),
        section="z",
        crossing_rate=_crossing_rate,
        sizes=_sizes,
        rotation="omega",
        energy=_energy,
        averages=_averages,
    ),
    shown=ShownProfile(
        noun="dle",
        columns=("y", "z"),
        path=("y", "z"),
        space=("omega", "y", "z"),
        run_start=(1.0, 1.0, 0.01),
    ),
)
