"""A result of every kind that the package returns, each small."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

import discovered
import udd


def disk_run() -> udd.Trajectory:
    return udd.simulate(udd.Disk(0.039), np.arange(0, 4, 0.01), [0.0, 1e-3, 0.04, 0.0])


@functools.cache
def cycle() -> udd.PeriodicOrbit:
    return udd.periodic_orbit(udd.DLE(8.0))


@functools.cache
def branch() -> udd.Branch:
    return udd.continuation(cycle(), "w", (6.8, 8.2))


@functools.cache
def results() -> dict[str, Any]:
    """A result of every kind, by the name of its class; small ones, made by the package's own functions."""
    dle = udd.DLE(5.0)
    each = udd.Model(["q", "v"], ["v", "-q - 0.1*v"])
    t = np.arange(0.0, 3.0, 0.05)
    tank = udd.Model(["h"], ["u - k*h"], {"k": 1.0}, inputs=["u"])
    level = udd.simulate(tank, t, [0.0], inputs={"u": np.sin(t) + 1}).state
    noisy = level + 1e-3 * np.random.default_rng(0).normal(size=level.shape)
    driven = udd.Measurement(t, {"h": noisy[:, 0]}, inputs={"u": np.sin(t) + 1})
    result = discovered.disk()
    return {
        "Trajectory": disk_run(),
        "Trajectory of an own model": udd.simulate(each, t, [1.0, 0.0]),
        "Trajectory of six states": udd.simulate(six(), t, [0.1] * 6),
        "Measurement": result.measurement,
        "Measurement of an own model": driven,
        "Fit": result.fit,
        "Fit of an own model": udd.fit(driven, tank),
        "Ensemble": udd.ensemble(dle, t, [[1, 1, 0], [2, 1, 0]]),
        "EnergyBalance": udd.energy_balance(disk_run()),
        "Section": udd.poincare(dle, n=50),
        "Section of two surfaces": udd.poincare(dle, ["z", "omega"], n=50),
        "Spectrum": udd.lyapunov_spectrum(udd.DLE(9.0), t=500.0, tol=0.1),
        "Covariant": udd.covariant_vectors(dle, 40),
        "Forecast": udd.forecast(result.measurement, result.fit, start=15.0, members=16),
        "Equilibrium": udd.equilibria(udd.DLE(8.0))[0],
        "PeriodicOrbit": cycle(),
        "Branch": branch(),
        "BifurcationPoint": branch().points[0] if branch().points else None,
        "Diagram": udd.diagram(udd.DLE(8.0), "w", np.linspace(7.0, 7.4, 5), n=24),
        "Lifetimes": udd.Lifetimes(np.linspace(1.0, 30.0, 20), np.arange(20) < 18, 2.0),
        "InputSignal": udd.InputSignal([0.0, 0.5, 1.0], [0.0, 1.0, 0.0]),
        "InputBias": udd.InputBias({"k": 0.1, "c": -0.2}, {"k": 0.05, "c": 0.1}, {"k": 1.0, "c": 2.0}),
        "bifurcation": udd.bifurcation(udd.DLE(9.0), "w", [5.3, 6.0, 7.5], n=40, path="both"),
        "basins": udd.basins(udd.DLE(9.0), grid(), n=24),
        "sweep": udd.sweep(udd.SweepSpec("lyapunov", dle, {"w": [4.0, 5.0, 6.0]}, options={"tol": 0.1})),
    }


def six() -> udd.Model:
    names = [f"x{k}" for k in range(6)]
    return udd.Model(names, [f"-{name}" for name in names])


def grid() -> dict[str, Any]:
    return {"omega": np.linspace(-3, 3, 8), "z": np.linspace(-3, 3, 8)}
