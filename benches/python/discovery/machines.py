"""Simulated twins of real machines: drawn devices with dry, quadratic and cubic friction, and their sensors.

SciPy integrates them; dry friction is set-valued: a machine of one degree of freedom stops where it reverses,
and rests there as long as friction holds it. No code of udd's models is used but to state what is known.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import udd

G = 9.81
RTOL = 1e-9
#: How a record is handed over: as it comes, with options that must not change the answer, and with its noise.
OPTIONS = ("default", "harmless", "sigma")


@dataclass(frozen=True)
class Sensor:
    """A sensor of a coordinate.

    Attributes
    ----------
    noise : float
        Standard deviation of white noise.
    step : float
        Of an encoder or a converter; 0 for none.
    memory : float
        Autocorrelation of the noise from frame to frame.
    bend : float
        A quadratic error: what is read is ``x + bend x^2``.
    """

    noise: float = 0.0
    step: float = 0.0
    memory: float = 0.0
    bend: float = 0.0

    @property
    def sigma(self) -> float:
        """Return the standard deviation that its data sheet would give."""
        return float(np.hypot(self.noise, self.step / np.sqrt(12)))

    def read(self, x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return its readings of a coordinate."""
        white = rng.standard_normal(len(x))
        own = np.empty(len(x))
        own[0] = white[0]
        for k in range(1, len(x)):
            own[k] = self.memory * own[k - 1] + np.sqrt(1 - self.memory**2) * white[k]
        seen = x + self.bend * x**2 + self.noise * own
        return np.round(seen / self.step) * self.step if self.step else seen


@dataclass(frozen=True)
class Machine:
    """A drawn record: what is known, what was read, and what the known model lacks.

    Attributes
    ----------
    lacks : tuple of str
        Kinds of the missing terms: "dry", "viscous", "joints", "quadratic", "cubic", "cubic spring", "late",
        "dead zone", "play".
    """

    known: Any
    measurement: udd.Measurement
    lacks: tuple[str, ...]
    encoder: bool
    sigma: dict[str, float]

    def asked(self, options: str) -> tuple[udd.Measurement, dict[str, Any]]:
        """The record and the arguments under one of :data:`OPTIONS`."""
        given = self.measurement
        if options == "harmless":
            if self.encoder:
                return replace(given, meta={**given.meta, "sensor": "encoder"}), {}
            return given, {"camera": False}
        if options == "sigma":
            sigma = np.tile([self.sigma[name] for name in given.names], (len(given), 1))
            return udd.Measurement(
                given.t, dict(zip(given.names, given.values.T, strict=True)), sigma=sigma
            ), {}
        return given, {}


def pendulum(lacks: tuple[str, ...], encoder: bool, rng: np.random.Generator) -> Machine:
    """A pendulum that loses some 80 % of its swing; each of its missing frictions takes a like share."""
    length, swing = rng.uniform(0.3, 1.3), rng.uniform(0.4, 1.2)
    rate, duration = (50.0, 60.0) if encoder else (30.0, 100.0)
    w = np.sqrt(G / length)
    fall = 1.6 / duration / (1 + len(lacks))  # 1/s: by what each friction damps the swing at first
    fast = swing * w
    k0 = 2 * fall * rng.uniform(0.3, 1.0)
    size = {
        "dry": lambda: fall * fast * np.pi / 4 * rng.uniform(0.5, 1.2),
        "quadratic": lambda: 2 * fall / fast * 3 * np.pi / 8 * rng.uniform(0.7, 2.0),
        "cubic": lambda: 2 * fall / fast**2 * 4 / 3 * rng.uniform(0.7, 2.0),
    }
    c = {name: size[name]() for name in lacks}

    def smooth(_t: float, x: float, v: float) -> float:
        drag = k0 * v + c.get("quadratic", 0.0) * abs(v) * v + c.get("cubic", 0.0) * v**3
        return -(w**2) * np.sin(x) - drag

    t = np.arange(0, duration, 1 / rate)
    theta = one_degree(smooth, c.get("dry", 0.0), swing, 0.0, t)
    sensor = Sensor(step=2 * np.pi / rng.choice([4096, 14400])) if encoder else _film(rng)
    zero = rng.normal(0, 0.01)
    measured = udd.Measurement(t, {"theta": sensor.read(theta + zero, rng)})
    stated = length * (1 + rng.normal(0, 0.01))
    known = udd.Pendulum(stated, k0=k0 * length**2)
    return Machine(known, measured, lacks, encoder, {"theta": sensor.sigma})


def _film(rng: np.random.Generator) -> Sensor:
    """A phone that looks at a pendulum somewhat from the side."""
    return Sensor(rng.uniform(3e-4, 2e-3), bend=rng.normal(0, 0.01))


def resting(_lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """An arm that has come to rest long before its record ends; friction is viscous, as known."""
    length = rng.uniform(0.2, 0.5)
    w, fall = np.sqrt(G / length), rng.uniform(0.25, 0.5)
    t = np.arange(0, 60, 0.02)
    theta = one_degree(
        lambda _t, x, v: -(w**2) * np.sin(x) - 2 * fall * v, 0.0, rng.uniform(0.3, 1.0), 0.0, t
    )
    sensor = Sensor(noise=2e-4, step=2 * np.pi / 4096)
    measured = udd.Measurement(t, {"theta": sensor.read(theta, rng)})
    return Machine(udd.Pendulum(length, k0=fall * length**2), measured, (), True, {"theta": sensor.sigma})


def slider(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """A mass on a spring that slides on metal and comes to rest; filmed."""
    w, swing = 2 * np.pi * rng.uniform(0.8, 2.0), rng.uniform(0.05, 0.15)
    turns = rng.uniform(12, 25)
    dry = swing * w**2 / 4 / turns * (0.7 if "viscous" in lacks else 1.0)
    damping = rng.uniform(0.02, 0.05) if "viscous" in lacks else 0.0
    t = np.arange(0, 1.3 * turns * 2 * np.pi / w, 1 / 60)
    x = one_degree(lambda _t, x, v: -(w**2) * x - damping * v, dry, swing, 0.0, t)
    sensor = Sensor(noise=rng.uniform(1e-4, 4e-4))
    known = udd.Model(["x", "v"], {"x": "v", "v": "-k*x - c*v"}, {"k": (1.02 * w) ** 2, "c": 0.1})
    measured = udd.Measurement(t, {"x": sensor.read(x, rng)})
    return Machine(known, measured, tuple(n for n in lacks if n != "viscous"), False, {"x": sensor.sigma})


def circuit(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """A driven circuit with a cubic element, its input two waves; 12 bits."""
    w, damping, cubic = 2 * np.pi * 70, 25.0, rng.uniform(0.5, 2.0) * (2 * np.pi * 70) ** 2
    cubic = cubic if lacks else 0.0
    f1, f2 = rng.uniform(30, 60), rng.uniform(60, 90)
    gain = 0.25 * w**2
    drive = f"{gain}*(sin({2 * np.pi * f1}*t) + 0.7*cos({2 * np.pi * f2}*t))"

    def rates(t: float, s: np.ndarray) -> list[float]:
        force = gain * (np.sin(2 * np.pi * f1 * t) + 0.7 * np.cos(2 * np.pi * f2 * t))
        return [s[1], force - w**2 * s[0] - damping * s[1] - cubic * s[0] ** 3]

    t = np.arange(0, 2.0, 1 / 610.0)
    y = solve_ivp(rates, (0, t[-1]), [0.0, 0.0], t_eval=t, rtol=RTOL, atol=1e-10, method="DOP853").y[0]
    sensor = Sensor(noise=0.002 * y.std(), step=float(np.ptp(y)) / 2**12)
    known = udd.Model(["y", "v"], {"y": "v", "v": f"-k*y - c*v + {drive}"}, {"k": 1.02 * w**2, "c": 20.0})
    return Machine(known, udd.Measurement(t, {"y": sensor.read(y, rng)}), lacks, True, {"y": sensor.sigma})


def double(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """A chaotic double pendulum of two point masses with viscous joints; the model knows none."""
    l1, l2, m = rng.uniform(0.08, 0.12), rng.uniform(0.06, 0.1), rng.uniform(0.3, 0.7)  # m = m2 / (m1 + m2)
    joint = rng.uniform(3e-5, 1e-4, 2) * 10 if lacks else np.zeros(2)

    def rates(_t: float, s: np.ndarray) -> np.ndarray:
        a, b, p, q = s
        d = a - b
        mass = np.array([[l1**2, m * l1 * l2 * np.cos(d)], [m * l1 * l2 * np.cos(d), m * l2**2]])
        force = np.array(
            [
                -m * l1 * l2 * np.sin(d) * q**2 - G * l1 * np.sin(a) - joint[0] * p + joint[1] * (q - p),
                m * l1 * l2 * np.sin(d) * p**2 - m * G * l2 * np.sin(b) - joint[1] * (q - p),
            ]
        )
        return np.concatenate([[p, q], np.linalg.solve(mass, force)])

    t = np.arange(0, 12, 1 / 200)
    start = [rng.uniform(1.5, 2.6), rng.uniform(1.5, 2.6), 0.0, 0.0]
    run = solve_ivp(rates, (0, t[-1]), start, t_eval=t, rtol=1e-10, atol=1e-10, method="DOP853").y
    sensor = Sensor(noise=3e-3)
    values = {"a": sensor.read(run[0], rng), "b": sensor.read(run[1], rng)}
    d, det = "(a - b)", "(l1*l2*(1 - m*cos(a - b)^2))"
    f = f"(-m*l2*sin{d}*q^2 - {G}*sin(a))"  # of the first equation over l1
    h = f"(l1*sin{d}*p^2 - {G}*sin(b))"  # of the second over m l2
    equations = {
        "a": "p",
        "b": "q",
        "p": f"({f}*l2 - m*l2*cos{d}*{h})/{det}",
        "q": f"({h}*l1 - l1*cos{d}*{f})/{det}",
    }
    known = udd.Model(["a", "b", "p", "q"], equations, {"l1": l1, "l2": l2, "m": m}, angles=["a", "b"])
    return Machine(known, udd.Measurement(t, values), lacks, False, dict.fromkeys(values, sensor.sigma))


def weighed(lacks: tuple[str, ...], encoder: bool, rng: np.random.Generator) -> Machine:
    """The same double pendulum, of which the mass matrix is known too."""
    machine = double(lacks, encoder, rng)
    off = "m*l1*l2*cos(a - b)"
    return replace(machine, known=machine.known.replace(mass=[["l1^2", off], [off, "m*l2^2"]]))


def track(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """Two carts on an air track between springs."""
    k1, k2, k3 = rng.uniform(20, 40, 3)
    damping = rng.uniform(0.02, 0.05) if lacks else 0.0

    def rates(_t: float, s: np.ndarray) -> list[float]:
        x, y, v, w = s
        force = -k1 * x - k2 * (x - y), -k3 * y - k2 * (y - x)
        return [v, w, force[0] - damping * v, force[1] - damping * w]

    t = np.arange(0, 20, 1 / 30)
    run = solve_ivp(
        rates, (0, t[-1]), [0.1, rng.uniform(-0.05, 0.05), 0, 0], t_eval=t, rtol=RTOL, atol=1e-10
    ).y
    sensor = Sensor(noise=rng.uniform(3e-4, 1e-3), bend=rng.uniform(-0.02, 0.02))
    equations = {"x": "v", "y": "w", "v": "-k1*x - k2*(x - y)", "w": "-k3*y - k2*(y - x)"}
    known = udd.Model(["x", "y", "v", "w"], equations, {"k1": 1.03 * k1, "k2": 0.98 * k2, "k3": k3})
    values = {"x": sensor.read(run[0], rng), "y": sensor.read(run[1], rng)}
    return Machine(known, udd.Measurement(t, values), lacks, False, dict.fromkeys(values, sensor.sigma))


def phone(_lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """A phone on a spring that reads its own motion, with a slight nonlinearity: harmonics of the sensor."""
    w, damping = 2 * np.pi * rng.uniform(0.6, 0.9), rng.uniform(0.01, 0.03)
    t = np.arange(0, 40, 1 / 50)
    x = one_degree(lambda _t, x, v: -(w**2) * x - damping * v, 0.0, rng.uniform(0.5, 1.5), 0.0, t)
    sensor = Sensor(noise=rng.uniform(0.01, 0.03), memory=0.5, bend=rng.uniform(-0.02, 0.02))
    known = udd.Model(["x", "v"], {"x": "v", "v": "-k*x - c*v"}, {"k": 1.02 * w**2, "c": 0.02})
    return Machine(known, udd.Measurement(t, {"x": sensor.read(x, rng)}), (), False, {"x": sensor.sigma})


def ball(lacks: tuple[str, ...], _encoder: bool, rng: np.random.Generator) -> Machine:
    """A ball that falls through air, filmed from the side."""
    limit = rng.uniform(4.0, 8.0)  # m/s
    t = np.arange(0, rng.uniform(1.2, 1.8), 1 / 60)
    c = G / limit**2 if lacks else 0.0
    run = solve_ivp(
        lambda _t, s: [s[1], G - c * abs(s[1]) * s[1]], (0, t[-1]), [0, 0], t_eval=t, rtol=RTOL, atol=1e-10
    ).y
    sensor = Sensor(noise=rng.uniform(1e-3, 3e-3))
    known = udd.Model(["x", "v"], {"x": "v", "v": "g"}, {"g": G})
    return Machine(
        known, udd.Measurement(t, {"x": sensor.read(run[0], rng)}), lacks, False, {"x": sensor.sigma}
    )


def one_degree(
    smooth: Callable[[float, float, float], float], dry: float, x: float, v: float, t: np.ndarray
) -> np.ndarray:
    """The coordinate of ``x'' = smooth(t, x, x') - dry sign(x')`` at times t.

    A body that dry friction stops once stays at rest: then `smooth` must not depend on the time.
    """
    result, now = np.empty(len(t)), float(t[0])
    while True:
        pull = smooth(now, x, v)
        sign = np.sign(v) or (np.sign(pull) if abs(pull) > dry else 0.0)
        if dry and not sign:
            result[t >= now] = x  # held for good
            return result

        def turned(_t: float, s: np.ndarray, sign: float = sign) -> float:
            return sign * s[1]

        turned.terminal, turned.direction = bool(dry), -1.0  # type: ignore[attr-defined]
        run = solve_ivp(
            lambda t, s, sign=sign: [s[1], smooth(t, s[0], s[1]) - dry * sign],
            (now, t[-1] + 1e-9),
            [x, v],
            method="DOP853",
            rtol=RTOL,
            atol=1e-11,
            events=turned,
            dense_output=True,
        )
        own = (t >= now) & (t <= run.t[-1])
        result[own] = run.sol(t[own])[0]
        if run.status == 0:
            return result
        now, x, v = float(run.t[-1]), float(run.y[0, -1]), 0.0


_FRICTIONS = (
    ("dry",),
    ("quadratic",),
    ("cubic",),
    ("dry", "quadratic"),
    ("dry", "cubic"),
    ("quadratic", "cubic"),
)
_PENDULUMS = {
    f"{' + '.join(lacks) or 'nothing'}: {'encoder' if encoder else 'camera'}": (pendulum, lacks, encoder)
    for lacks in (*_FRICTIONS, ())
    for encoder in (True, False)
}
#: A function that draws a machine, its missing terms, and True if an encoder reads it.
Kind = tuple[Callable[..., Machine], tuple[str, ...], bool]
KINDS: dict[str, Kind] = _PENDULUMS | {
    "slider: dry": (slider, ("dry",), False),
    "slider: dry + viscous": (slider, ("dry", "viscous"), False),
    "circuit: cubic spring": (circuit, ("cubic spring",), True),
    "double: viscous joints": (double, ("joints",), False),
    "double: viscous joints with mass": (weighed, ("joints",), False),
    "air track: viscous": (track, ("viscous",), False),
    "ball: quadratic": (ball, ("quadratic",), False),
    "circuit: nothing": (circuit, (), True),
    "double: nothing": (double, (), False),
    "double: nothing with mass": (weighed, (), False),
    "air track: nothing": (track, (), False),
    "ball: nothing": (ball, (), False),
    "phone: nothing": (phone, (), False),
    "at rest: nothing": (resting, (), True),
}


@dataclass(frozen=True)
class MachineCase:
    """One record to be drawn, and how it is handed over."""

    title: str
    number: int
    options: str

    @property
    def label(self) -> str:
        """Return the name for `--only`."""
        return f"{self.title}; {self.options}"


def machine_cases(
    numbers: Iterable[int], kinds: Iterable[str], options: Sequence[str] = OPTIONS
) -> Iterator[MachineCase]:
    """Records of these numbers of each kind, under each of the options."""
    for number in numbers:
        for title in kinds:
            yield from (MachineCase(title, number, one) for one in options)


def drawn(case: MachineCase, seed: int, kinds: Mapping[str, Kind] = KINDS) -> Machine:
    """The record of a case; the same for the same seed, whatever the options and what is known."""
    make, lacks, encoder = kinds[case.title]
    title = case.title.removesuffix(" with mass").encode()
    return make(lacks, encoder, np.random.default_rng([seed, zlib.crc32(title), case.number]))
