"""Branches of cycles of random quadratic models, followed from a Hopf point and from a cycle on them.

    python benches/python/both_ways.py [models]

A constant p is added to the first rate. The cycles born at each Hopf point over p are followed to their end,
and once more in both directions from a cycle half-way. Both must report the same bifurcation points.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from equilibria import NAMES, PAIRS

import udd

BOUNDS = (-1.0, 1.0)
REACH = 1e-6  # Distance of two values of one bifurcation point.


def model_of(table: np.ndarray) -> udd.Model:
    """Return the model with these coefficients and the parameter p."""
    terms = ["1", *NAMES, *(f"{NAMES[i]}*{NAMES[j]}" for i, j in PAIRS)]
    rates = [
        "+".join(f"({c!r})*{term}" for c, term in zip(row, terms, strict=True)) for row in table.tolist()
    ]
    return udd.Model(NAMES, [f"p + {rates[0]}", *rates[1:]], {"p": 0.0})


def same(a: list[tuple[str, float]], b: list[tuple[str, float]]) -> bool:
    """Return True if both lists have the same kinds at the same values."""
    pairs = zip(sorted(a), sorted(b), strict=False)
    return len(a) == len(b) and all(k == m and abs(v - w) < REACH for (k, v), (m, w) in pairs)


def compare(hopf: udd.BifurcationPoint, seed: int) -> str:
    """Return "same", "other" or "short" for the cycles born at a Hopf point; print the second."""
    limits: dict[str, Any] = {"bounds": BOUNDS, "max_points": 200, "max_period": 6.0 * hopf.period}
    try:
        born = udd.continuation(hopf, **limits)
        if len(born) < 8:
            return "short"
        again = udd.continuation(born.solution(len(born) // 2), "p", **limits)
    except udd.UddError as error:
        print(f"{seed}: Hopf point at {hopf.value:.8g}: {error}")
        return "other"
    first = [(hopf.kind, hopf.value), *((point.kind, point.value) for point in born.points)]
    second = [(point.kind, point.value) for point in again.points]
    if same(first, second):
        return "same"
    print(f"{seed}: Hopf point at {hopf.value:.8g}: {sorted(first)}, {born.ends[1]};")
    print(f"    from a cycle {sorted(second)}, {again.ends}")
    return "other"


def main(models: int) -> None:
    """Print how many branches have the same points both ways."""
    counts = {"same": 0, "other": 0, "short": 0}
    points = 0
    for seed in range(models):
        model = model_of(np.random.default_rng(seed).normal(size=(3, 10)))
        known: list[float] = []
        for rest in udd.equilibria(model):
            for hopf in udd.continuation(rest, "p", BOUNDS, max_points=300).find("Hopf"):
                if all(abs(hopf.value - value) > REACH for value in known):
                    known.append(hopf.value)
                    counts[compare(hopf, seed)] += 1
        points += len(known)
    print(f"{models} models, {points} Hopf points: {counts['same']} branches the same both ways,")
    print(f"{counts['other']} different, {counts['short']} with fewer than 8 points")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
