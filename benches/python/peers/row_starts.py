"""100,000 random starts to t = 100 at rtol 1e-6, two threads: the states at the end."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from peers import problems, udd_rows
from peers.harness import Entry, Row

END = 100.0
COUNT = 100_000


def inspect(answer: Any) -> str:
    """The averages of the exact invariants over the ensemble at the end."""
    states = np.asarray(answer)
    if not np.isfinite(states).all():
        return "some states are not finite"
    # Over the attractor <omega^2> = 1 and <z> = 0.
    for name, values, exact in (("<omega^2>", states[:, 0] ** 2, 1.0), ("<z>", states[:, 2], 0.0)):
        spread = values.std() / np.sqrt(len(values))
        if abs(values.mean() - exact) > 5 * spread:
            return f"{name} = {values.mean():.4f} over the ensemble, not {exact}"
    return ""


def entry(setting: str, finals: Any, note: str = "", least: int = 0) -> Entry:
    """From ``finals(starts, t)``, the states at t."""

    def work(n: int) -> tuple[float, Any]:
        return n * END, finals(problems.random_starts(n), END)

    def probe() -> float:
        return problems.state_error(finals(problems.probe_starts(), problems.SPAN))

    return Entry(setting, work, probe, note, least)


def numba(rtol: float = 1e-6, atol: float = 1e-9) -> Entry:
    from numba import njit, prange

    from peers import dop853
    from peers import numba_scalar as own

    one = own.run_of(dop853.dle, 3, 1, 3)

    @njit(parallel=True, **own.FAST)
    def all_of(starts: Any, end: float, rtol: float, atol: float) -> Any:
        finals = np.empty_like(starts)
        for i in prange(len(starts)):
            y = one((starts[i, 0], starts[i, 1], starts[i, 2]), (1.0,), end, 0.05, rtol, atol)
            finals[i, 0], finals[i, 1], finals[i, 2] = y
        return finals

    all_of(problems.random_starts(4), 1.0, rtol, atol)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", lambda s, t: all_of(s, t, rtol, atol))


def lanes(rtol: float = 1e-6, atol: float = 1e-9) -> Entry:
    from numba import njit

    from peers import dop853, numba_lanes
    from peers.numba_scalar import FAST

    own = numba_lanes.layout(dop853.dle, 3, 1, 3)
    begin = numba_lanes.starter(dop853.dle, 3, 1)
    step, size, width = own.step, own.size, numba_lanes.LANES
    T, STOP, H, MOST = own.t, own.end, own.h, own.most

    @njit(**FAST)
    def share(starts: Any, finals: Any, first: int, end: float, rtol: float, atol: float) -> None:
        """A thread's half of the starts, in lanes."""
        s = np.zeros(size)
        owner = np.full(width, -1)
        upcoming, live = first, width
        while live > 0:
            for lane in range(width):
                if s[T + lane] < s[STOP + lane] or owner[lane] == -2:
                    continue
                if owner[lane] >= 0:
                    for c in range(3):
                        finals[owner[lane], c] = s[c * width + lane]
                if upcoming < len(starts):
                    owner[lane] = upcoming
                    begin(s, lane, (starts[upcoming, 0], starts[upcoming, 1], starts[upcoming, 2]), (1.0,))
                    s[T + lane], s[STOP + lane], s[H + lane], s[MOST + lane] = 0.0, end, 0.05, 5.0
                    upcoming += 2
                else:
                    owner[lane] = -2
                    live -= 1
            step(s, rtol, atol)

    def finals(starts: Any, t: float) -> Any:
        result = np.empty_like(starts)
        with ThreadPoolExecutor(2) as pool:
            for done in [pool.submit(share, starts, result, i, t, rtol, atol) for i in range(2)]:
                done.result()
        return result

    finals(problems.random_starts(4), 1.0)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", finals, least=2000)


def heyoka(tol: float = 3e-5, width: int = 16) -> Entry:
    from peers import heyoka_peer

    def integrator() -> Any:
        ta = heyoka_peer.batch(heyoka_peer.dle(), 3, 1, width, tol)
        ta.pars[:] = 1.0
        return ta

    pair = [integrator(), integrator()]

    def finals(starts: Any, t: float) -> Any:
        result = np.empty_like(starts)

        def share(first: int) -> None:
            ta = pair[first]
            for at in range(first * width, len(starts), 2 * width):
                part = starts[at : at + width]
                ta.set_time(0.0)
                ta.state[:, : len(part)] = part.T
                ta.propagate_until(t)
                result[at : at + width] = ta.state[:, : len(part)].T

        with ThreadPoolExecutor(2) as pool:
            list(pool.map(share, range(2)))
        return result

    return entry(f"Taylor, tol {tol:g}, batches of {width}", finals, least=64)


def diffrax(rtol: float = 1e-6, atol: float = 1e-9) -> Entry:
    from peers import diffrax_peer

    return entry(f"Dopri8, vmap, rtol {rtol:g}, atol {atol:g}", diffrax_peer.finals(rtol, atol), least=256)


def scipy(rtol: float = 1e-6, atol: float = 1e-9) -> Entry:
    final = problems.by_scipy(problems.DLE, rtol, atol)
    note = "one thread: Python does not run in two"
    return entry(
        f"DOP853, rtol {rtol:g}, atol {atol:g}", lambda s, t: np.array([final(start, t) for start in s]), note
    )


def one_by_one(setting: str, final: Any) -> Entry:
    """From ``final(start, t)``, one start after the other."""
    return entry(setting, lambda s, t: np.array([final(start, t) for start in s]), "one thread")


def jitcode(rtol: float = 1e-6, atol: float = 1e-9) -> Entry:
    from peers import jitcode_peer

    return one_by_one(f"dop853, rtol {rtol:g}, atol {atol:g}", jitcode_peer.final(rtol, atol))


def pydiffsol(rtol: float = 1e-6, atol: float = 1e-9) -> Entry:
    from peers import pydiffsol_peer

    return one_by_one(f"tsit45, rtol {rtol:g}, atol {atol:g}", pydiffsol_peer.final(rtol, atol))


def pynamicalsys(rtol: float = 3e-7, atol: float = 3e-10) -> Entry:
    from peers import pynamicalsys_peer

    return one_by_one(f"rk45, rtol {rtol:g}, atol {atol:g}", pynamicalsys_peer.final(rtol, atol))


ROW = Row(
    number=4,
    title="100,000 random starts to t = 100, rtol 1e-6, two threads",
    unit="system-time-units/s",
    path="starts",
    threads=2,
    bound=2e-4,
    error="state at t = 30",
    full=COUNT,
    smallest=32,
    entries={
        "udd": lambda: entry(*udd_rows.starts()),
        "lanes": lanes,
        "heyoka": heyoka,
        "numba": numba,
        "diffrax": diffrax,
        "JiTCODE": jitcode,
        "pydiffsol": pydiffsol,
        "pynamicalsys": pynamicalsys,
        "SciPy": scipy,
    },
    inspect=inspect,
)
