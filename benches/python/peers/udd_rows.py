"""udd's own rows."""

from __future__ import annotations

from typing import Any

import numpy as np

from peers.harness import Missing


def trajectory() -> tuple[str, Any]:
    """The setting, and ``final(start, t)``."""
    import udd

    model = udd.DLE(1.0)

    def final(start: Any, t: float) -> Any:
        return udd.simulate(model, np.array([0.0, t]), start, rtol=1e-9, atol=1e-12, method="dopri5").state[
            -1
        ]

    return "dopri5, rtol 1e-9, atol 1e-12", final


def starts() -> tuple[str, Any]:
    """The setting, and ``finals(starts, t)``."""
    raise Missing("udd has no ensembles yet")


def spectrum() -> tuple[str, Any]:
    """The setting, and ``run(start, t)``: the exponents and the state at t."""
    raise Missing("udd has no spectra yet")


def sweep() -> tuple[str, Any]:
    """The setting, and ``run(w, starts, transient, t)``: the exponents and the states at t."""
    raise Missing("udd has no sweeps on a given number of threads yet")


def section() -> tuple[str, Any]:
    """The setting, and ``points(start, n)``."""
    import udd

    model = udd.DLE(1.0)

    def points(start: Any, n: int) -> Any:
        return udd.poincare(model, "z", n, state0=start, transient=0, threads=1).state

    return "Taylor, rtol 1e-9, atol 1e-12", points


def bifurcation() -> tuple[str, Any]:
    """The setting, and ``run(w, starts, transient, kept)``: points, shape (len(w), kept, 3)."""
    raise Missing("udd has no bifurcation diagrams yet")


def disk() -> tuple[str, Any]:
    """The setting, and ``final(start, t)``."""
    import udd
    from peers import problems

    model = udd.Disk(problems.W, edge="ignore")

    def final(start: Any, t: float) -> Any:
        return udd.simulate(model, np.array([0.0, t]), start, rtol=1e-9, atol=1e-12, method="dopri5").state[
            -1
        ]

    return "dopri5, rtol 1e-9, atol 1e-12", final
