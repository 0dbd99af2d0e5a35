"""udd's own rows. The tolerances are those that just meet each row's bound, as for the peers."""

from __future__ import annotations

from typing import Any

import numpy as np


def final_of(model: Any, rtol: float) -> tuple[str, Any]:
    """The setting, and ``final(start, t)``: the state at t of one trajectory."""
    import udd

    def final(start: Any, t: float) -> Any:
        times = np.array([0.0, t])
        return udd.simulate(model, times, start, rtol=rtol, atol=1e-3 * rtol, method="taylor").state[-1]

    return f"Taylor, rtol {rtol:g}", final


def trajectory(rtol: float = 1.4e-9) -> tuple[str, Any]:
    """The setting, and ``final(start, t)``."""
    import udd

    return final_of(udd.DLE(1.0), rtol)


def starts(rtol: float = 7.3e-6) -> tuple[str, Any]:
    """The setting, and ``finals(starts, t)``."""
    import udd

    model = udd.DLE(1.0)

    def finals(starts: Any, t: float) -> Any:
        return udd.ensemble(model, t, starts, rtol=rtol, atol=1e-3 * rtol, method="taylor", threads=2).end

    return f"Taylor, rtol {rtol:g}", finals


def spectrum(rtol: float = 2.8e-8) -> tuple[str, Any]:
    """The setting, and ``run(start, t)``: the exponents and the state at t."""
    import udd
    from udd import _core
    from udd.simulation.batch import Batch

    model, row = udd.DLE(1.0), np.array([[1.0, 0.0]])

    def run(start: Any, t: float) -> Any:
        # The call of udd.lyapunov_spectrum, for a given time without a transient.
        exponents = _core.lyapunov(Batch(model, row, start[None], rtol, 1e-3 * rtol), True, t, 0.0, 0.0)
        return exponents["value"][0], exponents["end"][0]

    return f"Taylor, rtol {rtol:g}", run


def sweep(rtol: float = 3.9e-5) -> tuple[str, Any]:
    """The setting, and ``run(w, starts, transient, t)``: the exponents and the states at t."""
    import udd
    from udd import _core
    from udd.simulation.batch import Batch

    model = udd.DLE(1.0)

    def run(w: Any, starts: Any, transient: float, t: float) -> Any:
        # The call of udd.lyapunov, from given starts.
        rows = np.column_stack([w, np.zeros(len(w))])
        batch = Batch(model, rows, starts, rtol, 1e-3 * rtol, threads=2)
        exponents = _core.lyapunov(batch, False, t, transient, 0.0)
        return exponents["value"][:, 0], exponents["end"]

    return f"Taylor, rtol {rtol:g}", run


def section(rtol: float = 2.8e-9) -> tuple[str, Any]:
    """The setting, and ``points(start, n)``."""
    import udd

    model = udd.DLE(1.0)

    def points(start: Any, n: int) -> Any:
        return udd.poincare(
            model, "z", n, state0=start, transient=0, rtol=rtol, atol=1e-3 * rtol, threads=1
        ).state

    return f"Taylor, rtol {rtol:g}", points


def bifurcation(rtol: float = 2.8e-9) -> tuple[str, Any]:
    """The setting, and ``run(w, starts, transient, kept)``: points, shape (len(w), kept, 3)."""
    import udd

    model = udd.DLE(1.0)

    def run(w: Any, starts: Any, transient: int, kept: int) -> Any:
        return udd.poincare(
            model,
            "z",
            kept,
            state0=starts,
            parameters={"w": w},
            transient=transient,
            rtol=rtol,
            atol=1e-3 * rtol,
            threads=2,
        ).state

    return f"Taylor, rtol {rtol:g}", run


def disk(rtol: float = 3e-9) -> tuple[str, Any]:
    """The setting, and ``final(start, t)``."""
    import udd
    from peers import problems

    return final_of(udd.Disk(problems.W, edge="ignore"), rtol)


def own_model(rtol: float = 2e-9) -> tuple[str, Any]:
    """The setting, and ``final(start, t)``."""
    import udd
    from peers.problems import BETA, RHO, SIGMA

    model = udd.Model(
        ["x", "y", "z"],
        ["sigma*(y - x)", "x*(rho - z) - y", "x*y - beta*z"],
        {"sigma": SIGMA, "rho": RHO, "beta": BETA},
    )
    return final_of(model, rtol)
