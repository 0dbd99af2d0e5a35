"""Lists of equilibria of random quadratic models, against a dense search and the Bezout number.

    python benches/python/equilibria.py [MODELS]

Each model has three states and ten normally distributed coefficients in each equation. Newton's method from
4,000 states over boxes of many sizes shows real roots; the homotopy's own count of complex roots is 8, the
Bezout number, if none is missed.
"""

from __future__ import annotations

import sys
import time
from itertools import combinations_with_replacement

import numpy as np

import udd
from udd.bifurcations.flow_map import flow_of
from udd.bifurcations.homotopy import complex_roots
from udd.bifurcations.polynomials import numerators_of

NAMES = ["x", "y", "z"]
PAIRS = list(combinations_with_replacement(range(3), 2))
STARTS = 4_000


def rates(table: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Quadratic rates (n, 3) with this table (3, 10) of coefficients."""
    terms = [np.ones(len(x)), *x.T, *(x[:, i] * x[:, j] for i, j in PAIRS)]
    return np.stack(terms, axis=1) @ table.T


def slopes(table: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Their derivatives (n, 3, 3)."""
    result = np.broadcast_to(table[:, 1:4], (len(x), 3, 3)).copy()
    for k, (i, j) in enumerate(PAIRS):
        result[:, :, i] += table[:, 4 + k] * x[:, j, None]
        result[:, :, j] += table[:, 4 + k] * x[:, i, None]
    return result


def dense(table: np.ndarray, random: np.random.Generator) -> list[np.ndarray]:
    """The real roots that Newton's method finds from many states."""
    x = random.normal(size=(STARTS, 3)) * 10.0 ** random.uniform(-1.0, 1.5, (STARTS, 1))
    for _ in range(40):
        x = x - np.linalg.solve(slopes(table, x), rates(table, x)[:, :, None])[:, :, 0]
        x = x[np.isfinite(x).all(axis=1) & (np.abs(x).max(axis=1) < 1e6)]
    step = np.linalg.solve(slopes(table, x), rates(table, x)[:, :, None])[:, :, 0]
    x = x[np.abs(step).max(axis=1) < 1e-9 * (1.0 + np.abs(x).max(axis=1))]
    results: list[np.ndarray] = []
    while len(x):
        results.append(x[0])
        x = x[np.abs(x - x[0]).max(axis=1) > 1e-6 * (1.0 + np.abs(x[0]).max())]
    return results


def model_of(table: np.ndarray) -> udd.Model:
    """The model with these coefficients."""
    terms = ["1", *NAMES, *(f"{NAMES[i]}*{NAMES[j]}" for i, j in PAIRS)]
    rows = [zip(row, terms, strict=True) for row in table.tolist()]
    return udd.Model(NAMES, ["+".join(f"({c!r})*{term}" for c, term in row) for row in rows])


def main(models: int) -> None:
    """Print how many lists are complete."""
    complete = short = extra = fewer = shown = 0
    seconds = 0.0
    for seed in range(models):
        random = np.random.default_rng(seed)
        table = random.normal(size=(3, 10))
        known = dense(table, random)
        model = model_of(table)
        begin = time.process_time()
        states = np.array([rest.state for rest in udd.equilibria(model)]).reshape(-1, 3)
        seconds += time.process_time() - begin
        near = [np.abs(states - r).max(axis=1).min(initial=np.inf) / (1 + np.abs(r).max()) for r in known]
        missed = int((np.array(near) > 1e-6).sum())
        wrong = np.abs(rates(table, states)).max(axis=1) > 1e-9 * (1 + np.abs(states).max(axis=1)) ** 2
        flow = flow_of(model, np.ones((1, 3)))
        fractions = numerators_of(flow)
        assert fractions is not None
        roots = complex_roots(fractions[0].scaled(flow.size))
        short += missed
        extra += int(wrong.sum())
        fewer += len(roots.simple) != 8
        shown += len(known)
        complete += not missed and not wrong.any()
    print(f"{models} models, {shown} roots by the dense search: {complete} lists complete,")
    print(f"{short} roots missed, {extra} false; {fewer} models with other than 8 complex roots;")
    print(f"{seconds / models:.3f} s of one core a list")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
