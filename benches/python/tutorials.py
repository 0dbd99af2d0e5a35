"""The fifteen cases of continuation tutorials: right or wrong, seconds of one core, and statements.

    python benches/python/tutorials.py

Each function is what a user writes, but for the model; it returns what was found and what is right, to the
published digits. Statements are those that are executed, but for the last, which returns the figures.
"""

from __future__ import annotations

import ast
import inspect
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import udd

sys.path.append(str(Path(__file__).parents[2] / "tests" / "support"))

from tutorial_models import (
    BAZYKIN,
    BRUSSELATOR,
    CHUA,
    CO,
    FITZHUGH,
    JERK,
    LORENZ84,
    LURE,
    MORRIS_LECAR,
    NILPOTENT,
    REACTION,
    ROESSLER,
    SEASONS,
    SIR,
)


def of(result: udd.Branch, kind: str) -> list[float]:
    """The values of the points of one kind, in order."""
    return sorted(point.value for point in result.find(kind))


def special(result: udd.Locus, kind: str) -> list[float]:
    """The second parameter at the special points of one kind, in order."""
    return sorted(float(point.values[1]) for point in result.points if point.kind == kind)


def morris_lecar_cycles() -> tuple[list[float], list[float]]:
    rest = udd.equilibria(MORRIS_LECAR, near=[-60.0, 0.01])[0]
    hopf = udd.continuation(rest, "I", (0.0, 300.0)).find("Hopf")[0]
    cycles = udd.continuation(hopf, bounds=(0.0, 300.0))
    return of(cycles, "fold") + of(cycles, "Hopf"), [88.29325054306, 216.89980138941132, 212.018816100]


def morris_lecar_equilibria() -> tuple[list[float], list[float]]:
    rest = udd.equilibria(MORRIS_LECAR, near=[-60.0, 0.01])[0]
    branch = udd.continuation(rest, "I", (0.0, 300.0))
    return [*of(branch, "Hopf"), float(len(branch) < 100)], [93.857618374, 212.018816100, 1.0]


def lorenz_84() -> tuple[list[float], list[float]]:
    orbit = udd.periodic_orbit(LORENZ84, [1.0, 0.0, 1.0], settle=200.0)
    cycles = udd.continuation(orbit, "F", direction="down")
    return of(cycles, "Hopf"), [1.027845271021219]


def brusselator() -> tuple[list[float], list[float]]:
    orbit = udd.periodic_orbit(BRUSSELATOR, [1.0, 2.0], settle=200.0)
    cycles = udd.continuation(orbit, "b", direction="down")
    return of(cycles, "Hopf"), [2.69]


def roessler() -> tuple[list[float], list[float]]:
    orbit = udd.periodic_orbit(ROESSLER, [1.0, 2.0, 0.0], settle=200.0)
    cycles = udd.continuation(orbit, "c", direction="down")
    return of(cycles, "Hopf"), [1.3056067738349]


def fitzhugh_nagumo() -> tuple[list[float], list[float]]:
    orbit = udd.periodic_orbit(FITZHUGH, [1.0, 0.0], settle=200.0)
    cycles = udd.continuation(orbit, "I")
    return of(cycles, "Hopf"), [0.3312813374547458, 1.418718662545]


def lure() -> tuple[list[float], list[float]]:
    rest = min(udd.equilibria(LURE), key=lambda one: abs(float(one.state[0])))
    hopf = udd.continuation(rest, "al", (-2.0, 2.0)).find("Hopf")[0]
    cycles = udd.continuation(hopf, bounds=(-2.0, 2.0))
    return of(cycles, "Hopf") + of(cycles, "period doubling"), [-1.0, -0.6303020062, 0.6303020062]


def degenerate() -> tuple[list[float], list[float]]:
    square = udd.equilibria(udd.Model(["x", "y"], ["x^2", "-y"]))
    line = udd.equilibria(SIR)
    return [float(len(square)), float(line[0].state[1]), float(line[0].isolated)], [1.0, 0.0, 0.0]


def nilpotent() -> tuple[list[float], list[float]]:
    equilibria = udd.equilibria(NILPOTENT)
    return [float(len(equilibria)), *equilibria[0].state], [1.0, 0.0, 0.0, 0.0]


def chua() -> tuple[list[float], list[float]]:
    origin = next(rest for rest in udd.equilibria(CHUA) if not rest.state.any())
    branch = udd.continuation(origin, "a", (1.0, 12.0))
    return [*branch.values[[0, -1]], float(np.abs(branch.states).max())], [1.0, 12.0, 0.0]


def seasons() -> tuple[list[float], list[float]]:
    orbit = udd.periodic_orbit(SEASONS, [0.5, 0.2, 1.0, 0.0], settle=100.0, max_period=5.0)
    branch = udd.continuation(orbit, "b0", (0.1, 0.5))
    return [*of(branch, "fold"), float(branch.ends[1] == "the branch is closed")], [0.22130, 0.33999, 1.0]


def oxidation() -> tuple[list[float], list[float]]:
    rest = next(rest for rest in udd.equilibria(CO) if (rest.state > 0.0).all())
    branch = udd.continuation(rest, "q2", (0.5, 2.0))
    folds = udd.locus(branch.find("fold")[0], "k", (0.01, 2.0), within=(0.3, 3.0))
    hopfs = udd.locus(branch.find("Hopf")[0], "k", (0.01, 2.0), within=(0.3, 3.0))
    result = of(branch, "fold") + of(branch, "Hopf") + special(folds, "cusp")
    ends = special(hopfs, "Bogdanov-Takens")
    return result + ends, [1.0420485, 1.0522003, 1.0409916, 1.0515575, 0.35599, 0.72234, 0.97140]


def bazykin() -> tuple[list[float], list[float]]:
    rest = next(rest for rest in udd.equilibria(BAZYKIN) if (rest.state > 0.0).all())
    branch = udd.continuation(rest, "al", (0.0, 2.0))
    folds = udd.locus(branch.find("fold")[0], "d", (0.0, 3.0), within=(0.0, 2.0))
    return [*special(folds, "cusp"), float(folds.values.min() >= 0.0)], [0.00357, 2.80236, 1.0]


def reaction() -> tuple[list[float], list[float]]:
    branch = udd.continuation(udd.equilibria(REACTION)[0], "p1", (0.0, 1.0))
    folds = udd.locus(branch.find("fold")[0], "p3", (1.0, 4.0), within=(0.0, 1.0))
    result = of(branch, "fold") + of(branch, "Hopf") + special(folds, "cusp")
    return result, [0.0889318, 0.105739, 0.1309, 2.5]


def jerk() -> tuple[list[float], list[float]]:
    connections = udd.connections(JERK, "mu", (0.5, 1.0))
    return [one.value for one in connections], [0.7398598229327773]


CASES: list[Callable[[], tuple[list[float], list[float]]]] = [
    morris_lecar_cycles, morris_lecar_equilibria, lorenz_84, brusselator, roessler, fitzhugh_nagumo, lure,
    degenerate, nilpotent, chua, seasons, oxidation, bazykin, reaction, jerk,
]  # fmt: skip


def statements(case: Callable[[], object]) -> int:
    """The statements of a function, but for the last."""
    (function,) = ast.parse(textwrap.dedent(inspect.getsource(case))).body
    return sum(isinstance(node, ast.stmt) for node in ast.walk(function)) - 2


def main() -> None:
    """Print the table."""
    udd.equilibria(udd.DLE(1.0))  # what is imported at the first call is no part of a case
    for number, case in enumerate(CASES, 1):
        begin = time.process_time()
        try:
            result, right = case()
            good = len(result) == len(right) and np.allclose(
                result, right, rtol=2e-5, atol=5e-6
            )  # published digits
        except (udd.UddError, IndexError, StopIteration) as error:
            good, result = False, [str(error)]  # type: ignore[list-item]
        seconds = time.process_time() - begin
        word = "right" if good else f"wrong: {result}"
        name = f"{number:2d} {case.__name__:24s}"
        print(f"{name} {seconds:6.1f} s {statements(case):2d} statements  {word}", flush=True)


if __name__ == "__main__":
    main()
