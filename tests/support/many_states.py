"""Models of any number of states: a chain of coupled Duffing oscillators, and Lorenz's ring of 1996."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import udd


def chain(n: int, **more: str) -> udd.Model:
    """Duffing oscillators between two walls, coupled to their neighbours by springs, the first one driven.

    `more` are terms added to the equations of some states.
    """
    states = [name for i in range(1, n + 1) for name in (f"x{i}", f"v{i}")]
    equations = {}
    for i in range(1, n + 1):
        neighbours = [f"x{j}" for j in (i - 1, i + 1) if 1 <= j <= n]
        pull = " + ".join([*neighbours, f"-2*x{i}"])
        drive = " + f*cos(w*t)" if i == 1 else ""
        equations |= {f"x{i}": f"v{i}", f"v{i}": f"-x{i} - b*x{i}^3 - d*v{i} + k*({pull}){drive}"}
    for state, term in more.items():
        equations[state] += f" + {term}"
    return udd.Model(states, equations, {"b": 1.0, "d": 0.05, "k": 0.6, "f": 0.4, "w": 1.3})


def chain_rates(t: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute the rates of :func:`chain` independently in NumPy."""
    x, v = state[0::2], state[1::2]
    beside = np.concatenate([[0.0], x, [0.0]])
    force = -x - x**3 - 0.05 * v + 0.6 * (beside[:-2] - 2 * x + beside[2:])
    force[0] += 0.4 * np.cos(1.3 * t)
    return np.stack([v, force], axis=1).ravel()


def ring(n: int) -> udd.Model:
    """``x_i' = a (x_{i+1} - x_{i-2}) x_{i-1} - x_i + F`` on a ring (Lorenz 1996, a = 1)."""
    names = [f"x{i}" for i in range(n)]
    texts = [
        f"a*(x{(i + 1) % n} - x{i - 2 if i > 1 else i - 2 + n})*x{(i - 1) % n} - x{i} + F" for i in range(n)
    ]
    return udd.Model(names, texts, {"F": 8.0, "a": 1.0})


def ring_rates(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute the rates of :func:`ring` independently in NumPy."""
    return (np.roll(x, -1) - np.roll(x, 2)) * np.roll(x, 1) - x + 8.0
