"""Two-parameter continuation of bifurcation points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.keywords import renamed
from udd._util.validation import number, whole
from udd.errors import IntegrationError, ModelError

from .bifurcation_functions import FUNCTIONS, test_functions_at
from .bifurcation_location import frequency_of
from .branch import AnyCurve, BifurcationPoint
from .branch_continuation import bounds_of
from .branch_solutions import solution_at
from .conservative_families import FamilyCurve
from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed, CurvePoint, natural_constraint, newton_corrector, tangent_at
from .shooting_curve import PeriodicOrbitCurve
from .solutions import Equilibrium, PeriodicOrbit

__all__ = ["Locus", "locus"]

_EXACT = 1e-13  # of the parameters, relative to their units
_TURN = 0.9  # least cosine between one direction in the plane and the next
_SHORTEST = 1e-5  # step


@dataclass(frozen=True, eq=False)
class Locus(Drawable):
    """Bifurcation points of one kind over two parameters.

    Attributes
    ----------
    kind : str
    parameters : tuple of str
        The first is that of the point from which the curve was followed.
    values : ndarray, shape (n, 2)
        Their values along the curve.
    solutions : tuple of Equilibrium or PeriodicOrbit
        What bifurcates at each of them.
    frequencies : ndarray, shape (n,)
        As in :class:`BifurcationPoint`.
    lyapunov_coefficients : ndarray, shape (n,)
        Of Hopf bifurcations: where it changes its sign cycles are born stable on one side.
    ends : tuple of str
        Why the curve ends, at its beginning and at its end.
    """

    kind: str
    parameters: tuple[str, str]
    values: Floats
    solutions: tuple[Equilibrium | PeriodicOrbit, ...]
    frequencies: Floats
    lyapunov_coefficients: Floats
    ends: tuple[str, str]

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        (a, b), (p, q) = self.values[[0, -1]], self.parameters
        return (
            f"<Locus of {self.kind} over {p} and {q}: {len(self)} points from ({a[0]:.6g}, {a[1]:.6g}) to "
            f"({b[0]:.6g}, {b[1]:.6g})>"
        )


@renamed(step="ds", longest="ds_max", most="max_points")
@checked_arguments
def locus(
    point: BifurcationPoint,
    parameter: str,
    bounds: Sequence[float] = (0.0, np.inf),
    *,
    within: Sequence[float] = (0.0, np.inf),
    ds: float = 0.05,
    ds_max: float = 0.2,
    max_points: int = 200,
) -> Locus:
    """Follow a bifurcation point over a second parameter.

    Parameters
    ----------
    point : BifurcationPoint
        A fold, a Hopf, Neimark-Sacker, symmetry-breaking or period-doubling point of
        :func:`udd.continuation`.
    parameter : str
        The second parameter.
    bounds, within : (float, float)
        The curve ends where the second or the first parameter leaves these bounds.
    ds, ds_max : float
        The first and the longest step, in units of the parameters' values at the point.
    max_points : int
        Points at most, in either direction.

    Returns
    -------
    Locus

    Raises
    ------
    ModelError
        A point of another kind, or a parameter or option that cannot be used.

    Notes
    -----
    At every pair of parameters the equilibrium or cycle is solved for, and the function whose zero makes the
    bifurcation is evaluated; the curve of its zeros is followed in the plane of the parameters, each point
    located by the secant method across the curve. A fold is located along its branch, for one value of
    the second parameter after the other: its curve ends where it turns back in that parameter.

    Examples
    --------
    Where rotation becomes stable, ``w = (1 - B)/(B (1 + B))``:

    >>> import udd
    >>> rest = udd.equilibria(udd.DLE(2.5, B=0.2))[0]
    >>> hopf = udd.continuation(rest, "w", (1.0, 9.0)).points[0]
    >>> curve = udd.locus(hopf, "B", (0.1, 0.4))
    >>> w, B = curve.values.T
    >>> print(abs(w - (1 - B) / (B * (1 + B))).max() < 1e-10)
    True
    """
    if not isinstance(point, BifurcationPoint) or point._curve is None or point._place is None:
        raise ModelError("a bifurcation point of udd.continuation is needed")
    if point.kind not in FUNCTIONS or point.kind == "branch point":
        raise ModelError(f"a curve of points of the kind {point.kind} is not followed")
    if isinstance(point._curve, FamilyCurve):
        raise ModelError("points of a family of cycles are not followed over a second parameter")
    second = point._curve.flow.index(parameter)
    if second == point._curve.parameter:
        raise ModelError(f"the second parameter must be another than {parameter}")
    box = np.array([bounds_of(within), bounds_of(bounds)])
    start = np.array([point.value, point._curve.values_at(point._place.u)[second]])
    if (start < box[:, 0]).any() or (start > box[:, 1]).any():
        raise ModelError(f"the point itself, at {start[0]:g} and {start[1]:g}, lies outside the bounds")
    ds = number("ds", ds, above=0.0)
    ds_max = max(ds, number("ds_max", ds_max, above=0.0))
    max_points = whole("max_points", max_points, 1)
    along = _Fold if point.kind == "fold" else _Plane
    ways = []
    for sense in (-1.0, 1.0):
        ways.append(along(point, second, box).follow(sense, ds, ds_max, max_points))
    (back, first), (on, last) = ways
    found = [*back[:0:-1], *on]
    values = np.array([value for value, _, _ in found])
    solutions = tuple(solution for _, solution, _ in found)
    frequencies = np.array([frequency for _, _, frequency in found])
    coefficients = [s.lyapunov_coefficient if isinstance(s, Equilibrium) else np.nan for s in solutions]
    return Locus(
        point.kind,
        (point.parameter, parameter),
        values,
        solutions,
        frequencies,
        np.array(coefficients),
        (first, last),
    )


_Found = tuple[Floats, Equilibrium | PeriodicOrbit, float]


class _Plane:
    """The zeros of a function over the plane of two parameters, in units of their first values."""

    def __init__(self, point: BifurcationPoint, second: int, box: Floats) -> None:
        curve, place = point._curve, point._place
        assert curve is not None and place is not None  # checked by the caller
        self.name, self.second = FUNCTIONS[point.kind], second
        values = curve.values_at(place.u)
        self.curve: AnyCurve = replace(curve, values=values)
        self.place = place
        pair = values[[curve.parameter, second]]
        self.unit = np.where(pair != 0.0, np.abs(pair), 1.0)
        self.start, self.box = pair / self.unit, box

    def solve(self, p: Floats) -> CurvePoint:
        """The solution at these scaled parameters, from the one before."""
        first, second = p * self.unit
        self.curve.values[self.second] = second
        if isinstance(self.curve, PeriodicOrbitCurve):
            self.curve.seen = None
        guess = self.place.u.copy()
        guess[-1] = first / self.curve.scale
        row = natural_constraint(guess)
        return CurvePoint(newton_corrector(self.curve, guess, row), row)

    def value(self, p: Floats) -> float:
        """The function at these scaled parameters."""
        return float(getattr(test_functions_at(self.curve, self.solve(p)), self.name))

    def follow(self, sense: float, step: float, longest: float, most: int) -> tuple[list[_Found], str]:
        """Points from the start on, and why they end; `sense` is that of the second parameter at first."""
        p, direction = self.start, np.array([0.0, sense])
        found = [self._found(p)]
        while len(found) <= most:
            try:
                small = 1e-5
                slope = np.array([(self.value(p + small * e) - self.value(p - small * e)) for e in np.eye(2)])
            except (CorrectorFailed, IntegrationError) as error:
                return found, f"lost: {error}"
            normal = slope / np.linalg.norm(slope)
            along = np.array([-normal[1], normal[0]])
            along *= np.sign(along @ direction) or 1.0
            while True:
                reason = "the curve turns too sharply"
                try:
                    there = self._across(p + step * along, normal, step)
                    way = (there - p) / np.linalg.norm(there - p)
                    if way @ along > _TURN:
                        break
                except (CorrectorFailed, IntegrationError, RuntimeError, ValueError) as error:
                    reason = str(error)
                step *= 0.5
                if step < _SHORTEST:
                    return found, f"lost: {reason}"
            outside = (there * self.unit < self.box[:, 0]) | (there * self.unit > self.box[:, 1])
            if outside.any():
                k = int(np.flatnonzero(outside)[0])
                bound = self.box[k, 0] if there[k] * self.unit[k] < self.box[k, 0] else self.box[k, 1]
                return [*found, *self._at_bound(p, there, k, bound)], f"the bound {bound:.6g}"
            p, direction = there, way
            found.append(self._found(p))
            step = min(longest, 1.4 * step)
        return found, "as many points as were wanted"

    def _across(self, guess: Floats, normal: Floats, step: float) -> Floats:
        root = optimize.root_scalar(
            lambda n: self.value(guess + n * normal), method="secant", x0=0.0, x1=0.05 * step, xtol=_EXACT
        )
        if not root.converged or abs(root.root) > step:
            raise CorrectorFailed("the curve turns too sharply")
        there: Floats = guess + root.root * normal
        return there

    def _at_bound(self, p: Floats, there: Floats, k: int, bound: float) -> list[_Found]:
        """The point where the curve meets a bound of parameter `k`."""
        part = (bound / self.unit[k] - p[k]) / (there[k] - p[k])
        guess, other = p + part * (there - p), np.eye(2)[1 - k]
        if np.abs(guess - p).max() < 1e-9:
            return []  # it begins on the bound
        try:
            return [self._found(self._across(guess, other, float(np.linalg.norm(there - p))))]
        except (CorrectorFailed, IntegrationError, RuntimeError, ValueError):
            return []

    def _found(self, p: Floats) -> _Found:
        self.place = self.solve(p)
        if isinstance(self.curve, PeriodicOrbitCurve):
            self.curve.fix_phase(self.place.u)
        frequency = float("nan")
        if self.name == "complex_pair":
            frequency = frequency_of(self.curve, self.place.u, test_functions_at(self.curve, self.place))
        return p * self.unit, solution_at(self.curve, self.place.u), frequency


class _Fold(_Plane):
    """Folds, each located along its branch at one value of the second parameter."""

    def follow(self, sense: float, step: float, longest: float, most: int) -> tuple[list[_Found], str]:
        second, end = float(self.start[1]), "as many points as were wanted"
        bound = self.box[1, 0 if sense < 0 else 1] / self.unit[1]
        found: list[_Found] = [self._here()]
        while len(found) <= most:
            trial = second + sense * step
            last = (trial - bound) * sense >= 0.0
            trial = bound if last else trial
            before = self.place
            try:
                self._to(trial)
            except (CorrectorFailed, IntegrationError, RuntimeError, ValueError) as error:
                self.place = before
                step *= 0.5
                if step < _SHORTEST:
                    end = f"lost, where the curve may turn: {error}"
                    break
                continue
            second = trial
            here = self._here()
            if not self.box[0, 0] <= here[0][0] <= self.box[0, 1]:
                end = "a bound of the first parameter"
                break
            found.append(here)
            if last:
                end = f"the bound {bound * self.unit[1]:.6g}"
                break
            step = min(longest, 1.4 * step)
        return found, end

    def _to(self, second: float) -> None:
        """The fold at this value of the second parameter, from the one before."""
        self.curve.values[self.second] = second * self.unit[1]
        if isinstance(self.curve, PeriodicOrbitCurve):
            self.curve.seen = None
        start, places = self.place, {}

        def at(sigma: float) -> float:
            u = newton_corrector(self.curve, start.u + sigma * start.tangent, start.tangent)
            places[sigma] = CurvePoint(u, tangent_at(self.curve, u, start.tangent))
            return float(places[sigma].tangent[-1])

        root = optimize.root_scalar(at, method="secant", x0=0.0, x1=1e-3, xtol=1e-12)
        if not root.converged or abs(root.root) > 0.3:
            raise CorrectorFailed("the fold moves too far")
        at(root.root)
        self.place = places[root.root]
        if isinstance(self.curve, PeriodicOrbitCurve):
            self.curve.fix_phase(self.place.u)

    def _here(self) -> _Found:
        value = np.array([self.curve.value(self.place.u), self.curve.values[self.second]])
        return value, solution_at(self.curve, self.place.u), float("nan")
