"""JiTCODE: symbolic equations compiled to C with its own flags, stepped by SciPy's wrapped dop853."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import chdir
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from peers import problems
from peers.harness import Missing

if shutil.which("gcc") is None and shutil.which("cc") is None:
    raise Missing("JiTCODE needs a C compiler")

import symengine
from jitcode import jitcode, jitcode_lyap, y

w = symengine.Symbol("w")
EQUATIONS = [y(1) - y(0), y(0) * y(2), w - y(0) * y(1)]


def disk_equations() -> list[Any]:
    k = symengine.Max(problems.K1 - problems.K2 * abs(y(0)), problems.K0)
    torque = 9.81 * y(1) - k * y(0) - y(2) * problems.W * y(0)
    rate = torque / (0.0032 + y(1) ** 2 + y(2) ** 2)
    return [rate, y(2) * y(0), problems.W - y(1) * y(0), y(0)]


@cache
def module(kind: str) -> str:
    """The compiled module of a system, in a directory of its own."""
    folder = Path(tempfile.mkdtemp(prefix="peers-jitcode-"))
    if kind == "disk":
        system = jitcode(disk_equations(), n=4, verbose=False)
    elif kind == "plain":
        system = jitcode(EQUATIONS, n=3, control_pars=[w], verbose=False)
    else:
        system = jitcode_lyap(EQUATIONS, n=3, n_lyap=int(kind), control_pars=[w], verbose=False)
    with chdir(folder):  # setuptools would read a project's settings here
        system.compile_C(verbose=False)
        return str(folder / system.save_compiled(f"dle_{kind}.so", overwrite=True))


def solver(kind: str, rtol: float, atol: float) -> Any:
    path = module(kind)
    if kind == "disk":
        system = jitcode(n=4, module_location=path, verbose=False)
    elif kind == "plain":
        system = jitcode(n=3, control_pars=[w], module_location=path, verbose=False)
    else:
        system = jitcode_lyap(n=3, n_lyap=int(kind), control_pars=[w], module_location=path, verbose=False)
    # By default an endless run stops after 10^6 steps; jitcode_lyap sets its own limit.
    limit = {} if kind.isdigit() else {"nsteps": 10**9}
    system.set_integrator("dop853", rtol=rtol, atol=atol, **limit)
    return system


def final(rtol: float, atol: float) -> Any:
    """``final(start, t)``."""
    system = solver("plain", rtol, atol)
    system.set_parameters(1.0)

    def run(start: Any, t: float) -> Any:
        system.set_initial_value(np.asarray(start, dtype=float), 0.0)
        return np.array(system.integrate(t))

    return run


def disk(rtol: float, atol: float) -> Any:
    """``final(start, t)`` of the disk, stepping over its kinks."""
    system = solver("disk", rtol, atol)

    def run(start: Any, t: float) -> Any:
        system.set_initial_value(np.asarray(start, dtype=float), 0.0)
        return np.array(system.integrate(t))

    return run


def spectrum(rtol: float, atol: float, every: float) -> Any:
    """``run(start, t)``: the exponents and the state at t."""
    system = solver("3", rtol, atol)
    system.set_parameters(1.0)

    def run(start: Any, t: float) -> Any:
        system.set_initial_value(np.asarray(start, dtype=float), 0.0)
        pieces = max(1, round(t / every))
        total, state = np.zeros(3), start
        for piece in range(1, pieces + 1):
            state, local, _ = system.integrate(t * piece / pieces)
            total += local if piece > 1 else 0.0  # the vectors it starts from are not orthogonal
        return total / max(1, pieces - 1), np.array(state)

    return run


def largest(rtol: float, atol: float) -> Any:
    """``run(w, starts, transient, t)``: the largest exponents and the states at t."""
    system = solver("1", rtol, atol)

    def one(drive: float, start: Any, transient: float, end: float) -> Any:
        system.set_parameters(drive)
        system.set_initial_value(np.asarray(start, dtype=float), 0.0)
        if transient > 0.0:
            system.integrate(transient)
        total, state = 0.0, start
        pieces = max(1, round((end - transient) / 50.0))
        for piece in range(1, pieces + 1):
            state, local, _ = system.integrate(transient + (end - transient) * piece / pieces)
            total += local[0]
        return total / pieces, np.array(state)

    def run(drives: Any, starts: Any, transient: float, end: float) -> Any:
        results = [one(float(a), s, transient, end) for a, s in zip(drives, starts, strict=True)]
        return np.array([x for x, _ in results]), np.array([s for _, s in results])

    return run
