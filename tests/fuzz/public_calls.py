"""A quick valid call of each public function and of the methods of results."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

import udd
from udd import related_systems

Call = tuple[Callable[..., Any], dict[str, Any]]
LORENZ = [1.0, 1.0, 0.1]
NOWHERE = os.devnull + "/x"


@cache
def calls() -> dict[str, Call]:
    """Return the functions with arguments that are valid, by name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return {**_runs(), **_branches(), **_models(), **_records(), **_pictures()}


@cache
def _disk_run() -> udd.Trajectory:
    return udd.simulate(udd.Disk(0.04), np.linspace(0, 1, 30), [0.0, 1e-3, 0.04, 0.0], dense=True)


@cache
def _record() -> udd.Measurement:
    t = np.linspace(0, 4, 121)
    swing = udd.simulate(udd.Pendulum(0.5, k0=0.01), t, [0.0, 0.5])
    theta = swing.state[:, 1] + 1e-3 * np.random.default_rng(1).normal(size=len(t))
    return udd.Measurement(t, {"theta": theta}, 1e-3 * np.ones((len(t), 1)))


@cache
def _fit() -> udd.Fit:
    return udd.fit(_record(), udd.Pendulum(0.5))


@cache
def _branch() -> udd.Branch:
    rest = udd.equilibria(udd.DLE(2.5, B=0.2), initial_states=8)[0]
    return udd.continuation(rest, "w", (1.0, 9.0), max_points=30)


@cache
def _cycle() -> udd.PeriodicOrbit:
    return udd.periodic_orbit(udd.DLE(10.0), settle=50.0)


@cache
def _cycles() -> udd.Branch:
    return udd.continuation(_cycle(), "w", (9.8, 10.2), max_points=6)


@cache
def _driven() -> udd.Fit:
    t, rng = np.linspace(0, 4, 81), np.random.default_rng(1)
    model = udd.Model(["x", "v"], ["v", "-k*x + u"], {"k": 4.0}, inputs=["u"])
    force = udd.InputSignal(t, np.sin(t))
    x = udd.simulate(model, t, [1.0, 0.0], inputs={"u": force}).state[:, 0]
    seen = udd.Measurement(t, {"x": x + 1e-3 * rng.normal(size=len(t))}, inputs={"u": force})
    return udd.fit(seen, model)


def _runs() -> dict[str, Call]:
    dle = udd.DLE(1.0)
    quick = {"t": 20.0, "transient": 1.0, "state0": LORENZ}
    points = udd.poincare(dle, "z", 20, transient=1, state0=LORENZ)
    return {
        "simulate": (udd.simulate, {"model": dle, "t": 1.0, "state0": LORENZ}),
        "ensemble": (udd.ensemble, {"model": dle, "t": 1.0, "state0": LORENZ, "threads": 1}),
        "lyapunov": (udd.lyapunov, {"w": 1.0, "threads": 1, **quick}),
        "lyapunov_spectrum": (udd.lyapunov_spectrum, {"w": 1.0, **quick}),
        "covariant_vectors": (udd.covariant_vectors, {"model": dle, "n": 5, "dt": 0.1, "transient": 1.0}),
        "poincare": (udd.poincare, {"model": dle, "section": "z", "n": 3, "transient": 1, "state0": LORENZ}),
        "bifurcation": (
            udd.bifurcation,
            {"model": dle, "parameter": "w", "values": [1.0], "n": 5, "transient": 5, "attractors": False},
        ),
        "basins": (udd.basins, {"model": udd.DLE(4.5), "grid": {"y": [0.1]}, "n": 12, "transient": 5}),
        "lifetimes": (
            udd.lifetimes,
            {"model": udd.DLE(10.0), "starts": [LORENZ], "attractors": _cycle(), "t_max": 5.0},
        ),
        "energy_balance": (udd.energy_balance, {"run": _disk_run()}),
        "SweepSpec": (
            udd.SweepSpec,
            {"quantity": "lyapunov", "model": dle, "over": {"w": [1.0]}, "options": {"t": 5.0}},
        ),
        "SweepSpec.from_dict": (udd.SweepSpec.from_dict, {"data": {}}),
        "SweepSpec.from_json": (udd.SweepSpec.from_json, {"text": "{}"}),
        "SweepSpec.read": (udd.SweepSpec.read, {"path": "nosuch.toml"}),
        "Trajectory.call": (_disk_run().__call__, {"t": 0.5}),
        "Section.of": (points.of, {"which": 0}),
        "Section.component": (points.component, {"name": "y"}),
        "Section.return_map": (points.return_map, {"component": "y"}),
        "Section.cusp_map": (points.cusp_map, {}),
    }


def _branches() -> dict[str, Call]:
    damped = udd.DLE(2.5, B=0.2)
    rest = udd.equilibria(damped, initial_states=8)[0]
    return {
        "equilibria": (udd.equilibria, {"model": damped, "initial_states": 4}),
        "continuation": (
            udd.continuation,
            {"start": rest, "parameter": "w", "bounds": (1.0, 9.0), "ds": 0.05, "max_points": 5},
        ),
        "periodic_orbit": (udd.periodic_orbit, {"model": udd.DLE(10.0), "settle": 20.0}),
        "PeriodicOrbit.trajectory": (_cycle().trajectory, {"n": 10}),
        "locus": (udd.locus, {"point": _branch().points[0], "parameter": "B", "max_points": 3}),
        "cascade": (
            udd.cascade,
            {"start": _cycle(), "parameter": "w", "bounds": (9.9, 10.0), "n": 1},
        ),
        "connection": (udd.connection, {"branch": _cycles()}),
        "connections": (
            udd.connections,
            {"model": damped, "parameter": "w", "bounds": (2.5, 2.6), "n": 2, "t_max": 5.0},
        ),
        "crises": (udd.crises, {"branch": _cycles(), "n": 10, "depth": 2}),
        "cycle_connections": (udd.cycle_connections, {"branch": _cycles(), "equilibrium": rest}),
        "diagram": (
            udd.diagram,
            {"model": damped, "parameter": "w", "values": [2.5, 2.6], "generations": 0, "max_points": 4}
            | {"n": 12, "transient": 12},
        ),
        "Branch.at": (_branch().at, {"value": 2.6}),
        "Branch.find": (_branch().find, {"kind": "hopf"}),
        "Branch.solution": (_branch().solution, {"i": 0}),
        "Branch.crossings": (_cycles().crossings, {}),
    }


def _models() -> dict[str, Call]:
    disk, oscillator = udd.Disk(0.04), udd.Model(["x", "v"], ["v", "-k*x"], {"k": 1.0})
    swing = udd.mechanism({"q": "v"}, [["1"]], ["-k*q"], {"k": 1.0})
    systems = {
        name: (getattr(related_systems, name), {"r": 1.0})
        for name in ("cycloidal_pendulum", "lorenz", "pendulum", "pumped_swing")
    }
    forced = {
        name: (
            getattr(related_systems, name),
            {"r": 1.0, "friction": 0.1, "amplitude": 0.1, "frequency": 1.0},
        )
        for name in ("pumped_pendulum", "shaken_pendulum", "torqued_pendulum")
    }
    return {
        "DLE": (udd.DLE, {"w": 1.0, "B": 0.1}),
        "Disk": (udd.Disk, {"W": 0.04, "R": 0.08, "k0": 0.012, "effects": ()}),
        "Disk.from_wheel": (udd.Disk.from_wheel, {"rate": 1.3, "wheel": 0.03}),
        "Pendulum": (udd.Pendulum, {"length": 0.5, "inertia": 0.25, "k0": 0.01}),
        "Pendulum.with_gyroscope": (udd.Pendulum(0.5).with_gyroscope, {"angle": True}),
        "Model": (udd.Model, {"states": ["x"], "equations": ["-k*x"], "parameters": {"k": 1.0}}),
        "with_parameters": (disk.with_parameters, {"values": {"W": 0.05}}),
        "with_effects": (disk.with_effects, {"effects": []}),
        "rates": (udd.DLE(1.0).rates, {"t": 0.0, "state": LORENZ}),
        "formula.rates": (oscillator.rates, {"t": 0.0, "state": [1.0, 0.0]}),
        "formula.with_term": (oscillator.with_term, {"equation": "v", "term": "v", "c": 0.1}),
        "formula.with_parameters": (oscillator.with_parameters, {"values": {"k": 2.0}}),
        "formula.observed": (oscillator.observed, {"t": [0.0], "states": [[1.0, 0.0]]}),
        "formula.accelerations": (swing.accelerations, {"along": "q"}),
        "formula.mass_matrix": (swing.mass_matrix, {"states": [[1.0, 0.0]]}),
        "pendulum_chain": (
            udd.pendulum_chain,
            {"masses": [1.0], "lengths": [0.3], "centres": [0.15], "inertias": [0.01], "friction": [0.0]},
        ),
        "mechanism": (
            udd.mechanism,
            {"coordinates": {"q": "v"}, "mass": [["1"]], "forces": ["-k*q"], "parameters": {"k": 1.0}},
        ),
        "moved_pendulum": (udd.moved_pendulum, {"length": 0.5, "inertia": 0.3}),
        "driven_disk": (udd.driven_disk, {"R": 0.06, "k0": 0.01}),
        "effects.curve": (
            udd.effects.curve,
            {"slot": "torque", "coordinate": "Omega", "low": -8, "high": 8, "coefficients": [0.0] * 6},
        ),
        "effects.formula": (udd.effects.formula, {"slot": "torque", "expression": "a*Omega", "a": 0.1}),
        "effects.surface": (
            udd.effects.surface,
            {"slot": "torque", "coordinates": ("Omega", "Y"), "low": (-8, -1), "high": (8, 1)}
            | {"coefficients": np.zeros((5, 5))},
        ),
        "effects.relaxation": (udd.effects.relaxation, {"b": 1.0, "momentum": "constraint"}),
        "effects.coulomb": (udd.effects.coulomb, {"c": 0.1, "treatment": "smoothed"}),
        "scaled_lorenz": (related_systems.scaled_lorenz, {"w": 1.0, "epsilon": 0.1}),
        "walking_droplet": (related_systems.walking_droplet, {"R": 1.0, "memory": 10.0}),
        "waterwheel": (related_systems.waterwheel, {"inflow": 1.0}),
        **systems,
        **forced,
    }


def _records() -> dict[str, Call]:
    record, fit = _record(), _fit()
    signal = udd.InputSignal([0, 1, 2.0], [0, 1, 2.0])
    return {
        "Measurement": (udd.Measurement, {"t": [0, 1, 2.0], "values": {"theta": [0, 0.1, 0.2]}}),
        "Measurement.slice": (record.slice, {"t0": 0.0, "t1": 1.0}),
        "Measurement.rows": (record.rows, {"mask": [0, 1, 2]}),
        "Measurement.on_rows": (_driven().measurement.on_rows, {"name": "u"}),
        "Measurement.with_meta": (record.with_meta, {"W": 0.1}),
        "Measurement.to_csv": (record.to_csv, {"path": NOWHERE}),
        "Measurement.to_parquet": (record.to_parquet, {"path": NOWHERE}),
        "InputSignal": (udd.InputSignal, {"t": [0, 1, 2.0], "values": [0, 1, 2.0]}),
        "InputSignal.call": (signal.__call__, {"t": 0.5}),
        "InputSignal.shifted": (signal.shifted, {"by": 0.5}),
        "smooth": (udd.smooth, {"measurement": record, "gap": 0.1}),
        "fit": (udd.fit, {"measurement": record, "model": udd.Pendulum(0.5), "free": ["k0"]}),
        "Fit.budget": (fit.budget, {"k": 2.0}),
        "forecast": (udd.forecast, {"measurement": record, "model": fit, "members": 4}),
        "input_bias": (udd.input_bias, {"fit": _driven(), "draws": 2}),
        "Defects": (udd.film.Defects, {}),
        "read_measurement": (udd.read_measurement, {"path": "nosuch.csv"}),
        "load": (udd.load, {"path": "nosuch.udd"}),
        "save": (udd.save, {"result": fit, "path": NOWHERE}),
        "write_config": (udd.tracking.write_config, {"path": NOWHERE, "config": {"fps": 30}}),
        "record": (udd.record, {"path": NOWHERE + ".mp4", "camera": 99, "seconds": 0.1}),
        "TrackOptions": (udd.tracking.TrackOptions, {"disk_radius": 0.08}),
        "render": (
            udd.render,
            {"trajectory": _disk_run(), "path": NOWHERE + ".mp4"},
        ),
    }


def _pictures() -> dict[str, Call]:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    ax, space = Figure().subplots(), Figure().add_subplot(projection="3d")
    points = udd.poincare(udd.DLE(1.0), "z", 20, transient=1, state0=LORENZ)
    first = {
        "branches": _branch(),
        "misfit": _fit(),
        "residuals": _fit(),
        "residual_map": _fit(),
        "orbit": _disk_run(),
        "phase_space": _disk_run(),
        "time_series": _disk_run(),
        "poincare": points,
        "return_map": points,
        "friction": udd.Disk(0.04),
    }
    drawn: dict[str, Call] = {}
    for name, result in first.items():
        function = getattr(udd.plot, name)
        argument = "fit" if isinstance(result, udd.Fit) else "result"
        drawn[f"plot.{name}"] = (function, {argument: result, "ax": space if name == "phase_space" else ax})
    return {**drawn, "plot.geometry": (udd.plot.geometry, {"ax": ax, "R": 0.08, "view": "front"})}
