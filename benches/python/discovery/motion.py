"""The disk's motion by its angular momentum: exact equations of another form than those of udd.

With the contact's velocity (u, W_c), J = I_C Omega + Z dY/dT - Y dZ/dT obeys dJ/dT = g Y - k Omega + torque,
so that no rate of u or W_c is needed. A law that enters the rolling constraint alone, (u', W'), moves the
disk without belonging to J, which adds to dJ/dT what it changes of I and of the lever arms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from laws import Law, Look
from scipy.integrate import solve_ivp

EDGE = 0.97  # of the radius: a record stays well between the wheels
RTOL, ATOL = 1e-9, 1e-11
STEP = 0.04  # s, the longest step: k has kinks
_WILD = 10.0  # m^2/s, of the momentum over the mass: at 1000 rad/s and more there is no device


@dataclass(frozen=True)
class Device:
    """The disk and its drive; any number may be an array."""

    W: Any
    k0: Any = 0.012
    k1: Any = 0.103
    k2: Any = 0.055
    R: float = 0.08
    g: float = 9.81

    def k(self, omega: Any) -> Any:
        """Friction coefficient, m^2/s."""
        slow, fast = self.k1 - self.k2 * abs(omega), self.k0
        return np.maximum(slow, fast) if isinstance(omega, np.ndarray) else max(slow, fast)

    def inertia(self, y: Any, z: Any) -> Any:
        """Moment of inertia about the contact, m^2."""
        return self.R**2 / 2 + y * y + z * z


@dataclass(frozen=True)
class World:
    """A device with laws."""

    device: Device
    laws: tuple[Law, ...] = ()

    def pushes(self, t: Any, x: Sequence[Any]) -> tuple[Any, Any, Any, Any, Any, Any]:
        """u, W_c that belong to the momentum; u', W' that do not; torque, friction beyond the plain."""
        u, w, u_free, w_free, torque, k = 0.0, self.device.W, 0.0, 0.0, 0.0, 0.0
        at = Look(self.device, t, *x)
        for law in self.laws:
            push = law.kind.formula(at, law.amplitudes, law.shape)
            torque, k = torque + push.torque, k + push.k
            if law.momentum == "constraint":
                u_free, w_free = u_free + push.u, w_free + push.w
            else:
                u, w = u + push.u, w + push.w
        return u, w, u_free, w_free, torque, k

    def momentum(self, t: Any, x: Sequence[Any]) -> Any:
        """J of a state [Omega, Y, Z, beta]."""
        u, w, *_rest = self.pushes(t, x)
        return self.device.inertia(x[1], x[2]) * x[0] + x[2] * u - x[1] * w

    def omega(self, t: Any, j: Any, y: Any, z: Any, beta: Any) -> Any:
        """Omega of a state [J, Y, Z, beta]."""
        inertia = self.device.inertia(y, z)
        omega = (j + y * self.device.W) / inertia
        if any(law.kind.needs_omega for law in self.laws):
            for _ in range(8):  # Newton: W_c itself depends on Omega
                h = 1e-4
                f = self.momentum(t, (omega, y, z, beta)) - j
                slope = (self.momentum(t, (omega + h, y, z, beta)) - j - f) / h
                omega = omega - f / slope
            return omega
        u, w, *_rest = self.pushes(t, (omega, y, z, beta))
        return (j - z * u + y * w) / inertia

    def rates(self, t: Any, state: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
        """d[J, Y, Z, beta]/dT."""
        j, y, z, beta = state
        d = self.device
        omega = self.omega(t, j, y, z, beta)
        u, w, u_free, w_free, torque, k = self.pushes(t, (omega, y, z, beta))
        turn = d.g * y - (d.k(omega) + k) * omega + torque
        turn = turn + 2 * (y * u_free + z * w_free) * omega + w_free * u - u_free * w
        return turn, z * omega + u + u_free, -y * omega + w + w_free, omega

    def step(self, t: Any, x: np.ndarray, dt: Any, parts: int = 8) -> np.ndarray:
        """States (n, 4) after dt, all at once, by Runge and Kutta's method."""
        s = np.array([self.momentum(t, x.T), *x.T[1:]])
        h = dt / parts
        for i in range(parts):
            now = t + i * h
            a = np.array(self.rates(now, s))
            b = np.array(self.rates(now + h / 2, s + h / 2 * a))
            c = np.array(self.rates(now + h / 2, s + h / 2 * b))
            e = np.array(self.rates(now + h, s + h * c))
            s = s + h / 6 * (a + 2 * b + 2 * c + e)
        return np.column_stack([self.omega(t + dt, *s), *s[1:]])


@dataclass(frozen=True)
class Run:
    """A motion that can be asked at any time."""

    world: World
    dense: Any

    def __call__(self, t: np.ndarray) -> np.ndarray:
        """States [Omega, Y, Z, beta] at times t, shape t.shape + (4,)."""
        flat = np.ravel(t)
        j, y, z, beta = self.dense(flat)
        return np.stack([self.world.omega(flat, j, y, z, beta), y, z, beta], axis=-1).reshape(*t.shape, 4)


def run(world: World, start: Sequence[float], duration: float) -> Run | None:
    """The motion from a start [Omega, Y, Z, beta]; None where the disk leaves the wheels or spins up."""

    def edge(_t: float, s: np.ndarray) -> float:
        return (EDGE * world.device.R) ** 2 - float(s[1] ** 2 + s[2] ** 2)

    def spinning(_t: float, s: np.ndarray) -> float:
        return _WILD - abs(float(s[0]))

    # A drawn law may push without bound: the solver then took ever smaller steps, and kept all of them.
    edge.terminal = spinning.terminal = True  # type: ignore[attr-defined]
    begin = [world.momentum(0.0, start), *start[1:]]
    solution = solve_ivp(
        lambda t, s: world.rates(t, s.tolist()),
        (-0.1, duration + 0.1),
        begin,
        method="DOP853",
        rtol=RTOL,
        atol=ATOL,
        max_step=STEP,
        events=(edge, spinning),
        dense_output=True,
    )
    return Run(world, solution.sol) if solution.status == 0 else None


def staying(world: World, duration: float, rng: np.random.Generator, tries: int = 20) -> Run | None:
    """The motion from a drawn start from which the disk stays between the wheels."""
    for _ in range(tries):
        radius, angle = rng.uniform(0.01, 0.05), rng.uniform(0, 2 * np.pi)
        start = [rng.normal(0, 2), radius * np.sin(angle), radius * np.cos(angle), rng.uniform(0, 6)]
        result = run(world, start, duration)
        if result is not None:
            return result
    return None
