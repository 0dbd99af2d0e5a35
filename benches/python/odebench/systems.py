"""The 63 systems of ODEBench (d'Ascoli et al. 2024, arXiv:2310.05573), each equation as a sum of terms.

The equations, constants and starts are those of `odeformer/odebench/strogatz_equations.py` in
github.com/sdascoli/odeformer, products multiplied out. A term is a factor and a function of the states. A
factor that is a whole number is a number of the equation; any other is a constant, and so are the shapes,
the numbers inside of functions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import log

Term = tuple[float, str]


@dataclass(frozen=True)
class System:
    """A system with its constants and its two starts.

    `equations` has the terms of each state's rate, `angles` the states that are angles; a record lasts from 0
    to `last`.
    """

    number: int
    title: str
    equations: Mapping[str, tuple[Term, ...]]
    starts: tuple[tuple[float, ...], tuple[float, ...]]
    shapes: Mapping[str, float] = field(default_factory=dict)
    angles: str = ""
    last: float = 10.0

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the states."""
        return tuple(self.equations)

    def kinematic(self, state: str) -> bool:
        """Whether the equation only says that one state is the rate of another."""
        terms = self.equations[state]
        return len(terms) == 1 and terms[0][0] == 1 and terms[0][1] in self.equations

    def terms(self) -> Iterator[tuple[str, int]]:
        """Every term that can be missing: its equation's state and its place there."""
        for state, own in self.equations.items():
            if not self.kinematic(state):
                yield from ((state, k) for k in range(len(own)))


def _lorenz(number: int, regime: str, sigma: float, rho: float, beta: float) -> System:
    return System(
        number,
        f"Lorenz, {regime}",
        {
            "x": ((sigma, "y"), (-sigma, "x")),
            "y": ((rho, "x"), (-1, "y"), (-1, "x*z")),
            "z": ((1, "x*y"), (-beta, "z")),
        },
        ((2.3, 8.1, 12.4), (10.0, 20.0, 30.0)),
    )


def _roessler(number: int, regime: str, a: float) -> System:
    return System(
        number,
        f"Roessler, {regime}",
        {
            "x": ((-5.0, "y"), (-5.0, "z")),
            "y": ((5.0, "x"), (5.0 * a, "y")),
            "z": ((5.0 * 0.2, "1"), (5.0, "x*z"), (-5.0 * 5.7, "z")),
        },
        ((2.3, 1.1, 0.8), (-0.1, 4.1, -2.1)),
    )


_ONE = (
    System(1, "RC circuit", {"x": ((0.7 / 2.31, "1"), (-1 / (1.2 * 2.31), "x"))}, ((10.0,), (3.54,))),
    System(2, "exponential growth", {"x": ((0.23, "x"),)}, ((4.78,), (0.87,))),
    System(3, "logistic growth", {"x": ((0.79, "x"), (-0.79 / 74.3, "x^2"))}, ((7.3,), (21.0,))),
    System(
        4,
        "RC circuit, nonlinear resistor",
        {"x": ((1, "1/(1 + exp(a - x/b))"), (-0.5, "1"))},
        ((0.8,), (0.02,)),
        {"a": 0.5, "b": 0.96},
    ),
    System(5, "fall with air resistance", {"x": ((9.81, "1"), (-0.0021175, "x^2"))}, ((0.5,), (73.0,))),
    System(6, "autocatalysis", {"x": ((2.1, "x"), (-0.5, "x^2"))}, ((0.13,), (2.24,))),
    System(7, "Gompertz", {"x": ((0.032, "x*log(x)"), (0.032 * log(2.29), "x"))}, ((1.73,), (9.5,))),
    System(
        8,
        "logistic growth, Allee effect",
        {"x": ((-0.14, "x"), (0.14 * (1 / 4.4 + 1 / 130), "x^2"), (-0.14 / (4.4 * 130), "x^3"))},
        ((6.123,), (2.1,)),
    ),
    System(9, "language death", {"x": ((0.32, "1"), (-0.6, "x"))}, ((0.14,), (0.55,))),
    System(
        10,
        "language death, refined",
        {"x": ((0.2, "(1 - x)*x^a"), (-0.8, "x*(1 - x)^a"))},
        ((0.83,), (0.34,)),
        {"a": 1.2},
    ),
    System(11, "critical slowing down", {"x": ((-1, "x^3"),)}, ((3.4,), (1.6,))),
    System(12, "laser photons", {"x": ((1.8, "x"), (-0.1107, "x^2"))}, ((11.0,), (1.3,))),
    System(
        13,
        "overdamped bead on a hoop",
        {"x": ((0.0981 * 9.7, "sin(x)*cos(x)"), (-0.0981, "sin(x)"))},
        ((3.1,), (2.4,)),
        angles="x",
    ),
    System(
        14,
        "budworms",
        {"x": ((0.78, "x"), (-0.78 / 81, "x^2"), (-0.9, "x^2/(a^2 + x^2)"))},
        ((2.76,), (23.3,)),
        {"a": 21.2},
    ),
    System(
        15,
        "budworms, dimensionless",
        {"x": ((0.4, "x"), (-0.4 / 95, "x^2"), (-1, "x^2/(1 + x^2)"))},
        ((44.3,), (4.5,)),
    ),
    System(16, "Landau", {"x": ((0.1, "x"), (0.04, "x^3"), (-0.001, "x^5"))}, ((0.94,), (1.65,))),
    System(17, "harvesting", {"x": ((0.4, "x"), (-0.004, "x^2"), (-0.3, "1"))}, ((14.3,), (34.2,))),
    System(
        18,
        "harvesting, improved",
        {"x": ((0.4, "x"), (-0.004, "x^2"), (-0.24, "x/(a + x)"))},
        ((21.1,), (44.1,)),
        {"a": 50.0},
    ),
    System(
        19,
        "harvesting, dimensionless",
        {"x": ((1, "x"), (-1, "x^2"), (-0.08, "x/(a + x)"))},
        ((0.13,), (0.03,)),
        {"a": 0.8},
    ),
    System(20, "gene switch", {"x": ((0.1, "1"), (-0.55, "x"), (1, "x^2/(1 + x^2)"))}, ((0.002,), (0.25,))),
    System(21, "SIR, the dead", {"x": ((1.2, "1"), (-0.2, "x"), (-1, "exp(-x)"))}, ((0.0,), (0.8,))),
    System(
        22,
        "protein expression",
        {"x": ((1.4, "1"), (0.4, "x^5/(a + x^5)"), (-0.89, "x"))},
        ((3.1,), (6.3,)),
        {"a": 123.0},
    ),
    System(23, "overdamped pendulum", {"x": ((0.21, "1"), (-1, "sin(x)"))}, ((-2.74,), (1.65,)), angles="x"),
)

_RATE = ((1, "y"),)

_TWO = (
    System(24, "harmonic oscillator", {"x": _RATE, "y": ((-2.1, "x"),)}, ((0.4, -0.03), (0.0, 0.2))),
    System(
        25,
        "damped oscillator",
        {"x": _RATE, "y": ((-4.5, "x"), (-0.43, "y"))},
        ((0.12, 0.043), (0.0, -0.3)),
    ),
    System(
        26,
        "Lotka-Volterra competition",
        {"x": ((3.0, "x"), (-1, "x^2"), (-2.0, "x*y")), "y": ((2.0, "y"), (-1, "x*y"), (-1, "y^2"))},
        ((5.0, 4.3), (2.3, 3.6)),
    ),
    System(
        27,
        "Lotka-Volterra",
        {"x": ((1.84, "x"), (-1.45, "x*y")), "y": ((-3.0, "y"), (1.62, "x*y"))},
        ((8.3, 3.4), (0.4, 0.65)),
    ),
    System(28, "pendulum", {"x": _RATE, "y": ((-0.9, "sin(x)"),)}, ((-1.9, 0.0), (0.3, 0.8)), angles="x"),
    System(29, "dipole", {"x": ((0.65, "x*y"),), "y": ((1, "y^2"), (-1, "x^2"))}, ((3.2, 1.4), (1.3, 0.2))),
    System(
        30,
        "RNA replication",
        {"x": ((1, "x*y"), (-1.61, "x^2*y")), "y": ((1, "x*y"), (-1.61, "x*y^2"))},
        ((0.3, 0.04), (0.1, 0.21)),
    ),
    System(
        31,
        "SIR",
        {"x": ((-0.4, "x*y"),), "y": ((0.4, "x*y"), (-0.314, "y"))},
        ((7.2, 0.98), (20.0, 12.4)),
    ),
    System(
        32,
        "damped double well",
        {"x": _RATE, "y": ((-0.18, "y"), (1, "x"), (-1, "x^3"))},
        ((-1.8, -1.8), (5.8, 0.0)),
    ),
    System(
        33,
        "glider",
        {"x": ((-1, "sin(y)"), (-0.08, "x^2")), "y": ((1, "x"), (-1, "cos(y)/x"))},
        ((5.0, 0.7), (9.81, -0.8)),
        angles="y",
    ),
    System(
        34,
        "bead on a hoop",
        {"x": _RATE, "y": ((1, "sin(x)*cos(x)"), (-0.93, "sin(x)"))},
        ((2.1, 0.0), (-1.2, -0.2)),
        angles="x",
    ),
    System(
        35,
        "rotation in a shear flow",
        {
            "x": ((1, "cos(y)/sin(y)*cos(x)"),),
            "y": ((1, "sin(x)*cos(y)^2"), (4.2, "sin(x)*sin(y)^2")),
        },
        ((1.13, -0.3), (2.4, 1.7)),
        angles="xy",
    ),
    System(
        36,
        "pendulum, nonlinear damping",
        {"x": _RATE, "y": ((-1, "sin(x)"), (-1, "y"), (-0.07, "y*cos(x)"))},
        ((0.45, 0.9), (1.34, -0.8)),
        angles="x",
    ),
    System(
        37,
        "Van der Pol",
        {"x": _RATE, "y": ((-1, "x"), (0.43, "y"), (-0.43, "x^2*y"))},
        ((2.2, 0.0), (0.1, 3.2)),
    ),
    System(
        38,
        "Van der Pol, Lienard's form",
        {"x": ((3.37, "y"), (-3.37 / 3, "x^3"), (3.37, "x")), "y": ((-1 / 3.37, "x"),)},
        ((0.7, 0.0), (-1.1, -0.7)),
    ),
    System(
        39,
        "glycolysis",
        {"x": ((-1, "x"), (2.4, "y"), (1, "x^2*y")), "y": ((0.07, "1"), (-2.4, "x"), (-1, "x^2*y"))},
        ((0.4, 0.31), (0.2, -0.7)),
    ),
    System(
        40,
        "weakly nonlinear oscillator",
        {"x": _RATE, "y": ((-1, "x"), (0.886, "y"), (-0.886, "x^2*y"))},
        ((0.63, -0.03), (0.2, 0.2)),
    ),
    System(
        41,
        "cell cycle",
        {
            "x": ((0.0153, "y"), (-1.0153, "x"), (15.3, "x^2*y"), (-15.3, "x^3")),
            "y": ((0.3, "1"), (-1, "x")),
        },
        ((0.8, 0.3), (0.02, 1.2)),
    ),
    System(
        42,
        "chlorine dioxide, iodine, malonic acid",
        {
            "x": ((8.9, "1"), (-1, "x"), (-4.0, "x*y/(1 + x^2)")),
            "y": ((1.4, "x"), (-1.4, "x*y/(1 + x^2)")),
        },
        ((0.2, 0.35), (3.0, 7.8)),
    ),
    System(
        43,
        "driven pendulum, linear damping",
        {"x": _RATE, "y": ((1.67, "1"), (-1, "sin(x)"), (-0.64, "y"))},
        ((1.47, -0.2), (-1.9, 0.03)),
        angles="x",
    ),
    System(
        44,
        "driven pendulum, quadratic damping",
        {"x": _RATE, "y": ((1.67, "1"), (-1, "sin(x)"), (-0.64, "y*abs(y)"))},
        ((1.47, -0.2), (-1.9, 0.03)),
        angles="x",
    ),
    System(
        45,
        "Gray-Scott",
        {"x": ((0.5, "1"), (-0.5, "x"), (-1, "x*y^2")), "y": ((1, "x*y^2"), (-0.02, "y"))},
        ((1.4, 0.2), (0.32, 0.64)),
    ),
    System(
        46,
        "bar magnets",
        {"x": ((0.33, "sin(x - y)"), (-1, "sin(x)")), "y": ((-0.33, "sin(x - y)"), (-1, "sin(y)"))},
        ((0.54, -0.1), (0.43, 1.21)),
        angles="xy",
    ),
    System(
        47,
        "binocular rivalry",
        {
            "x": ((-1, "x"), (1, "1/(1 + exp(a*y - b))")),
            "y": ((-1, "y"), (1, "1/(1 + exp(a*x - b))")),
        },
        ((0.65, 0.59), (3.2, 10.3)),
        {"a": 4.89, "b": 1.4},
    ),
    System(
        48,
        "bacterial respiration",
        {
            "x": ((18.3, "1"), (-1, "x"), (-1, "x*y/(1 + a*x^2)")),
            "y": ((11.23, "1"), (-1, "x*y/(1 + a*x^2)")),
        },
        ((0.1, 30.4), (13.2, 5.21)),
        {"a": 0.48},
    ),
    System(
        49,
        "Brusselator",
        {"x": ((1, "1"), (-4.03, "x"), (3.1, "x^2*y")), "y": ((3.03, "x"), (-3.1, "x^2*y"))},
        ((0.7, -1.4), (2.1, 1.3)),
    ),
    System(
        50,
        "Schnackenberg",
        {"x": ((0.24, "1"), (-1, "x"), (1, "x^2*y")), "y": ((1.43, "1"), (-1, "x^2*y"))},
        ((0.14, 0.6), (1.5, 0.9)),
    ),
    System(
        51,
        "oscillator death",
        {"x": ((1.432, "1"), (1, "sin(y)*cos(x)")), "y": ((0.972, "1"), (1, "sin(y)*cos(x)"))},
        ((2.2, 0.67), (0.03, -0.12)),
        angles="xy",
    ),
)

_MORE = (
    System(
        52,
        "Maxwell-Bloch",
        {
            "x": ((0.1, "y"), (-0.1, "x")),
            "y": ((0.21, "x*z"), (-0.21, "y")),
            "z": ((0.34 * 4.1, "1"), (-0.34, "z"), (-0.34 * 3.1, "x*y")),
        },
        ((1.3, 1.1, 0.89), (0.89, 1.3, 1.1)),
    ),
    System(
        53,
        "apoptosis",
        {
            "x": ((0.1, "1"), (-0.4, "x*y/(a + x)"), (-0.05, "x")),
            "y": ((0.06, "z"), (0.6, "y*z"), (-0.2, "y/(b + y)"), (-7.95, "x*y/(d + y)")),
            "z": ((-0.06, "z"), (-0.6, "y*z"), (0.2, "y/(b + y)"), (7.95, "x*y/(d + y)")),
        },
        ((0.005, 0.26, 2.15), (0.248, 0.0973, 0.0027)),
        {"a": 0.1, "b": 0.1, "d": 2.0},
    ),
    _lorenz(54, "stable", 5.1, 12.0, 1.67),
    _lorenz(55, "periodic", 10.0, 99.96, 8 / 3),
    _lorenz(56, "chaotic", 10.0, 28.0, 8 / 3),
    _roessler(57, "stable", -0.2),
    _roessler(58, "periodic", 0.1),
    _roessler(59, "chaotic", 0.2),
    System(
        60,
        "Aizawa",
        {
            "x": ((1, "x*z"), (-0.7, "x"), (-3.5, "y")),
            "y": ((3.5, "x"), (1, "y*z"), (-0.7, "y")),
            "z": (
                (0.65, "1"),
                (0.95, "z"),
                (-1 / 3, "z^3"),
                (-1, "x^2"),
                (-1, "y^2"),
                (-0.25, "x^2*z"),
                (-0.25, "y^2*z"),
                (0.1, "x^3*z"),
            ),
        },
        ((0.1, 0.05, 0.05), (-0.3, 0.2, 0.1)),
    ),
    System(
        61,
        "Chen-Lee",
        {
            "x": ((5.0, "x"), (-1, "y*z")),
            "y": ((-10.0, "y"), (1, "x*z")),
            "z": ((-3.8, "z"), (1 / 3, "x*y")),
        },
        ((15.0, -15.0, -15.0), (8.0, 14.0, -10.0)),
    ),
    System(
        62,
        "binocular rivalry with adaptation",
        {
            "x": ((-1, "x"), (1, "1/(1 + exp(a*z + b*y - d))")),
            "y": ((1.0, "x"), (-1.0, "y")),
            "z": ((-1, "z"), (1, "1/(1 + exp(a*x + b*w - d))")),
            "w": ((1.0, "z"), (-1.0, "w")),
        },
        ((2.25, -0.5, -1.13, 0.4), (0.342, -0.431, -0.86, 0.041)),
        {"a": 0.89, "b": 0.4, "d": 1.4},
    ),
    System(
        63,
        "SEIR",
        {
            "x": ((-0.28, "x*z"),),
            "y": ((0.28, "x*z"), (-0.47, "y")),
            "z": ((0.47, "y"), (-0.3, "z")),
            "w": ((0.3, "z"),),
        },
        ((0.6, 0.3, 0.09, 0.01), (0.4, 0.3, 0.25, 0.05)),
    ),
)

SYSTEMS = {one.number: one for one in (*_ONE, *_TWO, *_MORE)}
