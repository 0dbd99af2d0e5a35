"""Bounds of errors against values of 30 digits and more: the error over the bound, none above 1.

Periods by power series in decimal arithmetic and Newton's method, Hopf points by fractions, homoclinic orbits
by power series from the unstable manifold of the saddle. Points of codimension two, ends of branches,
multipliers, coefficients, and homoclinic and heteroclinic orbits of two families by closed forms.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from decimal import Decimal, getcontext
from fractions import Fraction
from pathlib import Path

import numpy as np

import udd

sys.path.append(str(Path(__file__).parents[2] / "tests" / "support"))

from exact_cycles import step, symmetric_period

_DIGITS, _STEP = 50, Decimal("0.1")
_FRICTION = 0.4
DRAG = Decimal(_FRICTION)  # as the float in the jerk equation


def row(what: str, value: float, known: Decimal, bound: float) -> float:
    """Print a row of the table; its last number."""
    error = float(abs(Decimal(value) - known))
    print(f"| {what} | {known:.30g} | {error:.1e} | {bound:.1e} | {error / bound:.2f} |", flush=True)
    return error / bound


def periods() -> list[float]:
    """Compare periods of the symmetric cycle of the DLE."""
    rows = []
    for w in (7.1, 7.5, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 30.0, 50.0, 70.0, 100.0):
        orbit = udd.periodic_orbit(udd.DLE(w))
        rows.append(row(f"period at w = {w:g}", orbit.period, symmetric_period(orbit), orbit.period_error))
    return rows


def hopf_points() -> list[float]:
    """Compare Hopf points of the damped equations: w = (1 - B)/(B (1 + B)), frequency sqrt((1 - B)/B)."""
    rows = []
    for B in (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9):
        b = Fraction(B)
        exact = (1 - b) / (b * (1 + b))
        rests = udd.equilibria(udd.DLE(0.8 * float(exact), B=B))
        start = next(rest for rest in rests if rest.state[0] > 1e-3)
        (hopf,) = udd.continuation(start, "w", (0.5 * float(exact), 2.0 * float(exact))).points
        known = Decimal(exact.numerator) / Decimal(exact.denominator)
        rows.append(row(f"Hopf point at B = {B:g}", hopf.value, known, hopf.error))
        squared = (1 - b) / b
        turn = 2 * PI / (Decimal(squared.numerator) / Decimal(squared.denominator)).sqrt()
        rows.append(row(f"its period at B = {B:g}", hopf.period, turn, hopf.period_error))
    return rows


def special_points() -> list[float]:
    """Compare points of codimension two: cusps, Bogdanov-Takens and Bautin points with closed forms."""
    rows = []
    for p2 in (10.0, 12.0, 14.0, 18.0, 20.0):
        # A -> B in a stirred reactor: v = 2 and u = 1/2 at the cusp.
        texts = ["-u + p1*(1 - u)*exp(v)", f"-v + p1*{p2}*(1 - u)*exp(v) - p3*v"]
        model = udd.Model(["u", "v"], texts, {"p1": 0.01, "p3": p2 / 4 - 1.5})
        rest = udd.equilibria(model, near=[0.05, 0.2])[0]
        fold = udd.continuation(rest, "p1", (0.0, 1.0)).find("fold")[0]
        curve = udd.locus(fold, "p3", (p2 / 4 - 1.6, p2 / 4), within=(0.0, 1.0))
        (cusp,) = (point for point in curve.points if point.kind == "cusp")
        known = Decimal(-2).exp(), Decimal(p2) / 4 - 1
        for k, name in enumerate(cusp.parameters):
            rows.append(row(f"{name} of the cusp at p2 = {p2:g}", cusp.values[k], known[k], cusp.errors[k]))
    c, d = 0.3, 0.7
    plane = udd.Model(["x", "v"], ["v", f"x^2 - (m - {d}) + v*(b - {c} + x)"], {"b": 1.1, "m": 1.7})
    rest = min(udd.equilibria(plane), key=lambda one: float(one.state[0]))
    (hopf,) = udd.continuation(rest, "b", (-1.0, 3.0)).find("Hopf")
    (takens,) = udd.locus(hopf, "m", (0.0, 3.0), within=(-1.0, 3.0)).points
    square = "(x^2 + y^2)"
    radial = f"(mu - {c} + (a - {d})*{square} - 0.7*{square}^2)"
    wheel = udd.Model(["x", "y"], [f"x*{radial} - 2*y", f"y*{radial} + 2*x"], {"mu": 0.2, "a": 0.3})
    (hopf,) = udd.continuation(udd.equilibria(wheel, near=[0.0, 0.0])[-1], "mu", (-0.2, 0.8)).find("Hopf")
    (bautin,) = udd.locus(hopf, "a", (-0.3, 1.7), within=(-0.2, 0.8)).points
    for point in (takens, bautin):
        for k, name in enumerate(point.parameters):
            at = Decimal((c, d)[k])
            rows.append(row(f"{name} of the {point.kind} point", point.values[k], at, point.errors[k]))
    for name, value in takens.coefficients.items():
        bound = takens.coefficient_errors[name]
        rows.append(row(f"coefficient {name} of the {takens.kind} point", value, Decimal(1), bound))
    known = -2 * Decimal(d)
    bound = bautin.coefficient_errors["l2"]
    rows.append(row("coefficient l2 of the Bautin point", bautin.coefficients["l2"], known, bound))
    return rows


def ends_of_branches() -> list[float]:
    """Compare ends of branches: Hopf points, pitchforks, a fold of cycles, a saddle-node on a circle."""
    rows = []
    pitchfork, fifth = 0.6, 0.7  # as floats, which the models have
    for A in (0.8, 1.0, 1.3):
        model = udd.Model(["x", "y"], ["A + x^2*y - (b + 1)*x", "b*x - x^2*y"], {"A": A, "b": 1.3 + A * A})
        orbit = udd.periodic_orbit(model, [1.0, 2.0], settle=200.0)
        (hopf,) = udd.continuation(orbit, "b", direction="down").find("Hopf")
        known = 1 + Decimal(A) ** 2
        rows.append(row(f"Hopf point of the Brusselator at A = {A:g}", hopf.value, known, hopf.error))
    for r in (0.61, 0.9, 2.0):
        model = udd.Model(["x"], ["(r - 0.6)*x - x^3"], {"r": r})
        side = max(udd.equilibria(model), key=lambda rest: float(rest.state[0]))
        (point,) = udd.continuation(side, "r", (0.0, 3.0), direction="down").points
        rows.append(row(f"pitchfork from r = {r:g}", point.value, Decimal(pitchfork), point.error))
    square = "(x^2 + y^2)"
    for a in (0.4, 0.9):
        radial = f"(mu + {a}*{square} - 0.7*{square}^2)"
        wheel = udd.Model(["x", "y"], [f"x*{radial} - 2*y", f"y*{radial} + 2*x"], {"mu": 0.1})
        orbit = udd.periodic_orbit(wheel, [1.0, 0.0], settle=100.0)
        fold = udd.continuation(orbit, "mu", (-0.5, 0.5), direction="down").find("fold")[0]
        known = -(Decimal(a) ** 2) / (4 * Decimal(fifth))
        rows.append(row(f"fold of cycles at a = {a:g}", fold.value, known, fold.error))
        rows.append(row(f"its period at a = {a:g}", fold.period, PI, fold.period_error))
    radial = "(1 - x^2 - y^2)"
    circle = udd.Model(["x", "y"], [f"x*{radial} - y*(3*m + x)", f"y*{radial} + x*(3*m + x)"], {"m": 0.5})
    orbit = udd.periodic_orbit(circle, [1.0, 0.0])
    snic = udd.connection(udd.continuation(orbit, "m", (0.1, 1.0), direction="down", max_period=200.0))
    rows.append(row("saddle-node on a circle", snic.value, Decimal(1) / 3, snic.error))
    return rows


def numbers_of_solutions() -> list[float]:
    """Compare multipliers and first Lyapunov coefficients."""
    rows = []
    radial = "(1 - x^2 - y^2)"
    model = udd.Model(["x", "y", "u"], [f"x*{radial} - y", f"y*{radial} + x", "-0.3*u + x*(x^2 + y^2 - 1)"])
    orbit = udd.periodic_orbit(model, [1.0, 0.0, 0.0])
    for rate, value, bound in zip((0.3, 2.0), orbit.multipliers, orbit.multiplier_errors, strict=True):
        known = (-2 * PI * Decimal(rate)).exp()
        rows.append(row(f"multiplier of the rate {rate:g}", float(value.real), known, float(bound)))
    for bend in (0.5, 1.0, 3.0):
        model = udd.Model(["x", "y"], ["y", f"-x + mu*y - {bend}*x^2*y"], {"mu": -0.3})
        (hopf,) = udd.continuation(udd.equilibria(model)[0], "mu", (-1.0, 1.0)).find("Hopf")
        known = -Decimal(bend) / 4
        what = f"first Lyapunov coefficient at {bend:g}"
        rows.append(row(what, hopf.lyapunov_coefficient, known, hopf.lyapunov_error))
    return rows


def homoclinic_orbits() -> list[float]:
    """Compare homoclinic orbits of saddles: of the damped equations, of a jerk equation and of Lorenz's."""
    rows = []
    for B in (0.15, 0.2, 0.3):
        rests = udd.equilibria(udd.DLE(2.5, B=B))
        start = next(rest for rest in rests if rest.state[0] > 1e-3)
        hopf = udd.continuation(start, "w", (0.5, 30.0)).find("Hopf")[0]
        one = udd.connection(udd.continuation(hopf, max_period=16.0))
        known = returning(one.value, *damped(Decimal(B)))
        rows.append(row(f"homoclinic orbit at B = {B:g}", one.value, known, one.error))
    texts = ["v", "a", f"-a - {_FRICTION}*v + mu*x*(1 - x)"]
    (one,) = udd.connections(udd.Model(["x", "v", "a"], texts, {"mu": 0.7}), "mu", (0.7398, 0.7399), n=2)
    rows.append(row("homoclinic orbit of a jerk", one.value, returning(one.value, *JERK), one.error))
    texts = ["10*(y - x)", "r*x - y - x*z", "x*y - 2*z"]
    lorenz = udd.Model(["x", "y", "z"], texts, {"r": 12.0})
    (one,) = udd.connections(lorenz, "r", (8.0, 20.0), n=8)
    rows.append(row("homoclinic orbit of Lorenz", one.value, returning(one.value, *LORENZ), one.error))
    return rows


def connections_of_closed_form() -> list[float]:
    """The rate H' = y^2 (b - c + k (H - H1)) of the energy H keeps H = H1, an orbit of saddles, at b = c."""
    rows = []
    for c, k in ((0.3, -1.0), (0.7, -0.5)):
        for kind, pull, energy, start in (
            ("homoclinic", "x - x^2", "y^2/2 - x^2/2 + x^3/3", 1.3),
            ("heteroclinic", "x^3 - x", "y^2/2 + x^2/2 - x^4/4 - 1/4", 0.6),
        ):
            planar = ["y", f"{pull} + y*(b - {c} + {k}*({energy}))"]
            for states, texts in ((["x", "y"], planar), (["x", "y", "z"], [*planar, "x*y - 2*z"])):
                model = udd.Model(states, texts, {"b": c + 0.1 * k})
                orbit = udd.periodic_orbit(model, [start] + [0.0] * (len(states) - 1), settle=100.0)
                branch = udd.continuation(orbit, "b", (0.0, 1.0), direction="up", max_period=30.0)
                one = udd.connection(branch)
                assert one.kind == kind
                what = f"{kind} orbit of {len(states)} states at c = {c:g}"
                rows.append(row(what, one.value, Decimal(c), one.error))
    return rows


# A model in decimals: a step in time, the saddle's growing direction, and its left eigenvector.
Step = Callable[[list[Decimal], Decimal], list[Decimal]]
Direction = Callable[[Decimal], list[Decimal]]
Exact = tuple[Step, list[Decimal], Direction, Direction]


def damped(B: Decimal) -> Exact:
    """The damped equations about the saddle at z = 1/B."""
    growing = (-1 + (1 + 4 / B).sqrt()) / 2
    rest = [Decimal(0), Decimal(0), 1 / B]
    right, left = [Decimal(1), 1 + growing, Decimal(0)], [growing, Decimal(1), Decimal(0)]
    return lambda x, w: step(x, w, _STEP, B), rest, lambda w: right, lambda w: left


def series(rates: Callable[[list[list[Decimal]], int, Decimal], list[Decimal]], h: Decimal) -> Step:
    """A step by a power series; `rates` gives the coefficients of an order from those of the states."""

    def advanced(x: list[Decimal], value: Decimal) -> list[Decimal]:
        table = [[number] for number in x]
        for k in range(36):
            for column, rate in zip(table, rates(table, k, value), strict=True):
                column.append(rate / (k + 1))
        return [sum((term * h**k for k, term in enumerate(column)), Decimal(0)) for column in table]

    return advanced


def product(a: list[Decimal], b: list[Decimal], k: int) -> Decimal:
    """The coefficient of the order k of a product."""
    return sum((a[i] * b[k - i] for i in range(k + 1)), Decimal(0))


def jerk_rates(x: list[list[Decimal]], k: int, mu: Decimal) -> list[Decimal]:
    """Coefficients of the jerk -a - 0.4 v + mu x (1 - x), with the float 0.4."""
    force = mu * (x[0][k] - product(x[0], x[0], k))
    return [x[1][k], x[2][k], -x[2][k] - DRAG * x[1][k] + force]


def lorenz_rates(x: list[list[Decimal]], k: int, r: Decimal) -> list[Decimal]:
    """Coefficients of Lorenz's equations with 10 and 2."""
    a, b, c = x
    return [10 * (b[k] - a[k]), r * a[k] - b[k] - product(a, c, k), product(a, b, k) - 2 * c[k]]


def jerk_eigenvalue(mu: Decimal) -> Decimal:
    """The growing eigenvalue of the origin, by Newton's method."""
    number = Decimal("0.57")
    for _ in range(8):
        value = ((number + 1) * number + DRAG) * number - mu
        number -= value / (3 * number**2 + 2 * number + DRAG)
    return number


def lorenz_eigenvalue(r: Decimal) -> Decimal:
    """The growing eigenvalue of the origin."""
    return (-11 + (81 + 40 * r).sqrt()) / 2


def jerk_right(mu: Decimal) -> list[Decimal]:
    """Its eigenvector."""
    number = jerk_eigenvalue(mu)
    return [Decimal(1), number, number**2]


def jerk_left(mu: Decimal) -> list[Decimal]:
    """Its left eigenvector."""
    number = jerk_eigenvalue(mu)
    return [number**2 + number + DRAG, number + 1, Decimal(1)]


ORIGIN = [Decimal(0)] * 3
JERK: Exact = series(jerk_rates, Decimal("0.1")), ORIGIN, jerk_right, jerk_left
LORENZ: Exact = (
    series(lorenz_rates, Decimal("0.02")),
    ORIGIN,
    lambda r: [Decimal(10), lorenz_eigenvalue(r) + 10, Decimal(0)],
    lambda r: [r, lorenz_eigenvalue(r) + 10, Decimal(0)],
)


def returning(near: float, advanced: Step, rest: list[Decimal], right: Direction, left: Direction) -> Decimal:
    """Where the saddle's unstable manifold comes back to it, by secants."""
    small = Decimal("1e-22")

    def after(value: Decimal, steps: int) -> list[list[Decimal]]:
        states = [[a + small * b for a, b in zip(rest, right(value), strict=True)]]
        for _ in range(steps):
            states.append(advanced(states[-1], value))
        return states

    # It comes back nearest to the saddle once it has been far away.
    path = np.array(after(Decimal(near), 1200), dtype=float) - np.array(rest, dtype=float)
    far = np.linalg.norm(path, axis=1)
    peak = int(np.argmax(far > 0.5))
    last = peak + 1 + int(np.argmin(far[peak + 1 :]))

    def beside(value: Decimal) -> Decimal:
        """The part along the growing direction."""
        end = after(value, last)[-1]
        return sum((a * (b - c) for a, b, c in zip(left(value), end, rest, strict=True)), Decimal(0))

    a, b = Decimal(near), Decimal(near) + Decimal("1e-13")
    at = beside(a), beside(b)
    for _ in range(12):
        if at[0] == at[1]:
            break
        a, b = b, b - at[1] * (b - a) / (at[1] - at[0])
        if abs(b - a) < Decimal("1e-36"):
            break
        at = at[1], beside(b)
    return b


if __name__ == "__main__":
    getcontext().prec = _DIGITS
    PI = Decimal("3.14159265358979323846264338327950288419716939937510")
    print("| what | known | error | bound | error/bound |")
    print("|---|---|---|---|---|")
    new = [*special_points(), *ends_of_branches(), *numbers_of_solutions(), *connections_of_closed_form()]
    shares = [*periods(), *hopf_points(), *homoclinic_orbits(), *new]
    print(f"{len(shares)} numbers, the largest error over its bound {max(shares):.2f}")
