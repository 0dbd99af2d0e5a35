"""How often the verdict of a spectrum is right: random starts of models whose attractors are known.

Prints each wrong one. `python verdicts.py 20` takes 20 starts of each model, `python verdicts.py 20 Lorenz`
those of names with this in it.
"""

from __future__ import annotations

import re
import sys
import time
import warnings

import numpy as np

import udd

LORENZ = ["10*(y-x)", "r*x-y-x*z", "x*y-8/3*z"]
SPREAD = np.array([10.0, 10.0, 10.0])


def cases() -> list[tuple[str, udd.Model, np.ndarray, np.ndarray, set[str]]]:
    """A name, a model, the middle and the spread of the starts, and what they may settle on."""
    xyz = ["x", "y", "z"]
    pol = udd.Model(["x", "v"], ["v", "m*(1-x^2)*v-x"], {"m": 1.0})
    middle = np.array([0.0, 0.0, 25.0])
    return [
        ("Van der Pol: a cycle", pol, np.zeros(2), np.full(2, 3.0), {"periodic orbit"}),
        ("Lorenz, r = 28", udd.Model(xyz, LORENZ, {"r": 28.0}), middle, SPREAD, {"chaos"}),
        ("Lorenz, r = 15", udd.Model(xyz, LORENZ, {"r": 15.0}), middle, SPREAD, {"equilibrium"}),
        ("Lorenz, r = 160", udd.Model(xyz, LORENZ, {"r": 160.0}), 5 * middle, SPREAD, {"periodic orbit"}),
        ("DLE, w = 10", udd.DLE(10.0), np.array([1.0, 1.0, 0.0]), np.full(3, 2.0), {"periodic orbit"}),
        ("DLE, w = 1", udd.DLE(1.0), np.array([1.0, 1.0, 0.0]), np.full(3, 1.0), {"chaos"}),
        *beside_what_repels(),
        *larger(),
    ]


def beside_what_repels() -> list[tuple[str, udd.Model, np.ndarray, np.ndarray, set[str]]]:
    """Starts beside strongly unstable cycles and equilibria, and in chaos that lasts, but not for ever."""
    lorenz = udd.Model(["x", "y", "z"], LORENZ, {"r": 28.0})
    # Multipliers 4.7, and, next to the homoclinic orbit at r = 13.93, much larger.
    turn = udd.periodic_orbit(lorenz, [-13.76361068, -19.57875194, 27.0], period=1.5586522)
    branch = udd.continuation(
        udd.continuation(max(udd.equilibria(lorenz), key=lambda one: one.state[0]), "r", (18.0, 30.0)).find(
            "Hopf"
        )[0],
        max_period=2.0,
    )
    long = branch.solution(len(branch) - 1)
    near = np.full(3, 1e-6)
    damped = udd.DLE(3.75, B=0.2)
    transient = np.array([np.sqrt(3.75), np.sqrt(3.75), -3.5])
    return [
        ("at an unstable cycle", lorenz, turn.state, near, {"chaos"}),
        ("at one before the Hopf", long.model, long.state, near, {"equilibrium"}),
        ("at a saddle-focus", udd.DLE(1.0), np.array([1.0, 1.0, 0.0]), near, {"chaos"}),
        ("in a transient", damped, transient, np.full(3, 0.1), {"equilibrium"}),
        ("in Lorenz's, r = 22", lorenz.with_parameters({"r": 22.0}), np.zeros(3), SPREAD, {"equilibrium"}),
    ]


def larger() -> list[tuple[str, udd.Model, np.ndarray, np.ndarray, set[str]]]:
    """Models of one, four, five and six states."""
    five = udd.Model(["x", "y", "z", "u", "v"], [*LORENZ, "v", "(1-u^2)*v-u"], {"r": 28.0})
    two = udd.Model(["x", "v", "y", "w"], ["v", "(1-x^2)*v-x", "w", "2*(1-y^2)*w-y"])
    chain = ["a", "(1-x^2)*a-x+0.5*(y-x)", "b", "(1-y^2)*b-y+0.5*(x+z-2*y)", "c", "(1-z^2)*c-z+0.5*(y-z)"]
    six = udd.Model(["x", "a", "y", "b", "z", "c"], chain)
    return [
        ("one state", udd.Model(["x"], ["x-x^3"]), np.zeros(1), np.full(1, 2.0), {"equilibrium"}),
        # Two frequencies without a common measure.
        ("four, a torus", two, np.zeros(4), np.full(4, 2.0), {"torus"}),
        ("five, chaos", five, np.array([0, 0, 25.0, 0, 0]), np.array([10, 10, 10, 2, 2.0]), {"chaos"}),
        # A stable torus coexists with the cycle; it has two exponents zero.
        ("six, cycle or torus", six, np.zeros(6), np.full(6, 2.0), {"periodic orbit", "torus"}),
    ]


def main(count: int, wanted: str) -> None:
    """Print for each case how many verdicts are right."""
    warnings.simplefilter("ignore")
    random = np.random.default_rng(11)
    for name, model, middle, spread, right in cases():
        if not re.search(wanted, name):
            continue
        begin, wrong = time.perf_counter(), []
        for start in middle + spread * random.uniform(-1.0, 1.0, (count, len(middle))):
            spectrum = udd.lyapunov_spectrum(model, state0=start)
            if spectrum.verdict not in right:
                wrong.append((start, spectrum))
        seconds = (time.perf_counter() - begin) / count
        print(f"{name:24s} {count - len(wrong):4d} of {count} right, {seconds:6.2f} s each", flush=True)
        for start, spectrum in wrong:
            values = ", ".join(f"{value:.4g}" for value in spectrum.exponents)
            print(f"    from {np.round(start, 4).tolist()}: {spectrum.verdict}, exponents {values}")


if __name__ == "__main__":
    main(int((sys.argv[1:] or ["84"])[0]), (sys.argv[2:] or [""])[0])
