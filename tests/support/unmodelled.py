"""Records of disks that obey a law of no library: own equations, SciPy's integrator, for tests."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import ode

import udd

#: ``(t, Omega, Y, Z, beta) -> (torque, lateral, vertical)``: m^2/s^2 and m/s; the contact's velocities enter
#: the rolling constraint alone.
Law = Callable[[float, float, float, float, float], tuple[float, float, float]]
K0, K1, K2, R, G = 0.012, 0.103, 0.055, 0.08, 9.81


@dataclass(frozen=True)
class Case:
    """A law and where it should be located: first where it is, then where a weak one may as well be."""

    name: str
    law: Law
    places: tuple[tuple[str, ...], ...]
    curve: Callable[[np.ndarray], np.ndarray]


def _torque(f: Callable[..., float]) -> Law:
    return lambda t, o, y, z, b: (f(o, y, z, b), 0.0, 0.0)


def _vertical(f: Callable[..., float]) -> Law:
    return lambda t, o, y, z, b: (0.0, 0.0, f(o, y, z, b))


def grip(z: np.ndarray) -> np.ndarray:
    """The wheels lose their grip where the disk's centre is high above them, m/s."""
    return -0.008 / (1 + np.exp(-(z - 0.02) / 0.006))


def rough_air(omega: np.ndarray) -> np.ndarray:
    """Friction that grows with the speed's power 1.5, as a torque, m^2/s^2."""
    return -1.5e-3 * np.sign(omega) * np.abs(omega) ** 1.5


def magnets(beta: np.ndarray) -> np.ndarray:
    """A torque with five waves per turn, m^2/s^2."""
    return 0.02 * np.sin(5 * beta)


def bump(z: np.ndarray) -> np.ndarray:
    """A push sideways near one height only, m/s."""
    return 0.004 * np.exp(-(((z + 0.02) / 0.008) ** 2))


def load(o: float, y: float, z: float, w: float) -> float:
    """Return the excess of the disk's force on the wheels over that at rest, in weights: F/g - 1."""
    inertia = R * R / 2 + y * y + z * z
    turning = (G * y - max(K1 - K2 * abs(o), K0) * o - z * w * o) / inertia
    return -(z * o * o + y * turning) / G


def squeeze(excess: np.ndarray) -> np.ndarray:
    """Friction that sets in where the load is a tenth above the weight, m^2/s."""
    return 0.008 / (1 + np.exp(-(excess - 0.1) / 0.04))


CASES = (
    Case(
        "grip loss",
        _vertical(lambda o, y, z, b: float(grip(z))),
        (("vertical (constraint)", "Z"), ("vertical (consistent)", "Z")),
        grip,
    ),
    Case(
        "friction to 1.5",
        _torque(lambda o, y, z, b: float(rough_air(o))),
        (("torque", "Omega"), ("friction", "|Omega|")),
        rough_air,
    ),
    Case("five waves", _torque(lambda o, y, z, b: float(magnets(b))), (("torque", "beta"),), magnets),
    Case(
        "one-sided bump",
        lambda t, o, y, z, b: (0.0, float(bump(z)), 0.0),
        (("lateral (constraint)", "Z"), ("lateral (consistent)", "Z")),
        bump,
    ),
)


def rates(law: Law | None, w: float) -> Callable[[float, np.ndarray], list[float]]:
    """The equations of motion."""

    def f(t: float, x: np.ndarray) -> list[float]:
        o, y, z, b = x.tolist()  # numbers of Python's own: several times the speed of NumPy's
        torque, lateral, vertical = law(t, o, y, z, b) if law else (0.0, 0.0, 0.0)
        k = max(K1 - K2 * abs(o), K0)
        inertia = R * R / 2 + y * y + z * z
        return [(G * y - k * o - z * w * o + torque) / inertia, z * o + lateral, -y * o + w + vertical, o]

    return f


def motion(law: Law | None, w: float, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """States at times, from a random start from which the disk stays between the wheels.

    SciPy's older interface, whose steps are compiled: a quarter of the time that `solve_ivp` takes.
    """
    run = ode(rates(law, w)).set_integrator("dop853", rtol=1e-9, atol=1e-11)
    run.set_solout(lambda _t, x: -1 if math.hypot(x[1], x[2]) > R - 0.002 else 0)  # -1: no further
    for _ in range(200):
        radius, angle = rng.uniform(0.01, 0.05), rng.uniform(0, 2 * np.pi)
        start = [rng.normal(0, 2), radius * np.sin(angle), radius * np.cos(angle), rng.uniform(0, 6)]
        run.set_initial_value(start, t[0])
        states = [np.array(start)]
        for end in t[1:]:
            states.append(run.integrate(end).copy())
            if run.get_return_code() != 1:  # 1: it has come to the end
                break
        else:
            return np.array(states)
    raise RuntimeError("no start stays between the wheels")


def record(
    law: Law | None,
    seed: int,
    duration: float = 60.0,
    w: float = 0.045,
    noise: tuple[float, float] = (3e-4, 5e-3),
) -> udd.Measurement:
    """A record at 25 frames a second with white noise, an offset, and a tilt of the camera."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, duration, 0.04)
    _o, y, z, b = motion(law, w, t, rng).T
    c, s = np.cos(0.01), np.sin(0.01)
    seen = np.column_stack([c * y + s * z + 8e-4, c * z - s * y - 5e-4, b + 0.01])
    seen += rng.standard_normal(seen.shape) * [noise[0], noise[0], noise[1]]
    return udd.Measurement(t, seen, meta={"W": w, "R": R})
