"""One trajectory at w = 1 and rtol 1e-9: the state at its end."""

from __future__ import annotations

from typing import Any

import numpy as np

from peers import problems, udd_rows
from peers.harness import Entry, Row

BOUND = 1.2e-7  # what DOP853 at rtol 1e-9 leaves at t = 30


def inspect(answer: Any) -> str:
    state = np.asarray(answer)
    return "" if np.isfinite(state).all() and np.abs(state).max() < 30 else f"ends at {state}"


def probe(final: Any) -> float:
    return problems.state_error(np.array([final(start, problems.SPAN) for start in problems.probe_starts()]))


def entry(setting: str, final: Any, note: str = "") -> Entry:
    """From ``final(start, t)``, the state at t."""

    def work(n: int) -> tuple[float, Any]:
        return n, final(np.array(problems.START), float(n))

    return Entry(setting, work, lambda: probe(final), note)


def scipy() -> Entry:
    from scipy.integrate import solve_ivp

    def final(start: Any, t: float) -> Any:
        run = solve_ivp(problems.dle, (0.0, t), start, method="DOP853", rtol=1e-9, atol=1e-12, t_eval=[t])
        return run.y[:, -1]

    return entry("DOP853, rtol 1e-9, atol 1e-12", final)


def numba(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import dop853, numba_scalar

    run = numba_scalar.run_of(dop853.dle, 3, 1, 3)

    def final(start: Any, t: float) -> Any:
        return np.array(run(tuple(start.tolist()), (1.0,), t, 0.01, rtol, atol))

    final(np.array(problems.START), 1.0)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", final)


def heyoka(tol: float = 1e-7, fast_math: bool = True) -> Entry:
    from peers import heyoka_peer

    ta = heyoka_peer.single(heyoka_peer.dle(), 3, [1.0], tol, fast_math)

    def final(start: Any, t: float) -> Any:
        ta.time = 0.0
        ta.state[:] = start
        ta.propagate_until(t)
        return ta.state.copy()

    return entry(f"Taylor, tol {tol:g}" + (", fast math" if fast_math else ""), final)


def jitcode(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import jitcode_peer

    return entry(f"dop853, rtol {rtol:g}, atol {atol:g}", jitcode_peer.final(rtol, atol))


def diffrax(rtol: float = 2e-9, atol: float = 2e-12) -> Entry:
    from peers import diffrax_peer

    return entry(f"Dopri8, rtol {rtol:g}, atol {atol:g}", diffrax_peer.final(rtol, atol))


def pydiffsol(rtol: float = 2e-9, atol: float = 2e-12) -> Entry:
    from peers import pydiffsol_peer

    return entry(f"tsit45, rtol {rtol:g}, atol {atol:g}", pydiffsol_peer.final(rtol, atol))


def pynamicalsys(rtol: float = 3e-10, atol: float = 3e-13) -> Entry:
    from peers import pynamicalsys_peer

    return entry(f"rk45, rtol {rtol:g}, atol {atol:g}", pynamicalsys_peer.final(rtol, atol))


ROW = Row(
    number=1,
    title="one trajectory, w = 1, rtol 1e-9",
    unit="time units/s",
    bound=BOUND,
    error="state at t = 30",
    full=10_000_000,
    smallest=100,
    entries={
        "udd": lambda: entry(*udd_rows.trajectory()),
        "heyoka": heyoka,
        "heyoka, no fast math": lambda: heyoka(fast_math=False),
        "numba": numba,
        "JiTCODE": jitcode,
        "diffrax": diffrax,
        "pydiffsol": pydiffsol,
        "pynamicalsys": pynamicalsys,
        "SciPy": scipy,
    },
    inspect=inspect,
)
