"""Crossings and switches with known answers: none may be missed, none seen twice.

python benches/python/crossings.py --cases 10000 --seed 1 --jobs 2
python benches/python/crossings.py --only "stick and slip" --cases 200

Half of the cases are sections (`udd.poincare`), half are laws that switch (`udd.simulate` by all five
methods, and `udd.ensemble`). Each is drawn at random: functions of time, of the state, products,
near-tangents, solutions at rest, dry friction. The references are closed forms, or go from switch to switch
by closed forms.
"""

from __future__ import annotations

import argparse
import collections
import multiprocessing
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

import udd

Floats = NDArray[np.float64]
METHODS = ("dopri5", "dop853", "taylor", "rodas", "auto")


@dataclass
class Case:
    """A model from a start; either a section with its times, or a length with the state at the end."""

    kind: str
    model: udd.Model
    start: list[float]
    section: str = ""
    times: Floats | None = None
    length: float = 0.0
    end: Floats | None = None
    error: float = 5e-6
    what: str = ""


def roots(f: Callable[[Floats], Floats], length: float, fastest: float) -> Floats:
    """Return all zeros from 0 to `length` of a function with frequencies up to `fastest`."""
    t = np.linspace(0.0, length, int(length * fastest * 40) + 200)
    y = f(t)
    knots = [t[0]]
    for i in range(1, len(t) - 1):
        # A dip that the grid does not show.
        if y[i] * y[i - 1] > 0 and y[i] * y[i + 1] > 0 and abs(y[i]) <= min(abs(y[i - 1]), abs(y[i + 1])):
            side = np.sign(y[i])
            dip = minimize_scalar(
                lambda s, side=side: float(side * f(np.asarray(s))),
                bounds=(t[i - 1], t[i + 1]),
                method="bounded",
                options={"xatol": 1e-13},
            )
            knots.append(float(dip.x))
        knots.append(t[i])
    at = np.unique([*knots, t[-1]])
    values = f(at)
    # The neighbours of a place that is a zero have its sides; at the start the side behind it counts.
    at, values = at[values != 0], values[values != 0]
    if at[0] > 0:
        near = np.geomspace(1e-9 * at[0], at[0], 200)[:-1]
        at, values = np.concatenate([near, at]), np.concatenate([f(near), values])
    result = [
        brentq(lambda s: float(f(np.asarray(s))), a, b, xtol=1e-14)
        for a, b, fa, fb in zip(at[:-1], at[1:], values[:-1], values[1:], strict=True)
        if fa * fb < 0
    ]
    return np.array(result)


# --- sections


def _of_section(kind: str, model: udd.Model, start: list[float], text: str, times: Floats) -> Case | None:
    # The first and the last few: whoever draws 10 000 of them need not have a thousand in each.
    times = times[times > 1e-6][:60]
    return Case(kind, model, start, text, times, what=text) if len(times) else None


def section_of_time(rng: np.random.Generator) -> Case | None:
    """A strobe of a solution that rests, creeps or grows steadily."""
    law, start = [("0", 0.0), ("1", 0.0), ("-y/1000", 1.0), ("1e-6", 2.0)][rng.integers(4)]
    a, b, p = rng.uniform(0.2, 20), rng.uniform(0.2, 20), rng.uniform(0, 6)
    c = rng.choice([rng.uniform(-0.99, 0.99), 0.9999, -0.999, 0.0])
    shapes = (
        (f"cos({a}*t + {p}) + {c}", lambda t: np.cos(a * t + p) + c),
        (f"sin({a}*t)*cos({b}*t + {p}) + {0.3 * c}", lambda t: np.sin(a * t) * np.cos(b * t + p) + 0.3 * c),
        (f"sin({a}*t + {p}) = {c}*exp(-t/7)", lambda t: np.sin(a * t + p) - c * np.exp(-t / 7)),
        (f"tanh(5*sin({a}*t + {p})) - {0.9 * c}", lambda t: np.tanh(5 * np.sin(a * t + p)) - 0.9 * c),
    )
    text, f = shapes[rng.integers(len(shapes))]
    length = 200 / max(a, b)
    return _of_section(
        "section of time", udd.Model(["y"], [law]), [start], text, roots(f, length, 6 * (a + b))
    )


def section_of_rotor(rng: np.random.Generator) -> Case | None:
    """An angle that runs on, at a speed that hardly changes."""
    v, slow, k, p = rng.uniform(1, 20), rng.choice([0.0, 1e-3, 0.05]), rng.integers(1, 4), rng.uniform(-3, 3)
    c = rng.choice([rng.uniform(-0.99, 0.99), 0.9995, 0.0])
    model = udd.Model(["theta", "v"], ["v", f"-{slow}*v"], angles=["theta"])
    moved = (lambda t: v * t) if slow == 0 else (lambda t: v * (1 - np.exp(-slow * t)) / slow)
    text, f = f"sin({k}*theta + {p}) = {c}", lambda t: np.sin(k * (1 + moved(t)) + p) - c
    return _of_section("section of a rotor", model, [1.0, v], text, roots(f, 60 / v, 3 * v * k))


def section_of_oscillator(rng: np.random.Generator) -> Case | None:
    """Products and powers of an oscillation, often near its crest."""
    a, near = 10.0 ** rng.uniform(-3, 3), 1 - 10.0 ** rng.uniform(-8, -0.3)
    b = rng.uniform(0.3, 9)
    model = udd.Model(["x", "v"], ["v", "-x"])
    p = rng.uniform(-3, 3)
    start = [a * np.cos(p), -a * np.sin(p)]
    shapes = (
        (f"x = {a * near}", lambda t: a * np.cos(t + p) - a * near),
        (f"x^2 = {a**2 * near}", lambda t: a**2 * (np.cos(t + p) ** 2 - near)),
        (f"x*v = {-a * a * near / 2}", lambda t: -(a**2) * (np.sin(2 * (t + p)) - near) / 2),
        (f"x*cos({b}*t) = {a * near / 2}", lambda t: a * (np.cos(t + p) * np.cos(b * t) - near / 2)),
        (f"sin({b / a}*x) = 0.3", lambda t: np.sin(b * np.cos(t + p)) - 0.3),
        ("x'", lambda t: -a * np.sin(t + p)),
    )
    text, f = shapes[rng.integers(len(shapes))]
    return _of_section("section of an oscillator", model, start, text, roots(f, 40.0, 4 * (b + 2)))


def section_of_polynomial(rng: np.random.Generator) -> Case | None:
    """A solution whose series ends, so that a single step goes to the end."""
    zeros = np.sort(rng.uniform(0.5, 12, rng.integers(2, 7)))
    if rng.random() < 0.3:
        zeros[1] = zeros[0] + 10.0 ** rng.uniform(-4, -1)
        zeros.sort()
    curve = np.polynomial.Polynomial.fromroots(zeros - 6)
    slope = curve.deriv().coef
    law = " + ".join(f"({c!r})*(t - 6)^{k}" if k else f"({c!r})" for k, c in enumerate(slope.tolist()))
    model, start = udd.Model(["y"], [law]), [float(curve(-6.0))]
    # Where rounding of the start may undo a pair.
    if len(zeros) > 1 and np.diff(zeros).min() < 1e-4:
        return None
    return _of_section("section of a polynomial", model, start, "y", zeros)


# --- switches


def _linear(matrix: Floats, force: Callable[[float], Floats], cuts: Floats, start: Floats) -> Floats:
    """The state at the last of these times of x' = matrix x + force, constant between them."""
    from scipy.linalg import expm

    x, n = start, len(start)
    for a, b in pairwise(cuts):
        wide = np.zeros((n + 1, n + 1))
        wide[:n, :n], wide[:n, n] = matrix, force(0.5 * (a + b))
        x = (expm(wide * (b - a)) @ np.append(x, 1.0))[:n]
    return x


def switch_of_time(rng: np.random.Generator) -> Case | None:
    """A slow circuit or an oscillator that a function of time switches."""
    a, b, p = rng.uniform(0.3, 12), rng.uniform(0.3, 12), rng.uniform(0, 6)
    c = rng.choice([rng.uniform(-0.95, 0.95), 0.9995, 0.0])
    shapes = (
        (f"sin({a}*t + {p}) > {c}", lambda t: np.sin(a * t + p) - c),
        (f"sin({a}*t + {p})*sin({b}*t) > {0.3 * c}", lambda t: np.sin(a * t + p) * np.sin(b * t) - 0.3 * c),
        (f"cos({a}*t)^2 > {abs(c)}", lambda t: np.cos(a * t) ** 2 - abs(c)),
    )
    text, g = shapes[rng.integers(3)]
    length = rng.uniform(5, 25)
    cuts = np.concatenate([[0.0], roots(g, length, 3 * (a + b)), [length]])
    on = lambda t: float(g(np.asarray(t)) > 0)  # noqa: E731
    if rng.random() < 0.5:
        slow = rng.choice([0.5, 5.0, 200.0])
        model = udd.Model(["x"], [f"(where({text}, 1, 0) - x)/{slow}"])
        end = _linear(np.array([[-1 / slow]]), lambda t: np.array([on(t) / slow]), cuts, np.zeros(1))
        return Case("switch of time", model, [0.0], length=length, end=end, what=text)
    model = udd.Model(["x", "v"], ["v", f"-x - 0.2*v + where({text}, 1, -1)"])
    end = _linear(
        np.array([[0.0, 1.0], [-1.0, -0.2]]), lambda t: np.array([0.0, 2 * on(t) - 1]), cuts, np.zeros(2)
    )
    return Case("switch of time", model, [0.0, 0.0], length=length, end=end, what=text)


def kink_of_time(rng: np.random.Generator) -> Case | None:
    """An integral of abs, min or max of a function of time."""
    from scipy.integrate import quad

    a, p, c = rng.uniform(0.3, 15), rng.uniform(0, 6), rng.uniform(-0.999, 0.999)
    length = rng.uniform(5, 25)
    cuts = np.concatenate([[0.0], roots(lambda t: np.cos(a * t + p) - c, length, a), [length]])
    text, f = [
        (f"abs(cos({a}*t + {p}) - {c})", lambda t: abs(np.cos(a * t + p) - c)),
        (f"max(cos({a}*t + {p}), {c})", lambda t: max(np.cos(a * t + p), c)),
        (f"min(cos({a}*t + {p}), {c})", lambda t: min(np.cos(a * t + p), c)),
        (f"sign(cos({a}*t + {p}) - {c})", lambda t: np.sign(np.cos(a * t + p) - c)),
    ][rng.integers(4)]
    parts = [quad(f, u, v, epsabs=1e-12)[0] for u, v in pairwise(cuts)]
    return Case(
        "kink of time", udd.Model(["x"], [text]), [0.0], length=length, end=np.array([sum(parts)]), what=text
    )


def switch_of_state(rng: np.random.Generator) -> Case | None:
    """A clock that runs while an oscillation is near its crest, or a product of it is."""
    p, near, b = rng.uniform(-3, 3), 1 - 10.0 ** rng.uniform(-7, -0.3), rng.uniform(0.3, 6)
    shapes = (
        (f"x > {near}", lambda t: np.cos(t + p) - near),
        (f"x^2 > {near}", lambda t: np.cos(t + p) ** 2 - near),
        (f"x*v > {near / 2}", lambda t: -np.sin(2 * (t + p)) / 2 - near / 2),
        (
            f"sin({b}*x) > {near * np.sin(min(b, 1.5))}",
            lambda t: np.sin(b * np.cos(t + p)) - near * np.sin(min(b, 1.5)),
        ),
        (f"x*cos({b}*t) > {near / 2}", lambda t: np.cos(t + p) * np.cos(b * t) - near / 2),
    )
    text, g = shapes[rng.integers(len(shapes))]
    length = rng.uniform(5, 30)
    cuts = np.concatenate([[0.0], roots(g, length, 8 + 2 * b), [length]])
    time = sum(v - u for u, v in pairwise(cuts) if g(np.asarray(0.5 * (u + v))) > 0)
    model = udd.Model(["x", "v", "y"], ["v", "-x", f"where({text}, 1, 0)"])
    start = [float(np.cos(p)), float(-np.sin(p)), 0.0]
    end = np.array([np.cos(length + p), -np.sin(length + p), time])
    # Where the solution's error moves a near-tangent by more.
    return Case("switch of state", model, start, length=length, end=end, error=2e-4, what=text)


def stick_slip(rng: np.random.Generator) -> Case | None:
    """A body that dry friction holds until a slow force lets it go."""
    force, hold, w = rng.uniform(1.05, 3), 1.0, 10.0 ** rng.uniform(-1.5, 0.7)
    length = rng.uniform(1, 3) * 2 * np.pi / w
    model = udd.Model(["x", "v"], ["v", f"{force}*sin({w}*t) - {hold}*sign(v)"])
    t, x, v = 0.0, 0.0, 0.0
    while t < length:
        # It sticks, until the force is as large as what holds it.
        side = 0.0
        if abs(force * np.sin(w * t)) <= hold + 1e-12:
            free = roots(lambda s: (force * np.sin(w * s)) ** 2 - hold**2, length, 4 * w)
            later = free[free > t + 1e-9]
            if not len(later):
                break
            t = float(later[0])
        side = float(np.sign(np.sin(w * t)))
        t0, x0 = t, x

        def speed(s: Floats, t0: float = t0, side: float = side) -> Floats:
            return -force / w * (np.cos(w * s) - np.cos(w * t0)) - hold * side * (s - t0)

        stops = roots(lambda s, speed=speed, t0=t0: speed(s + t0), 2 * np.pi / w, 4 * w)
        stops = stops[stops > 1e-6 / w]
        t = min(t0 + float(stops[0]) if len(stops) else length, length)
        x = x0 - force / w * ((np.sin(w * t) - np.sin(w * t0)) / w - np.cos(w * t0) * (t - t0))
        x -= hold * side * (t - t0) ** 2 / 2
        v = float(speed(np.asarray(t))) if t >= length else 0.0
    return Case(
        "stick and slip",
        model,
        [0.0, 0.0],
        length=length,
        end=np.array([x, v]),
        error=1e-5,
        what=f"{force} {w}",
    )


SECTIONS = (section_of_time, section_of_rotor, section_of_oscillator, section_of_polynomial)
SWITCHES = (switch_of_time, kink_of_time, switch_of_state, stick_slip)


def cases(seed: int, count: int, only: str = "") -> Iterator[tuple[str, Case]]:
    """So many cases, sections and switches in turn."""
    for i in range(count):
        makers = (SECTIONS, SWITCHES)[i % 2]
        rng = np.random.default_rng([seed, i])
        made = None
        while made is None:
            made = makers[rng.integers(len(makers))](rng)
        if only in made.kind:
            yield f"{seed}.{i}", made


def faults(case: Case) -> list[str]:
    """List the errors in udd's answers, each in a few words."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if case.times is not None:
            return _section_faults(case)
        return _switch_faults(case)


def _section_faults(case: Case) -> list[str]:
    right = case.times
    assert right is not None
    options = {"state0": case.start, "transient": 0, "direction": "both", "rtol": 1e-12, "atol": 1e-14}
    result = udd.poincare(case.model, case.section, len(right), t_max=right[-1] + 1e-3, **options)
    times = result.t
    if len(times) != len(right):
        return [f"poincare: {len(times)} of {len(right)} crossings"]
    off = float(np.abs(times - right).max())
    # A near-tangent is as uncertain as the square root of the solution's error.
    return [f"poincare: off by {off:.1e}"] if off > 2e-5 * max(1.0, right[-1]) else []


def _switch_faults(case: Case) -> list[str]:
    assert case.end is not None
    result = {}
    for method in METHODS:
        run = udd.simulate(case.model, [0.0, case.length], case.start, method=method, rtol=1e-10, atol=1e-12)
        result[method] = run.state[-1]
    many = udd.ensemble(case.model, [0.0, case.length], [case.start] * 2, rtol=1e-10, atol=1e-12)
    result["ensemble"] = many.end[1]
    wrong = []
    for name, end in result.items():
        off = float(np.abs(end - case.end).max())
        if not off < case.error:
            wrong.append(f"{name}: off by {off:.1e}")
    return wrong


def _work(task: tuple[int, int, int, int, str]) -> tuple[collections.Counter[str], list[str]]:
    seed, count, first, jobs, only = task
    tally: collections.Counter[str] = collections.Counter()
    wrong = []
    for i, (name, case) in enumerate(cases(seed, count, only)):
        if i % jobs != first:
            continue
        tally[case.kind] += 1
        try:
            result = faults(case)
        except Exception as error:
            result = [f"{type(error).__name__}: {error}"]
        if result:
            wrong.append(f"{name} {case.kind} ({case.what}; from {case.start}): {'; '.join(result)}")
            print(wrong[-1], flush=True)
    return tally, wrong


def main() -> None:
    """Print each fault and the number of cases of each kind."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--only", default="", help="kinds whose name contains this")
    chosen = parser.parse_args()
    tasks = [(chosen.seed, chosen.cases, k, chosen.jobs, chosen.only) for k in range(chosen.jobs)]
    if chosen.jobs == 1:
        results = [_work(tasks[0])]
    else:
        with multiprocessing.Pool(chosen.jobs) as pool:
            results = pool.map(_work, tasks)
    tally: collections.Counter[str] = sum((own for own, _ in results), collections.Counter())
    wrong = sum(len(own) for _, own in results)
    for kind, number in sorted(tally.items()):
        print(f"{kind:26}{number:7}")
    print(f"{wrong} of {tally.total()} cases are wrong")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
