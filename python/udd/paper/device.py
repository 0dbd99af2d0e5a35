"""The paper's device: its constants, drives and starts."""

from __future__ import annotations

import math

from udd.models import DLE, Disk

R, G, K0, K1, K2 = 0.08, 9.81, 0.012, 0.103, 0.055

#: Scales of length [m] and time [s] by which the disk's equations become the DLE.
L = 2 * K0**2 / (G * R**2)
TAU = R**2 / (2 * K0)

SLOW = 0.014  # m/s
DRIVES = (0.039, 0.055, 0.071)
DLE_DRIVES = (3.9, 4.5, 7.1)
B = 0.2

#: Angular velocity below which friction grows [rad/s].
KINK = (K1 - K0) / K2

#: Zero drive: the centre starts from rest 58 mm away, 127 degrees from upright.
ZERO_START = (0.0, 0.058 * math.sin(math.radians(127)), 0.058 * math.cos(math.radians(127)), 0.0)
#: W = 1.4 cm/s: from rest, almost upright, 4 cm up.
SLOW_START = (0.0, 1e-3, 0.04, 0.0)
#: The faster drives: from rest, 11 mm to the side; the disk then stays between the wheels.
FAST_START = (0.0, 0.011, 0.04, 0.0)


def disk(W: float, *, beyond: bool = False) -> Disk:
    """Return the paper's disk; with `beyond` its equations are valid past the disk's edge."""
    return Disk(W, R=R, g=G, k0=K0, k1=K1, k2=K2, edge="ignore" if beyond else "stop")


def rotating(W: float, sense: int = 1) -> tuple[float, float, float]:
    """Return the rotating state (Omega, Y, Z): ``Omega^2 = g W/k0``, ``Y = W/Omega``, above the kink."""
    omega = sense * math.sqrt(G * W / K0)
    return omega, W / omega, 0.0


def rotating_dle(model: DLE) -> tuple[float, float, float]:
    """Return the rotating state of the DLE, ``omega = y = sqrt(w)``, z = 0, for any B."""
    return math.sqrt(model.w), math.sqrt(model.w), 0.0


def hopf_drive(damping: float) -> float:
    """Return the drive of the DLE above which rotation is stable: ``w_H = (1 - B)/(B (1 + B))``."""
    return (1 - damping) / (damping * (1 + damping))
