"""Claims about the related systems: Lorenz, the waterwheel, pendulums."""

from __future__ import annotations

import numpy as np

from udd import related_systems as systems
from udd.models import DLE
from udd.paper.registry import Verdict, claim, judged
from udd.paper.shared_films import Lab
from udd.simulation.trajectory import simulate

_START = [1.0, 1.0, 0.01]


@claim(
    "lorenz-limit",
    place="Section 4 C",
    says="The DLE are the Lorenz equations in the limit that viscous damping dominates over diffusion.",
)
def lorenz_limit(_lab: Lab) -> Verdict:
    """Check that the difference of runs decreases with epsilon = 1/sigma."""
    end = simulate(DLE(1.0), 5.0, _START, method="taylor").state[-1]
    gaps = [
        np.abs(simulate(systems.scaled_lorenz(1.0, e), 5.0, _START, method="taylor").state[-1] - end).max()
        for e in (1e-3, 1e-4, 1e-5)
    ]
    words = ", ".join(f"{gap:.1e}" for gap in gaps)
    return judged(
        gaps[1] < 0.12 * gaps[0] and gaps[2] < 0.12 * gaps[1],
        f"after 5 units, σ = 10³, 10⁴, 10⁵ at w = b r/σ² = 1: differences {words}",
    )


@claim("waterwheel", place="Section 4 C", says="The Malkus waterwheel resembles the DLE.")
def waterwheel(_lab: Lab) -> Verdict:
    """Compare rates at random states."""
    states = np.random.default_rng(0).normal(size=(1000, 3))
    gap = np.abs(systems.waterwheel(3.9).rates(0.0, states) - DLE(3.9).rates(0.0, states)).max()
    return judged(gap == 0, f"without leakage its rates are those of the DLE at 1000 states, to {gap:g}")


@claim(
    "unforced-pendulum",
    place="Section 4 C",
    says="Without a drive the DLE are the damped pendulum Θ″ + Θ′ + r sin Θ = 0.",
)
def unforced_pendulum(_lab: Lab) -> Verdict:
    """Compare two runs."""
    r, angle = 7.0, 2.5
    dle = simulate(DLE(0.0), 10.0, [0, -r * np.sin(angle), -r * np.cos(angle)], method="taylor").state[-1]
    pendulum = simulate(systems.pendulum(r), 10.0, [0, angle], method="taylor").state[-1]
    gap = np.abs(dle - [pendulum[0], -r * np.sin(pendulum[1]), -r * np.cos(pendulum[1])]).max()
    return judged(gap < 1e-8, f"from 2.5 rad, r = 7, the states agree to {gap:.0e} after 10 units of time")


@claim(
    "steady-torque",
    place="Section 4 C",
    says="A steady torque makes the pendulum turn periodically or holds it at an angle; no complex response.",
)
def steady_torque(_lab: Lab) -> Verdict:
    """Check runs below and above the threshold."""
    held_torques, rounds = [], []
    for torque in np.arange(0.05, 4.0, 0.1):
        run = simulate(
            systems.pendulum(1.0, 1.0, float(torque)),
            np.arange(0, 400, 0.01),
            [0, 0],
            method="taylor",
        )
        if np.ptp(run.theta[-2000:]) < 1e-6:
            held_torques.append(torque)
        else:
            first = np.ceil(run.theta[20_000] / (2 * np.pi))
            whole = np.arange(first, np.floor(run.theta[-1] / (2 * np.pi)))
            laps = np.diff(np.interp(2 * np.pi * whole, run.theta, run.t))
            rounds.append((torque, np.ptp(laps) / laps.mean()))
    worst = max(spread for _, spread in rounds)
    evidence = (
        f"r = 1: torques up to {max(held_torques):.2f} hold it; from {rounds[0][0]:.2f} on it turns, with "
        "the times of "
        f"its turns constant to {worst:.0e}"
    )
    return judged(bool(worst < 1e-3 and max(held_torques) < rounds[0][0]), evidence)


@claim(
    "diffusive-state",
    place="Section 5 B",
    says="ω = y = 0, z = z₀ + w t is an exact solution, and unstable.",
)
def diffusive_state(_lab: Lab) -> Verdict:
    """Check a run exactly on the solution, and one close to it."""
    t = np.linspace(0, 20, 201)
    on = simulate(DLE(0.5), t, [0, 0, -1], method="taylor")
    off = np.abs(on.state - np.stack([0 * t, 0 * t, 0.5 * t - 1], axis=1)).max()
    perturbed = simulate(DLE(0.5), t, [0, 1e-9, -1], method="taylor")
    parted = np.abs(perturbed.y).max()
    evidence = f"a run stays on it to {off:g} over 20 units; released 1e-9 from it y reaches {parted:.1f}"
    return judged(off < 1e-12 and parted > 0.1, evidence)
