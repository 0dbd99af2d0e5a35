"""The compiled models and the same laws as text: `python two_doors.py` prints costs and differences.

A ratio is the processor time of the text over that of the compiled law, each the least of several turns
that alternate.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

os.environ.update(RAYON_NUM_THREADS="1", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np

import udd

TURNS = 5
effects = udd.effects

#: Effects of the disk as text: parameters, and additions to torque, friction, W_c and u with their rates.
WRITTEN: dict[str, tuple[dict[str, float], dict[str, str]]] = {
    "quadratic_drag": ({"c": 0.01}, {"torque": "-c*abs(Omega)*Omega"}),
    "cubic_drag": ({"c": 0.001}, {"torque": "-c*Omega^3"}),
    "coulomb": ({"c": 0.002, "eps": 0.05}, {"torque": "-c*tanh(Omega/eps)"}),
    "stribeck": (
        {"c": 0.002, "fade": 1.0, "eps": 0.05},
        {"torque": "-c*tanh(Omega/eps)*exp(-(Omega/fade)^2)"},
    ),
    "relaxation": ({"b": 6.0}, {"vertical": "-b*W*Z", "vertical_rate": "-b*W*(W - b*W*Z - Y*Omega)"}),
    "slip": ({"c": 0.2}, {"vertical": "-c*Z", "vertical_rate": "-c*(W - c*Z - Y*Omega)"}),
    "lateral_slip": ({"c": 0.2}, {"lateral": "-c*Y", "lateral_rate": "-c*(Z*Omega - c*Y)"}),
    "drive_ripple": (
        {"a": 0.01, "b": 0.02, "f": 1.0},
        {
            "vertical": "W*(a*cos(2*pi*f*t) + b*sin(2*pi*f*t))",
            "vertical_rate": "W*2*pi*f*(b*cos(2*pi*f*t) - a*sin(2*pi*f*t))",
        },
    ),
    "drive_drift": ({"a": 1e-4}, {"vertical": "W*a*t", "vertical_rate": "W*a"}),
    "tilt": ({"a": 0.01}, {"torque": "a*g*Z"}),
    "eccentric_mass": ({"a": 0.01, "b": 0.005}, {"torque": "a*sin(beta) + b*cos(beta)"}),
    "uneven_disk": ({"a": 0.01, "b": 0.005, "n": 2.0}, {"torque": "a*sin(n*beta) + b*cos(n*beta)"}),
    "cable_torque": ({"kappa": 1e-4, "c": 0.001}, {"torque": "c - kappa*beta"}),
    "constant_torque": ({"c": 0.001}, {"torque": "c"}),
    "radial_friction": ({"c": 0.2}, {"friction": "c*(Y^2 + Z^2)"}),
    "threshold_drag": (
        {"a": 0.002, "c": 1.0, "r": 0.05},
        {"friction": "a*(abs(Omega) - c + sqrt((abs(Omega) - c)^2 + r^2))/2"},
    ),
    "power_drag": ({"a": 0.002, "n": 1.5, "r": 1e-3}, {"friction": "a*(Omega^2 + r^2)^(n/2)"}),
    "warming_friction": ({"a": 0.002, "tau": 20.0}, {"friction": "a*exp(-t/tau)"}),
    "local_brake": (
        {"a": 0.002, "c": 0.3, "s": 0.2},
        {"friction": "a*exp(-(2*sin((beta - c)/2)/s)^2)"},
    ),
}


def disk(parameters: dict[str, float] | None = None, **parts: str) -> udd.Model:
    """Return the disk as text with these additions."""
    friction = "max(k1 - k2*abs(Omega), k0)" + "".join(f" + {p}" for p in [parts.get("friction")] if p)
    drive = f"(W + {parts['vertical']})" if "vertical" in parts else "W"
    pull = f"g*Y - ({friction})*Omega"
    if "torque" in parts:
        pull += f" + {parts['torque']}"
    pull += f" - {drive}*Z*Omega"
    if "lateral" in parts:
        pull += f" - Y*({parts['lateral']})*Omega - Z*({parts['lateral_rate']})"
    if "vertical" in parts:
        pull += f" + Y*({parts['vertical_rate']})"
    equations = {
        "Omega": f"({pull})/(R^2/2 + Y^2 + Z^2)",
        "Y": "Z*Omega" + (f" + {parts['lateral']}" if "lateral" in parts else ""),
        "Z": f"{drive} - Y*Omega",
        "beta": "Omega",
    }
    plain = udd.Disk(0.039).parameters
    return udd.Model(list(equations), equations, {**plain, **(parameters or {})})


DLE = udd.Model(["omega", "y", "z"], {"omega": "y - omega", "y": "omega*z", "z": "w - omega*y"}, {"w": 1.0})
SWING = udd.Model(
    ["Omega", "theta"],
    {"Omega": "(-g*l*sin(theta) - k0*Omega - c*sign(Omega))/l^2", "theta": "Omega"},
    {"g": 9.81, "l": 0.5, "k0": 0.01, "c": 0.05},
)
DRY = udd.Pendulum(0.5, k0=0.01, effects=[effects.coulomb(c=0.05, treatment="set-valued")])
DISK = udd.Disk(0.039, edge="ignore")
START = np.array([3.0, 0.005, 0.0, 0.0])


def ratio(compiled: Callable[[], Any], text: Callable[[], Any]) -> float:
    """Return the processor time of the second over that of the first."""
    least = [np.inf, np.inf]
    for _ in range(TURNS):
        for k, work in enumerate((compiled, text)):
            began = time.process_time()
            work()
            least[k] = min(least[k], time.process_time() - began)
    return least[1] / least[0]


def difference(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest difference relative to the size of the numbers."""
    return float(np.nanmax(np.abs(a - b)) / np.nanmax(np.abs(a)))


def row(
    what: str, compiled: Callable[[], Any], text: Callable[[], Any], numbers: Callable[[Any], Any]
) -> None:
    """Print a row of the table."""
    apart = difference(np.asarray(numbers(compiled())), np.asarray(numbers(text())))
    print(f"| {what} | {ratio(compiled, text):.2f} | {apart:.0e} |", flush=True)


def fixed_run(model: udd.models.Model, method: str) -> Callable[[], Any]:
    """Return a run of the disk of 20 s."""
    return lambda: udd.simulate(model, [0, 20], START, method=method, rtol=1e-9, atol=1e-12)


def runs(name: str, compiled: udd.models.Model, text: udd.Model, start: Any, near: float, far: float) -> None:
    """Print the rows of trajectories and ensembles."""
    for method in ("dopri5", "dop853", "taylor"):
        apart = difference(
            *(udd.simulate(m, [0, near], start, method=method).state[-1] for m in (compiled, text))
        )
        cost = ratio(
            *(
                lambda m=m, how=method: udd.simulate(m, [0, far], start, method=how, rtol=1e-9, atol=1e-12)
                for m in (compiled, text)
            )
        )
        print(f"| {name}, {method} | {cost:.2f} | {apart:.0e} |", flush=True)
    starts = np.asarray(start) + 1e-3 * np.random.default_rng(0).normal(size=(64, len(start)))
    row(
        f"{name}, ensemble",
        lambda: udd.ensemble(compiled, [0, near], starts, threads=1),
        lambda: udd.ensemble(text, [0, near], starts, threads=1),
        lambda r: r.state[:, -1],
    )


def main() -> None:
    """Print the tables."""
    print("| work | text / compiled | relative difference |\n|---|---|---|")
    runs("DLE", udd.DLE(1.0), DLE, [1.0, 1.0, 0.01], 8.0, 2000.0)
    runs("disk", DISK, disk(), START, 1.0, 100.0)
    runs("pendulum with dry friction", DRY, SWING, [0.0, 1.5], 3.0, 20.0)
    row(
        "largest exponent of the disk",
        lambda: udd.lyapunov(DISK, t=50.0, tol=1.0, state0=START),
        lambda: udd.lyapunov(disk(), t=50.0, tol=1.0, state0=START),
        lambda r: [float(r)],
    )
    row(
        "section of the disk, Z = 0.01, 50 points",
        lambda: udd.poincare(DISK, "Z = 0.01", 50, state0=START),
        lambda: udd.poincare(disk(), "Z = 0.01", 50, state0=START),
        lambda r: r.state[:5],
    )
    row(
        "stops of the pendulum",
        lambda: udd.simulate(DRY, [0, 8], [0.0, 1.5], rtol=1e-10),
        lambda: udd.simulate(SWING, [0, 8], [0.0, 1.5], rtol=1e-10),
        lambda r: [event.t for event in r.events][:8],
    )
    motion = udd.simulate(DISK, np.arange(0, 20, 0.04), START, rtol=1e-11)
    noise = np.array([5e-4, 5e-4, 7e-3])
    seen = motion.state[:, 1:] + noise * np.random.default_rng(0).normal(size=(len(motion.t), 3))
    sigma = {n: np.full(len(motion.t), s) for n, s in zip(("Y", "Z", "beta"), noise, strict=True)}
    record = udd.Measurement(motion.t, dict(zip(sigma, seen.T, strict=True)), sigma=sigma)
    free = ["k0", "k1", "k2", "W"]
    row(
        "fit of the disk, 500 frames: standard errors",
        lambda: udd.fit(record, DISK, free, camera=False),
        lambda: udd.fit(record, disk(), free),
        lambda r: [r.errors[n] / v for n, v in zip(free, (2e-6, 3e-4, 3e-4, 7e-6), strict=True)],
    )
    print("\n| disk with | dopri5 | taylor | relative difference of the rates |\n|---|---|---|---|")
    rng = np.random.default_rng(1)
    states = rng.normal(size=(300, 4)) * [3.0, 0.02, 0.02, 2.0]
    for name, (values, parts) in WRITTEN.items():
        momentum = {"momentum": "consistent"} if {"vertical", "lateral"} & set(parts) else {}
        effect = getattr(effects, name)(**{n: v for n, v in values.items() if n != "r"}, **momentum)
        compiled = udd.Disk(0.039, edge="ignore", effects=[effect])
        text = disk(values, **parts)
        t = rng.uniform(0, 10, 300)
        rates = difference(compiled.rates(t, states), text.rates(t, states))
        costs = []
        for method in ("dopri5", "taylor"):
            try:
                costs.append(f"{ratio(*(fixed_run(m, method) for m in (compiled, text))):.2f}")
            except udd.errors.IntegrationError:
                costs.append("fails as text")
        print(f"| {name} | {costs[0]} | {costs[1]} | {rates:.0e} |", flush=True)


if __name__ == "__main__":
    main()
