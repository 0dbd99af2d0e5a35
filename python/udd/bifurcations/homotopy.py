"""All isolated roots of a system of polynomials, by a homotopy with the Bezout number of paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .flow_map import Floats
from .polynomials import Polynomials

__all__ = ["Roots", "bezout_number", "complex_roots"]

Complex = NDArray[np.complex128]

_FIRST = 0.05  # First step of the homotopy's parameter, which falls from 1 to 0.
_LAST = 1e-11  # Parameter at which paths to multiple roots end.
_SHORTEST = 1e-9  # Shortest step, relative to the parameter: with it a path has failed.
_TOLERANCE = (1e-6, 1e-8, 1e-10)  # Largest first Newton step on the path, from one attempt to the next.
_ROUNDS = 4000  # Largest number of steps.
_STEPS = 3  # Newton steps at each of them.
_REGULAR = 1e-11  # Least quotient of the singular values at a simple root.
_SAME = 1e-7  # Relative distance of two results for one simple root.
_FAR = 1e7  # Units beyond which a root lies at infinity.
_JUMP = 0.1  # Largest change, relative to its size, by which Newton's method moves the end of a path.
_DECADES = 100.0  # Factor of the parameter within which a path to a multiple root still moves.


@dataclass(frozen=True, eq=False)
class Roots:
    """The ends of the paths of a homotopy.

    Attributes
    ----------
    simple : ndarray of complex, shape (k, n)
        Simple roots.
    multiple : ndarray of complex, shape (l, n)
        Ends of paths near which the derivatives are singular, paths to one root together: multiple roots,
        and points on sets of roots.
    lost : int
        Paths that could not be followed to the end, or that jumped to another.
    """

    simple: Complex
    multiple: Complex
    lost: int


def bezout_number(system: Polynomials) -> int:
    """Return the product of the degrees, which bounds the number of isolated complex roots."""
    return int(np.prod([int(degree) for degree in system.degrees], dtype=object))


def complex_roots(system: Polynomials) -> Roots:
    """Return the isolated roots of as many polynomials as variables.

    The paths lead from the roots of ``x_i^d_i = 1`` to those of the system, in projective coordinates, in
    which roots at infinity are points like others (A. J. Sommese and C. W. Wampler, The Numerical Solution of
    Systems of Polynomials, 2005). For almost all of the complex constants of the start every isolated root is
    the end of a path. If two paths end at one simple root, one of them has jumped: all are followed again,
    more closely.
    """
    best = _attempt(system, _TOLERANCE[0], seed=0)
    for attempt, tolerance in enumerate(_TOLERANCE[1:], 1):
        if best.lost == 0:
            break
        best = min(best, _attempt(system, tolerance, seed=attempt), key=lambda roots: roots.lost)
    return best


def _attempt(system: Polynomials, tolerance: float, seed: int) -> Roots:
    random = np.random.default_rng(50 + seed)
    path = _Paths(system, random)
    x, earlier, arrived = path.follow(tolerance)
    n = system.variables
    finite = np.abs(x[:, 0]) * _FAR > np.abs(x[:, 1:]).max(axis=1)
    finite &= np.abs(x[:, 0]) > 0.0
    ends = x[arrived & finite]
    ends = ends[:, 1:] / ends[:, :1]
    before = earlier[arrived & finite]
    moved = np.abs(before[:, 1:] / np.where(before[:, :1] == 0.0, 1e-300, before[:, :1]) - ends).max(axis=1)
    simple: list[Complex] = []
    others: list[tuple[Complex, float]] = []
    jumped = 0
    for end, motion in zip(ends, moved, strict=True):
        root = _polished(system, end)
        size = 1.0 + float(np.abs(end).max())
        if root is None or np.abs(root - end).max() > _JUMP * size:
            # On its way to infinity it grows, to a multiple root it moves less and less.
            if motion < 0.5 * size:
                others.append((end, float(motion)))
        elif any(np.abs(root - known).max() < _SAME * size for known in simple):
            jumped += 1
        else:
            simple.append(root)
    merged = _clusters(others)
    lost = int((~arrived).sum()) + jumped
    return Roots(np.array(simple).reshape(-1, n), np.array(merged).reshape(-1, n), lost)


def _clusters(ends: list[tuple[Complex, float]]) -> list[Complex]:
    """Return the means of ends that lie nearer to each other than they still move.

    The paths to a multiple root lie around it, so that their mean is nearer to it by far.
    """
    left, merged = list(range(len(ends))), []
    while left:
        group = [left.pop(0)]
        for k in group:
            near = [
                j for j in left if np.abs(ends[j][0] - ends[k][0]).max() < 3.0 * max(ends[j][1], ends[k][1])
            ]
            group += near
            left = [j for j in left if j not in near]
        merged.append(np.mean([ends[k][0] for k in group], axis=0))
    return merged


def _polished(system: Polynomials, x: Complex) -> Complex | None:
    """Return the simple root at which Newton's method arrives, or None."""
    for _ in range(12):
        matrix = system.slopes(x)
        sizes = np.linalg.svd(matrix, compute_uv=False)
        if not np.isfinite(sizes).all() or sizes[-1] <= _REGULAR * sizes[0]:
            return None
        step = np.linalg.solve(matrix, system.values(x))
        x = x - step
        if np.abs(step).max() <= 1e-13 * (1.0 + np.abs(x).max()):
            # Nearer to a multiple root the derivatives would vanish with the rates.
            rounding = 1e-15 * float(system.sizes(x).max()) / sizes[-1]
            return x if rounding < 1e-6 * (1.0 + float(np.abs(x).max())) else None
    return None


class _Paths:
    """The homotopy ``t G + (1 - t) F`` from ``G_i = c_i (x_i^d_i - x_0^d_i)``, all paths at a time."""

    def __init__(self, system: Polynomials, random: np.random.Generator) -> None:
        self.system = system.homogeneous()
        self.degrees = system.degrees
        self.factors = np.exp(2j * np.pi * random.random(len(self.degrees)))
        # Not the same lengths for all: a start of the same symmetry as the system is not generic.
        self.factors *= 0.5 + random.random(len(self.degrees))
        phases = [np.exp(2j * np.pi * np.arange(d) / d) for d in self.degrees.tolist()]
        grid = np.stack(np.meshgrid(*phases, indexing="ij"), axis=-1).reshape(-1, len(phases))
        start = np.concatenate([np.ones((len(grid), 1)), grid], axis=1)
        self.start: Complex = start / np.linalg.norm(start, axis=1, keepdims=True)

    def at(self, x: Complex, t: Floats) -> tuple[Complex, Complex, Complex]:
        """Return the homotopy (p, n), its derivatives (p, n, n + 1) and those by the parameter (p, n)."""
        n, d = len(self.degrees), self.degrees
        last = x[:, :1] ** (d - 1)
        own = x[:, 1:] ** (d - 1)
        begin = self.factors * (own * x[:, 1:] - last * x[:, :1])
        slopes = np.zeros((len(x), n, n + 1), dtype=complex)
        each = np.arange(n)
        slopes[:, each, each + 1] = self.factors * d * own
        slopes[:, :, 0] = -self.factors * d * last
        end, ends = self.system.values(x), self.system.slopes(x)
        s = t[:, None]
        return s * begin + (1.0 - s) * end, s[:, :, None] * slopes + (1.0 - s)[:, :, None] * ends, begin - end

    def _solve(self, x: Complex, matrix: Complex, right: Complex) -> Complex:
        """Return the solution across the point itself: lengths do not matter."""
        full = np.concatenate([matrix, x.conj()[:, None, :]], axis=1)
        right = np.concatenate([right, np.zeros((len(x), 1))], axis=1)
        try:
            return np.asarray(np.linalg.solve(full, right[:, :, None])[:, :, 0], dtype=np.complex128)
        except np.linalg.LinAlgError:
            result = np.array(
                [np.linalg.lstsq(a, b, rcond=None)[0] for a, b in zip(full, right, strict=True)]
            )
        return result

    def _slope(self, x: Complex, t: Floats) -> Complex:
        _, matrix, by_t = self.at(x, t)
        return self._solve(x, matrix, -by_t)

    def follow(self, tolerance: float) -> tuple[Complex, Complex, NDArray[np.bool_]]:
        """Ends (p, n + 1), points at which the parameter was larger, and which paths have arrived."""
        x, count = self.start.copy(), len(self.start)
        t, step = np.ones(count), np.full(count, _FIRST)
        earlier, going = x.copy(), np.ones(count, dtype=bool)
        arrived = np.zeros(count, dtype=bool)
        for _ in range(_ROUNDS):
            active = np.flatnonzero(going)
            if not len(active):
                break
            h = np.minimum(step[active], 0.75 * t[active])
            y, good, easy = self._step(x[active], t[active], h, tolerance)
            kept = active[good]
            watched = kept[t[kept] > _DECADES * _LAST]
            x[kept] = y[good]
            t[kept] -= h[good]
            earlier[watched] = x[watched]
            step[active] = np.where(good, np.where(easy, 2.0, 1.0) * h, 0.5 * h)
            arrived[active] = t[active] <= _LAST
            going[active] = ~arrived[active] & (step[active] > _SHORTEST * t[active])
        return x, earlier, arrived

    def _step(
        self, x: Complex, t: Floats, h: Floats, tolerance: float
    ) -> tuple[Complex, NDArray[np.bool_], NDArray[np.bool_]]:
        """Points a step on, which of them lie on the path, and which were found easily."""
        with np.errstate(all="ignore"):
            half = 0.5 * h[:, None]
            k1 = self._slope(x, t)
            k2 = self._slope(x - half * k1, t - 0.5 * h)
            k3 = self._slope(x - half * k2, t - 0.5 * h)
            k4 = self._slope(x - h[:, None] * k3, t - h)
            y = x - h[:, None] / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            first = np.full(len(x), np.inf)
            for k in range(_STEPS):
                value, matrix, _ = self.at(y, t - h)
                move = self._solve(y, matrix, -value)
                y = y + move
                last = np.linalg.norm(move, axis=1) / np.linalg.norm(y, axis=1)
                first = last if k == 0 else first
                if k and (np.nan_to_num(last, nan=0.0) < 1e-12).all():
                    break
            y = y / np.linalg.norm(y, axis=1, keepdims=True)
            good = np.isfinite(y).all(axis=1) & (first < tolerance**0.5) & (last < tolerance)
            return np.where(good[:, None], y, x), good, first < 0.1 * tolerance**0.5
