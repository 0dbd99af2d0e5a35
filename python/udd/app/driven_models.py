"""The models for tables with an input: a disk with a measured drive, a pendulum with a measured torque."""

from __future__ import annotations

from udd.measurement import Measurement
from udd.models import Disk, Model, Pendulum
from udd.models.driven import driven_disk
from udd.models.formula_model import FormulaModel

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
