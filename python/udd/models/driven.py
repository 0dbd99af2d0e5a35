"""Disk and pendulum whose drive was measured: models with inputs."""

from __future__ import annotations

from udd._util.arguments import checked_arguments
from udd._util.validation import number

from .formula_model import FormulaModel

__all__ = ["driven_disk", "moved_pendulum"]


@checked_arguments
def driven_disk(
    R: float = 0.06, *, k0: float = 0.0, k1: float = 0.0, k2: float = 0.0, g: float = 9.81
) -> FormulaModel:
    """Make a disk with a measured drive W(t): inputs ``W`` [m/s] and ``W_rate`` [m/s^2].

    ::

        (R^2/2 + Y^2 + Z^2) dOmega/dT = (g + dW/dT) Y - k Omega - Z W Omega,   k = max(k1 - k2 |Omega|, k0)
        dY/dT = Z Omega    dZ/dT = W - Y Omega    dbeta/dT = Omega

    A changing drive accelerates the disk, which adds to gravity. ``W_rate`` is
    ``W.rate()`` of the measured :class:`udd.InputSignal`.

    Parameters
    ----------
    R : float
        Radius [m].
    k0, k1, k2 : float
        Friction as of :class:`udd.Disk` [m^2/s; k2 in m^2].
    g : float
        Gravity [m/s^2].

    Returns
    -------
    Model
        For the state ``Omega, Y, Z, beta``.

    Raises
    ------
    ModelError
        A number that is not finite, a radius that is not positive.

    See Also
    --------
    udd.Disk : the disk with a constant drive.
    udd.InputSignal : a measured signal.
    udd.plot.input_signal : draw the signal.

    References
    ----------
    The disk: L. Maas [1].

    Examples
    --------
    >>> import udd
    >>> drive = udd.InputSignal([0.0, 1.0, 2.0], [0.03, 0.05, 0.05])
    >>> disk = udd.driven_disk(k0=0.01).with_inputs({"W": drive, "W_rate": drive.rate()})
    >>> [round(float(rate), 6) for rate in disk.rates(0.5, [0.0, 0.01, 0.0, 0.0])]
    [51.736842, 0.0, 0.04, 0.0]
    """
    return FormulaModel(
        ["Omega", "Y", "Z", "beta"],
        {
            "Omega": "((g + W_rate)*Y - max(k1 - k2*abs(Omega), k0)*Omega - Z*W*Omega)/(R^2/2 + Y^2 + Z^2)",
            "Y": "Z*Omega",
            "Z": "W - Y*Omega",
            "beta": "Omega",
        },
        {"R": number("R", R, above=0.0), "g": g, "k0": k0, "k1": k1, "k2": k2},
        angles=["beta"],
        inputs=["W", "W_rate"],
    )


@checked_arguments
def moved_pendulum(
    length: float, *, inertia: float | None = None, k0: float = 0.0, g: float = 9.81
) -> FormulaModel:
    """Make a pendulum with a moving pivot: inputs ``ax, az`` [m/s^2], its measured acceleration.

    ::

        inertia dOmega/dT = -length ((g + az) sin(theta) + ax cos(theta)) - k0 Omega    dtheta/dT = Omega

    If the place of the pivot was measured, the accelerations are ``x.rate().rate()`` of a signal with
    ``hold="cubic"``.

    Parameters
    ----------
    length : float
        Distance from the pivot to the centre of mass [m].
    inertia : float, optional
        Moment of inertia about the pivot per unit mass [m^2]. The default is `length` squared.
    k0 : float
        Viscous friction [m^2/s].
    g : float
        Gravity [m/s^2].

    Returns
    -------
    Model
        For the state ``Omega, theta``; x is to the right, z upward, ``theta = 0`` hanging and positive to the
        right.

    Raises
    ------
    ModelError
        A number that is not finite, a length or an inertia that is not positive.

    See Also
    --------
    udd.Pendulum : the pendulum with a fixed pivot.
    udd.InputSignal : a measured signal.
    udd.plot.input_signal : draw the signal.

    Examples
    --------
    A lift that falls freely takes the weight away:

    >>> import udd
    >>> fall = udd.InputSignal([0.0, 1.0], [-9.81, -9.81])
    >>> still = udd.InputSignal([0.0, 1.0], [0.0, 0.0])
    >>> udd.moved_pendulum(0.5).with_inputs({"ax": still, "az": fall}).rates(0.5, [2.0, 1.0])
    array([0., 2.])
    """
    size = number("length", length, above=0.0)
    moment = size * size if inertia is None else number("inertia", inertia, above=0.0)
    return FormulaModel(
        ["Omega", "theta"],
        {
            "Omega": "(-length*((g + az)*sin(theta) + ax*cos(theta)) - k0*Omega)/inertia",
            "theta": "Omega",
        },
        {"length": size, "inertia": moment, "g": g, "k0": k0},
        angles=["theta"],
        inputs=["ax", "az"],
    )
