"""Equilibria or cycles over two parameters: a surface on which bifurcations are curves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from udd.errors import IntegrationError

from .bifurcation_functions import TestFunctions
from .branch import AnyCurve
from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed, CurvePoint, newton, solve

__all__ = ["SolutionSurface", "SurfacePoint"]

_EXACT = 1e-13  # of the distance across the curve, in scaled unknowns
_SMALL = 1e-5  # for slopes of the test functions


@dataclass(frozen=True, eq=False)
class SurfacePoint:
    """A point of the surface.

    Attributes
    ----------
    curve : EquilibriumCurve or PeriodicOrbitCurve
        The solutions over the first parameter at this value of the second.
    v : ndarray, shape (n + 2,)
        Scaled unknowns of that curve, and the second parameter.
    plane : ndarray, shape (2, n + 2)
        Orthonormal vectors of the tangent plane. The first one leads along the curve.
    """

    curve: AnyCurve
    v: Floats
    plane: Floats

    @property
    def place(self) -> CurvePoint:
        """The point on its curve over the first parameter."""
        return CurvePoint(self.v[:-1], self.plane[0, :-1])

    @property
    def functions(self) -> TestFunctions:
        """The test functions of the curve."""
        return self.curve.test_functions(self.place)

    def ahead(self, direction: Floats) -> Floats:
        """Return a direction (2,) in the plane as one of the unknowns."""
        along: Floats = direction @ self.plane
        return along


@dataclass(frozen=True, eq=False)
class SolutionSurface:
    """Solutions over two parameters, the second of them in units of `scale`.

    Nothing singles out one of the parameters but the first vector of the tangent planes: cusps, at which a
    curve of folds turns in both, are points like others.
    """

    curve: AnyCurve
    second: int
    scale: float

    def values(self, point: SurfacePoint) -> Floats:
        """Both parameters."""
        return np.array([point.curve.value(point.v[:-1]), point.v[-1] * self.scale])

    def start(self, place: CurvePoint) -> SurfacePoint:
        """Return the point of the surface where the curve over the first parameter has this one."""
        value = float(self.curve.values_at(place.u)[self.second])
        v = np.append(place.u, value / self.scale)
        return self._at(v, np.append(place.tangent, 0.0), np.append(0.0 * place.u, 1.0))

    def _at(self, v: Floats, along: Floats, across: Floats) -> SurfacePoint:
        """Return the point with these unknowns, whose plane is oriented as two vectors are."""
        curve = self._curve_at(v)
        _, matrix = curve.equations(v[:-1])
        n = len(v) - 2
        first = solve(matrix, along[:-1], np.append(np.zeros(n), 1.0))
        first /= np.linalg.norm(first)
        rest = solve(matrix, first, np.append(-curve.by_second(v[:-1], self.scale), 0.0))
        second = np.append(rest, 1.0)
        second *= np.sign(second @ across) or 1.0
        return SurfacePoint(curve, v, np.array([np.append(first, 0.0), second / np.linalg.norm(second)]))

    def _curve_at(self, v: Floats) -> AnyCurve:
        return self.curve.with_second(self.second, float(v[-1] * self.scale))

    def corrected(self, guess: Floats, base: SurfacePoint) -> SurfacePoint:
        """Return the point of the surface across another one's plane through a guess."""
        first, second = base.plane

        def step_at(v: Floats) -> Floats:
            curve, gap = self._curve_at(v), guess - v
            residual, matrix = curve.equations(v[:-1])
            column = curve.by_second(v[:-1], self.scale)
            begin = solve(matrix, first[:-1], np.append(-residual, first @ gap))
            by_second = solve(matrix, first[:-1], np.append(column, first[-1]))
            more = (second @ gap - second[:-1] @ begin) / (second[-1] - second[:-1] @ by_second)
            return np.append(begin - more * by_second, more)

        return self._at(newton(step_at, guess), first, second)

    def anchored(self, point: SurfacePoint) -> tuple[SolutionSurface, SurfacePoint]:
        """Return the surface with this solution as the reference of the phase, and the point on it."""
        if self.curve.kind != "cycle":
            return self, point
        surface = replace(self, curve=self._curve_at(point.v).anchored(point.v[:-1]))
        return surface, surface._at(point.v, *point.plane)

    def slope(self, point: SurfacePoint, name: str) -> Floats:
        """Return the derivatives (2,) of a test function along the plane, by central differences."""
        slope = []
        for along in point.plane:
            ends = [self.corrected(point.v + h * along, point) for h in (_SMALL, -_SMALL)]
            a, b = (float(getattr(end.functions, name)) for end in ends)
            slope.append((a - b) / (2.0 * _SMALL))
        return np.array(slope)

    def zero(
        self, base: SurfacePoint, guess: Floats, normal: Floats, name: str, reach: float
    ) -> SurfacePoint:
        """Return the zero of a test function near a guess, on the line along a direction (2,) of a plane."""
        points: dict[float, SurfacePoint] = {}
        across = base.ahead(normal)

        def at(distance: float) -> float:
            points[distance] = self.corrected(guess + distance * across, base)
            return float(getattr(points[distance].functions, name))

        try:
            root = optimize.root_scalar(at, method="secant", x0=0.0, x1=0.05 * reach, xtol=_EXACT)
        except (RuntimeError, ValueError, IntegrationError) as error:
            raise CorrectorFailed(str(error)) from None
        if not root.converged or not abs(root.root) <= reach:
            raise CorrectorFailed("the curve turns too sharply")
        if root.root not in points:
            at(root.root)
        return points[root.root]
