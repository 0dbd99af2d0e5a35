"""Cubic B-splines on evenly spaced knots, with a roughness penalty (P-splines)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Spline:
    """B-spline basis along one coordinate.

    Attributes
    ----------
    low, high : float
        First and last knot; beyond them a curve is constant.
    intervals : int
        Count of intervals between knots.
    periodic : bool
        True if `high` is the same place as `low`.
    """

    low: float
    high: float
    intervals: int
    periodic: bool

    @property
    def size(self) -> int:
        """Count of basis functions."""
        return self.intervals if self.periodic else self.intervals + 3

    @property
    def step(self) -> float:
        """Distance between knots."""
        return (self.high - self.low) / self.intervals

    def design(self, x: Array, derivative: int = 0) -> Array:
        """Evaluate the basis functions, or their derivatives, at places; the last axis has length `size`."""
        knots = self.low + self.step * np.arange(-3, self.intervals + 4)
        inside = self._inside(x)
        functions = BSpline(knots, np.eye(self.intervals + 3), 3)
        if derivative:
            functions = functions.derivative(derivative)
        result: Array = functions(inside.ravel()).reshape(*x.shape, self.intervals + 3)
        if derivative and not self.periodic:
            result = np.where(((x < self.low) | (x > self.high))[..., None], 0.0, result)
        if self.periodic:
            result, beyond = result[..., : self.intervals].copy(), result[..., self.intervals :]
            result[..., :3] += beyond
        return result

    def _inside(self, x: Array) -> Array:
        if self.periodic:
            return self.low + np.mod(x - self.low, self.high - self.low)
        return np.clip(x, self.low, self.high)

    @property
    def roughness(self) -> Array:
        """Matrix whose quadratic form sums the squared second differences of the coefficients."""
        if self.periodic:
            identity = np.eye(self.size)
            second = np.roll(identity, 1, axis=1) - 2 * identity + np.roll(identity, -1, axis=1)
        else:
            second = np.diff(np.eye(self.size), 2, axis=0)
        result: Array = second.T @ second
        return result


def along(x: Array, angle: bool, intervals: int) -> Spline:
    """Make the basis for the places that a record visits.

    An angle is periodic if the places cover the turn, or lie on both sides of the jump from pi to -pi.
    """
    low, high = float(x.min()), float(x.max())
    if angle:
        gap = np.diff(np.sort(x, axis=None)).max(initial=2 * np.pi / intervals)
        if 2 * np.pi - (high - low) < gap:
            return Spline(0.0, 2 * np.pi, intervals, True)
    margin = 0.02 * (high - low)
    return Spline(low - margin, high + margin, intervals, False)


def product(a: Array, b: Array) -> Array:
    """Multiply every column of one design by every column of another."""
    result: Array = (a[..., :, None] * b[..., None, :]).reshape(*a.shape[:-1], -1)
    return result


def rough_product(a: Spline, b: Spline) -> Array:
    """Return the roughness matrix of a surface, summed over both directions."""
    result: Array = np.kron(a.roughness, np.eye(b.size)) + np.kron(np.eye(a.size), b.roughness)
    return result
