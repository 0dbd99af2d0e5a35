"""The upward-driven disk: the model and its profile."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from udd._util.validation import number
from udd.effects import Effect
from udd.errors import ModelError

from .compiled import CompiledModel, plain_friction
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


@dataclass(frozen=True)
class Disk(CompiledModel):
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
        Friction: floor at high speed [m^2/s], value at rest [m^2/s], decrease with the speed [m^2].
    effects : iterable of Effect
        Effects that the equations contain in addition. See :mod:`udd.effects`.
    edge : {"stop", "ignore"}
        Behaviour at the edge, ``Y^2 + Z^2 = R^2``. The run ends with the outcome "ejected", or the equations
        are followed beyond their domain.

    Raises
    ------
    ModelError
        A parameter that is not finite or has the wrong sign, an effect given twice.

    See Also
    --------
    udd.DLE : the dimensionless equations.
    udd.driven_disk : a disk with a measured drive.
    udd.effects.library : the effects that a disk may have.
    udd.plot.geometry : draw the device and its coordinates.

    References
    ----------
    L. Maas, "The upward-driven disk, a steadily forced chaotic pendulum" [1]: the full model, with its
    constants as defaults.

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
        """Make a disk driven by a wheel of this radius and angular velocity: ``W = rate wheel``.

        Parameters
        ----------
        rate : float
            Angular velocity of the drive wheel [rad/s], not negative; the paper's motor runs at 0.3 to 3.
        wheel : float
            Its radius [m], positive; the paper's has 3 cm.
        **options
            Of the constructor: ``R``, ``g``, ``k0``, ``k1``, ``k2``, ``effects``, ``edge``.

        Returns
        -------
        Disk
            With the drive ``W = rate wheel`` [m/s].

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
        if not isinstance(self.edge, str) or self.edge not in ("stop", "ignore"):
            raise ModelError(f'edge must be "stop" or "ignore", not {self.edge!r}')


def _crossing_rate(p: Parameters) -> Floats:
    # The rate of the DLE, with w = tau W/L.
    rate: Floats = np.sqrt(p["g"] * p["W"] / (4.0 * p["k0"])) / 10.0
    return rate


def _sizes(p: Parameters) -> tuple[dict[str, float], float]:
    swing = math.sqrt(p["g"] / p["R"]) or 1.0
    return {"Omega": swing, "Y": p["R"], "Z": p["R"], "beta": 1.0}, 10.0 / swing


def _inertia(model: Disk, state: Floats) -> Floats:
    inertia: Floats = model.R**2 / 2 + state[..., 1] ** 2 + state[..., 2] ** 2
    return inertia


def _energy(model: Disk, state: Floats, rates: Floats) -> Powers:
    """``I Omega^2/2 + g Z`` changes by ``g W - k Omega^2``, plus what the effects put in."""
    omega, y, z = state[:, :3].T
    inertia = _inertia(model, state)
    turning = inertia * omega * rates[:, 0] + (y * rates[:, 1] + z * rates[:, 2]) * omega**2
    return Powers(
        stored=inertia * omega**2 / 2 + model.g * z,
        motor=model.g * model.W,
        change=turning + model.g * rates[:, 2],
        friction=plain_friction(model, model.R**2 / 2, omega),
    )


def _averages(model: Disk, _exponents: Floats, _mean: Floats, product: Floats) -> dict[str, float]:
    if model.effects:
        return {}
    return {"<Y Omega> - W": float(product[1, 0] - model.W), "<Z Omega>": float(product[2, 0])}


def _on_the_wheels(p: Parameters, states: Floats) -> NDArray[np.bool_]:
    on: NDArray[np.bool_] = np.hypot(states[..., 1], states[..., 2]) < p["R"]
    return on


# --- units

#: Decades by which a stated speed or length may be off: cm, mm and their inverses.
_DECADES = (-3, -2, -1, 1, 2, 3)
_DEGREE = np.pi / 180
_BEYOND = 5.0  # Radii: a disk is closer to its contact unless its place is in cm.
_SLOWEST = 0.5  # Seconds between frames. A disk changes its motion in a quarter of that.
_NEAR = 0.25  # Largest relative error of a ratio.
_SURE = 0.7  # Correlation above which a slope counts.


def _mistaken_unit(model: Disk, step: float, values: Floats) -> str | None:
    y, z, beta = values.T
    if step > _SLOWEST:
        return f"the times step by {step:.3g}, too far apart for a disk if they are in s: are they in ms?"
    away = float(np.median(np.hypot(y, z)))
    if away > _BEYOND * model.R:
        return (
            f"the disk's centre is typically {away:.3g} from the contact, but its radius is {model.R:g} m: "
            f"are Y and Z in {'mm' if away > 100 * model.R else 'cm'}?"
        )
    # A disk that rolls goes dY = Z dbeta, whatever drives and brakes it.
    along, turned = np.diff(y), 0.5 * (z[1:] + z[:-1]) * np.diff(beta)
    power = float(turned @ turned)
    if not power or not along.any():
        return None
    slope = float(along @ turned) / power
    sure = slope * np.sqrt(power / float(along @ along)) > _SURE
    if sure and abs(slope / _DEGREE - 1) < _NEAR:
        return (
            f"the disk rolls {1 / slope:.3g} times less far than beta turns if that is in rad: is beta in "
            "degrees?"
        )
    return None


def _other_units(model: Disk) -> Iterator[OtherUnit]:
    """Yield other units of the drive; wrong units of places or of the angle show at once."""
    for k in _DECADES if model.W else ():
        drive = model.W * 10.0**k
        text = (
            f"the motion is that of a drive of {drive:.3g} m/s, where {model.W:g} m/s was stated: check "
            "the drive and its unit"
        )
        yield OtherUnit(text, {"W": drive})


def _drive_seen(t: Floats, values: Floats, seen: NDArray[np.bool_]) -> float:
    """Compute the mean of dZ/dT + Y dbeta/dT, m/s: it needs no fit, and effects hardly change it."""
    consecutive = seen[1:] & seen[:-1]
    if not consecutive.any():
        return float("nan")
    y, z, beta = values.T
    lifted = np.diff(z) + 0.5 * (y[1:] + y[:-1]) * np.diff(beta)
    return float(lifted[consecutive].sum() / np.diff(t)[consecutive].sum())


# --- what curves depend on


def _distance(_t: Floats, x: Floats) -> Floats:
    result: Floats = np.hypot(x[..., 1], x[..., 2])
    return result


def _radial(x: Floats, v: Floats) -> Floats:
    result: Floats = (x[..., 1] * v[..., 1] + x[..., 2] * v[..., 2]) / np.hypot(x[..., 1], x[..., 2])
    return result


def _azimuth(_t: Floats, x: Floats) -> Floats:
    result: Floats = np.arctan2(x[..., 1], x[..., 2])
    return result


def _azimuthal(x: Floats, v: Floats) -> Floats:
    squared = x[..., 1] ** 2 + x[..., 2] ** 2
    result: Floats = (x[..., 2] * v[..., 1] - x[..., 1] * v[..., 2]) / squared
    return result


#: F/g - 1, where F = g + d^2Z/dT^2 is the contact's force along the drive, by the plain model.
_LOAD = "(-(Z*Omega^2 + Y*(g*Y - k*Omega - W*Z*Omega)/inertia)/g)"


def _load(plain: Disk, _t: Floats, x: Floats) -> Floats:
    turning = plain.rates(0.0, x.reshape(-1, x.shape[-1]))[:, 0].reshape(x.shape[:-1])
    result: Floats = -(x[..., 2] * x[..., 0] ** 2 + x[..., 1] * turning) / plain.g
    return result


def _loading(plain: Disk, x: Floats, v: Floats) -> Floats:
    step = 1e-6
    ahead, behind = (_load(plain, np.zeros(x.shape[:-1]), x + sign * step * v) for sign in (1.0, -1.0))
    result: Floats = (ahead - behind) / (2.0 * step)
    return result


def _coordinates(model: Disk) -> tuple[Coordinate, ...]:
    plain = model.with_effects([])
    places = (
        Coordinate("R", _distance, _radial, False, "sqrt(Y^2 + Z^2)"),
        Coordinate("theta", _azimuth, _azimuthal, True, "atan2(Y, Z)"),
    )
    load = Coordinate("load", partial(_load, plain), partial(_loading, plain), False, _LOAD)
    return (*places, load) if model.g else places


# --- what to film next

_DRIVES = (0.5, 0.7, 1.4, 2.0)  # times the present drive


def _films(model: Disk, places: Floats) -> Iterator[FurtherFilm]:
    if model.W:
        for times in _DRIVES:
            drive = times * model.W
            design = f"the disk again with {times:g} times the drive (W = {drive:.3g} m/s)"
            yield FurtherFilm(design, {"W": drive}, places)
    yield FurtherFilm("the disk again, from another start", {}, places[1:])


def _measured(model: Disk, stated: Disk) -> str:
    return (
        f"The centre and the orientation of a disk of radius {100 * model.R:g}\u00a0cm that two wheels "
        f"lift at {100 * stated.W:.3g}\u00a0cm/s (as stated)"
    )


Disk.profile = ModelProfile(
    dynamics=DynamicsProfile(
        drive="W",
        start=(3.75, 0.0046, 5e-5, 0.0),  # the DLE's in the disk's units, for the paper's constants
        section="Z",
        crossing_rate=_crossing_rate,
        sizes=_sizes,
        inertia=_inertia,
        energy=_energy,
        averages=_averages,
        inside=_on_the_wheels,
    ),
    sensor=SensorProfile(
        columns=("Y", "Z", "beta"),
        units=("m", "m", "rad"),
        sigma=(5e-4, 5e-4, 7e-3),
        compared=2,
        # The pivot is located to a few millimetres. The picture is upright to 2 degrees and scaled to 1 %.
        # The centre of the marks is off by a millimetre, and the orientation lags the position by
        # milliseconds. The shutter may roll (a frame's time over a picture 0.4 m high). Frames are means over
        # some 20 ms (of which a 24th of the square counts). The lens distorts by 1 % at 0.2 m from the
        # middle.
        camera={
            "y0": 5e-3,
            "z0": 5e-3,
            "tilt": 0.035,
            "scale": 0.01,
            "right": 1e-3,
            "up": 1e-3,
            "lag": 0.01,
            "row": 0.05,
            "shutter": 2e-5,
            "lens": 0.0025,
        },
        clock=3e-3,  # good to 0.3 %
        pivot=("y0", "z0", "tilt"),
        faults=(2e-6, 2e-6, 4e-5),  # some thousandths of a pixel
        sees_marks=True,
    ),
    fit=FitProfile(
        model_error=(  # rad/s, m, m, rad
            (0.1, 1e-4, 1e-4, 1e-3),
            (0.02, 3e-5, 3e-5, 3e-4),
            (3e-3, 1e-5, 1e-5, 1e-4),
            (1e-3, 3e-6, 3e-6, 3e-5),
            (3e-4, 1e-6, 1e-6, 1e-5),
            (1e-4, 3e-7, 3e-7, 3e-6),
            (3e-5, 1e-7, 1e-7, 1e-6),
        ),
        searched=3,  # below some 10 um a frame a film's faults look like effects
        equations={"Omega": "rad/s^2", "Y": "m/s", "Z": "m/s"},
        priors={"k0": 1.0, "k1": 1.0, "k2": 1.0, "W": 0.05},
        fixed={"R": 1e-4, "g": 0.01},  # a caliper, m; gravity at a place that is not said, m/s^2
        stated=("W",),
        unknown=("k0", "k1", "k2"),
        mistaken_unit=_mistaken_unit,
        other_units=_other_units,
        drive_seen=_drive_seen,
        ahead=10.0,
        window=1.0,
        valid_error=5e-3,  # m
    ),
    discovery=DiscoveryProfile(
        horizons=(0.2, 0.4, 1.0, 2.0, 4.0),
        filter_window=1.0,
        filter_level=1,
        chaotic=True,
        coordinates=_coordinates,
        # The contact's velocities with and without the momentum that goes with them.
        slots=(
            CurveSlot("torque", None, "Omega"),
            CurveSlot("friction", None, "Omega"),
            CurveSlot("lateral", "constraint", "Y"),
            CurveSlot("lateral", "consistent", "Y"),
            CurveSlot("vertical", "constraint", "Z"),
            CurveSlot("vertical", "consistent", "Z"),
        ),
        films=_films,
    ),
    shown=ShownProfile(
        noun="disk",
        columns=("Y", "Z"),
        path=("Y", "Z"),
        space=("J", "Y", "Z"),
        contact=True,
        movie=6.0,
        forecast=3.0,
        run_start=(0.0, 1e-3, 0.04, 0.0),
        meanings={
            "W": "speed at which the wheels lift the disk",
            "R": "radius of the disk",
            "g": "gravity",
            "k0": "friction coefficient of fast rotation",
            "k1": "friction coefficient at rest",
            "k2": "how fast friction falls with the speed of rotation",
        },
        measured=_measured,
        taken_as_known=(
            "The radius of the disk and gravity were taken as known. The angles between camera, drive "
            "and gravity can be measured, but no angle that all three share."
        ),
    ),
)
