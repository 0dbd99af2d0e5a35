"""pydiffsol: equations in DiffSL, compiled by its LLVM, stepped by diffsol's Tsitouras 5(4)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pydiffsol as ds

from peers import problems

DLE = """
in_i { w = 1, x0 = 1, y0 = 1, z0 = 0.01 }
u_i { x = x0, y = y0, z = z0 }
F_i { y - x, x * z, w - x * y }
"""

FRAME = "abcdefghi"  # the components of up to three tangent vectors


def tangent_code(vectors: int) -> str:
    """The equations with tangent vectors, one after the other."""
    frame = FRAME[: 3 * vectors]
    inputs = ", ".join(f"{c}0 = 0" for c in frame)
    states = ", ".join(f"{c} = {c}0" for c in frame)
    rates = ", ".join(
        f"{u[1]} - {u[0]}, {u[0]} * z + x * {u[2]}, 0.0 - ({u[0]} * y + x * {u[1]})"
        for u in (frame[i : i + 3] for i in range(0, len(frame), 3))
    )
    return (
        f"in_i {{ w = 1, x0 = 1, y0 = 1, z0 = 0, {inputs} }}\nu_i {{ x = x0, y = y0, z = z0, {states} }}\n"
        f"F_i {{ y - x, x * z, w - x * y, {rates} }}\n"
    )


DISK = f"""
in_i {{ p0 = 1, q0 = 1, r0 = 1, s0 = 1 }}
u_i {{ p = p0, q = q0, r = r0, s = s0 }}
k {{ max({problems.K1} - {problems.K2} * abs(p), {problems.K0}) }}
F_i {{ (9.81 * q - k * p - r * {problems.W} * p) / (0.0032 + q * q + r * r), r * p, {problems.W} - q * p, p }}
"""


def system(code: str, rtol: float, atol: float) -> Any:
    ode = ds.Ode(code, matrix_type=ds.nalgebra_dense, ode_solver=ds.tsit45)
    ode.rtol, ode.atol = rtol, atol
    return ode


def final(rtol: float, atol: float) -> Any:
    """``final(start, t)``."""
    ode = system(DLE, rtol, atol)
    return lambda start, t: ode.solve_dense(np.array([1.0, *start]), np.array([t])).ys[:, -1]


def disk(rtol: float, atol: float) -> Any:
    """``final(start, t)`` of the disk, stepping over its kinks."""
    ode = system(DISK, rtol, atol)
    return lambda start, t: ode.solve_dense(np.array([*map(float, start)]), np.array([t])).ys[:, -1]


def spectrum(rtol: float, atol: float, every: float) -> Any:
    """``run(start, t)``: the exponents and the state at t."""
    ode = system(tangent_code(3), rtol, atol)

    def run(start: Any, t: float) -> Any:
        logs, state, frame = np.zeros(3), np.array(start), np.eye(3)
        pieces = max(1, round(t / every))
        span = np.array([t / pieces])
        for _ in range(pieces):
            end = ode.solve_dense(np.concatenate([[1.0], state, frame.T.ravel()]), span).ys[:, -1]
            state = end[:3]
            frame, r = np.linalg.qr(end[3:].reshape(3, 3).T)
            logs += np.log(np.abs(np.diag(r)))
        return logs / t, state

    return run


def largest(rtol: float, atol: float) -> Any:
    """``run(w, starts, transient, t)``: the largest exponents and the states at t."""
    ode = system(tangent_code(1), rtol, atol)

    def one(w: float, start: Any, transient: float, end: float) -> Any:
        pieces = max(1, round((end - transient) / 50.0))
        spans = [transient] * (transient > 0.0) + [(end - transient) / pieces] * pieces
        logs, state = 0.0, np.array([*start, 1.0, 0.0, 0.0])
        for i, span in enumerate(spans):
            state = ode.solve_dense(np.array([w, *state]), np.array([span])).ys[:, -1].copy()
            length = np.linalg.norm(state[3:])
            state[3:] /= length
            logs += np.log(length) if i > 0 or transient <= 0.0 else 0.0
        return logs / (end - transient), state[:3]

    def run(w: Any, starts: Any, transient: float, end: float) -> Any:
        results = [one(float(a), s, transient, end) for a, s in zip(w, starts, strict=True)]
        return np.array([x for x, _ in results]), np.array([s for _, s in results])

    return run


def points(rtol: float, atol: float) -> Any:
    """``points(start, n, w=1)``: the first n points on z = 0, z' > 0."""
    ode = system(DLE + "stop { z }\n", rtol, atol)
    horizon = np.array([1e4])

    def run(start: Any, n: int, w: float = 1.0) -> Any:
        results: list[Any] = []
        state = np.array(start, dtype=float)
        while len(results) < n:
            state = ode.solve_dense(np.array([w, *state]), horizon).ys[:, -1].copy()
            up = w - state[0] * state[1] > 0.0
            if up:
                results.append(state.copy())
            state[2] = 1e-13 if up else -1e-13  # past the surface, not to be found again
        return np.array(results)

    return run
