"""Records without any effect, seen by real sensors: each has one fault that looks like something missing.

A disk before a camera, a pendulum and a cart on a spring with an angle's or a length's sensor. The motions of
the last two are solved here by SciPy from their own equations.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from motion import Device, World, staying
from scipy.integrate import solve_ivp
from scipy.signal import butter, lfilter, sosfiltfilt

import udd

G = 9.81
FAULTS = ("encoder", "low-pass", "1 kHz", "hum", "drift", "support")
BODIES = ("disk", "pendulum", "cart")
_FINE = 2000.0  # 1/s, at which a sensor's electronics and a support's motion are worked out
_PER_CHANNEL = {"disk": (5e-4, 5e-4, 0.01), "pendulum": (2e-3,), "cart": (5e-4,)}  # noise, m and rad
_SHAKE = (5e-5, 2e-4)  # m r.m.s., how far a support moves, between 0.3 and 3 Hz

Motion = Callable[[np.ndarray], np.ndarray]


def sensed(
    body: str, fault: str, duration: float, rng: np.random.Generator
) -> tuple[udd.Measurement, udd.Disk | udd.Pendulum | udd.Model]:
    """A record and the model that is all there is to it."""
    rate = (
        1000.0 if fault == "1 kHz" else float(rng.choice([25.0, 50.0] if body == "disk" else [50.0, 100.0]))
    )
    length = duration / 2 if fault == "1 kHz" else duration
    shake = _support(length, rng) if fault == "support" else None
    motion, known = {"disk": _disk, "pendulum": _pendulum, "cart": _cart}[body](length, shake, rng)
    t = np.arange(0, length - 0.5 / rate, 1 / rate)
    noise = np.array(_PER_CHANNEL[body])
    seen = motion(t)
    if fault == "low-pass":
        seen = _slow(motion, t, length, rng.uniform(3e-3, 15e-3))
    if shake is not None and body == "disk":
        seen[:, 0] += shake(t)  # the camera stands still
    white = noise * rng.standard_normal(seen.shape)
    if fault == "encoder":
        step = noise * rng.uniform(0.3, 3.0)
        seen = np.round((seen + 0.1 * white) / step) * step
        white = 0 * white
    elif fault == "hum":
        size, phase = rng.uniform(0.5, 2.0), rng.uniform(0, 2 * np.pi)
        mains = float(rng.choice([50.0, 60.0])) * (1 + rng.normal(0, 2e-4))
        seen = seen + size * noise * np.sin(2 * np.pi * mains * t + phase)[:, None]
    elif fault == "drift":
        walk = np.cumsum(rng.standard_normal(len(t))) * np.sqrt(1 / rate / length)
        seen = seen + rng.uniform(1.0, 5.0) * noise * (rng.normal() * t / length + walk)[:, None]
    seen = seen + white
    if body == "disk":
        return udd.Measurement(t, seen, sigma=np.tile(noise, (len(t), 1))), known
    return udd.Measurement(t, {"theta" if body == "pendulum" else "x": seen[:, 0]}), known


def _support(length: float, rng: np.random.Generator) -> Motion:
    """How a support moves sideways, m."""
    t = np.arange(-1.0, length + 1.0, 1 / _FINE)
    band = butter(2, [0.3, 3.0], "bandpass", fs=_FINE, output="sos")
    moved = sosfiltfilt(band, rng.standard_normal(len(t)))
    moved *= rng.uniform(*_SHAKE) / moved.std()
    return lambda at: np.interp(at, t, moved)


def _pushed(shake: Motion | None, length: float) -> Motion:
    """The support's acceleration, m/s^2."""
    if shake is None:
        return lambda at: np.zeros(np.shape(at))
    t = np.arange(-0.5, length + 0.5, 1 / _FINE)
    rate = np.gradient(np.gradient(shake(t), t), t)
    return lambda at: np.interp(at, t, rate)


def _disk(length: float, _shake: Motion | None, rng: np.random.Generator) -> tuple[Motion, udd.Disk]:
    for _ in range(40):
        known = udd.Disk(float(rng.uniform(0.016, 0.083)))
        spread = 1 + rng.normal(0, [0.02, 0.1, 0.1, 0.1])
        names = ("W", "k0", "k1", "k2")
        device = Device(*(f * known.parameters[name] for f, name in zip(spread, names, strict=True)))
        run = staying(World(device), length, rng)
        if run is not None:
            return lambda t, run=run: run(t)[:, 1:], known
    raise RuntimeError("the disk leaves the wheels in every draw")


def _pendulum(length: float, shake: Motion | None, rng: np.random.Generator) -> tuple[Motion, udd.Pendulum]:
    arm, pushed = float(rng.uniform(0.3, 1.2)), _pushed(shake, length)
    inertia, drag = arm**2 * rng.normal(1, 0.02), arm**2 * rng.uniform(0.005, 0.03)

    def rates(t: float, s: np.ndarray) -> list[float]:
        turn = -G * arm * np.sin(s[0]) - drag * s[1] - arm * float(pushed(t)) * np.cos(s[0])
        return [s[1], turn / inertia]

    start = [float(rng.uniform(0.2, 1.2)), 0.0]
    return _solved(rates, start, length), udd.Pendulum(arm * rng.normal(1, 0.01), k0=0.02 * arm**2)


def _cart(length: float, shake: Motion | None, rng: np.random.Generator) -> tuple[Motion, udd.Model]:
    stiff, drag = (2 * np.pi * rng.uniform(0.4, 1.5)) ** 2, rng.uniform(0.01, 0.06)
    pushed = _pushed(shake, length)

    def rates(t: float, s: np.ndarray) -> list[float]:
        return [s[1], -stiff * s[0] - drag * s[1] - float(pushed(t))]

    known = udd.Model(["x", "v"], ["v", "-k*x - c*v"], {"k": stiff * rng.normal(1, 0.02), "c": 0.03})
    return _solved(rates, [float(rng.uniform(0.03, 0.15)), 0.0], length), known


def _solved(rates: Callable[[float, np.ndarray], list[float]], start: list[float], length: float) -> Motion:
    solution = solve_ivp(
        rates,
        (-0.1, length + 0.1),
        start,
        method="DOP853",
        rtol=1e-9,
        atol=1e-11,
        max_step=0.05,
        dense_output=True,
    )
    return lambda t: solution.sol(t)[:1].T


def _slow(motion: Motion, t: np.ndarray, length: float, constant: float) -> np.ndarray:
    """Filter a motion by a sensor of first order with a time constant."""
    fine = np.arange(0, length, 1 / _FINE)
    share = np.exp(-1 / (_FINE * constant))
    x = motion(fine)
    slow = lfilter([1 - share], [1.0, -share], x, axis=0, zi=share * x[:1])[0]
    return np.column_stack([np.interp(t, fine, column) for column in slow.T])
