"""heyoka.py, as its authors write it: compact mode and high accuracy off, fast math, batches for SIMD."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

Equations = list[tuple[Any, Any]]

OPTIONS = {"compact_mode": False, "high_accuracy": False}


def dle() -> Equations:
    x, y, z = hy.make_vars("x", "y", "z")
    return [(x, y - x), (y, x * z), (z, hy.par[0] - x * y)]


def lorenz() -> Equations:
    """Lorenz's equations of 1963."""
    x, y, z = hy.make_vars("x", "y", "z")
    sigma, rho, beta = hy.par[0], hy.par[1], hy.par[2]
    return [(x, sigma * (y - x)), (y, x * (rho - z) - y), (z, x * y - beta * z)]


def dle_tangent() -> Equations:
    """With one tangent vector after the state."""
    x, y, z = hy.make_vars("x", "y", "z")
    u, v, s = hy.make_vars("u", "v", "s")
    return [*dle(), (u, v - u), (v, u * z + x * s), (s, -(u * y + x * v))]


def single(
    equations: Equations, dim: int, parameters: list[float], tol: float, fast_math: bool = True, **more: Any
) -> Any:
    """An integrator of one trajectory."""
    return hy.taylor_adaptive(
        equations, [0.0] * dim, pars=parameters, tol=tol, fast_math=fast_math, **OPTIONS, **more
    )


def batch(equations: Equations, dim: int, parameters: int, width: int, tol: float, **more: Any) -> Any:
    """An integrator of `width` trajectories in step."""
    return hy.taylor_adaptive_batch(
        equations,
        np.zeros((dim, width)),
        pars=np.zeros((parameters, width)),
        tol=tol,
        fast_math=True,
        **OPTIONS,
        **more,
    )


def final(
    equations: Equations, parameters: list[float], tol: float, fast_math: bool = True
) -> tuple[str, Callable[[Any, float], Any]]:
    """The setting, and ``final(start, t)``: the state at t of one trajectory of three equations."""
    ta = single(equations, 3, parameters, tol, fast_math)

    def run(start: Any, t: float) -> Any:
        ta.time = 0.0
        ta.state[:] = start
        ta.propagate_until(t)
        return ta.state.copy()

    return f"Taylor, tol {tol:g}" + (", fast math" if fast_math else ""), run
