"""The largest exponent at 1000 drives, from 0.05 to 10, to t = 2000 at rtol 1e-6, two threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from peers import problems, udd_rows
from peers.harness import Entry, Row

END, TRANSIENT = 2000.0, 200.0
COUNT = 1000
KNOWN = {1.0: 0.2101, 3.4693: 0.3080}  # physics; both chaotic


def drives(n: int) -> Any:
    """Every (1000/n)-th drive, so that a slow code sees the same mixture."""
    return problems.DRIVES[((np.arange(n) + 0.5) * COUNT / n).astype(int)]


def inspect(answer: Any) -> str:
    """Exponents of bounded motion; chaos and order where they are known to be."""
    w, exponents = np.asarray(answer[0]), np.asarray(answer[1])
    if not np.isfinite(exponents).all() or exponents.min() < -0.05 or exponents.max() > 0.36:
        return f"exponents from {exponents.min():.3g} to {exponents.max():.3g}"
    ordered, chaotic = exponents[w > 8.0], exponents[(w > 0.6) & (w < 3.3)]
    # Above w = 8 the attractor is a cycle; between 0.6 and 3.3 nearly all is chaos, with mean exponent 0.22.
    if len(ordered) > 3 and abs(np.median(ordered)) > 5e-3:
        return f"exponents {np.median(ordered):.3g} where the attractor is a cycle"
    if len(chaotic) > 10 and not 0.15 < np.median(chaotic) < 0.3:
        return f"exponents {np.median(chaotic):.3g} where it is chaotic"
    return ""


def entry(setting: str, run: Any, note: str = "", least: int = 0) -> Entry:
    """From ``run(w, starts, transient, t)``: the exponents and the states at t."""

    def work(n: int) -> tuple[float, Any]:
        w = drives(n)
        starts = np.tile(problems.START, (n, 1))
        return n * END, (w, run(w, starts, TRANSIENT, END)[0])

    def probe() -> float:
        starts = problems.probe_starts()
        return problems.state_error(run(np.ones(len(starts)), starts, 0.0, problems.SPAN)[1])

    return Entry(setting, work, probe, note, least)


def numba(rtol: float = 1e-6, atol: float = 1e-9) -> Entry:
    from numba import njit, prange

    from peers import dop853
    from peers import numba_scalar as own

    system = dop853.dle_tangent(1)
    step, rates = own.step_of(system, 6, 1, 3), own.rates_of(system, 6, 1)
    factor = own.factor

    @njit(**own.FAST)
    def one(w: float, start: Any, transient: float, end: float, rtol: float, atol: float) -> Any:
        p = (w,)
        y = (start[0], start[1], start[2], 1.0, 0.0, 0.0)
        k = rates(y, p)
        t, h, most, logs, skipped = 0.0, 0.05, 5.0, 0.0, transient <= 0.0
        while t < end:
            h = min(h, (end if skipped else transient) - t)
            n, kn, err2, _ = step(y, k, h, rtol, atol, p)
            change = factor(err2)
            if err2 < 1.0:
                t += h
                y, k = n, kn
                h *= min(most, change)
                most = 5.0
                size = y[3] * y[3] + y[4] * y[4] + y[5] * y[5]
                over = not skipped and t >= transient
                if size > 1e20 or over or t >= end:
                    logs += 0.5 * np.log(size)
                    scale = 1.0 / np.sqrt(size)
                    y = (y[0], y[1], y[2], y[3] * scale, y[4] * scale, y[5] * scale)
                    k = (k[0], k[1], k[2], k[3] * scale, k[4] * scale, k[5] * scale)
                    if over:
                        logs, skipped, h = 0.0, True, 0.05
            else:
                h *= max(0.2, change)
                most = 1.0
        return logs / (end - transient), (y[0], y[1], y[2])

    @njit(parallel=True, **own.FAST)
    def run(w: Any, starts: Any, transient: float, end: float, rtol: float, atol: float) -> Any:
        exponents, finals = np.empty(len(w)), np.empty((len(w), 3))
        for i in prange(len(w)):
            exponents[i], y = one(w[i], starts[i], transient, end, rtol, atol)
            finals[i, 0], finals[i, 1], finals[i, 2] = y
        return exponents, finals

    run(np.ones(2), np.ones((2, 3)), 1.0, 2.0, rtol, atol)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", lambda *given: run(*given, rtol, atol))


def lanes(rtol: float = 1e-6, atol: float = 1e-9) -> Entry:
    from numba import njit

    from peers import dop853, numba_lanes
    from peers.numba_scalar import FAST

    system = dop853.dle_tangent(1)
    own = numba_lanes.layout(system, 6, 1, 3)
    begin = numba_lanes.starter(system, 6, 1)
    step, size, width = own.step, own.size, numba_lanes.LANES
    T, STOP, H, MOST = own.t, own.end, own.h, own.most

    @njit(**FAST)
    def rescaled(s: Any, lane: int) -> float:
        """The logarithm of the tangent vector's length, which becomes 1."""
        length = np.sqrt(s[3 * width + lane] ** 2 + s[4 * width + lane] ** 2 + s[5 * width + lane] ** 2)
        for c in (3, 4, 5, 9, 10, 11):  # the vector and its rates
            s[c * width + lane] /= length
        return np.log(length)

    @njit(**FAST)
    def share(
        w: Any,
        starts: Any,
        first: int,
        transient: float,
        end: float,
        rtol: float,
        atol: float,
        out: Any,
        finals: Any,
    ) -> None:
        s = np.zeros(size)
        logs, owner, upcoming, live, count = np.zeros(width), np.full(width, -1), first, width, 0
        while live > 0:
            count += 1
            for lane in range(width):
                if owner[lane] >= 0 and count % 64 == 0:
                    logs[lane] += rescaled(s, lane)
                if s[T + lane] < s[STOP + lane] or owner[lane] == -2:
                    continue
                if owner[lane] >= 0:
                    logs[lane] += rescaled(s, lane)
                    if s[STOP + lane] < end:
                        logs[lane], s[STOP + lane], s[H + lane] = 0.0, end, 0.05
                        continue
                    out[owner[lane]] = logs[lane] / (end - transient)
                    for c in range(3):
                        finals[owner[lane], c] = s[c * width + lane]
                if upcoming < len(w):
                    i = upcoming
                    owner[lane], logs[lane] = i, 0.0
                    begin(s, lane, (starts[i, 0], starts[i, 1], starts[i, 2], 1.0, 0.0, 0.0), (w[i],))
                    s[T + lane], s[H + lane], s[MOST + lane] = 0.0, 0.05, 5.0
                    s[STOP + lane] = transient if transient > 0.0 else end
                    upcoming += 2
                else:
                    owner[lane] = -2
                    live -= 1
            step(s, rtol, atol)

    def run(w: Any, starts: Any, transient: float, end: float) -> Any:
        out, finals = np.empty(len(w)), np.empty((len(w), 3))
        with ThreadPoolExecutor(2) as pool:
            work = (transient, end, rtol, atol, out, finals)
            for done in [pool.submit(share, w, starts, i, *work) for i in range(2)]:
                done.result()
        return out, finals

    run(np.ones(2), np.ones((2, 3)), 1.0, 2.0)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", run, least=COUNT)


def heyoka(tol: float = 3e-5, width: int = 16) -> Entry:
    from peers import heyoka_peer

    pair = [heyoka_peer.batch(heyoka_peer.dle_tangent(), 6, 1, width, tol) for _ in range(2)]

    def run(w: Any, starts: Any, transient: float, end: float) -> Any:
        out, finals = np.empty(len(w)), np.empty((len(w), 3))
        pieces = max(1, round((end - transient) / 100.0))

        def share(first: int) -> None:
            ta = pair[first]
            for at in range(first * width, len(w), 2 * width):
                n = len(w[at : at + width])
                ta.set_time(0.0)
                ta.pars[0, :n] = w[at : at + n]
                ta.state[:3, :n] = starts[at : at + n].T
                ta.state[3:] = [[1.0], [0.0], [0.0]]
                if transient > 0.0:
                    ta.propagate_until(transient)
                    ta.state[3:] /= np.linalg.norm(ta.state[3:], axis=0)
                logs = np.zeros(width)
                for piece in range(1, pieces + 1):
                    ta.propagate_until(transient + (end - transient) * piece / pieces)
                    length = np.linalg.norm(ta.state[3:], axis=0)
                    ta.state[3:] /= length
                    logs += np.log(length)
                out[at : at + n] = logs[:n] / (end - transient)
                finals[at : at + n] = ta.state[:3, :n].T

        with ThreadPoolExecutor(2) as pool:
            list(pool.map(share, range(2)))
        return out, finals

    return entry(f"Taylor, tol {tol:g}, batches of {width}", run, least=64)


def diffrax(rtol: float = 1e-5, atol: float = 1e-8) -> Entry:
    from peers import diffrax_peer

    return entry(f"Dopri8, vmap, rtol {rtol:g}", diffrax_peer.largest(rtol, atol), least=16)


def jitcode(rtol: float = 5e-6, atol: float = 5e-9) -> Entry:
    from peers import jitcode_peer

    return entry(f"jitcode_lyap, dop853, rtol {rtol:g}", jitcode_peer.largest(rtol, atol), "one thread")


def pydiffsol(rtol: float = 3e-6, atol: float = 3e-9) -> Entry:
    from peers import pydiffsol_peer

    return entry(f"tsit45, rtol {rtol:g}", pydiffsol_peer.largest(rtol, atol), "one thread")


def pynamicalsys(rtol: float = 2e-7, atol: float = 2e-10) -> Entry:
    from peers import pynamicalsys_peer

    return entry(f"rk45, rtol {rtol:g}", pynamicalsys_peer.largest(rtol, atol), "one thread")


def scipy(rtol: float = 4e-6, atol: float = 4e-9) -> Entry:
    from scipy.integrate import solve_ivp

    def one(w: float, start: Any, transient: float, end: float) -> Any:
        logs, state, t = 0.0, np.array([*start, 1.0, 0.0, 0.0]), 0.0
        while t < end:
            stop = min(end, t + 50.0) if t >= transient else transient
            piece = solve_ivp(
                problems.dle_tangent, (t, stop), state, method="DOP853", rtol=rtol, atol=atol, args=(w,)
            )
            state = piece.y[:, -1].copy()
            length = np.linalg.norm(state[3:])
            state[3:] /= length
            logs += np.log(length) if t >= transient else 0.0
            t = stop
        return logs / (end - transient), state[:3]

    def run(w: Any, starts: Any, transient: float, end: float) -> Any:
        results = [one(float(a), start, transient, end) for a, start in zip(w, starts, strict=True)]
        return np.array([x for x, _ in results]), np.array([y for _, y in results])

    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", run, "one thread: Python does not run in two")


ROW = Row(
    number=3,
    title="largest exponent at 1000 drives to t = 2000, rtol 1e-6, two threads",
    unit="system-time-units/s",
    path="exponents",
    threads=2,
    bound=2e-4,
    error="state at t = 30",
    full=COUNT,
    smallest=1,
    entries={
        "udd": lambda: entry(*udd_rows.sweep()),
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
