"""The disk with friction at W = 0.039 m/s, the edge ignored, the friction's kinks located, rtol 1e-9."""

from __future__ import annotations

from typing import Any

import numpy as np

from peers import problems, udd_rows
from peers.harness import Entry, Row
from peers.problems import K0, K1, K2, KINK, W

BLIND = "steps over the kinks"


def inspect(answer: Any) -> str:
    state = np.asarray(answer)
    fine = np.isfinite(state).all() and abs(state[0]) < 100 and np.abs(state[1:3]).max() < 0.5
    return "" if fine else f"ends at {state}"


def entry(setting: str, final: Any, note: str = "") -> Entry:
    """From ``final(start, t)``, the state at t."""

    def work(n: int) -> tuple[float, Any]:
        return n, final(np.array(problems.DISK_START), float(n))

    def probe() -> float:
        return problems.disk_error(
            np.array([final(start, problems.DISK_SPAN) for start in problems.disk_starts()])
        )

    return Entry(setting, work, probe, note)


def numba(rtol: float = 9e-10, atol: float = 9e-13) -> Entry:
    from numba import njit

    from peers import dop853
    from peers import numba_scalar as own

    step, rates = own.step_of(dop853.disk, 4, 3, 4), own.rates_of(dop853.disk, 4, 3)
    dense = own.dense_of(dop853.disk, 4, 3)
    factor, crossing = own.factor, own.crossing

    @njit(**own.FAST)
    def law(Omega: float) -> Any:
        if abs(Omega) >= KINK:
            return (W, K0, 0.0)
        return (W, K1, -K2 if Omega > 0.0 else K2)

    @njit(**own.FAST)
    def passed(old: float, new: float) -> float:
        """The first kink on the way from one Omega to another, or nan."""
        if old < new:
            for kink in (-KINK, 0.0, KINK):
                if old < kink <= new:
                    return kink
        else:
            for kink in (KINK, 0.0, -KINK):
                if new <= kink < old:
                    return kink
        return 1e300

    @njit(**own.FAST)
    def run(y: Any, end: float, rtol: float, atol: float) -> Any:
        p = law(y[0])
        k = rates(y, p)
        t, h, most = 0.0, 1e-3, 5.0
        while t < end:
            h = min(h, end - t)
            n, kn, err2, stages = step(y, k, h, rtol, atol, p)
            change = factor(err2)
            if err2 < 1.0:
                wished = h * min(most, change)
                kink = passed(y[0], n[0])
                if kink < 1e299:
                    # Land on the kink: a step of its own of the right length, then the law beyond.
                    x = crossing(dense(y, k, n, kn, stages, h, p)[0], kink)
                    if x < 1e-6:  # off the kink and back to it within the step
                        h *= 0.5
                        continue
                    h *= x
                    n, kn, _, _ = step(y, k, h, rtol, atol, p)
                    n = (kink + (4e-16 if kn[0] > 0.0 else -4e-16), n[1], n[2], n[3])
                    p = law(n[0])
                    kn = rates(n, p)
                t += h
                y, k = n, kn
                h = wished
                most = 5.0
            else:
                h *= max(0.2, change)
                most = 1.0
        return y

    def final(start: Any, t: float) -> Any:
        return np.array(run(tuple(float(c) for c in start), t, rtol, atol))

    final(problems.DISK_START, 1.0)
    return entry(f"DOP853, kinks located, rtol {rtol:g}, atol {atol:g}", final)


def heyoka(tol: float = 1e-8) -> Entry:
    import heyoka as hy

    from peers import heyoka_peer

    Omega, Y, Z, beta = hy.make_vars("Omega", "Y", "Z", "beta")
    k = hy.par[0] + hy.par[1] * Omega
    rate = (9.81 * Y - k * Omega - Z * W * Omega) / (0.0032 + Y * Y + Z * Z)
    equations = [(Omega, rate), (Y, Z * Omega), (Z, W - Y * Omega), (beta, Omega)]

    def at(kink: float) -> Any:
        def switch(ta: Any, sign: int) -> bool:
            ta.pars[:] = problems.branch(kink + sign * 1e-12)
            return True

        return hy.t_event(Omega - kink, callback=switch)

    ta = heyoka_peer.single(equations, 4, [K0, 0.0], tol, t_events=[at(kink) for kink in (-KINK, 0.0, KINK)])

    def final(start: Any, t: float) -> Any:
        ta.reset_cooldowns()
        ta.time = 0.0
        ta.state[:] = start
        ta.pars[:] = problems.branch(float(start[0]))
        ta.propagate_until(t)
        return ta.state.copy()

    return entry(f"Taylor, t_event, tol {tol:g}", final)


def scipy(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    return entry(
        f"DOP853, events, rtol {rtol:g}", lambda start, t: problems.disk_pieces(start, t, rtol, atol)
    )


def numba_blind(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from numba import njit

    from peers import dop853
    from peers import numba_scalar as own

    def equations(y: Any, p: Any) -> list[str]:
        k = f"max({K1} - {K2} * abs({y[0]}), {K0})"
        return dop853.disk(y, [p[0], k, "0.0"])

    step, rates = own.step_of(equations, 4, 1, 4), own.rates_of(equations, 4, 1)
    factor = own.factor

    @njit(**own.FAST)
    def run(y: Any, end: float, rtol: float, atol: float) -> Any:
        p = (W,)
        k = rates(y, p)
        t, h, most = 0.0, 1e-3, 5.0
        while t < end:
            h = min(h, end - t)
            n, kn, err2, _ = step(y, k, h, rtol, atol, p)
            change = factor(err2)
            if err2 < 1.0:
                t += h
                y, k = n, kn
                h *= min(most, change)
                most = 5.0
            else:
                h *= max(0.2, change)
                most = 1.0
        return y

    def final(start: Any, t: float) -> Any:
        return np.array(run(tuple(float(c) for c in start), t, rtol, atol))

    final(problems.DISK_START, 1.0)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", final, BLIND)


def jitcode(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import jitcode_peer

    return entry(f"dop853, rtol {rtol:g}", jitcode_peer.disk(rtol, atol), BLIND)


def diffrax(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import diffrax_peer

    return entry(f"Dopri8, rtol {rtol:g}", diffrax_peer.disk(rtol, atol), BLIND)


def pydiffsol(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import pydiffsol_peer

    return entry(f"tsit45, rtol {rtol:g}", pydiffsol_peer.disk(rtol, atol), BLIND)


def pynamicalsys(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from peers import pynamicalsys_peer

    return entry(f"rk45, rtol {rtol:g}", pynamicalsys_peer.disk(rtol, atol), BLIND)


ROW = Row(
    number=7,
    title="disk with friction, W = 0.039 m/s, kinks located, rtol 1e-9",
    unit="model s/s",
    bound=1.2e-6,
    error="state after 8 s",
    full=1_000_000,
    smallest=20,
    entries={
        "udd": lambda: entry(*udd_rows.disk()),
        "heyoka": heyoka,
        "numba": numba,
        "numba, blind": numba_blind,
        "JiTCODE": jitcode,
        "diffrax": diffrax,
        "pydiffsol": pydiffsol,
        "pynamicalsys": pynamicalsys,
        "SciPy": scipy,
    },
    inspect=inspect,
)
