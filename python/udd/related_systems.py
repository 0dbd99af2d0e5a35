"""Systems related to the disk: Lorenz's equations, the waterwheel, and the pendulum driven in other ways.

Every one is a :class:`udd.Model` made from text, so that runs, sections, exponents and fits take it.

==========================  ===============================================================================
function                    its relation to the disk
==========================  ===============================================================================
:func:`lorenz`              the full Lorenz system; the DLE where sigma and r are large, ``w = b r/sigma^2``
:func:`scaled_lorenz`       the same system in the variables of the DLE, which it becomes at ``epsilon = 0``
:func:`waterwheel`          Malkus' wheel; without leakage it is the DLE exactly, with it Lorenz's at b = 1
:func:`pendulum`            the disk without a drive, damped; a steady torque may act on it
:func:`torqued_pendulum`    (i) driven by a periodic torque
:func:`shaken_pendulum`     (ii) driven by a suspension point that moves up and down
:func:`pumped_pendulum`     (iii) driven by a length that changes periodically
:func:`pumped_swing`        a swing whose rider stands up on the way out and squats on the way in
:func:`cycloidal_pendulum`  Huygens' pendulum between cheeks, whose period does not depend on its swing
:func:`walking_droplet`     a droplet carried by its own waves; with infinite memory it is the DLE exactly
==========================  ===============================================================================

Pendulums have the paper's dimensionless form, ``theta = 0`` hanging, and the state ``[v, theta]`` with
``v = theta'``; 1 is the unit of time of their friction unless that is changed.
"""

from __future__ import annotations

from udd._util.arguments import checked_arguments
from udd._util.validation import number
from udd.models import Model

from .errors import ModelError

__all__ = [
    "cycloidal_pendulum",
    "lorenz",
    "pendulum",
    "pumped_pendulum",
    "pumped_swing",
    "scaled_lorenz",
    "shaken_pendulum",
    "torqued_pendulum",
    "walking_droplet",
    "waterwheel",
]


@checked_arguments
def lorenz(sigma: float = 10.0, r: float = 28.0, b: float = 8 / 3) -> Model:
    """Make the Lorenz system, for the state ``[x, y, z]``.

    ::

        x' = sigma (y - x)        y' = x (r - z) - y        z' = x y - b z

    Parameters
    ----------
    sigma, r, b : float
        Prandtl number, heating relative to its critical value, aspect ratio.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite.

    See Also
    --------
    scaled_lorenz : the same in the variables of the DLE.
    udd.plot.phase_space : draw an orbit.

    References
    ----------
    E. N. Lorenz, J. Atmos. Sci. 20 (1963) 130 [2].

    Examples
    --------
    >>> import udd
    >>> udd.related_systems.lorenz().rates(0.0, [1.0, 2.0, 3.0])
    array([10., 23., -6.])
    """
    return Model(
        ["x", "y", "z"],
        {"x": "sigma*(y - x)", "y": "x*(r - z) - y", "z": "x*y - b*z"},
        {"sigma": sigma, "r": r, "b": b},
    )


@checked_arguments
def scaled_lorenz(w: float, epsilon: float, b: float = 8 / 3) -> Model:
    """Make the Lorenz system in the variables of the DLE, for the state ``[omega, y, z]``.

    ::

        omega' = y - omega        y' = omega z - epsilon y        z' = -omega y + w - epsilon b z

    Parameters
    ----------
    w : float
        The drive, ``b r/sigma^2``.
    epsilon : float
        Diffusion relative to viscous damping, ``1/sigma``; 0 is the DLE.
    b : float
        Lorenz's b.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite.

    See Also
    --------
    udd.DLE : its limit without friction.
    udd.related_systems.lorenz : the original variables.

    Notes
    -----
    With ``sigma = 1/epsilon`` and ``r = w sigma^2/b``, Lorenz's variables are ``x = sigma omega``,
    ``y = sigma y``, ``z = r - sigma z``, and his time runs sigma times slower. Nothing is neglected.

    References
    ----------
    E. N. Lorenz, J. Atmos. Sci. 20 (1963) 130 [2]. The scaling: L. Maas [1].

    Examples
    --------
    >>> import udd
    >>> udd.related_systems.scaled_lorenz(1.0, 0.0).rates(0.0, [1.0, 2.0, 3.0])
    array([ 1.,  3., -1.])
    >>> udd.DLE(1.0).rates(0.0, [1.0, 2.0, 3.0])
    array([ 1.,  3., -1.])
    """
    return Model(
        ["omega", "y", "z"],
        {"omega": "y - omega", "y": "omega*z - epsilon*y", "z": "-omega*y + w - epsilon*b*z"},
        {"w": w, "epsilon": epsilon, "b": b},
    )


@checked_arguments
def waterwheel(inflow: float, leakage: float = 0.0, friction: float = 1.0, gravity: float = 1.0) -> Model:
    """Make Malkus' waterwheel: spin, and the water's sine and cosine parts, ``[omega, a, b]``.

    ::

        omega' = gravity a - friction omega    a' = omega b - leakage a    b' = -omega a + inflow - leakage b

    Parameters
    ----------
    inflow : float
        Rate of water at the top.
    leakage : float
        Rate at which the cups lose water, not negative.
    friction : float
        Rate at which the empty wheel loses its spin, positive.
    gravity : float
        Torque of the water, positive.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite, or not positive where it must be.

    See Also
    --------
    udd.related_systems.lorenz : the same equations.
    udd.plot.phase_space : draw an orbit.

    Notes
    -----
    Without leakage, in the unit of time ``1/friction``, this is the DLE with ``y = gravity a/friction^2``,
    ``z = gravity b/friction^2`` and the drive ``w = gravity inflow/friction^3``. With leakage, it is Lorenz's
    equations at b = 1.

    References
    ----------
    S. H. Strogatz, Nonlinear Dynamics and Chaos, section 9.1 [3].

    Examples
    --------
    >>> import udd
    >>> udd.related_systems.waterwheel(1.0).rates(0.0, [1.0, 2.0, 3.0])
    array([ 1.,  3., -1.])
    """
    return Model(
        ["omega", "a", "b"],
        {
            "omega": "gravity*a - friction*omega",
            "a": "omega*b - leakage*a",
            "b": "-omega*a + inflow - leakage*b",
        },
        {
            "inflow": inflow,
            "leakage": number("leakage", leakage, least=0.0),
            "friction": number("friction", friction, above=0.0),
            "gravity": number("gravity", gravity, above=0.0),
        },
    )


@checked_arguments
def pendulum(r: float, friction: float = 1.0, torque: float = 0.0) -> Model:
    """Make the damped pendulum that the disk is without a drive, for the state ``[v, theta]``.

    ::

        v' = -friction v - r sin(theta) + torque        theta' = v

    Parameters
    ----------
    r : float
        Dimensionless length, the distance from the contact to the centre.
    friction : float
        1 in the paper's units.
    torque : float
        A steady one; the system stays planar, without chaos.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite.

    See Also
    --------
    udd.Pendulum : a pendulum in SI units, with effects.
    udd.plot.time_series : draw a run.

    Notes
    -----
    The DLE at w = 0 moves as ``y = -r sin(theta)``, ``z = -r cos(theta)``, ``omega = v``.

    References
    ----------
    L. Maas [1].

    Examples
    --------
    >>> import numpy as np, udd
    >>> swing = udd.simulate(udd.related_systems.pendulum(5.0), 10.0, [0.0, 1.0])
    >>> dle = udd.simulate(udd.DLE(0.0), 10.0, [0.0, -5 * np.sin(1.0), -5 * np.cos(1.0)])
    >>> bool(abs(dle.omega[-1] - swing.v[-1]) < 1e-8)
    True
    """
    return _pendulum("-friction*v - r*sin(theta) + torque", r=r, friction=friction, torque=torque)


@checked_arguments
def torqued_pendulum(r: float, friction: float, amplitude: float, frequency: float) -> Model:
    """Make a pendulum with a periodic torque, for the state ``[v, theta]``.

    ::

        v' = -friction v - r sin(theta) + amplitude cos(frequency t)        theta' = v

    Parameters
    ----------
    r, friction : float
        As for :func:`pendulum`.
    amplitude, frequency : float
        Of the torque; the frequency is an angular one.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite.

    See Also
    --------
    udd.related_systems.shaken_pendulum : driven at its pivot.
    udd.plot.bifurcation : draw its attractors over a parameter.

    References
    ----------
    G. L. Baker and J. P. Gollub, Chaotic Dynamics, chapter 3 [4]; it is chaotic at r = 1, friction = 1/2,
    amplitude = 1.5, frequency = 2/3.

    Examples
    --------
    >>> import udd
    >>> chaotic = udd.related_systems.torqued_pendulum(1.0, 0.5, 1.5, 2 / 3)
    >>> udd.lyapunov(chaotic, t=5000, tol=0.05, state0=[0.0, 1.0]) > 0.1
    True
    """
    return _pendulum(
        "-friction*v - r*sin(theta) + amplitude*cos(frequency*t)",
        r=r,
        friction=friction,
        amplitude=amplitude,
        frequency=frequency,
    )


@checked_arguments
def shaken_pendulum(r: float, friction: float, amplitude: float, frequency: float) -> Model:
    """Make a pendulum whose pivot moves up and down, for the state ``[v, theta]``.

    ::

        v' = -friction v - (r + amplitude cos(frequency t)) sin(theta)        theta' = v

    Parameters
    ----------
    r, friction : float
        As for :func:`pendulum`.
    amplitude, frequency : float
        Of the suspension point's acceleration, which acts as a change of gravity.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite.

    See Also
    --------
    udd.moved_pendulum : a measured motion of the pivot.
    udd.related_systems.torqued_pendulum : driven by a torque.

    Notes
    -----
    Small swings grow at ``frequency = 2 sqrt(r)`` where ``amplitude > 2 friction sqrt(r)`` (Mathieu).
    Standing on its head is stable where ``amplitude^2 > 2 r frequency^2`` for fast shaking (Kapitza).

    Examples
    --------
    >>> import udd
    >>> upright = udd.related_systems.shaken_pendulum(1.0, 0.1, 40.0, 20.0)
    >>> run = udd.simulate(upright, 200.0, [0.0, 3.0])
    >>> bool(abs(run.theta[-1] - 3.141593) < 1e-3)
    True
    """
    return _pendulum(
        "-friction*v - (r + amplitude*cos(frequency*t))*sin(theta)",
        r=r,
        friction=friction,
        amplitude=amplitude,
        frequency=frequency,
    )


@checked_arguments
def pumped_pendulum(r: float, friction: float, amplitude: float, frequency: float) -> Model:
    """Make a pendulum whose length changes by the clock, for the state ``[v, theta]``.

    ::

        (l^2 v)' = -friction v - r l sin(theta)        theta' = v        l = 1 + amplitude cos(frequency t)

    Parameters
    ----------
    r, friction : float
        As for :func:`pendulum`, at the mean length.
    amplitude, frequency : float
        Of the length's change, relative to its mean.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite, or an amplitude of 1 or more, at which the length vanishes.

    See Also
    --------
    udd.related_systems.pumped_swing : pumped without a clock.
    udd.plot.time_series : draw a run.

    Notes
    -----
    Small swings grow as ``exp((3/4 amplitude sqrt(r) - friction/2) t)`` at ``frequency = 2 sqrt(r)``, to
    first order in the amplitude.

    Examples
    --------
    >>> import udd
    >>> run = udd.simulate(udd.related_systems.pumped_pendulum(1.0, 0.0, 0.05, 2.0), 60.0, [0.0, 0.01])
    >>> bool(abs(run.theta).max() > 0.05)
    True
    """
    if not abs(number("amplitude", amplitude)) < 1:
        raise ModelError(
            f"the length 1 + amplitude cos(...) must stay positive: amplitude < 1, not {amplitude}"
        )
    length = "(1 + amplitude*cos(frequency*t))"
    drag = f"(friction/{length} - 2*amplitude*frequency*sin(frequency*t))*v"
    return _pendulum(
        f"-({drag} + r*sin(theta))/{length}", r=r, friction=friction, amplitude=amplitude, frequency=frequency
    )


@checked_arguments
def pumped_swing(
    r: float, friction: float = 0.0, depth: float = 0.1, quickness: float = 50.0, sharpness: float = 1e3
) -> Model:
    """Make a swing that its rider pumps without a clock, for the state ``[v, theta, l]``.

    ::

        (l^2 v)' = -friction v - r l sin(theta)        theta' = v
        l' = quickness (1 - depth tanh(sharpness theta v) - l)

    Parameters
    ----------
    r, friction : float
        As for :func:`pendulum`, at length 1.
    depth : float
        Standing, on the way out, the rider shortens the swing to ``1 - depth``. Squatting, on the way in, the
        rider lengthens it to ``1 + depth``. Positive, below 1.
    quickness : float
        Rate at which the rider moves; positive.
    sharpness : float
        Sharpness of the rider's reaction to the direction of the swing.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite or not in its range.

    See Also
    --------
    udd.related_systems.pumped_pendulum : pumped by a clock.
    udd.plot.time_series : draw a run.

    Notes
    -----
    A quick rider multiplies small swings by ``((1 + depth)/(1 - depth))^(3/2)`` every half period. The
    angular momentum stays as the rider rises at the bottom; the angle stays as the rider squats at the end.

    References
    ----------
    P. L. Tea and H. Falk, Am. J. Phys. 36 (1968) 1165 [5].

    Examples
    --------
    >>> import udd
    >>> run = udd.simulate(udd.related_systems.pumped_swing(1.0), 20.0, [0.0, 0.05, 1.0])
    >>> bool(abs(run.theta).max() > 0.2)
    True
    """
    if not 0 < number("depth", depth) < 1:
        raise ModelError(f"depth must be between 0 and 1, not {depth}")
    rate = "quickness*(1 - depth*tanh(sharpness*theta*v) - l)"
    return Model(
        ["v", "theta", "l"],
        {"v": f"-((friction/l + 2*{rate})*v + r*sin(theta))/l", "theta": "v", "l": rate},
        {
            "r": r,
            "friction": friction,
            "depth": depth,
            "quickness": number("quickness", quickness, above=0.0),
            "sharpness": number("sharpness", sharpness, above=0.0),
        },
        angles=["theta"],
    )


@checked_arguments
def cycloidal_pendulum(r: float, friction: float = 0.0) -> Model:
    """Make Huygens' isochronous pendulum between cycloidal cheeks, for the state ``[v, theta]``.

    ::

        v' = -friction v - (r - v^2) tan(theta)        theta' = v

    Parameters
    ----------
    r, friction : float
        As for :func:`pendulum`; `theta` is the angle of the free part of the string, less than pi/2.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not finite.

    See Also
    --------
    udd.Pendulum : the pendulum on a circle.
    udd.plot.time_series : draw a run.

    Notes
    -----
    The string winds onto the cheeks as it swings, and the bob runs along a cycloid. The arc from its lowest
    point is ``s = sin(theta)`` in units of the string's length, and without friction ``s'' = -r s``. The
    period is ``2 pi/sqrt(r)`` for every amplitude; that of :func:`pendulum` grows with the amplitude.

    References
    ----------
    C. Huygens, Horologium oscillatorium (1673), part 2 [6].

    Examples
    --------
    >>> import numpy as np, udd
    >>> run = udd.simulate(udd.related_systems.cycloidal_pendulum(1.0), 2 * np.pi, [0.0, 1.2])
    >>> bool(abs(run.theta[-1] - 1.2) < 1e-6)
    True
    """
    return _pendulum("-friction*v - (r - v^2)*tan(theta)", r=r, friction=friction)


@checked_arguments
def walking_droplet(R: float, memory: float = float("inf")) -> Model:
    """Make a droplet that walks on the waves of its own bounces, for the state ``[v, y, z]``.

    ::

        v' = y - v        y' = v z - y/memory        z' = R - v y - z/memory

    Parameters
    ----------
    R : float
        Strength of the waves' push; positive.
    memory : float
        Decay time of the waves, in units of the time in which friction stops the droplet; positive.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        A parameter that is not positive.

    See Also
    --------
    udd.DLE : its limit of infinite memory.
    udd.plot.phase_space : draw an orbit.

    Notes
    -----
    In one dimension and with sinusoidal waves the droplet at x(t) obeys

    ::

        x'' + x' = R int_0^t sin(x(t) - x(s)) exp(-(t - s)/memory) ds

    for waves that begin at t = 0. ``v = x'``, and y and z are R times this integral and the same one with a
    cosine; they begin at 0. With infinite memory these are the DLE with ``omega = v`` and ``w = R``; with
    finite memory they are :func:`scaled_lorenz` with ``epsilon = 1/memory`` and b = 1.

    References
    ----------
    R. N. Valani, Infinite-memory classical wave-particle entities, attractor-driven active particles, and the
    diffusionless Lorenz equations, Chaos 34 (2024) 013133, arXiv:2308.03062 [7].

    Examples
    --------
    >>> import udd
    >>> udd.related_systems.walking_droplet(1.0).rates(0.0, [1.0, 2.0, 3.0])
    array([ 1.,  3., -1.])
    """
    decay = 0.0 if memory == float("inf") else 1.0 / number("memory", memory, above=0.0)
    return Model(
        ["v", "y", "z"],
        {"v": "y - v", "y": "v*z - decay*y", "z": "R - v*y - decay*z"},
        {"R": number("R", R, above=0.0), "decay": decay},
    )


def _pendulum(rate: str, **parameters: float) -> Model:
    return Model(["v", "theta"], {"v": rate, "theta": "v"}, parameters, angles=["theta"])
