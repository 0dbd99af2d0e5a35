"""Models whose attractors are known, moved and stretched at random: none of that may change a verdict."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import udd

__all__ = ["KINDS", "Case", "drawn"]

Floats = NDArray[np.float64]

KINDS = ("equilibrium", "periodic orbit", "torus", "chaos", "escapes")


@dataclass(frozen=True)
class Law:
    """Equations, a typical start, and what orbits from there end on.

    `spread` is how far around the start they all do; `section` is for basins if the default is not crossed.
    """

    name: str
    kind: str
    states: tuple[str, ...]
    equations: tuple[str, ...]
    start: tuple[float, ...]
    spread: float = 0.1
    angles: tuple[str, ...] = ()
    section: str | None = None
    parameters: tuple[tuple[str, tuple[float, float]], ...] = ()


@dataclass(frozen=True, eq=False)
class Case:
    """A law with drawn parameters, origin and units."""

    name: str
    kind: str
    model: udd.Model
    start: Floats
    spread: Floats
    section: str | None


LORENZ = ("10*(y - x)", "r*x - y - x*z", "x*y - 8/3*z")
XYZ, XV = ("x", "y", "z"), ("x", "v")
FORCED = "c*v - x^3 + f*cos(t)"

LAWS = (
    Law("focus", "equilibrium", XV, ("v", "-x - c*v"), (1.0, 0.5), 0.5, parameters=(("c", (0.01, 1.5)),)),
    Law(
        "node",
        "equilibrium",
        XYZ,
        ("-a*x + y", "-2*y + 0.3*z", "-0.5*z"),
        (1.0, -1.0, 2.0),
        0.5,
        parameters=(("a", (0.1, 3.0)),),
    ),
    Law(
        "two wells",
        "equilibrium",
        XV,
        ("v", "x - x^3 - c*v"),
        (1.2, 0.1),
        0.02,
        parameters=(("c", (0.1, 1.0)),),
    ),
    Law(
        "Lorenz at rest", "equilibrium", XYZ, LORENZ, (7.0, 7.0, 14.0), 0.1, parameters=(("r", (14.0, 17.0)),)
    ),
    Law(
        "hanging pendulum",
        "equilibrium",
        ("q", "v"),
        ("v", "-sin(q) - c*v"),
        (1.0, 0.3),
        0.3,
        ("q",),
        parameters=(("c", (0.1, 1.0)),),
    ),
    Law(
        "locked phase",
        "equilibrium",
        ("q",),
        ("a - sin(q)",),
        (0.3,),
        0.2,
        ("q",),
        parameters=(("a", (-0.8, 0.8)),),
    ),
    Law("one state", "equilibrium", ("x",), ("x - x^3",), (0.7,), 0.2),
    Law(
        "tanks",
        "equilibrium",
        ("x", "y"),
        ("1 - a*sqrt(x)", "a*sqrt(x) - 0.4*sqrt(y)"),
        (4.0, 6.0),
        0.2,
        parameters=(("a", (0.4, 0.7)),),
    ),
    Law(
        "Van der Pol",
        "periodic orbit",
        XV,
        ("v", "m*(1 - x^2)*v - x"),
        (1.0, 0.5),
        0.3,
        parameters=(("m", (0.2, 3.0)),),
    ),
    Law(
        "Hopf",
        "periodic orbit",
        ("x", "y"),
        ("a*x - y - x*(x^2 + y^2)", "x + a*y - y*(x^2 + y^2)"),
        (0.5, 0.1),
        0.1,
        parameters=(("a", (0.2, 1.0)),),
    ),
    Law(
        "Brusselator",
        "periodic orbit",
        ("x", "y"),
        ("1 - (b + 1)*x + x^2*y", "b*x - x^2*y"),
        (1.2, 2.5),
        0.1,
        parameters=(("b", (2.2, 3.5)),),
    ),
    Law(
        "Lorenz, r = 160",
        "periodic orbit",
        XYZ,
        LORENZ,
        (10.0, 20.0, 150.0),
        0.02,
        parameters=(("r", (159.0, 161.0)),),
    ),
    Law(
        "Roessler, period 1",
        "periodic orbit",
        XYZ,
        ("-y - z", "x + 0.1*y", "0.1 + z*(x - c)"),
        (4.0, 0.0, 0.1),
        0.1,
        parameters=(("c", (3.5, 4.5)),),
    ),
    Law(
        "forced oscillator",
        "periodic orbit",
        XV,
        ("v", "-x - c*v + cos(0.8*t)"),
        (1.0, 0.0),
        0.5,
        parameters=(("c", (0.1, 0.8)),),
    ),
    Law("energy kept", "periodic orbit", XV, ("v", "-sin(x)"), (1.0, 0.0), 0.2),
    Law(
        "running pendulum",
        "periodic orbit",
        ("q", "v"),
        ("v", "a - 0.5*v - sin(q)"),
        (0.0, 3.0),
        0.3,
        ("q",),
        "sin(q)",
        parameters=(("a", (1.2, 3.0)),),
    ),
    Law(
        "running phase",
        "periodic orbit",
        ("q",),
        ("a - sin(q)",),
        (0.0,),
        0.3,
        ("q",),
        "sin(q)",
        parameters=(("a", (1.1, 3.0)),),
    ),
    Law(
        "running back",
        "periodic orbit",
        ("q", "v"),
        ("v", "-a - 0.4*v - sin(q)"),
        (0.0, -3.0),
        0.3,
        ("q",),
        "-sin(q)",
        parameters=(("a", (1.2, 3.0)),),
    ),
    Law(
        "two frequencies",
        "torus",
        ("x", "v", "y", "w"),
        ("v", "(1 - x^2)*v - x", "w", "b*(1 - y^2)*w - 1.7*y"),
        (1.0, 0.0, 0.5, 0.3),
        0.2,
        parameters=(("b", (0.5, 1.5)),),
    ),
    Law(
        "two circles",
        "torus",
        ("x", "y", "u", "w"),
        (
            "x*(1 - x^2 - y^2) - y",
            "y*(1 - x^2 - y^2) + x",
            "u*(1 - u^2 - w^2) - b*w",
            "w*(1 - u^2 - w^2) + b*u",
        ),
        (1.0, 0.0, 0.5, 0.3),
        0.2,
        parameters=(("b", (1.4142, 1.4143)),),
    ),
    Law(
        "forced circle",
        "torus",
        ("x", "y"),
        ("x*(1 - x^2 - y^2) - 1.618*y + 0.1*cos(t)", "y*(1 - x^2 - y^2) + 1.618*x"),
        (1.0, 0.0),
        0.2,
    ),
    Law("Lorenz", "chaos", XYZ, LORENZ, (1.0, 1.0, 25.0), 0.1, parameters=(("r", (28.0, 28.0)),)),
    Law("Roessler", "chaos", XYZ, ("-y - z", "x + 0.2*y", "0.2 + z*(x - 5.7)"), (1.0, 1.0, 0.1), 0.1),
    Law("no diffusion", "chaos", XYZ, ("y - x", "x*z", "1 - x*y"), (1.0, 1.0, 0.01), 0.05),
    Law("Ueda", "chaos", XV, ("v", "-0.05*v - x^3 + 7.5*cos(t)"), (3.0, 4.0), 0.02),
    Law(
        "spiral out",
        "escapes",
        ("x", "y"),
        ("a*x - y", "x + a*y"),
        (0.5, 0.5),
        0.1,
        parameters=(("a", (0.01, 0.3)),),
    ),
    Law("saddle", "escapes", ("x", "y"), ("a*x", "-y"), (0.01, 1.0), 0.1, parameters=(("a", (0.05, 1.0)),)),
    Law("growth", "escapes", ("x",), ("a*x",), (1.0,), 0.1, parameters=(("a", (0.05, 2.0)),)),
    Law(
        "drift", "escapes", ("x", "y"), ("a", "-y + x - x"), (0.0, 1.0), 0.1, parameters=(("a", (0.5, 2.0)),)
    ),
    Law("free fall", "escapes", XV, ("v", "1 - 0*v"), (0.0, 0.0), 0.1),
    Law("blow-up", "escapes", ("x",), ("x^2 + 1",), (0.0,), 0.1),
    Law(
        "angle not named",
        "escapes",
        XV,
        ("v", "a - 0.5*v - sin(x)"),
        (0.0, 3.0),
        0.1,
        parameters=(("a", (1.5, 3.0)),),
    ),
)


def moved(equations: tuple[str, ...], states: tuple[str, ...], origin: Floats, size: Floats) -> list[str]:
    """The equations of ``X = origin + size x``."""
    made = []
    for text, scale in zip(equations, size, strict=True):
        for name, zero, unit in zip(states, origin, size, strict=True):
            text = re.sub(rf"\b{name}\b", f"(({name}_ - ({float(zero)!r}))/({float(unit)!r}))", text)
        made.append(f"{float(scale)!r}*({text.replace('_', '')})")
    return made


def drawn(count: int, seed: int) -> Iterator[Case]:
    """Cases of all laws in turn: each as it is written first, then with another origin and other units."""
    random = np.random.default_rng(seed)
    for k in range(count):
        law = LAWS[k % len(LAWS)]
        plain = np.array([name not in law.angles for name in law.states])
        far = random.uniform(-1.0, 1.0, len(plain)) * 10.0 ** random.uniform(0.0, 3.0)
        unit = 10.0 ** random.uniform(-2.0, 2.0)
        size = np.where(plain, unit if k >= len(LAWS) else 1.0, 1.0)
        origin = np.where(plain & (k >= len(LAWS)), far * size, 0.0)
        values = {name: float(random.uniform(*range_)) for name, range_ in law.parameters}
        if k >= len(LAWS):
            # Rates of angles stay rates: only states that are no angle's rate have units of their own.
            rates = [law.equations[i] for i, item in enumerate(plain) if not item]
            for i, name in enumerate(law.states):
                if name in rates:
                    size[i], origin[i] = 1.0, 0.0
        model = udd.Model(
            law.states, moved(law.equations, law.states, origin, size), values, angles=law.angles
        )
        start = origin + size * np.array(law.start)
        yield Case(f"{k} {law.name}", law.kind, model, start, law.spread * size, law.section)
