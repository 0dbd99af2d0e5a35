"""Models that only the page makes: a disk with a measured drive, a driven and a double pendulum."""

from __future__ import annotations

from typing import Any

from udd.measurement import Measurement
from udd.models import Disk, Model, Pendulum, mechanism
from udd.models.driven import driven_disk
from udd.models.formula_model import FormulaModel

DOUBLE = ("th1", "th2")  # angles of a double pendulum
#: The input's name in a disk's record, and in that of a pendulum.
DRIVE, TORQUE = "W", "u"

#: Meaning and unit of the constants of models with a gyroscope or an input.
CONSTANTS = {
    "length": ("length of a point mass with this period", "m"),
    "k0": ("viscous friction", "m²/s"),
    "k1": ("friction coefficient at rest", "m²/s"),
    "k2": ("how fast friction falls with the speed of rotation", "m²"),
    "R": ("radius of the disk", "m"),
    "g": ("gravity", "m/s²"),
    "bias": ("zero of the gyroscope", "rad/s"),
    "theta0": ("zero of the angle", "rad"),
    "l1": ("length of the upper pendulum", "m"),
    "l2": ("length of the lower pendulum", "m"),
    "m": ("mass of the lower bob by that of the upper one", ""),
    "b1": ("friction of the upper joint, per mass of the upper bob", "m²/s"),
    "b2": ("friction of the lower joint, per mass of the upper bob", "m²/s"),
    "tilt": ("tilt of the camera", "rad"),
    "gain": ("angular acceleration per unit of the input", ""),
}


def driven_model(measurement: Measurement, length: float | None, R: float) -> Model:
    """Return the model of a record with an input.

    Parameters
    ----------
    measurement : Measurement
        With the inputs ``W`` and ``W_rate``, or ``u``.
    length : float or None
        Length of the pendulum [m].
    R : float
        Radius of the disk [m].
    """
    if DRIVE in measurement.inputs:
        usual = Disk(0.0)
        return driven_disk(R, k0=usual.k0, k1=usual.k1, k2=usual.k2, g=usual.g)
    assert length is not None  # the caller has asked for it
    pendulum = Pendulum(length)
    # A gain converts the input from its own unit, so a voltage or a current serves as well.
    # A point mass: its length follows from the period, whatever length was given to begin with.
    rate = f"(-{pendulum.g!r}*length*sin(theta) - k0*Omega)/length^2 + gain*{TORQUE}"
    zero, seen = ("theta0", "theta") if measurement.names == ("theta",) else ("bias", "Omega")
    return FormulaModel(
        ["Omega", "theta"],
        {"Omega": rate, "theta": "Omega"},
        {"length": length, "k0": pendulum.k0, "gain": 0.0, zero: 0.0},
        angles=["theta"],
        inputs=[TORQUE],
        observe={seen: f"{seen} + {zero}"},
    )


def double_pendulum(measurement: Measurement) -> Model:
    """Return the model of two bobs on light rods; the first lengths are those of the film.

    Parameters
    ----------
    measurement : Measurement
        ``th1, th2``, and in ``meta`` the upper length [m] and both lengths [pixels].
    """
    meta = measurement.meta
    upper: Any = meta["length"]
    ratio: Any = meta["lower_length_px"] / meta["length_px"]
    coupling = "m*l1*l2*cos(th1 - th2)"
    joint = "b2*(w2 - w1)"
    return mechanism(
        {"th1": "w1", "th2": "w2"},
        [["(1 + m)*l1^2", coupling], [coupling, "m*l2^2"]],
        [
            f"-(1 + m)*9.81*l1*sin(th1) - m*l1*l2*sin(th1 - th2)*w2^2 - b1*w1 + {joint}",
            f"-m*9.81*l2*sin(th2) + m*l1*l2*sin(th1 - th2)*w1^2 - {joint}",
        ],
        {"l1": upper, "l2": ratio * upper, "m": 1.0, "b1": 0.0, "b2": 0.0, "tilt": 0.0},
        angles=DOUBLE,
        observe={name: f"{name} + tilt" for name in DOUBLE},
    )
