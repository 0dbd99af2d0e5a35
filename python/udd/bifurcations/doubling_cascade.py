"""Period-doubling cascades and Feigenbaum's ratios."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.validation import whole
from udd.errors import IntegrationError, ModelError

from .bifurcation_functions import TestFunctions
from .bifurcation_location import point_at
from .branch import BifurcationPoint, Branch
from .branch_continuation import bounds_of, branch_from, continuation
from .branch_following import BranchTrace, Station
from .branch_switching import doubled
from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed, CurvePoint, corrected_point
from .solutions import PeriodicOrbit

__all__ = ["Cascade", "cascade"]

_KIND = "period doubling"
_CLOSER = 2.5  # about the factor by which the two rounds come closer at each doubling (Feigenbaum's alpha)
_KNOWN = 3  # doublings, whose spacings say where the next one is
_MOST = 12  # Largest number of orbits of the secant method.
_NOISE = 1e-5  # Size of the test function that may be rounding.
_EXACT = 1e-11  # Relative error of the square of the amplitude, where the secant method ends.
_WAY = (0.1, 0.5, 1.0)  # Parts of the expected square: each orbit is the guess of the next.
_FARTHEST = 1e4  # Largest ratio of the expected square to that of the first amplitude.


@dataclass(frozen=True, eq=False)
class Cascade(Drawable):
    """Successive period doublings.

    Attributes
    ----------
    parameter : str
    points : tuple of BifurcationPoint
        The doublings.
    branches : tuple of Branch
        The cycles that lead to each of them.

    See Also
    --------
    udd.cascade : makes it.
    udd.plot.cascade : draw it.
    """

    parameter: str
    points: tuple[BifurcationPoint, ...]
    branches: tuple[Branch, ...]

    @property
    def values(self) -> Floats:
        """The parameter's value at each doubling, shape (n,)."""
        return np.array([point.value for point in self.points])

    @property
    def errors(self) -> Floats:
        """Bounds of these values' errors, shape (n,)."""
        return np.array([point.error for point in self.points])

    @property
    def ratios(self) -> Floats:
        """The ratios of successive spacings, shape (n - 2,): they tend to Feigenbaum's 4.669201609."""
        spacing = np.diff(self.values)
        return spacing[:-1] / spacing[1:]

    @property
    def limit(self) -> float:
        """The limit of the doublings, extrapolated from the last three (Aitken); NaN of fewer."""
        return _aitken(self.values)

    @property
    def limit_error(self) -> float:
        """A bound of its error: what the last doubling changes in it, more than all that follow will."""
        if len(self.points) < 3:
            return float("nan")
        before = _aitken(self.values[:-1]) if len(self.points) > 3 else float(self.values[-1])
        # An error of one of the three moves the limit by no more than itself, of all three by twice as much.
        return abs(self.limit - before) + 2.0 * float(self.errors[-3:].max())

    def __repr__(self) -> str:
        values = ", ".join(f"{value:.11g}" for value in self.values)
        ratios = ", ".join(f"{ratio:.5g}" for ratio in self.ratios)
        limit = f"limit {self.limit:.11g} (error below {self.limit_error:.1g})"
        return f"<Cascade over {self.parameter}: {values}; ratios {ratios}; {limit}>"


def _aitken(values: Floats) -> float:
    """Return the limit of a sequence whose last differences fall by one factor."""
    if len(values) < 3:
        return float("nan")
    a, b, c = values[-3:]
    return float(c - (c - b) ** 2 / ((c - b) - (b - a)))


@checked_arguments
def cascade(
    start: PeriodicOrbit | BifurcationPoint,
    parameter: str | None = None,
    bounds: Sequence[float] = (0.0, np.inf),
    *,
    n: int = 6,
    direction: Literal["up", "down"] = "down",
) -> Cascade:
    """Follow a cascade of period doublings.

    Parameters
    ----------
    start : PeriodicOrbit or BifurcationPoint
        A cycle before its first doubling, or a period doubling or symmetry breaking from
        :func:`udd.continuation`.
    parameter : str, optional
        The parameter that is varied; by default that of the bifurcation point.
    bounds : (float, float)
        The cascade ends where the parameter leaves them.
    n : int
        How many doublings are wanted, at least 1.
    direction : {"up", "down"}
        Which way from the cycle; a bifurcation point knows its own.

    Returns
    -------
    Cascade

    Raises
    ------
    ModelError
        Where no doubling follows: the message says which was the last.

    See Also
    --------
    udd.continuation : follows a single branch.
    udd.plot.cascade : draw it.
    udd.plot.branches : draw its branches.

    Notes
    -----
    Each doubled cycle is followed from its birth until it doubles itself, with steps that become shorter as
    the cycles do. See :func:`udd.continuation`.

    Examples
    --------
    >>> import udd
    >>> cascade = udd.cascade(udd.periodic_orbit(udd.DLE(6.0)), "w", n=3)
    >>> cascade.values.round(6).tolist()
    [5.394713, 5.086062, 5.02182]
    """
    n = whole("n", n, 1)
    low, high = bounds_of(bounds)
    points: list[BifurcationPoint] = []
    branches: list[Branch] = []
    if isinstance(start, BifurcationPoint) and start.kind == _KIND:
        points.append(start)
    closer = 1.0
    while len(points) < n:
        if not points:
            branch = continuation(start, parameter, bounds, direction=direction, until=_KIND)
        else:
            closer *= _CLOSER
            branch = _next(points, (low, high), closer)
        doublings = branch.find(_KIND)
        if not doublings:
            last = f"after that at {points[-1].value:.10g}" if points else "from the start"
            raise ModelError(
                f"{len(points)} of {n} doublings are found: {last} the branch ends at {branch.ends[-1]}"
            )
        branches.append(branch)
        points.append(doublings[0])
    return Cascade(points[0].parameter, tuple(points), tuple(branches))


def _next(points: list[BifurcationPoint], bounds: tuple[float, float], closer: float) -> Branch:
    """Return the branch born at the last doubling, up to the doubling of its own."""
    if len(points) >= _KNOWN:
        a, b, c = (point.value for point in points[-3:])
        ahead = (c - b) ** 2 / (b - a)
        try:
            branch = _doubling_ahead(points[-1], ahead, 0.01 / closer)
            if bounds[0] <= branch.values[-1] <= bounds[1]:
                return branch
        except (CorrectorFailed, IntegrationError):
            pass  # step by step, then
    return continuation(
        points[-1],
        bounds=bounds,
        until=_KIND,
        max_period=4.0 * points[-1].period,
        ds=0.01 / closer,
        ds_max=0.05 / closer,
        amplitude=0.01 / closer,
    )


def _doubling_ahead(point: BifurcationPoint, ahead: float, amplitude: float) -> Branch:
    """Return the branch born at a doubling, up to the doubling of its own: a few points of it.

    The next one is about `ahead` off in the parameter; the branch is looked for first at a small `amplitude`.
    By the normal form, parameter and multiplier are nearly linear in the square of the amplitude. The bend of
    the parameter says where the next doubling is expected, and the secant method finds the multiplier -1.
    CorrectorFailed: it is not there.
    """
    curve, start = point._curve, point._place
    if curve is None or start is None or curve.kind != "cycle":
        raise CorrectorFailed("the point is not one of a cycle")
    new, base, row = doubled(curve, start)
    orbits: dict[float, tuple[CurvePoint, TestFunctions]] = {}

    def at(square: float, near: Floats) -> Floats:
        """Return the orbit at the square of an amplitude, from another one."""
        before = float(row @ (near - base))
        across = near - base - before * row
        # The part across the amplitude grows with its square.
        guess = base + square**0.5 * row + across * (square / before**2 if before else 0.0)
        try:
            place = corrected_point(new, guess, row)
        except IntegrationError as error:
            raise CorrectorFailed(str(error)) from None
        orbits[square] = place, new.test_functions(place)
        return place.u

    square = amplitude**2
    u = at(square, base)
    for part in _WAY:
        expected = ahead * square / (new.value(u) - point.value)
        if not 0.0 < expected < _FARTHEST * amplitude**2:
            raise CorrectorFailed("the branch does not lead there")
        square = part * expected
        u = at(square, u)
    value = orbits[square][1].period_doubling
    # From the birth to the doubling the multiplier falls from 1 to -1: half of it and 1, nearly along a line.
    other = square * (1.0 + float(np.clip(value, -0.3, 0.3)))
    for _ in range(_MOST):
        if not 0.0 < other < 4.0 * square:
            raise CorrectorFailed("the multiplier does not fall to -1")
        if abs(other - square) <= _EXACT * square:
            break
        u = at(other, u)
        before, value = value, orbits[other][1].period_doubling
        if abs(before) < _NOISE and abs(value) >= 0.5 * abs(before):
            break  # as near as rounding lets it come
        if not np.isfinite(value) or value == before:
            raise CorrectorFailed("the multiplier does not fall to -1")
        square, other = other, other - value * (other - square) / (value - before)
    else:
        raise CorrectorFailed("the secant method does not converge")
    place, signs = orbits[square]
    size = square**0.5
    errors = new.location_error(
        CurvePoint(place.u - size * place.tangent, place.tangent), size, place, size, "period_doubling"
    )
    own = point_at(new, _KIND, place, signs, size, errors)
    # Orbits beyond the doubling, from the secant method, are left out.
    places = [Station(new, *orbits[s], s**0.5) for s in sorted(orbits) if s <= square]
    way = BranchTrace(places, [own], "the point that was wanted")
    return branch_from([way], point.solution.model, point.parameter, f"born at a {_KIND}")
