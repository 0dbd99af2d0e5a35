"""The laws of the effects, written from their definitions in numpy: no code of udd's model is used.

A law gives what it adds: to the contact's lateral velocity u and vertical velocity W_c [m/s], to the torque
[m^2/s^2] and to the friction coefficient k [m^2/s]. It may look at the device, the time and the state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

EPS = 0.05  # rad/s over which dry friction's sign is smoothed


class Push(NamedTuple):
    """Contributions of a law."""

    u: Any = 0.0
    w: Any = 0.0
    torque: Any = 0.0
    k: Any = 0.0


class Look(NamedTuple):
    """Arguments of a law: the device, the time, the state."""

    device: Any
    t: Any
    omega: Any
    y: Any
    z: Any
    beta: Any


Formula = Callable[[Look, Any, dict[str, float]], Push]


@dataclass(frozen=True)
class Kind:
    """A kind of law.

    `equations` are those that it enters: dY, dZ, dOmega. `momenta` is empty for torque and friction. `shapes`
    are drawn log-uniformly between two limits, or from a list.
    """

    name: str
    formula: Formula
    equations: tuple[str, ...]
    momenta: tuple[str, ...] = ()
    amplitudes: tuple[str, ...] = ("a",)
    positive: bool = False
    shapes: dict[str, Any] = field(default_factory=dict)
    needs_omega: bool = False


@dataclass(frozen=True)
class Law:
    """A kind with its numbers."""

    kind: Kind
    amplitudes: tuple[float, ...]
    shape: dict[str, float]
    momentum: str | None

    def scaled(self, factor: float) -> Law:
        """All amplitudes multiplied."""
        return Law(self.kind, tuple(factor * a for a in self.amplitudes), self.shape, self.momentum)


def _quadratic_drag(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(torque=-p[0] * abs(at.omega) * at.omega)


def _cubic_drag(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(torque=-p[0] * at.omega**3)


def _coulomb(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(torque=-p[0] * np.tanh(at.omega / EPS))


def _stribeck(at: Look, p: Any, s: dict[str, float]) -> Push:
    return Push(torque=-p[0] * np.tanh(at.omega / EPS) * np.exp(-((at.omega / s["fade"]) ** 2)))


def _relaxation(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(w=-p[0] * at.device.W * at.z)


def _slip(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(w=-p[0] * at.z)


def _radial_slip(at: Look, p: Any, _s: dict[str, float]) -> Push:
    pull = p[0] * at.z / (at.y**2 + at.z**2 + 1e-6)  # softened within 1 mm of the centre
    return Push(u=-pull * at.y, w=-pull * at.z)


def _load_drive(at: Look, p: Any, _s: dict[str, float]) -> Push:
    d = at.device
    turning = (d.g * at.y - d.k(at.omega) * at.omega - d.W * at.z * at.omega) / d.inertia(at.y, at.z)
    load = d.g - at.z * at.omega**2 - at.y * turning
    return Push(w=-p[0] * d.W * (load / d.g - 1))


def _lateral_slip(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(u=-p[0] * at.y)


def _ripple(at: Look, p: Any, phase: Any) -> Push:
    return Push(w=at.device.W * (p[0] * np.cos(phase) + p[1] * np.sin(phase)))


def _wheel_ripple(at: Look, p: Any, s: dict[str, float]) -> Push:
    return _ripple(at, p, at.device.W * at.t / s["r"])


def _drive_ripple(at: Look, p: Any, s: dict[str, float]) -> Push:
    return _ripple(at, p, 2 * np.pi * s["f"] * at.t)


def _drive_drift(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(w=p[0] * at.device.W * at.t)


def _tilt(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(torque=p[0] * at.device.g * at.z)


def _harmonic(at: Look, p: Any, n: float) -> Push:
    return Push(torque=p[0] * np.sin(n * at.beta) + p[1] * np.cos(n * at.beta))


def _eccentric_mass(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return _harmonic(at, p, 1.0)


def _uneven_disk(at: Look, p: Any, s: dict[str, float]) -> Push:
    return _harmonic(at, p, s["n"])


def _fifth_harmonic(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return _harmonic(at, p, 5.0)


def _cable_torque(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(torque=-p[0] * at.beta + p[1])


def _constant_torque(_at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(torque=p[0])


def _radial_friction(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(k=p[0] * (at.y**2 + at.z**2))


def _grip_loss(at: Look, p: Any, s: dict[str, float]) -> Push:
    return Push(w=-p[0] * at.device.W / (1 + np.exp(-(at.z - s["from"]) / s["over"])))


def _power_drag(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(torque=-p[0] * abs(at.omega) ** 0.5 * at.omega)


def _bump(at: Look, p: Any, s: dict[str, float]) -> Push:
    return Push(torque=p[0] * np.exp(-(((at.y - s["at"]) / s["over"]) ** 2)))


def _lateral_bump(at: Look, p: Any, s: dict[str, float]) -> Push:
    return Push(u=p[0] * np.exp(-(((at.y - s["at"]) / s["over"]) ** 2)))


def _uneven_grip(at: Look, p: Any, s: dict[str, float]) -> Push:
    theta = np.arctan2(at.y, at.z)
    return Push(w=p[0] * at.device.W * np.exp(np.cos(theta - s["at"]) - 1))


def _beta_friction(at: Look, p: Any, s: dict[str, float]) -> Push:
    return Push(k=p[0] * np.exp(3 * (np.cos(at.beta - s["at"]) - 1)))


def _saturating_slip(at: Look, p: Any, s: dict[str, float]) -> Push:
    return Push(w=-p[0] * np.tanh(at.z / s["over"]))


BOTH = ("constraint", "consistent")
CONSISTENT = ("consistent",)

LIBRARY = {
    kind.name: kind
    for kind in (
        Kind("quadratic_drag", _quadratic_drag, ("dOmega",), (), ("c",), positive=True),
        Kind("cubic_drag", _cubic_drag, ("dOmega",), (), ("c",), positive=True),
        Kind("coulomb", _coulomb, ("dOmega",), (), ("c",), positive=True),
        Kind("stribeck", _stribeck, ("dOmega",), (), ("c",), True, {"fade": (0.3, 3.0)}),
        Kind("relaxation", _relaxation, ("dZ",), BOTH, ("b",)),
        Kind("slip", _slip, ("dZ",), BOTH, ("c",)),
        Kind("radial_slip", _radial_slip, ("dY", "dZ"), BOTH, ("c",), positive=True),
        Kind("load_drive", _load_drive, ("dZ",), CONSISTENT, ("a",), positive=True, needs_omega=True),
        Kind("lateral_slip", _lateral_slip, ("dY",), BOTH, ("c",)),
        Kind("wheel_ripple", _wheel_ripple, ("dZ",), CONSISTENT, ("a", "b"), shapes={"r": [0.03]}),
        Kind("drive_ripple", _drive_ripple, ("dZ",), CONSISTENT, ("a", "b"), shapes={"f": (0.1, 5.0)}),
        Kind("drive_drift", _drive_drift, ("dZ",), CONSISTENT),
        Kind("tilt", _tilt, ("dOmega",)),
        Kind("eccentric_mass", _eccentric_mass, ("dOmega",), (), ("a", "b")),
        Kind("uneven_disk", _uneven_disk, ("dOmega",), (), ("a", "b"), shapes={"n": [2.0, 3.0, 4.0]}),
        Kind("cable_torque", _cable_torque, ("dOmega",), (), ("kappa", "c"), positive=True),
        Kind("constant_torque", _constant_torque, ("dOmega",), (), ("c",)),
        Kind("radial_friction", _radial_friction, ("dOmega",), (), ("c",)),
    )
}

#: Effects that no library holds. "grip_loss" is lost lift above a height, "bump" touches on one side only.
FOREIGN = {
    kind.name: kind
    for kind in (
        Kind("grip_loss", _grip_loss, ("dZ",), BOTH, shapes={"from": (0.005, 0.03), "over": (2e-3, 6e-3)}),
        Kind("power_drag", _power_drag, ("dOmega",), positive=True),
        Kind("fifth_harmonic", _fifth_harmonic, ("dOmega",), (), ("a", "b")),
        Kind("bump", _bump, ("dOmega",), shapes={"at": (0.01, 0.03), "over": (4e-3, 0.012)}),
        Kind(
            "lateral_bump", _lateral_bump, ("dY",), BOTH, shapes={"at": (0.01, 0.03), "over": (4e-3, 0.012)}
        ),
        Kind("uneven_grip", _uneven_grip, ("dZ",), BOTH, shapes={"at": (0.5, 3.0)}),
    )
}

#: Effects outside every library with which the fit of the plain model converged to a wrong solution.
ASTRAY = {
    kind.name: kind
    for kind in (
        Kind("beta_friction", _beta_friction, ("dOmega",), positive=True, shapes={"at": (0.5, 6.0)}),
        Kind(
            "saturating_slip", _saturating_slip, ("dZ",), BOTH, positive=True, shapes={"over": (5e-3, 0.02)}
        ),
    )
}
