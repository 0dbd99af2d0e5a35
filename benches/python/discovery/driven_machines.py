"""Simulated machines with a measured input, their sensors quantised and the input's sensor slow.

SciPy integrates them; dry friction is set-valued: a machine stops where it reverses, rests as long as
friction holds it against its input, and starts again. No code of udd's models is used but to state what is
known.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from machines import RTOL, G, Kind, Machine, Sensor
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.signal import lfilter

import udd

#: A force, as a function of time, coordinate and speed.
Force = Callable[[float, float, float], float]

_SHORTEST = 1e-5  # s, of a swing from rest to rest: a shorter one moves nothing


def waves(
    rng: np.random.Generator, lowest: float, highest: float, many: int = 6
) -> Callable[..., np.ndarray]:
    """A drawn drive of r.m.s. 1: some waves between two frequencies [Hz]."""
    f, phase = rng.uniform(lowest, highest, many), rng.uniform(0, 2 * np.pi, many)
    size = rng.uniform(0.5, 1.0, many)
    size *= np.sqrt(2 / (size**2).sum())

    def drive(t: Any) -> Any:
        return np.sin(np.multiply.outer(t, 2 * np.pi * f) + phase) @ size

    return drive


def slow(values: np.ndarray, step: float, lag: float) -> np.ndarray:
    """Filter samples by a sensor of first order."""
    keep = np.exp(-step / lag)
    return np.asarray(lfilter([1 - keep], [1, -keep], values, zi=[keep * values[0]])[0])


def arm(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """A motor's arm in the gravity field, its torque measured; it is known but for its friction."""
    J, weight, viscous = rng.uniform(0.03, 0.1), rng.uniform(0.5, 1.5), rng.uniform(0.02, 0.06)
    push = weight * rng.uniform(0.5, 0.9)
    drive = waves(rng, 0.15, 1.2)
    speed = push / np.sqrt(J * weight)  # rad/s, about
    dry = 0.15 * push * rng.uniform(0.6, 1.4) if "dry" in lacks else 0.0
    offset = 0.12 * push * rng.choice([-1, 1]) if "offset" in lacks else 0.0
    drag = 0.25 * push / speed**2 * rng.uniform(0.6, 1.4) if "quadratic" in lacks else 0.0
    late = rng.uniform(0.02, 0.06) if "late" in lacks else 0.0
    band = 0.2 * push * rng.uniform(0.6, 1.4) if "dead zone" in lacks else 0.0
    t = np.arange(0, 20, 0.01)

    def smooth(now: float, x: float, v: float) -> float:
        motor = push * float(drive(now - late))
        motor -= min(max(motor, -band), band)
        return (motor - weight * np.sin(x) - viscous * v - drag * abs(v) * v + offset) / J

    theta = driven_one_degree(smooth, dry / J, 0.0, 0.0, t)
    sensor = Sensor(step=2 * np.pi / rng.choice([2048, 4096]))
    fine = np.arange(0, 20, 0.001)
    torque = slow(push * drive(fine), 0.001, 0.003)[::10] + 0.005 * push * rng.standard_normal(len(t))
    known = udd.Model(
        ["q", "v"],
        {"q": "v", "v": "(torque - weight*sin(q) - viscous*v)/J"},
        {"J": 1.1 * J, "weight": 0.95 * weight, "viscous": viscous} | ({} if late else {"late": 0.0}),
        angles=["q"],
        inputs=["torque"],
        delays={} if late else {"torque": "late"},
    )
    return _machine(known, t, {"q": theta}, sensor, {"torque": torque}, lacks, rng)


def cart(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """A cart with a motor on a rail between springs, its voltage measured."""
    w, damping = 2 * np.pi * rng.uniform(0.4, 0.8), rng.uniform(0.3, 0.8)
    gain = 0.08 * w**2
    drive = waves(rng, 0.1, 1.0)
    dry = 0.2 * gain * rng.uniform(0.6, 1.4) if "dry" in lacks else 0.0
    cubic = 0.4 * w**2 / 0.1**2 * rng.uniform(0.6, 1.4) if "cubic spring" in lacks else 0.0
    stiff, play = 1.5 * w**2 * rng.uniform(0.6, 1.4), 0.04 * rng.uniform(0.6, 1.4)
    stiff = stiff if "play" in lacks else 0.0
    t = np.arange(0, 30, 0.01)

    def smooth(now: float, x: float, v: float) -> float:
        further = cubic * x**3 + stiff * (x - min(max(x, -play), play))
        return gain * float(drive(now)) - w**2 * x - damping * v - further

    x = driven_one_degree(smooth, dry, 0.0, 0.0, t)
    fine = np.arange(0, 30, 0.001)
    volts = slow(drive(fine), 0.001, 0.002)[::10] + 0.003 * rng.standard_normal(len(t))
    known = udd.Model(
        ["x", "v"],
        {"x": "v", "v": "gain*volts - k*x - c*v"},
        {"gain": 0.9 * gain, "k": 1.05 * w**2, "c": damping, "late": 0.0},
        inputs=["volts"],
        delays={"volts": "late"},
    )
    return _machine(known, t, {"x": x}, Sensor(step=2e-4), {"volts": volts}, lacks, rng)


def crane(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """A load on a rod below a trolley, whose acceleration is measured."""
    length, damping = rng.uniform(0.3, 1.0), rng.uniform(0.02, 0.08)
    w = np.sqrt(G / length)
    drive, push = waves(rng, 0.1, 1.3 * w / (2 * np.pi)), 0.25 * G
    drag = rng.uniform(0.05, 0.15) if "quadratic" in lacks else 0.0
    t = np.arange(0, 30, 0.01)
    theta = driven_one_degree(
        lambda now, x, v: -(G * np.sin(x) + push * float(drive(now)) * np.cos(x)) / length
        - damping * v
        - drag * abs(v) * v,
        0.0, rng.uniform(-0.5, 0.5), 0.0, t,
    )  # fmt: skip
    a = push * drive(t) + 0.002 * push * rng.standard_normal(len(t))
    known = udd.Model(
        ["q", "v"],
        {"q": "v", "v": f"-({G}*sin(q) + a*cos(q))/length - c*v"},
        {"length": 1.02 * length, "c": damping},
        angles=["q"],
        inputs=["a"],
    )
    return _machine(known, t, {"q": theta}, Sensor(step=2 * np.pi / 4096), {"a": a}, lacks, rng)


def electronic(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """An electronic oscillator; both voltages are read by converters of 12 bits."""
    w, damping = 2 * np.pi * rng.uniform(50, 80), rng.uniform(20, 40)
    gain = 0.25 * w**2
    drive = waves(rng, 10, 90, many=10)
    cubic = rng.uniform(0.5, 2.0) * w**2 if "cubic spring" in lacks else 0.0
    t = np.arange(0, 4.0, 1 / 600.0)
    y = driven_one_degree(
        lambda now, y, v: gain * float(drive(now)) - w**2 * y - damping * v - cubic * y**3, 0.0, 0.0, 0.0, t
    )
    sensor = Sensor(noise=0.001 * y.std(), step=float(np.ptp(y)) / 2**12)
    u = Sensor(step=8.0 / 2**12).read(drive(t), rng)
    known = udd.Model(
        ["y", "v"],
        {"y": "v", "v": "gain*u - k*y - c*v"},
        {"gain": gain, "k": 1.02 * w**2, "c": 20.0},
        inputs=["u"],
    )
    signal = udd.InputSignal(t, u, hold="cubic")
    return Machine(
        known,
        udd.Measurement(t, {"y": sensor.read(y, rng)}, inputs={"u": signal}),
        lacks,
        True,
        {"y": sensor.sigma},
    )


def _machine(
    known: udd.Model,
    t: np.ndarray,
    values: dict[str, np.ndarray],
    sensor: Sensor,
    inputs: dict[str, np.ndarray],
    lacks: tuple[str, ...],
    rng: np.random.Generator,
) -> Machine:
    seen = {name: sensor.read(one, rng) for name, one in values.items()}
    measured = udd.Measurement(t, seen, inputs=inputs)
    return Machine(known, measured, lacks, True, dict.fromkeys(values, sensor.sigma))


def driven_one_degree(smooth: Force, dry: float, x: float, v: float, t: np.ndarray) -> np.ndarray:
    """The coordinate of ``x'' = smooth(t, x, x') - dry sign(x')`` at times t, with set-valued friction."""
    result, now, end = np.empty(len(t)), float(t[0]), float(t[-1])
    while now < end:
        sign = float(np.sign(v))
        if dry and not sign:
            start = _released(smooth, dry, x, now, end)
            result[(t >= now) & (t <= start)] = x
            if start >= end:
                return result
            now, sign = start, float(np.sign(smooth(start, x, 0.0)))

        def turned(_t: float, s: np.ndarray, sign: float = sign) -> float:
            return sign * s[1]

        turned.terminal, turned.direction = bool(dry), -1.0  # type: ignore[attr-defined]
        run = solve_ivp(
            lambda t, s, sign=sign: [s[1], smooth(t, s[0], s[1]) - dry * sign],
            (now, end),
            [x, v],
            method="DOP853",
            rtol=RTOL,
            atol=1e-11,
            max_step=0.05 * (end - float(t[0])),
            # From rest: a first step in which it turns again would end where it began.
            first_step=min(_SHORTEST, end - now) if dry else None,
            events=turned,
            dense_output=True,
        )
        own = (t >= now) & (t <= run.t[-1])
        if own.any():  # some swings are shorter than the time between two samples
            result[own] = run.sol(t[own])[0]
        now, x, v = max(float(run.t[-1]), now + _SHORTEST), float(run.y[0, -1]), 0.0
    return result


def _released(smooth: Force, dry: float, x: float, now: float, end: float) -> float:
    """When the force on a body at rest exceeds what friction holds."""

    def beyond(t: float) -> float:
        return abs(smooth(t, x, 0.0)) - dry

    step = 0.002 * (end - now) if end - now < 1 else 0.002
    while now < end and beyond(now) <= 0.0:
        if beyond(now + step) > 0.0:
            return float(brentq(beyond, now, now + step, xtol=1e-12)) + 1e-9
        now += step
    return now


KINDS: dict[str, Kind] = {
    "driven arm: dry": (arm, ("dry",), True),
    "driven arm: dry + offset": (arm, ("dry", "offset"), True),
    "driven arm: quadratic": (arm, ("quadratic",), True),
    "driven arm: late": (arm, ("late",), True),
    "driven arm: dead zone": (arm, ("dead zone",), True),
    "driven cart: play": (cart, ("play",), True),
    "driven cart: dry": (cart, ("dry",), True),
    "driven cart: cubic spring": (cart, ("cubic spring",), True),
    "driven crane: quadratic": (crane, ("quadratic",), True),
    "driven circuit: cubic spring": (electronic, ("cubic spring",), True),
    "driven arm: nothing": (arm, (), True),
    "driven cart: nothing": (cart, (), True),
    "driven crane: nothing": (crane, (), True),
    "driven circuit: nothing": (electronic, (), True),
}
