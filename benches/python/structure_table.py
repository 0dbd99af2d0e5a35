"""Apply the analyses of structure to text models: values, times, and reference values.

Published values where there are such, else those of SciPy's integrators with Newton's method.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import integrate, optimize, special

import udd

# D. Viswanath, Nonlinearity 16 (2003) 1035; LR by A. Abad et al., Phys. Rev. E 84 (2011) 016701.
LORENZ = {"LR": 1.5586522107161747, "LLR": 2.3059072639398, "LLLR": 3.0235837034339, "LLRR": 3.0842767758221}
LORENZ |= {"LLLRR": 3.8202541634368}


def row(what: str, seconds: float, value: float, against: float, source: str) -> None:
    """Print a row of the table."""
    off = abs(value - against) / abs(against)
    print(f"{what:46s} {seconds:7.2f} s  {value:18.14g}  {against:18.14g}  {off:7.0e}  {source}", flush=True)


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Return the result of the work and its time."""
    start = time.perf_counter()
    return work(), time.perf_counter() - start


def period_by_scipy(model: udd.Model, state: np.ndarray, period: float) -> float:
    """The period of the cycle near by, by DOP853 and Newton's method."""

    def rates(t: float, s: np.ndarray) -> np.ndarray:
        return model.rates(0.0, s)

    across = model.rates(0.0, state)

    def gaps(unknowns: np.ndarray) -> np.ndarray:
        s, lasts = unknowns[:-1], float(unknowns[-1])
        end = integrate.solve_ivp(rates, [0.0, lasts], s, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        return np.append(end - s, across @ (s - state))

    return float(optimize.fsolve(gaps, np.append(state, period) * (1 + 1e-7), xtol=1e-12)[-1])


def lorenz_cycles(longest: int = 7, n: int = 20_000) -> dict[str, udd.PeriodicOrbit]:
    """Cycles by the sides of their turns, each from the chaotic motion's closest return of that kind."""
    lorenz = udd.Model(["x", "y", "z"], ["10*(y-x)", "28*x-y-x*z", "x*y-8/3*z"])
    section = udd.poincare(lorenz, "z'", n, state0=[1.0, 1.0, 20.0], direction="down")
    right = section.state[:, 0] > 0
    cycles: dict[str, udd.PeriodicOrbit] = {}
    for turns in range(2, longest + 1):
        gap = np.linalg.norm(section.state[turns:] - section.state[:-turns], axis=1)
        for i in np.argsort(gap)[:4000]:
            word = "".join("LR"[int(side)] for side in right[i : i + turns])
            mirrored = word.translate(str.maketrans("LR", "RL"))
            name = min(w[k:] + w[:k] for w in (word, mirrored) for k in range(turns))
            if name in cycles or len(set(name)) < 2:
                continue
            if any(name == name[:k] * (turns // k) for k in range(1, turns) if turns % k == 0):
                continue
            try:
                lasts = float(section.t[i + turns] - section.t[i])
                cycles[name] = udd.periodic_orbit(lorenz, section.state[i], period=lasts)
            except udd.UddError:
                continue
    return cycles


def lorenz() -> None:
    """The shortest cycles of Lorenz's attractor."""
    cycles, seconds = timed(lorenz_cycles)
    shortest = sorted(cycles.items(), key=lambda item: item[1].period)[:20]
    for name, orbit in shortest:
        if name in LORENZ:
            known, source = LORENZ[name], "published"
        else:
            known, source = period_by_scipy(orbit.model, orbit.state, orbit.period), "SciPy"
        row(f"Lorenz, cycle {name}", seconds / len(cycles), orbit.period, known, source)


def cycles_of_others() -> None:
    """One cycle each of Rössler, Sprott's case B and Chua's circuit."""
    chua = {"al": 15.6, "be": 28.0, "a": -8 / 7, "b": -5 / 7}
    bend = "al*(y - x - b*x - (a-b)/2*(abs(x+1)-abs(x-1)))"
    models = {
        "Roessler": (["-y-z", "x+0.2*y", "0.2+z*(x-5.7)"], {}, [0.0, -6.0, 0.0], 5.9),
        "Sprott B": (["y*z", "x-y", "1-x*y"], {}, [1.0, 0.5, 1.0], None),
        "Chua, with abs": ([bend, "x-y+z", "-be*y"], chua, [1.8, 0.0, -2.2], None),
    }
    for name, (equations, parameters, start, period) in models.items():
        model = udd.Model(["x", "y", "z"], equations, parameters)
        try:
            orbit, seconds = timed(
                lambda m=model, s=start, p=period: udd.periodic_orbit(m, s, period=p, settle=50.0)
            )
        except udd.UddError as error:
            print(f"{name:46s} {error}")
            continue
        known = period_by_scipy(model, orbit.state, orbit.period)
        row(f"{name}, period of a cycle", seconds, orbit.period, known, "SciPy")


def exponents() -> None:
    """Largest exponents."""
    roessler = udd.Model(["x", "y", "z"], ["-y-z", "x+0.2*y", "0.2+z*(x-5.7)"])
    sprott = udd.Model(["x", "y", "z"], ["y*z", "x-y", "1-x*y"])
    for name, model, known in (("Roessler", roessler, 0.0714), ("Sprott B", sprott, 0.2101)):
        result, seconds = timed(lambda m=model: udd.lyapunov_spectrum(m, state0=[1.0, 1.0, 0.5], t=20_000.0))
        row(f"{name}, largest exponent", seconds, float(result.exponents[0]), known, "Sprott (2003)")


def forced_and_conservative() -> None:
    """Duffing's oscillator, Hénon and Heiles's potential, three pendulums."""
    parameters = {"c": 0.1, "F": 0.3, "w": 1.2}
    duffing = udd.Model(["x", "v"], ["v", "-x - x^3 - c*v + F*cos(w*t)"], parameters)
    orbit, seconds = timed(lambda: udd.periodic_orbit(duffing, [0, 0], period="2*pi/w", settle=200.0))

    def gap(state: np.ndarray) -> np.ndarray:
        def rates(t: float, s: np.ndarray) -> list[float]:
            return [s[1], -s[0] - s[0] ** 3 - 0.1 * s[1] + 0.3 * np.cos(1.2 * t)]

        span = [0.0, 2 * np.pi / 1.2]
        return integrate.solve_ivp(rates, span, state, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1] - state

    known = optimize.fsolve(gap, orbit.state + 1e-4, xtol=1e-12)
    row("Duffing, forced: x at phase 0", seconds, float(orbit.state[0]), float(known[0]), "SciPy")
    henon = udd.Model(["x", "y", "u", "v"], ["u", "v", "-x-2*x*y", "-y-x^2+y^2"])
    swing = udd.periodic_orbit(henon, [0, 0, 0, 0.1**0.5], period=6.4)
    energy = "(u^2+v^2+x^2+y^2)/2 + x^2*y - y^3/3"
    family, seconds = timed(lambda: udd.continuation(swing, energy, (0.04, 0.165)))
    for point, known_ in zip(family.find("branch point"), (0.969309, 0.986709), strict=True):
        row("Hénon-Heiles, pitchfork (E/E_saddle)", seconds, 6 * point.value, known_, "Brack (2001)")
    equations = ["p", "q", "r", "-sin(a)+k*(b-a)", "-sin(b)+k*(a+c-2*b)", "-sin(c)+k*(b-c)"]
    three = udd.Model(["a", "b", "c", "p", "q", "r"], equations, {"k": 0.2})
    family, seconds = timed(
        lambda: udd.continuation(
            udd.periodic_orbit(three, [1.0] * 3 + [0.0] * 3, max_period=6.7), "period", (6.3, 12.0)
        )
    )
    k = len(family) // 2
    height = family.states[k, 3] ** 2 / 2 - np.cos(family.states[k, 0])
    known_ = 4 * special.ellipk((1 + height) / 2)
    row(
        "three pendulums in step, a period",
        seconds,
        float(family.periods[k]),
        known_,
        "elliptic integral",
    )


def stiff() -> None:
    """Van der Pol at mu = 1000, Robertson's reaction to 4e7."""
    pol = udd.Model(["x", "v"], ["v", "m*(1-x^2)*v-x"], {"m": 1000.0})
    times = np.linspace(0.0, 1500.0, 4)
    run, seconds = timed(lambda: udd.simulate(pol, times, [2.0, 0.0], method="auto", rtol=1e-9, atol=1e-12))
    tight = {"method": "Radau", "rtol": 1e-11, "atol": 1e-13}

    def rates(t: float, s: np.ndarray) -> list[float]:
        return [s[1], 1000 * (1 - s[0] ** 2) * s[1] - s[0]]

    known = integrate.solve_ivp(rates, [0, 1500], [2.0, 0.0], **tight).y[0, -1]
    row("Van der Pol, mu = 1000: x at 1500", seconds, float(run.state[-1, 0]), float(known), "SciPy's Radau")
    equations = ["-0.04*a + 1e4*b*c", "0.04*a - 1e4*b*c - 3e7*b^2", "3e7*b^2"]
    robertson = udd.Model(["a", "b", "c"], equations)
    options: dict[str, Any] = {"method": "auto", "rtol": 1e-9, "atol": 1e-14}
    run, seconds = timed(lambda: udd.simulate(robertson, [0.0, 4e7], [1.0, 0.0, 0.0], **options))

    def reaction(t: float, s: np.ndarray) -> list[float]:
        a, b, c = s
        first, second = -0.04 * a + 1e4 * b * c, 3e7 * b**2
        return [first, -first - second, second]

    tight = {"method": "Radau", "rtol": 1e-11, "atol": 1e-16}
    known = integrate.solve_ivp(reaction, [0, 4e7], [1.0, 0.0, 0.0], **tight).y[0, -1]
    row("Robertson to 4e7: first substance", seconds, float(run.state[-1, 0]), float(known), "SciPy's Radau")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    print(f"{'what':46s} {'time':>9s}  {'value':>18s}  {'against':>18s}  {'off':>7s}  source")
    for part in (forced_and_conservative, stiff, exponents, cycles_of_others, lorenz):
        part()
