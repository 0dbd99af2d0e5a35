"""Parameters at which an orbit of one manifold arrives at another: bracket, converge, bound."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from udd.errors import IntegrationError, ModelError

from .error_bounds import COARSE, rounding_of
from .flow_map import Floats

__all__ = ["Accuracy", "brackets", "converge", "distinct", "secant", "until_it_stands"]

_ROUNDS = 11  # Largest number of rounds about the cycle.
_STANDS = 1e-13  # Relative change below which the parameter has converged.
_STEPS = 50  # Steps of the secant method.
_ALIKE = 1e-9  # Relative distance of two results for one value.

Mark = TypeVar("Mark")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Accuracy:
    """Initial distance of an orbit from its source, in typical sizes, and a factor of the tolerances."""

    away: float
    loose: float = 1.0


def brackets(
    marks: Iterable[Mark | None], changes: Callable[[Mark, Mark], bool], solve: Callable[[Mark, Mark], Result]
) -> list[Result]:
    """Solve between neighbouring marks of a scan that differ; leave out pairs without a solution."""
    located = []
    for a, b in pairwise(marks):
        if a is not None and b is not None and changes(a, b):
            with suppress(ModelError, IntegrationError):
                located.append(solve(a, b))
    return located


def converge(
    solve: Callable[[Floats, int, float, Accuracy], Floats], x: Floats, step: float, accuracy: Accuracy
) -> tuple[Floats, float, int]:
    """Solve with more and more rounds about a cycle, then with poorer accuracy.

    `solve` takes the unknowns (the parameter's value, then others), a number of rounds, the value's expected
    change, and an accuracy. Returned are the unknowns, a bound of the value's error, and the rounds. The
    bound is the change with the last round, with runs a hundred times less accurate, and with a start ten
    times further from the source.
    """
    x, moved, rounds = until_it_stands(
        x, lambda y, k, moved: solve(y, k, moved, accuracy), lambda y: float(y[0]), step, _ROUNDS
    )
    value = float(x[0])
    error = moved + float(rounding_of(value))
    for poorer in (Accuracy(10.0 * accuracy.away), Accuracy(accuracy.away, COARSE)):
        error += abs(float(solve(x, rounds, 1e-7 * abs(value), poorer)[0]) - value)
    return x, error, rounds


def until_it_stands(
    x: Mark,
    improve: Callable[[Mark, int, float], Mark],
    value: Callable[[Mark], float],
    moved: float,
    most: int,
) -> tuple[Mark, float, int]:
    """Improve a solution until its value stands; return it with the last change and the number of rounds.

    `improve` takes a solution, the number of the round from 1 on, and the change in the round before.
    """
    for k in range(1, most + 1):
        after = improve(x, k, moved)
        moved, x = abs(value(after) - value(x)), after
        if moved < _STANDS * abs(value(x)):
            break
    return x, moved, k


def secant(height: Callable[[Floats], tuple[float, Floats]], x: Floats, step: float) -> Floats:
    """Find the value ``x[0]`` at which a height vanishes.

    `height` returns the height at a value, and the unknowns with the others adjusted to that value.
    """
    start, step = float(x[0]), max(step, 1e-8 * abs(x[0]))
    before, a = height(x)
    b = np.append(start + 0.1 * step, a[1:])
    for _ in range(_STEPS):
        here, b = height(b)
        if here == before:
            break
        after = b[0] - here * (b[0] - a[0]) / (here - before)
        if not np.isfinite(after) or abs(after - start) > 20.0 * step:
            raise ModelError("the value does not settle")
        a, b, before = b, np.append(after, b[1:]), here
        if abs(b[0] - a[0]) < 0.1 * _STANDS * abs(b[0]):
            break
    return b


def distinct(located: Sequence[Any]) -> list[Any]:
    """Return results in the order of their values; the mirror image of a manifold has the same ones."""
    result: list[Any] = []
    for item in sorted(located, key=lambda item: item.value):
        reach = max(item.error + result[-1].error, _ALIKE * abs(item.value)) if result else 0.0
        if not result or item.value - result[-1].value > reach:
            result.append(item)
    return result
