"""Laws that lie near the library, not in it: does a claim name the right coordinate and the right form?

Pendulums and disks as users film them: 60 to 90 s at 25 to 60 frames per second, with noise of 0.3 mm and
5 mrad. SciPy integrates all of them. No code of udd's models is used but to state what is known.
"""

from __future__ import annotations

import re
import time
import traceback
import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

import numpy as np
from camera import Camera, film
from laws import CONSISTENT, Kind, Law, Look, Push
from motion import Device, World, staying
from scipy.integrate import solve_ivp

import udd

G, RTOL, ATOL = 9.81, 1e-9, 1e-11
NOISE, ANGLE_NOISE = 3e-4, 5e-3  # m, rad
_DRY = 0.02  # rad/s, over which dry friction turns
_EXPONENT = 0.1  # by which a named exponent may be off


@dataclass(frozen=True)
class Truth:
    """The law that a record lacks: where it stands, over which coordinate, in which form.

    Attributes
    ----------
    slot : str
        ``"friction"`` (any law that brakes), ``"torque"``, ``"vertical"``, ``"support"``, ``"none"``.
    coordinate : str
        ``"|Omega|"``, ``"theta"``, ``"t"``, ``"Y"``, ``"load"``, ``"memory"``.
    form : str
        ``"power"``, ``"dry"``, ``"bump"``, ``"threshold"``, ``"load"``, ``"decay"``, ``"mode"``, ``"noise"``,
        ``"memory"``, ``"two"``, ``"cubic"``, ``"none"``.
    exponent : float
        A power's, as drag: 2 for quadratic drag.
    """

    slot: str = "none"
    coordinate: str = ""
    form: str = "none"
    exponent: float = np.nan


@dataclass(frozen=True)
class Drawn:
    """A drawn record, and what is known of its device."""

    known: Any
    measurement: udd.Measurement
    truth: Truth


Drag = Callable[[float, float, float], float]  # of t, theta, Omega: a friction coefficient, m^2/s


def _sampled(rng: np.random.Generator) -> np.ndarray:
    return np.arange(0, rng.uniform(60, 90), 1 / rng.choice([25.0, 30.0, 50.0, 60.0]))


def _seen(t: np.ndarray, theta: np.ndarray, rng: np.random.Generator) -> udd.Measurement:
    return udd.Measurement(t, {"theta": theta + ANGLE_NOISE * rng.standard_normal(len(t))})


def pendulum(law: Drag, truth: Truth, rng: np.random.Generator) -> Drawn:
    """A pendulum of about half a metre whose friction coefficient is 0.01 m^2/s and a law of its own."""
    length = rng.uniform(0.45, 0.55)

    def rates(t: float, s: np.ndarray) -> list[float]:
        brake = (0.01 + law(t, s[1], s[0])) / length**2
        return [-G / length * np.sin(s[1]) - brake * s[0], s[0]]

    t = _sampled(rng)
    start = [0.0, rng.uniform(0.7, 1.3)]
    run = solve_ivp(rates, (0, t[-1]), start, "DOP853", t, rtol=RTOL, atol=ATOL, max_step=0.02)
    return Drawn(udd.Pendulum(length, k0=0.01), _seen(t, run.y[1], rng), truth)


def _power(t: float, theta: float, omega: float, a: float, n: float) -> float:
    return a * abs(omega) ** n


def powered(n: float, a: float, rng: np.random.Generator) -> Drawn:
    """Drag as a power of the speed."""
    law = partial(_power, a=a * rng.uniform(0.8, 1.2), n=n)
    return pendulum(law, Truth("friction", "|Omega|", "power", 1 + n), rng)


def braked(rng: np.random.Generator) -> Drawn:
    """A brake near one angle."""
    c, s, a = rng.uniform(0.1, 0.2), rng.uniform(0.07, 0.1), rng.uniform(0.04, 0.06)
    truth = Truth("friction", "theta", "bump")
    return pendulum(lambda _t, x, _v: a * np.exp(-(((x - c) / s) ** 2)), truth, rng)


def above(rng: np.random.Generator) -> Drawn:
    """Drag that begins above a speed of about 1 rad/s."""
    c, a = rng.uniform(0.8, 1.2), rng.uniform(0.01, 0.02)
    truth = Truth("friction", "|Omega|", "threshold")
    return pendulum(lambda _t, _x, v: a * max(abs(v) - c, 0.0), truth, rng)


def _turn(v: float) -> float:
    return np.tanh(v / _DRY) / v if abs(v) > 1e-9 else 1 / _DRY


def loaded(rng: np.random.Generator) -> Drawn:
    """Dry friction in proportion to the load on the pivot; the length counts as 0.5 m."""
    f = rng.uniform(0.003, 0.005)
    truth = Truth("friction", "load", "load")
    return pendulum(lambda _t, x, v: f * (np.cos(x) + 0.5 * v**2 / G) * _turn(v), truth, rng)


def dry(rng: np.random.Generator) -> Drawn:
    """Dry friction."""
    f = rng.uniform(0.002, 0.004)
    return pendulum(lambda _t, _x, v: f * _turn(v), Truth("friction", "|Omega|", "dry"), rng)


def warming(rng: np.random.Generator) -> Drawn:
    """A rubber that warms: the friction falls to half within 30 s."""
    tau = rng.uniform(8, 14)
    truth = Truth("friction", "t", "decay")
    return pendulum(lambda t, _x, _v: 0.01 * np.exp(-t / tau), truth, rng)


def two_weak(rng: np.random.Generator) -> Drawn:
    """Weak dry friction and weak quadratic drag together."""
    truth = Truth("friction", "|Omega|", "two")
    return pendulum(lambda _t, _x, v: 0.0006 * _turn(v) + 0.001 * abs(v), truth, rng)


def nothing(rng: np.random.Generator) -> Drawn:
    """The pendulum as it is known."""
    return pendulum(lambda _t, _x, _v: 0.0, Truth(), rng)


def remembering(rng: np.random.Generator) -> Drawn:
    """Drag with a memory of 0.3 s: it follows the square of the speed late."""
    length, a, tau = rng.uniform(0.45, 0.55), rng.uniform(0.006, 0.01), 0.3

    def rates(_t: float, s: np.ndarray) -> list[float]:
        turn = -G / length * np.sin(s[1]) - (0.01 * s[0] + s[2]) / length**2
        return [turn, s[0], (a * abs(s[0]) * s[0] - s[2]) / tau]

    t = _sampled(rng)
    start = [0.0, rng.uniform(0.8, 1.3), 0.0]
    run = solve_ivp(rates, (0, t[-1]), start, "DOP853", t, rtol=RTOL, atol=ATOL, max_step=0.02)
    truth = Truth("friction", "memory", "memory")
    return Drawn(udd.Pendulum(length, k0=0.01), _seen(t, run.y[1], rng), truth)


def sprung(rng: np.random.Generator) -> Drawn:
    """A pivot that gives way sideways on a spring of 1.3 Hz and a weight of twenty bobs."""
    length, heavy, w, damping = rng.uniform(0.45, 0.55), 20.0, 2 * np.pi * 1.3, 0.3

    def rates(_t: float, s: np.ndarray) -> list[float]:
        v, x, speed, place = s
        # (1 + heavy) p'' + l (x'' cos x - v^2 sin x) = -heavy (w^2 p + damping p')
        # l x'' + p'' cos x = -g sin x
        rest = -heavy * (w**2 * place + damping * speed)
        push = (rest + length * v**2 * np.sin(x) + G * np.sin(x) * np.cos(x)) / (heavy + np.sin(x) ** 2)
        return [-(G * np.sin(x) + push * np.cos(x)) / length - 0.01 / length**2 * v, v, push, speed]

    t = _sampled(rng)
    start = [0.0, rng.uniform(0.7, 1.2), 0.0, 0.0]
    run = solve_ivp(rates, (0, t[-1]), start, "DOP853", t, rtol=RTOL, atol=ATOL, max_step=0.02)
    return Drawn(udd.Pendulum(length, k0=0.01), _seen(t, run.y[1], rng), Truth("support", "", "mode"))


def shaken(rng: np.random.Generator) -> Drawn:
    """A pivot that is shaken at random, with a spectrum of 1/f from 0.05 to 5 Hz."""
    length = rng.uniform(0.45, 0.55)
    f = np.geomspace(0.05, 5, 80)
    phase, size = rng.uniform(0, 2 * np.pi, 80), 0.02 * rng.standard_normal(80)

    def rates(t: float, s: np.ndarray) -> list[float]:
        push = float(size @ np.sin(2 * np.pi * f * t + phase))
        return [-(G * np.sin(s[1]) + push * np.cos(s[1])) / length - 0.01 / length**2 * s[0], s[0]]

    t = _sampled(rng)
    start = [0.0, rng.uniform(0.7, 1.2)]
    run = solve_ivp(rates, (0, t[-1]), start, "DOP853", t, rtol=RTOL, atol=ATOL, max_step=0.02)
    return Drawn(udd.Pendulum(length, k0=0.01), _seen(t, run.y[1], rng), Truth("support", "", "noise"))


def disk(kind: Kind | None, amplitude: float, drive: float, truth: Truth, rng: np.random.Generator) -> Drawn:
    """The standard disk with a law, seen by a camera without defects."""
    drive *= rng.uniform(0.9, 1.1)
    momentum = kind.momenta[0] if kind and kind.momenta else None
    law = () if kind is None else (Law(kind, (amplitude * rng.uniform(0.8, 1.2),), {}, momentum),)
    duration = rng.uniform(60, 90)
    motion = staying(World(Device(drive), law), duration, rng, tries=60)
    if motion is None:
        raise RuntimeError("the disk leaves the wheels in every draw")
    stated, seen = film(Camera(noise=NOISE, angle_noise=ANGLE_NOISE), motion, duration, rng)
    sigma = np.tile([NOISE, NOISE, ANGLE_NOISE], (len(stated), 1))
    measured = udd.Measurement(stated, seen, sigma=sigma)
    return Drawn(udd.Disk(drive * (1 + rng.normal(0, 0.02))), measured, truth)


def _root_drag(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(k=p[0] * abs(at.omega) ** 0.5)


def _square_drag(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(k=p[0] * abs(at.omega))


def _fast_drag(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(k=p[0] * np.maximum(abs(at.omega) - 4.0, 0.0))


def _cubic_spring(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(torque=-p[0] * at.y**3)


def _side_grip(at: Look, p: Any, _s: dict[str, float]) -> Push:
    return Push(w=-p[0] * at.device.W * np.exp(-((at.y / 0.012) ** 2)))


def _kind(name: str, formula: Any, *, positive: bool = True) -> Kind:
    vertical = formula is _side_grip
    equation, momenta = ("dZ", CONSISTENT) if vertical else ("dOmega", ())
    return Kind(name, formula, (equation,), momenta, positive=positive)


Maker = Callable[[np.random.Generator], Drawn]
_SPEED = ("friction", "|Omega|")
#: Makers of records, by the name of the missing law.
KINDS: dict[str, Maker] = {
    "pendulum: power 1.2": partial(powered, 0.2, 0.02),
    "pendulum: power 1.5": partial(powered, 0.5, 0.009),
    "pendulum: power 1.7": partial(powered, 0.7, 0.008),
    "pendulum: power 2.4": partial(powered, 1.4, 0.006),
    "pendulum: power 2.8": partial(powered, 1.8, 0.005),
    "pendulum: quadratic": partial(powered, 1.0, 0.008),
    "pendulum: cubic": partial(powered, 2.0, 0.004),
    "pendulum: brake near an angle": braked,
    "pendulum: drag above a speed": above,
    "pendulum: dry": dry,
    "pendulum: dry by load": loaded,
    "pendulum: warming": warming,
    "pendulum: memory": remembering,
    "pendulum: two weak": two_weak,
    "pendulum: support on a spring": sprung,
    "pendulum: support shaken": shaken,
    "pendulum: nothing": nothing,
    "disk: power 1.5": partial(disk, _kind("root", _root_drag), 0.002, 0.045, Truth(*_SPEED, "power", 1.5)),
    "disk: quadratic": partial(
        disk, _kind("square", _square_drag), 0.002, 0.045, Truth(*_SPEED, "power", 2.0)
    ),
    "disk: drag above a speed": partial(
        disk, _kind("fast", _fast_drag), 0.004, 0.045, Truth(*_SPEED, "threshold")
    ),
    "disk: cubic spring": partial(
        disk, _kind("spring", _cubic_spring), 500.0, 0.045, Truth("torque", "Y", "cubic")
    ),
    "disk: lift lost near Y = 0": partial(
        disk, _kind("grip", _side_grip), 0.1, 0.045, Truth("vertical", "Y", "bump")
    ),
    "disk: nothing": partial(disk, None, 0.0, 0.045, Truth()),
}


@dataclass(frozen=True)
class NearCase:
    """One record to be drawn."""

    title: str
    number: int

    def drawn(self, seed: int) -> Drawn:
        """The record; the same for the same seed."""
        rng = np.random.default_rng([seed, zlib.crc32(f"near {self.title}".encode()), self.number])
        return KINDS[self.title](rng)


def near_cases(numbers: Iterable[int], kinds: Iterable[str] = KINDS) -> Iterator[NearCase]:
    """Records of these numbers of each kind."""
    return (NearCase(title, number) for number in numbers for title in kinds)


#: The library's own effects: slot, coordinate, form, exponent.
_NAMED = {
    "quadratic_drag": Truth(*_SPEED, "power", 2.0),
    "cubic_drag": Truth(*_SPEED, "power", 3.0),
    "coulomb": Truth(*_SPEED, "dry"),
    "stribeck": Truth(*_SPEED, "stribeck"),
    "load_coulomb": Truth("friction", "load", "load"),
    "warming_friction": Truth("friction", "t", "decay"),
    "dry_brake": Truth("friction", "theta", "dry bump"),
    "saturating": Truth(*_SPEED, "saturating"),
    "one_way": Truth("friction", "Omega", "one way"),
    "one_way_drag": Truth("friction", "Omega", "one way"),
}


def meaning(effect: udd.effects.Effect) -> Truth:
    """Return the law that an effect names."""
    if effect.name in _NAMED:
        return _NAMED[effect.name]
    text, slot = effect.equation, effect.slots[0]
    braking = "friction" if slot == "friction" or ("Omega" in text and slot == "torque") else slot
    coordinate = next((name for name in ("Omega", "theta", "Y", "Z", "R", "beta") if name in text), "t")
    coordinate = "|Omega|" if coordinate == "Omega" else coordinate
    if "cos(theta) + length*Omega^2/g" in text:
        return Truth(braking, "load", "load")
    values = effect.parameters
    if effect.name == "power_drag":
        return Truth(*_SPEED, "power", 1 + values["n"])
    exponent = re.search(r"(?:abs\(Omega\)|\(abs\(Omega\)\^2 \+ [\d.e-]+\))\^(\w+|[\d.]+)$", text)
    if exponent and text.count("Omega") == 1:
        n = exponent[1]
        return Truth(braking, coordinate, "power", 1 + (values[n] if n in values else float(n)))
    if slot == "torque" and re.search(r"= \w \* Y\^3$", text):
        return Truth(slot, "Y", "cubic")
    if "exp" in text and "^2" in text:
        return Truth(braking, coordinate, "bump")
    if "max(" in text:
        return Truth(braking, coordinate, "threshold")
    if coordinate == "t" and "exp" in text:
        return Truth(braking, coordinate, "decay")
    return Truth(braking, coordinate, "curve")


@dataclass
class NearScore:
    """The score of a record."""

    title: str
    number: int
    truth: dict[str, Any] = field(default_factory=dict)
    verdict: str = ""
    effects: list[str] = field(default_factory=list)
    rivals: list[str] = field(default_factory=list)
    right: bool = False  # what is named is what is missing
    place: bool = False  # the coordinate is named, or the rivals have it
    before: float = np.nan
    after: float = np.nan
    seconds: float = 0.0
    error: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the score as plain data."""
        return {"batch": "near", **asdict(self)}


def near_score(case: NearCase, seed: int) -> NearScore:
    """Draw the record, look for what its model lacks, compare with the truth."""
    result = NearScore(case.title, case.number)
    try:
        record = case.drawn(seed)
        result.truth = asdict(record.truth)
        begin = time.process_time()
        answer = udd.discover(record.measurement, record.known)
        result.seconds = time.process_time() - begin
        judge(result, answer, record.truth)
    except Exception:  # one record's failure is a result too, and must not end the others
        result.error = traceback.format_exc(limit=-3)
    return result


def judge(result: NearScore, answer: udd.Discovery, truth: Truth) -> None:
    """Compare what is said with what is missing."""
    result.verdict = answer.verdict
    meanings = [meaning(one.effect) for one in answer.effects]
    rivals = [meaning(one.effect) for one in answer.alternatives]
    result.effects = [f"{one.title}: {one.expression}"[:110] for one in answer.effects]
    result.rivals = [one.title for one in answer.alternatives]
    near = [meaning(one.effect) for one in answer.rejected]
    coordinates = {one.coordinate for one in (*meanings, *rivals, *near)}
    result.before, result.after = (
        one.whole if one.unit == "rad" else float(one.median[one.horizons.index(answer.horizon)])
        for one in (answer.error_before, answer.error_after)
    )
    if truth.form == "none":
        result.right = result.place = answer.verdict == "nothing missing"
    elif truth.form == "two":
        names = {one.effect.name for one in answer.effects}
        result.right = names == {"coulomb", "quadratic_drag"}
        result.place = "|Omega|" in coordinates
    else:
        result.right = len(meanings) == 1 and _same(meanings[0], truth)
        result.place = truth.coordinate in coordinates or truth.coordinate in ("", "memory")


def _same(named: Truth, truth: Truth) -> bool:
    if (named.slot, named.coordinate, named.form) != (truth.slot, truth.coordinate, truth.form):
        return False
    return bool(np.isnan(truth.exponent) or abs(named.exponent - truth.exponent) <= _EXPONENT)


def near_line(one: NearScore) -> str:
    """A record in a line."""
    head = f"{one.title:32s} {one.number:2d}"
    if one.error:
        return f"{head} FAILED: {one.error.strip().splitlines()[-1]}"
    mark = ("R" if one.right else "-") + ("p" if one.place else "-")
    said = "; ".join(one.effects) or "-"
    others = f" (or {', '.join(one.rivals)})" if one.rivals else ""
    errors = f"{one.before:.3g} -> {one.after:.3g}"
    return f"{head} {mark} {one.verdict}: {said}{others}; {errors}; {one.seconds:.0f} s"


def near_report(scores: Iterable[NearScore]) -> str:
    """Claims by kind of law, and how many claims "identified" are right."""
    rows = [one for one in scores if not one.error]
    lines = [f"\n  {'law':32s} {'n':>3s} {'claims':>6s} {'right':>6s} {'place':>6s}  verdicts"]
    for title in dict.fromkeys(one.title for one in rows):
        some = [one for one in rows if one.title == title]
        claims = [one for one in some if one.verdict == "effect identified"]
        said = {v: sum(one.verdict == v for one in some) for v in sorted({one.verdict for one in some})}
        lines.append(
            f"  {title:32s} {len(some):3d} {len(claims):6d} {sum(one.right for one in claims):6d} "
            f"{sum(one.place for one in some):6d}  " + "; ".join(f"{n} {v}" for v, n in said.items())
        )
    claims = [one for one in rows if one.verdict == "effect identified"]
    lacking = [one for one in rows if one.truth.get("form") not in ("none", "noise", "mode", "memory")]
    lines.append(
        f"  claims that are right: {sum(one.right for one in claims)} of {len(claims)}; "
        f"coordinate: {sum(one.place for one in lacking)} of {len(lacking)}"
    )
    return "\n".join(lines)
