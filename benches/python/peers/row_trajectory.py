"""One trajectory at w = 1 and rtol 1e-9: the state at its end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from peers import problems, udd_rows
from peers.harness import Entry, Row
from peers.problems import Flow

BOUND = 1.2e-7  # what DOP853 at rtol 1e-9 leaves at t = 30


def bounded(flow: Flow) -> Callable[[Any], str]:
    """Return the error of a state at the end."""

    def inspect(answer: Any) -> str:
        state = np.asarray(answer)
        good = np.isfinite(state).all() and np.abs(state).max() < flow.size
        return "" if good else f"ends at {state}"

    return inspect


def entry(setting: str, final: Any, note: str = "", flow: Flow = problems.DLE) -> Entry:
    """From ``final(start, t)``, the state at t."""

    def work(n: int) -> tuple[float, Any]:
        return n, final(np.array(flow.start), float(n))

    def probe() -> float:
        ends = [final(start, flow.span) for start in problems.probe_starts(flow)]
        return problems.state_error(ends, flow)

    return Entry(setting, work, probe, note)


def scipy(flow: Flow = problems.DLE) -> Entry:
    return entry("DOP853, rtol 1e-9, atol 1e-12", problems.by_scipy(flow, 1e-9, 1e-12), flow=flow)


def numba(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import dop853, numba_scalar

    return entry(*numba_scalar.final(dop853.dle, problems.DLE.parameters, rtol, atol))


def heyoka(tol: float = 1e-7, fast_math: bool = True) -> Entry:
    from peers import heyoka_peer

    return entry(*heyoka_peer.final(heyoka_peer.dle(), [1.0], tol, fast_math))


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
    path="trajectory",
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
    inspect=bounded(problems.DLE),
)
