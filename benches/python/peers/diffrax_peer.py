"""diffrax on jax's CPU backend in double precision: whole computations compiled, ensembles by vmap."""

from __future__ import annotations

from typing import Any

import diffrax as dfx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from peers.problems import K0, K1, K2, W

jax.config.update("jax_enable_x64", True)


def dle(t: Any, y: Any, w: Any) -> Any:
    return jnp.stack([y[1] - y[0], y[0] * y[2], w - y[0] * y[1]])


def tangent(t: Any, state: Any, w: Any) -> Any:
    """The state and tangent vectors, the columns of an array."""
    y, frame = state
    return jax.jvp(lambda s: dle(t, s, w), (y,), (y,))[0], jax.vmap(
        lambda u: jax.jvp(lambda s: dle(t, s, w), (y,), (u,))[1], in_axes=1, out_axes=1
    )(frame)


def disk_rates(t: Any, y: Any, _: Any) -> Any:
    k = jnp.maximum(K1 - K2 * jnp.abs(y[0]), K0)
    rate = (9.81 * y[1] - k * y[0] - y[2] * W * y[0]) / (0.0032 + y[1] * y[1] + y[2] * y[2])
    return jnp.stack([rate, y[2] * y[0], W - y[1] * y[0], y[0]])


def solved(rates: Any, start: Any, t: Any, w: Any, rtol: float, atol: float, **more: Any) -> Any:
    """The solution's last state."""
    solution = dfx.diffeqsolve(
        dfx.ODETerm(rates),
        dfx.Dopri8(scan_kind="bounded"),
        0.0,
        t,
        0.01,
        start,
        args=w,
        stepsize_controller=dfx.PIDController(rtol=rtol, atol=atol),
        saveat=dfx.SaveAt(t1=True),
        max_steps=None,
        throw=False,
        **more,
    )
    return jax.tree.map(lambda a: a[-1], solution.ys)


def final(rtol: float, atol: float) -> Any:
    """``final(start, t)``."""
    run = jax.jit(lambda start, t: solved(dle, start, t, 1.0, rtol, atol))
    return lambda start, t: np.asarray(run(jnp.asarray(start), float(t)))


def disk(rtol: float, atol: float) -> Any:
    """``final(start, t)`` of the disk, stepping over its kinks."""
    run = jax.jit(lambda start, t: solved(disk_rates, start, t, None, rtol, atol))
    return lambda start, t: np.asarray(run(jnp.asarray(start, dtype=float), float(t)))


def finals(rtol: float, atol: float) -> Any:
    """``finals(starts, t)``."""
    run = jax.jit(jax.vmap(lambda start, t: solved(dle, start, t, 1.0, rtol, atol), in_axes=(0, None)))
    return lambda starts, t: np.asarray(run(jnp.asarray(starts), float(t)))


def exponents(start: Any, frame: Any, w: Any, span: Any, pieces: int, rtol: float, atol: float) -> Any:
    """Over `pieces` spans: the sums of the logarithms of the frame's stretching, the state and the frame."""

    def piece(carried: Any, _: Any) -> Any:
        (y, own), logs = carried
        y, own = solved(tangent, (y, own), span, w, rtol, atol)
        own, r = jnp.linalg.qr(own)
        return ((y, own), logs + jnp.log(jnp.abs(jnp.diagonal(r)))), None

    (state, own), logs = jax.lax.scan(piece, ((start, frame), jnp.zeros(frame.shape[1])), length=pieces)[0]
    return logs, state, own


def spectrum(rtol: float, atol: float, every: float) -> Any:
    """``run(start, t)``: the exponents and the state at t."""
    most = 100
    many = jax.jit(lambda s, f, span: exponents(s, f, 1.0, span, most, rtol, atol))
    one = jax.jit(lambda s, f, span: exponents(s, f, 1.0, span, 1, rtol, atol))

    def run(start: Any, t: float) -> Any:
        state, frame, logs = jnp.asarray(start), jnp.eye(3), 0.0
        left = max(1, round(t / every))
        span = t / left
        while left > 0:
            own, state, frame = (many if left >= most else one)(state, frame, span)
            logs = logs + np.asarray(own)
            left -= most if left >= most else 1
        return logs / t, np.asarray(state)

    return run


def largest(rtol: float, atol: float) -> Any:
    """``run(w, starts, transient, t)``: the largest exponents and the states at t."""

    def one(w: Any, start: Any, transient: Any, end: Any) -> Any:
        frame = jnp.array([[1.0], [0.0], [0.0]])
        _, state, frame = exponents(start, frame, w, transient, 1, rtol, atol)
        logs, state, _ = exponents(state, frame, w, (end - transient) / 36, 36, rtol, atol)
        return logs[0] / (end - transient), state

    several = jax.jit(jax.vmap(one, in_axes=(0, 0, None, None)))

    def run(w: Any, starts: Any, transient: float, end: float) -> Any:
        result = several(jnp.asarray(w), jnp.asarray(starts), float(transient), float(end))
        return np.asarray(result[0]), np.asarray(result[1])

    return run


def points(rtol: float, atol: float) -> Any:
    """``points(start, n, w=1)``: the first n points on z = 0, z' > 0."""
    section = dfx.Event(lambda t, y, args, **_: y[2], optx.Newton(rtol=1e-13, atol=1e-13), direction=True)

    def point(carried: Any, _: Any) -> Any:
        state, w = carried
        result = solved(dle, state, 1e4, w, rtol, atol, event=section)
        # Past the section, not to be found again.
        return (result.at[2].set(1e-13), w), result

    most = 20
    several = jax.jit(lambda state, w: jax.lax.scan(point, (state, w), length=most))

    def run(start: Any, n: int, w: float = 1.0) -> Any:
        parts, state = [], jnp.asarray(start)
        while len(parts) * most < n:
            (state, _), result = several(state, w)
            parts.append(np.asarray(result))
        return np.concatenate(parts)[:n]

    return run
