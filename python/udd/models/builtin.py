"""The models of the paper and its pendulum: their laws are compiled into the core."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

from udd._util.validation import number
from udd.effects import Effect
from udd.errors import ModelError

from .base import Model


def beyond_the_edge(model: Model) -> Model:
    """The equations alone: a disk that does not leave the wheels, another model as it is."""
    return model.replace(edge="ignore") if isinstance(model, Disk) else model


class _BuiltIn(Model):
    """A model whose law is compiled into the core."""

    def __new__(cls, *_arguments: Any, **_options: Any) -> Self:
        """Leave everything to the initialisation, which a copy or a pickle does not need."""
        return object.__new__(cls)


@dataclass(frozen=True)
class DLE(_BuiltIn):
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

    Notes
    -----
    With ``L = 2 k0^2/(g R^2)`` and ``tau = R^2/(2 k0)`` the disk has ``w = tau W/L``. Time averages on every
    bounded orbit are exact: ``<omega y> = <omega^2> = w`` and ``<z> = 0`` for ``B = 0``.

    Examples
    --------
    >>> import udd
    >>> udd.DLE(1.0).rates(0.0, [1.0, 1.0, 0.0])
    array([0., 0., 0.])
    """

    kind: ClassVar[str] = "dle"
    slow: ClassVar[float] = 1.0
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
        """The dimensionless equations take no effects; use :class:`Disk`."""
        if tuple(effects):
            raise ModelError("the dimensionless equations take no effects; use udd.Disk")
        return self


@dataclass(frozen=True)
class Disk(_BuiltIn):
    """The upward-driven disk, per unit mass, for the state ``[Omega, Y, Z, beta]`` in rad/s, m, m, rad.

    ::

        dY/dT = Z Omega        dZ/dT = -Y Omega + W        dbeta/dT = Omega
        (R^2/2 + Y^2 + Z^2) dOmega/dT = g Y - k Omega - Z W Omega,   k = max(k1 - k2 |Omega|, k0)

    (Y, Z) is the centre of the disk relative to the contact with the wheels, Y to the right, Z up; angles are
    clockwise positive. Effects add to the torque, to k, and to the contact's velocity (0, W).

    Parameters
    ----------
    W : float
        Drive speed [m/s], not negative.
    R : float
        Radius of the disk [m].
    g : float
        Gravity [m/s^2].
    k0, k1, k2 : float
        Friction: floor at high speed [m^2/s], value at rest [m^2/s], fall with the speed [m^2].
    effects : iterable of Effect
        See :mod:`udd.effects`.
    edge : {"stop", "ignore"}
        What happens where the contact reaches the edge, ``Y^2 + Z^2 = R^2``: the run ends with the outcome
        "ejected", or the equations are followed beyond their domain.

    Raises
    ------
    ModelError
        A parameter that is not finite or has the wrong sign, an effect given twice.

    References
    ----------
    The equations are the paper's full model (paper/upward_driven_disk.tex), with its constants as defaults.

    Examples
    --------
    >>> import udd
    >>> udd.Disk(0.039).rates(0.0, [0.0, 0.01, 0.0, 0.0])
    array([29.72727273,  0.        ,  0.039     ,  0.        ])
    """

    kind: ClassVar[str] = "disk"
    state_names: ClassVar[tuple[str, ...]] = ("Omega", "Y", "Z", "beta")
    state_units: ClassVar[tuple[str, ...]] = ("rad/s", "m", "m", "rad")
    angles: ClassVar[tuple[str, ...]] = ("beta",)
    _plain: ClassVar[tuple[str, ...]] = ("W", "R", "g", "k0", "k1", "k2")
    _options: ClassVar[tuple[str, ...]] = ("effects", "edge")

    W: float
    R: float = field(default=0.08, kw_only=True)
    g: float = field(default=9.81, kw_only=True)
    k0: float = field(default=0.012, kw_only=True)
    k1: float = field(default=0.103, kw_only=True)
    k2: float = field(default=0.055, kw_only=True)
    effects: tuple[Effect, ...] = field(default=(), kw_only=True)
    edge: str = field(default="stop", kw_only=True)

    @classmethod
    def from_wheel(cls, rate: float, wheel: float = 0.03, **options: Any) -> Self:
        """The disk driven by a wheel of this radius that turns at this rate: ``W = rate wheel``.

        Parameters
        ----------
        rate : float
            Angular velocity of the drive wheel [rad/s], not negative; the paper's motor runs at 0.3 to 3.
        wheel : float
            Its radius [m], positive; the paper's has 3 cm.
        **options
            Of the constructor: ``R``, ``g``, ``k0``, ``k1``, ``k2``, ``effects``, ``edge``.

        Raises
        ------
        ModelError
            A number that is not finite or has the wrong sign.

        Examples
        --------
        >>> import udd
        >>> udd.Disk.from_wheel(1.3).W
        0.039
        """
        return cls(number("rate", rate, least=0.0) * number("wheel", wheel, above=0.0), **options)

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", number("R", self.R, above=0.0))
        for name in ("W", "g", "k0", "k1", "k2"):
            object.__setattr__(self, name, number(name, getattr(self, name), least=0.0))
        object.__setattr__(self, "effects", self._effects(self.effects))
        self._add_bristles()
        if self.edge not in ("stop", "ignore"):
            raise ModelError(f'edge must be "stop" or "ignore", not {self.edge!r}')


@dataclass(frozen=True, init=False)
class Pendulum(_BuiltIn):
    """A pendulum, per unit mass, for the state ``[Omega, theta]`` in rad/s, rad, with ``theta = 0`` hanging.

    ::

        inertia dOmega/dT = -g length sin(theta) - k0 Omega        dtheta/dT = Omega

    Parameters
    ----------
    length : float
        Distance from the pivot to the centre of mass [m].
    inertia : float, optional
        Moment of inertia about the pivot per unit mass [m^2]; by default `length` squared, a point mass.
    g : float
        Gravity [m/s^2].
    k0 : float
        Viscous friction [m^2/s].
    effects : iterable of Effect
        Those that enter through torque or friction; see :mod:`udd.effects`.

    Raises
    ------
    ModelError
        A parameter that is not finite or has the wrong sign, an effect that moves the pivot.

    Examples
    --------
    >>> import udd
    >>> udd.Pendulum(0.5).inertia
    0.25
    """

    kind: ClassVar[str] = "pendulum"
    state_names: ClassVar[tuple[str, ...]] = ("Omega", "theta")
    state_units: ClassVar[tuple[str, ...]] = ("rad/s", "rad")
    angles: ClassVar[tuple[str, ...]] = ("theta",)
    _plain: ClassVar[tuple[str, ...]] = ("length", "inertia", "g", "k0")

    length: float
    inertia: float
    g: float
    k0: float
    effects: tuple[Effect, ...]

    def __init__(
        self,
        length: float,
        *,
        inertia: float | None = None,
        g: float = 9.81,
        k0: float = 0.0,
        effects: Iterable[Effect] = (),
    ) -> None:
        size = number("length", length, above=0.0)
        object.__setattr__(self, "length", size)
        default = size * size
        object.__setattr__(
            self, "inertia", default if inertia is None else number("inertia", inertia, above=0.0)
        )
        object.__setattr__(self, "g", number("g", g, least=0.0))
        object.__setattr__(self, "k0", number("k0", k0, least=0.0))
        object.__setattr__(self, "effects", self._effects(effects))
        self._add_bristles()
