"""Roots at which derivatives are singular: multiple ones, and points on sets of roots."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .flow_map import Floats
from .polynomials import Polynomials

__all__ = ["Law", "degenerate_root"]

#: Scaled rates about a point, as polynomials of the distance from it.
Law = Callable[[Floats], Polynomials]

_ZERO = 1e-6  # Largest singular value that is zero, if all coefficients are of size 1.
_ASIDE = 0.03  # Distance of another root of a set of roots, in sizes of the point.
_SOLVED = 1e-11  # Rates, relative to their terms, that are zero.
_MOVED = 0.3  # Largest distance from the guess, in sizes of the root.
_STEPS = 60  # Steps of the method of Gauss and Newton.
_DEPTH = 4  # Largest number of deflations.
_MOST_VARIABLES = 20  # Largest number of unknowns.
_SNAPPED = 1e-3  # Relative: a smaller component is 0 if nothing moves there.
_ROUNDING = 1e-15  # Rates that are rounding.
_NEAREST = 40  # Steps towards the point of a set that is nearest to the origin.
_ROUNDS = 4  # Expansions of the law.


def degenerate_root(law: Law, x: Floats, nearest: bool) -> tuple[Floats, bool] | None:
    """Return the degenerate root near a point, and True if it is isolated; or None.

    If roots form a set, it is the point near `x`, or the one that is `nearest` to the origin.
    """
    begin = x
    snapped = np.where(np.abs(x) < _SNAPPED * (1.0 + np.abs(x).max()), 0.0, x)
    at_zero = bool((np.abs(law(snapped).values(0.0 * x)) <= _ROUNDING).all())
    x = snapped if at_zero else x
    for _ in range(0 if at_zero else _ROUNDS):
        system, base = law(x), x
        x = base + _descended(system, 0.0 * x)
        if np.abs(x - base).max() < 1e-12 * (1.0 + np.abs(x).max()):
            break
    system = law(x)
    if not _vanishes(system, 0.0 * x) or not _null(system).size:
        return None
    if np.abs(x - begin).max() > _MOVED * (1.0 + np.abs(begin).max()):
        return None  # another one
    if _on_a_set(law, x):
        return (_nearest(law, x) if nearest else x), False
    for _ in range(0 if at_zero else _ROUNDS):
        system = law(x)
        step = _deflated_root(system)
        if step is None:
            return x, True
        x = x + step
        if np.abs(step).max() < 1e-14 * (1.0 + np.abs(x).max()):
            break
    return x, True


def _vanishes(system: Polynomials, x: Floats) -> bool:
    # If all coefficients are of size 1, so are the terms at a generic point.
    return bool((np.abs(system.values(x)) <= _SOLVED * np.maximum(system.sizes(x), 1.0)).all())


def _null(system: Polynomials) -> Floats:
    """Return an orthonormal basis (n, k) of the directions of constant rates at the point itself."""
    matrix = system.slopes(np.zeros(system.variables))
    _, sizes, right = np.linalg.svd(matrix)
    sizes = np.append(sizes, np.zeros(len(right) - len(sizes)))
    null: Floats = right[sizes <= _ZERO].T
    return null


def _descended(system: Polynomials, x: Floats) -> Floats:
    """Return the root, however singular, at which the method of Gauss and Newton arrives."""
    for _ in range(_STEPS):
        step = np.linalg.lstsq(system.slopes(x), -system.values(x), rcond=1e-9)[0]
        x = x + step
        if np.abs(step).max() < 1e-15 * (1.0 + np.abs(x).max()) or not np.isfinite(x).all():
            break
    return x


def _on_a_set(law: Law, x: Floats) -> bool:
    """Return True if other roots lie arbitrarily near, along a direction in which the rates are constant."""
    null, random = _null(law(x)), np.random.default_rng(7)
    away = _ASIDE * (1.0 + float(np.abs(x).max()))
    for _ in range(3):
        along = null @ random.normal(size=null.shape[1])
        along /= np.linalg.norm(along)
        for sign in (away, -away):
            z = x + sign * along
            for _ in range(20):
                system = law(z)
                matrix = np.vstack([system.slopes(0.0 * z), along])
                right = np.append(-system.values(0.0 * z), sign - along @ (z - x))
                step = np.linalg.lstsq(matrix, right, rcond=None)[0]
                z = z + step
                if not np.isfinite(z).all() or np.abs(step).max() < 1e-15:
                    break
            if not np.isfinite(z).all():
                continue
            near = np.abs(z - x).max() < 10.0 * away and abs(sign - along @ (z - x)) < 1e-6 * away
            if near and _vanishes(law(z), 0.0 * z):
                return True
    return False


def _nearest(law: Law, x: Floats) -> Floats:
    """Return the point of a set of roots nearest to the origin, by a descent along the set."""
    best = x
    for _ in range(_NEAREST):
        null = _null(law(best))
        y = best - null @ (null.T @ best)
        for _ in range(_ROUNDS):
            y = y + _descended(law(y), 0.0 * y)
        if not (np.isfinite(y).all() and _vanishes(law(y), 0.0 * y) and _null(law(y)).size):
            break
        if np.linalg.norm(y) > np.linalg.norm(best) * (1.0 - 1e-9):
            break
        best = y
    return best


def _deflated_root(system: Polynomials) -> Floats | None:
    """Return the vector from the point of expansion to an isolated multiple root, or None."""
    random, n = np.random.default_rng(8), system.variables
    point = np.zeros(n)
    for _ in range(_DEPTH):
        slopes = system.slopes(point)
        sizes = np.linalg.svd(slopes, compute_uv=False)
        rank = int((sizes > _ZERO).sum())
        if rank == system.variables:
            point = _descended(system, point)
            return point[:n] if _vanishes(system, point) else None
        if system.variables + rank + 1 > _MOST_VARIABLES:
            return None
        matrix, row = random.normal(size=(system.variables, rank + 1)), random.normal(size=rank + 1)
        matrix /= np.linalg.norm(matrix, axis=0)
        equations = np.vstack([slopes @ matrix, row])
        vector = np.linalg.lstsq(equations, np.append(np.zeros(len(slopes)), 1.0), rcond=None)[0]
        system = system.deflated(matrix, row)
        point = np.append(point, vector)
    return None
