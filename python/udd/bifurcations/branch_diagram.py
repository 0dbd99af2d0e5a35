"""The one diagram: what motions do, the branches behind it, and the points where these change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.keywords import renamed
from udd.attractors.arguments import parameter_values
from udd.attractors.bifurcation_diagram import bifurcation
from udd.errors import ModelError
from udd.models import Model

from .branch import BifurcationPoint, Branch
from .branch_continuation import continuation
from .branch_switching import BIRTHS
from .equilibrium_search import equilibria
from .error_bounds import rounding_of
from .flow_map import Floats
from .periodic_orbits import periodic_orbit
from .solutions import Equilibrium, PeriodicOrbit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Diagram", "diagram"]

_ALIKE = 1e-6  # relative difference of the periods and largest multipliers of one cycle found twice


@dataclass(frozen=True, eq=False)
class Diagram(Drawable):
    """Section points, branches and bifurcation points over one parameter.

    Attributes
    ----------
    model : Model
    parameter : str
    scan : xarray.Dataset
        The result of :func:`udd.bifurcation`, up and down: points, attractors, hysteresis.
    branches : tuple of Branch
        Equilibria first, then cycles; of mirror images one.

    See Also
    --------
    udd.diagram : makes it.
    udd.plot.diagram : draw it.
    """

    model: Model
    parameter: str
    scan: xr.Dataset
    branches: tuple[Branch, ...]

    @property
    def points(self) -> tuple[BifurcationPoint, ...]:
        """The bifurcation points of all branches, by the parameter; where two branches meet, one."""
        points: list[BifurcationPoint] = []
        for point in sorted((p for branch in self.branches for p in branch.points), key=lambda p: p.value):
            if not any(_same_point(point, known) for known in points):
                points.append(point)
        return tuple(points)

    @property
    def hysteresis(self) -> Floats:
        """The first and the last value of each stretch with hysteresis, shape (k, 2)."""
        intervals: Floats = self.scan["hysteresis_interval"].to_numpy()
        return intervals

    def as_dict(self) -> dict[str, Any]:
        """Return branches, points and hysteresis as plain numbers, for JSON.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
        return {
            "model": repr(self.model),
            "parameter": self.parameter,
            "branches": [branch.as_dict() for branch in self.branches],
            "hysteresis": self.hysteresis.tolist(),
        }

    def __repr__(self) -> str:
        return (
            f"<Diagram of {self.model!r} over {self.parameter}: {len(self.branches)} branches, "
            f"{len(self.points)} bifurcation points, {len(self.hysteresis)} stretches with hysteresis>"
        )


@renamed(most="max_points", period="max_period")
@checked_arguments
def diagram(
    model: Model,
    parameter: str,
    values: ArrayLike,
    *,
    generations: int = 2,
    max_points: int = 400,
    max_period: float | None = None,
    **options: Any,
) -> Diagram:
    """Compute a bifurcation diagram: section points, branches and their bifurcations.

    Parameters
    ----------
    model : Model
        The model; `parameter` is varied in it.
    parameter : str
        One of ``model.parameters``.
    values : array_like, shape (v,)
        Its values, increasing, at least 2: the motion is followed at each of them, up and down; branches
        between the first and the last.
    generations : int
        How often branches born at bifurcation points are followed in turn.
    max_points : int
        Points at most on each branch, in either direction.
    max_period : float, optional
        As in :func:`udd.continuation`.
    **options
        As in :func:`udd.bifurcation`: `n`, `transient`, `section`, `initial_states`, ...

    Returns
    -------
    Diagram

    Raises
    ------
    ModelError
        A parameter, value or option that cannot be used.

    See Also
    --------
    udd.bifurcation : the section points alone.
    udd.continuation : a single branch.
    udd.plot.diagram : draw it.

    Notes
    -----
    Cycles are those on which the scan ends somewhere, and those born on their branches and on the branches of
    equilibria; unstable ones that are connected to none of these are missed.

    Examples
    --------
    >>> import numpy as np, udd
    >>> diagram = udd.diagram(udd.DLE(8.0), "w", np.linspace(6.9, 7.3, 9), n=24)
    >>> [(point.kind, round(point.value, 8)) for point in diagram.points]
    [('symmetry breaking', 7.09642643)]
    """
    axis = parameter_values(model, parameter, values)
    if len(axis) < 2:
        raise ModelError("a diagram needs at least two values")
    scan = bifurcation(model, parameter, axis, path="both", **options)
    bounds = (float(axis[0]), float(axis[-1]))
    limits: dict[str, Any] = {"bounds": bounds, "max_points": max_points, "max_period": max_period}
    branches: list[Branch] = []
    for value in (axis[0], axis[len(axis) // 2], axis[-1]):
        for rest in equilibria(model.with_parameters({parameter: float(value)})):
            if not any(_has(branch, rest, float(value)) for branch in branches):
                branches.append(continuation(rest, parameter, bounds, max_points=max_points))
    cycles: list[Branch] = []
    for orbit, value in _seeds(model, parameter, scan):
        if not any(_has(branch, orbit, value) for branch in cycles):
            cycles.append(continuation(orbit, parameter, **limits))
    grown = descendants([*branches, *cycles], generations, **limits)
    rests = [branch for branch in grown if branch.kind == "equilibrium"]
    return Diagram(model, parameter, scan, (*rests, *(branch for branch in grown if branch.kind == "cycle")))


def descendants(
    branches: Sequence[Branch],
    generations: int,
    *,
    begun: Callable[[BifurcationPoint], None] = lambda point: None,
    missed: Callable[[BifurcationPoint, ModelError], None] = lambda point, error: None,
    **options: Any,
) -> list[Branch]:
    """These branches, and those born at their points and at the points of those; of mirror images one.

    `begun` is called with each point whose branch is followed next, `missed` with each point whose branch is
    not found; the others are followed nevertheless.
    `options` are those of :func:`udd.continuation`.
    """
    family = list(branches)
    waiting = [(point, 1) for branch in family for point in branch.points]
    while waiting:
        point, generation = waiting.pop(0)
        if point.kind not in BIRTHS or generation > generations:
            continue
        begun(point)
        try:
            born = continuation(point, **options)
        except ModelError as error:
            missed(point, error)
            continue
        middle, value = born.solution(len(born) // 2), float(born.values[len(born) // 2])
        if not any(_has(branch, middle, value) for branch in family):
            family.append(born)
            waiting += [(p, generation + 1) for p in born.points]
    return family


def _seeds(model: Model, parameter: str, scan: xr.Dataset) -> list[tuple[PeriodicOrbit, float]]:
    """Return a cycle of each periodic attractor, from the middle of its stretch."""
    kinds = np.stack([scan[name].to_numpy() for name in ("attractor", "period", "symmetric")], axis=-1)
    periodic = (kinds[..., 0] > 0) & (kinds[..., 1] > 0)
    seeds = []
    # An attractor keeps its label where it doubles or loses its symmetry.
    for kind in np.unique(kinds[periodic], axis=0):
        places = np.argwhere(periodic & (kinds == kind).all(axis=-1))
        path, start, v = places[len(places) // 2]
        value = float(scan[parameter].to_numpy()[v])
        state = [float(scan[name].to_numpy()[path, start, v, 0]) for name in model.state_names]
        time = float(scan["period_time"].to_numpy()[path, start, v])
        if not np.isfinite([*state, time]).all() or time <= 0.0:
            continue
        try:
            orbit = periodic_orbit(model.with_parameters({parameter: value}), state, period=time)
        except ModelError:
            continue  # what settles too slowly to be a good guess
        seeds.append((orbit, value))
    return seeds


def _same_point(a: BifurcationPoint, b: BifurcationPoint) -> bool:
    """Return True if two points are the same, or mirror images of each other."""
    near = abs(a.value - b.value) <= np.nan_to_num(a.error) + np.nan_to_num(b.error) + rounding_of(a.value)
    return a.kind == b.kind and bool(near) and _same(a.solution, b.solution)


def _has(branch: Branch, solution: Equilibrium | PeriodicOrbit, value: float) -> bool:
    """Return True if a branch has this equilibrium or cycle, or its mirror image."""
    kind = "equilibrium" if isinstance(solution, Equilibrium) else "cycle"
    return branch.kind == kind and any(_same(own, solution) for own in branch.at(value))


def _same(a: Equilibrium | PeriodicOrbit, b: Equilibrium | PeriodicOrbit) -> bool:
    if isinstance(a, Equilibrium) and isinstance(b, Equilibrium):
        return _alike(a.eigenvalues, b.eigenvalues)
    if isinstance(a, PeriodicOrbit) and isinstance(b, PeriodicOrbit):
        near = a.symmetric == b.symmetric and abs(a.period - b.period) < _ALIKE * b.period
        return near and _alike(a.multipliers[:1], b.multipliers[:1])
    return False


def _alike(a: Any, b: Any) -> bool:
    a, b = np.sort_complex(np.asarray(a)), np.sort_complex(np.asarray(b))
    return bool(np.abs(np.abs(a) - np.abs(b)).max() < _ALIKE * max(1.0, float(np.abs(a).max())))
