"""A pendulum with a fixed pivot: the model and its profile."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.validation import number
from udd.effects import Effect
from udd.errors import ModelError

from .compiled import CompiledModel, plain_friction
from .formula_model import FormulaModel
from .profile import (
    Coordinate,
    CurveSlot,
    DiscoveryProfile,
    DynamicsProfile,
    FitProfile,
    Floats,
    FurtherFilm,
    ModelProfile,
    OtherUnit,
    Parameters,
    Powers,
    SensorProfile,
    ShownProfile,
)


@dataclass(frozen=True, init=False)
class Pendulum(CompiledModel):
    """Pendulum, per unit mass, for the state ``[Omega, theta]`` in rad/s, rad, with ``theta = 0`` hanging.

    ::

        inertia dOmega/dT = -g length sin(theta) - k0 Omega        dtheta/dT = Omega

    Parameters
    ----------
    length : float
        Distance from the pivot to the centre of mass [m].
    inertia : float, optional
        Moment of inertia about the pivot per unit mass [m^2]. The default is `length` squared, a point mass.
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

    See Also
    --------
    udd.moved_pendulum : a pendulum with a moving pivot.
    udd.related_systems.pendulum : the damped pendulum in text form.
    udd.plot.orbit : draw its motion.

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

    @checked_arguments
    def with_gyroscope(self, *, angle: bool = False) -> FormulaModel:
        """Return the pendulum as a model whose angular rate is measured, for example by a phone on it.

        ::

            Omega_seen = Omega + bias        theta_seen = theta + theta0

        Parameters
        ----------
        angle : bool
            If True, the angle is measured too.

        Returns
        -------
        Model
            With the sensors ``Omega`` [rad/s] and, with `angle`, ``theta`` [rad]; ``length, k0, bias`` and
            ``theta0`` are its parameters. Gravity is a number in its equation, because a fit cannot
            distinguish it from the length. So is an inertia that was given. Without one the pendulum is a
            point mass, whose inertia is its fitted length squared.

        Raises
        ------
        ModelError
            The pendulum has effects: add what is missing to the new model instead.

        Examples
        --------
        >>> import numpy as np
        >>> import udd
        >>> t = np.arange(0, 20, 0.02)
        >>> rate = udd.simulate(udd.Pendulum(0.5, k0=0.01), t, [0.0, 0.6]).Omega
        >>> noise = 0.01 * np.random.default_rng(1).normal(size=len(t))
        >>> seen = udd.Measurement(t, {"Omega": rate + 0.03 + noise})
        >>> fit = udd.fit(seen, udd.Pendulum(0.52).with_gyroscope())
        >>> bool(abs(fit.parameters["bias"] - 0.03) < 4 * fit.errors["bias"])
        True
        >>> round(fit.parameters["length"], 3)
        0.5
        """
        if self.effects:
            names = ", ".join(effect.name for effect in self.effects)
            raise ModelError(f"a pendulum with a gyroscope is a model of your own, which cannot have {names}")
        point_mass = self.inertia == self.length**2
        inertia = "length^2" if point_mass else repr(self.inertia)
        rate = f"(-{self.g!r}*length*sin(theta) - k0*Omega)/{inertia}"
        zero = {"theta0": 0.0} if angle else {}
        return FormulaModel(
            ["Omega", "theta"],
            {"Omega": rate, "theta": "Omega"},
            {"length": self.length, "k0": self.k0, "bias": 0.0} | zero,
            angles=["theta"],
            observe={"Omega": "Omega + bias"} | ({"theta": "theta + theta0"} if angle else {}),
        )


def _crossing_rate(p: Parameters) -> Floats:
    rate: Floats = np.sqrt(p["g"] * p["length"] / p["inertia"]) / (2.0 * np.pi)
    return rate


def _sizes(p: Parameters) -> tuple[dict[str, float], float]:
    swing = math.sqrt(p["g"] * p["length"] / p["inertia"]) or 1.0
    return {"Omega": swing, "theta": 1.0}, 6.0 / swing


def _inertia(model: Pendulum, _state: Floats) -> float:
    return model.inertia


def _energy(model: Pendulum, state: Floats, rates: Floats) -> Powers:
    omega, theta = state[:, :2].T
    weight = model.g * model.length
    return Powers(
        stored=model.inertia * omega**2 / 2 - weight * np.cos(theta),
        motor=0.0,
        change=model.inertia * omega * rates[:, 0] + weight * np.sin(theta) * rates[:, 1],
        friction=plain_friction(model, model.inertia, omega),
    )


# --- units

#: Decades by which a stated length may be off: cm, mm and their inverses.
_DECADES = (-3, -2, -1, 1, 2, 3)
_DEGREE = np.pi / 180
_BENDS = 3.0  # times what gravity can bend a pendulum's motion
_PULLED = 0.7  # correlation of bends and gravity's pull from which on the angle is in rad


def _mistaken_unit(model: Pendulum, step: float, values: Floats) -> str | None:
    theta = values[:, 0]
    pace = np.sqrt(model.inertia / (model.g * model.length))
    period = 2 * np.pi * pace
    if step > period / 2:
        return (
            f"the times step by {step:.3g}, but the pendulum swings once in {period:.3g} s: are they in ms, "
            "or the length in another unit than m?"
        )
    if np.ptp(theta) <= 2 * np.pi:  # within one turn it may never have been unwrapped
        return None
    lag = max(round(period / 8 / step), 1)
    bend = np.abs(_second_difference(theta, lag))
    if (
        len(bend)
        and float(np.quantile(bend, 0.9)) > _BENDS * max((lag * step / pace) ** 2, 0.3)
        and not _pulled_as_in_radians(theta, lag)
    ):
        counts = (
            ", or counts of an encoder (multiply by 2 pi over the counts per turn)"
            if (theta == np.round(theta)).all()
            else ""
        )
        return (
            f"the angle has a range of {np.ptp(theta):.3g}, with steps of up to "
            f"{float(np.abs(np.diff(theta)).max()):.3g} between frames, which gravity cannot do if it is in "
            f"rad: is it in degrees{counts}?"
        )
    return None


def _second_difference(x: Floats, lag: int) -> Floats:
    result: Floats = x[2 * lag :] - 2 * x[lag:-lag] + x[: -2 * lag]
    return result


def _pulled_as_in_radians(theta: Floats, longest: int) -> bool:
    """Return True if an angle bends as gravity bends one in rad, whatever the length: as -sin(theta)."""
    lag = longest
    while lag >= 1 and len(theta) > 2 * lag + 2:
        bend, pull = _second_difference(theta, lag), np.sin(theta[lag:-lag])
        power = float(bend @ bend) * float(pull @ pull)
        if power and float(bend @ pull) < -_PULLED * np.sqrt(power):
            return True
        lag //= 2
    return False


def _other_units(model: Pendulum) -> Iterator[OtherUnit]:
    yield OtherUnit(
        "the motion is that of a pendulum whose angle is in degrees, not in rad",
        factors={"theta": _DEGREE, "Omega": _DEGREE},
    )
    yield OtherUnit(
        "y points down, or the angle is counted from the upright: y must point up, the angle from the lowest "
        "point",
        shifts={"theta": np.pi},
    )
    for k in _DECADES:
        length = model.length * 10.0**k
        text = (
            f"the motion is that of a pendulum of {length:.3g} m, where {model.length:g} m was stated: "
            "check the length and its unit"
        )
        yield OtherUnit(text, {"length": length, "inertia": model.inertia * 10.0 ** (2 * k)})


def _pace(p: Parameters) -> float:
    """Compute length over inertia, which with gravity sets the period."""
    return float(p["length"] / p["inertia"])


# --- what a curve can be a function of

#: F/g - 1, where F is the rod's force on the pivot: the bob's weight and its centrifugal force.
_LOAD = "(cos(theta) + length*Omega^2/g - 1)"


def _load(model: Pendulum, _t: Floats, x: Floats) -> Floats:
    result: Floats = np.cos(x[..., 1]) + model.length * x[..., 0] ** 2 / model.g - 1.0
    return result


def _loading(model: Pendulum, x: Floats, v: Floats) -> Floats:
    result: Floats = 2 * model.length * x[..., 0] * v[..., 0] / model.g - np.sin(x[..., 1]) * v[..., 1]
    return result


def _coordinates(model: Pendulum) -> tuple[Coordinate, ...]:
    load = Coordinate("load", partial(_load, model), partial(_loading, model), False, _LOAD)
    return (load,) if model.g else ()


# --- what to film next

_SWINGS = (0.5, 1.5, 2.0)  # times the present start
_UPRIGHT = 2.8  # rad; a pendulum is not started farther out


def _films(_model: Pendulum, places: Floats) -> Iterator[FurtherFilm]:
    for times in _SWINGS:
        start = places[:1] * times
        if abs(start[0, 1]) < _UPRIGHT:
            yield FurtherFilm(f"the pendulum again, from {start[0, 1]:.2g} rad", {}, start)


def _measured(_model: Pendulum, stated: Pendulum) -> str:
    return f"The angle of a pendulum of {100 * stated.length:.4g}\u00a0cm"


Pendulum.profile = ModelProfile(
    dynamics=DynamicsProfile(
        start=(0.0, 1.0),
        section="theta",
        crossing_rate=_crossing_rate,
        sizes=_sizes,
        inertia=_inertia,
        energy=_energy,
    ),
    sensor=SensorProfile(
        columns=("theta",),
        units=("rad",),
        sigma=(5e-3,),
        compared=1,
        # A pivot known to 1 % of the length.
        camera={"theta0": 0.1, "aside": 0.01, "above": 0.01},
        pivot=("theta0",),
        zero="theta0",
        # Frames may scatter less than what is typical, but perspective bends the angle by as much.
        faithful=0.5,
    ),
    fit=FitProfile(
        # rad/s, rad
        model_error=((0.1, 1e-3), (0.01, 3e-4), (1e-3, 3e-5), (1e-4, 3e-6), (1e-5, 3e-7)),
        equations={"Omega": "rad/s^2"},
        priors={"k0": np.inf, "length": 0.05, "inertia": 0.1},
        fixed={"g": 0.01},  # gravity at a place that is not said, m/s^2
        stated=("length",),
        unknown=("k0", "length", "inertia"),
        hardly=1,
        mistaken_unit=_mistaken_unit,
        other_units=_other_units,
        pace=_pace,
        ahead=60.0,
        window=4.0,
        valid_error=0.05,  # rad
    ),
    discovery=DiscoveryProfile(
        horizons=(0.5, 1.0, 4.0, 10.0, 20.0),
        filter_window=4.0,
        filter_level=3,
        brakes=("k0",),
        slots=(CurveSlot("torque", None, "Omega"), CurveSlot("friction", None, "Omega")),
        coordinates=_coordinates,
        films=_films,
    ),
    shown=ShownProfile(
        noun="pendulum",
        columns=("theta",),
        path=("theta", "Omega"),
        movie=12.0,
        forecast=12.0,
        forecast_end=True,
        run_start=(0.0, 0.5),
        meanings={
            "length": "length of the pendulum; the period determines length/inertia alone",
            "inertia": "moment of inertia per unit mass",
            "g": "gravity",
            "k0": "viscous friction",
        },
        measured=_measured,
        taken_as_known=(
            "Gravity was taken as known; only the ratio of the length to the inertia sets the period."
        ),
        options={"length": "pendulum"},
    ),
)
