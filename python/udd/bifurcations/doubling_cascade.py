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

from .branch import BifurcationPoint, Branch
from .branch_continuation import bounds_of, continuation
from .flow_map import Floats
from .period_doubling import next_doubling
from .pseudo_arclength import CorrectorFailed
from .solutions import PeriodicOrbit

__all__ = ["Cascade", "cascade"]

_KIND = "period doubling"
_CLOSER = 2.5  # about the factor by which the two rounds come closer at each doubling (Feigenbaum's alpha)
_KNOWN = 3  # doublings, whose spacings say where the next one is


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
    >>> found = udd.cascade(udd.periodic_orbit(udd.DLE(6.0)), "w", n=3)
    >>> found.values.round(6).tolist()
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
            branch = next_doubling(points[-1], ahead, 0.01 / closer)
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
