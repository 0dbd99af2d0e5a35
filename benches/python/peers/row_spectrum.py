"""The full Lyapunov spectrum at w = 1, one trajectory at rtol 1e-9, one thread.

The error of a step is that of the state, if a code has such an option: then the exponents over t = 30 are
accurate to 5e-9.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from peers import problems, udd_rows
from peers.harness import Entry, Row

EVERY = 10.0  # time between two reorthonormalisations; the frame shears by a factor 10^6 in it


def inspect(answer: Any) -> str:
    """The exponents against the exact sum, the zero along the flow and the known largest one."""
    exponents, t = np.asarray(answer[0]), answer[1]
    if abs(exponents.sum() + 1.0) > 2e-6:
        return f"the exponents' sum is off by {exponents.sum() + 1:.1g}"
    # The scatter of a mean over the time t, measured over many runs, and the wandering of the frame.
    scatter = 0.25 / np.sqrt(t) + 20.0 / t
    if abs(exponents[0] - 0.2101) > 5 * scatter or abs(exponents[1]) > 5 * scatter:
        return f"exponents {exponents}"
    return ""


def entry(setting: str, run: Any, note: str = "") -> Entry:
    """From ``run(start, t)``: the exponents and the state at t."""

    def work(n: int) -> tuple[float, Any]:
        return n, (run(np.array(problems.START), float(n))[0], n)

    def probe() -> float:
        return problems.state_error(
            np.array([run(start, problems.SPAN)[1] for start in problems.probe_starts()])
        )

    return Entry(setting, work, probe, note)


def orthonormalise(frame: Any, logs: Any) -> None:
    """Gram-Schmidt of the columns in place; the logarithms of their lengths are added to `logs`."""
    for i in range(3):
        for j in range(i):
            dot = frame[0, j] * frame[0, i] + frame[1, j] * frame[1, i] + frame[2, j] * frame[2, i]
            for c in range(3):
                frame[c, i] -= dot * frame[c, j]
        length = np.sqrt(frame[0, i] ** 2 + frame[1, i] ** 2 + frame[2, i] ** 2)
        logs[i] += np.log(length)
        for c in range(3):
            frame[c, i] /= length


def numba(rtol: float = 1e-9, atol: float = 1e-12) -> Entry:
    from numba import njit

    from peers import dop853
    from peers import numba_scalar as own

    system = dop853.dle_tangent(3)
    step, rates = own.step_of(system, 12, 1, 3), own.rates_of(system, 12, 1)
    factor = own.factor
    gram_schmidt = njit(forceinline=True, **own.FAST)(orthonormalise)

    @njit(**own.FAST)
    def run(start: Any, end: float, rtol: float, atol: float) -> Any:
        p = (1.0,)
        y = (start[0], start[1], start[2], 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        k = rates(y, p)
        logs, frame = np.zeros(3), np.empty((3, 3))
        t, h, most, since = 0.0, 0.01, 5.0, 0.0
        while t < end:
            h = min(h, end - t)
            n, kn, err2, _ = step(y, k, h, rtol, atol, p)
            change = factor(err2)
            if err2 < 1.0:
                t += h
                since += h
                y, k = n, kn
                h *= min(most, change)
                most = 5.0
                if since > EVERY or t >= end:
                    for j in range(3):
                        for c in range(3):
                            frame[c, j] = y[3 + 3 * j + c]
                    gram_schmidt(frame, logs)
                    u = frame.T.copy().reshape(9)
                    y = (y[0], y[1], y[2], u[0], u[1], u[2], u[3], u[4], u[5], u[6], u[7], u[8])
                    k = rates(y, p)
                    since = 0.0
            else:
                h *= max(0.2, change)
                most = 1.0
        return logs / end, np.array((y[0], y[1], y[2]))

    run(np.array(problems.START), 1.0, rtol, atol)
    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", lambda start, t: run(start, t, rtol, atol))


def heyoka(tol: float = 1e-7) -> Entry:
    import heyoka as hy
    from numba import njit

    from peers import heyoka_peer

    system = hy.var_ode_sys(heyoka_peer.dle(), hy.var_args.vars, order=1)
    ta = hy.taylor_adaptive(
        system, list(problems.START), pars=[1.0], tol=tol, fast_math=True, **heyoka_peer.OPTIONS
    )
    # The derivatives of x, then y, then z with respect to the initial x, y, z: columns are tangent vectors.
    frame = ta.state[3:].reshape(3, 3)
    gram_schmidt = njit(orthonormalise)

    def run(start: Any, t: float) -> Any:
        logs = np.zeros(3)
        ta.time = 0.0
        ta.state[:3] = start
        frame[:] = np.eye(3)
        pieces = max(1, round(t / EVERY))
        for piece in range(pieces):
            ta.propagate_until(t * (piece + 1) / pieces)
            gram_schmidt(frame, logs)
        return logs / t, ta.state[:3].copy()

    run(np.array(problems.START), 1.0)
    return entry(f"Taylor, var_ode_sys, tol {tol:g}", run)


def jitcode(rtol: float = 9e-9, atol: float = 9e-12) -> Entry:
    from peers import jitcode_peer

    return entry(f"jitcode_lyap, dop853, rtol {rtol:g}", jitcode_peer.spectrum(rtol, atol, EVERY))


def diffrax(rtol: float = 8e-9, atol: float = 8e-12) -> Entry:
    from peers import diffrax_peer

    return entry(f"Dopri8, scan, rtol {rtol:g}", diffrax_peer.spectrum(rtol, atol, EVERY))


def pydiffsol(rtol: float = 8e-9, atol: float = 8e-12) -> Entry:
    from peers import pydiffsol_peer

    return entry(f"tsit45, rtol {rtol:g}", pydiffsol_peer.spectrum(rtol, atol, EVERY))


def pynamicalsys(rtol: float = 3e-10, atol: float = 3e-13) -> Entry:
    from peers import pynamicalsys_peer

    return entry(f"rk45, rtol {rtol:g}", pynamicalsys_peer.spectrum(rtol, atol))


def scipy(rtol: float = 5e-9, atol: float = 5e-12) -> Entry:
    from scipy.integrate import solve_ivp

    def rates(t: float, y: Any) -> Any:
        a, b, c = y[:3]
        u, v, s = y[3:6], y[6:9], y[9:]
        return np.concatenate([problems.dle(t, y), v - u, u * c + a * s, -(u * b + a * v)])

    def run(start: Any, t: float) -> Any:
        logs, state = np.zeros(3), np.concatenate([start, np.eye(3).ravel()])
        pieces = max(1, round(t / EVERY))
        for _ in range(pieces):
            piece = solve_ivp(rates, (0, t / pieces), state, method="DOP853", rtol=rtol, atol=atol)
            state = piece.y[:, -1].copy()
            orthonormalise(state[3:].reshape(3, 3), logs)
        return logs / t, state[:3]

    return entry(f"DOP853, rtol {rtol:g}, atol {atol:g}", run)


ROW = Row(
    number=2,
    title="full Lyapunov spectrum, w = 1, rtol 1e-9, one thread",
    unit="time units/s",
    path="spectrum",
    bound=1.2e-7,
    error="state at t = 30",
    full=5_000_000,
    smallest=100,
    entries={
        "udd": lambda: entry(*udd_rows.spectrum()),
        "numba": numba,
        "heyoka": heyoka,
        "JiTCODE": jitcode,
        "diffrax": diffrax,
        "pydiffsol": pydiffsol,
        "pynamicalsys": pynamicalsys,
        "SciPy": scipy,
    },
    inspect=inspect,
)
