"""All connections of an interval of a parameter: where a manifold of one dimension passes an equilibrium."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.keywords import renamed
from udd._util.memory import require_memory
from udd._util.validation import number, whole
from udd.errors import IntegrationError, ModelError
from udd.models import Model, beyond_the_edge
from udd.simulation.trajectory import simulate

from .boundary_value import ConnectingCurve
from .branch_continuation import bounds_of
from .connecting_orbits import Connection, found_by
from .equilibrium_search import equilibria
from .flow_map import Floats, FlowMap, flow_of
from .invariant_manifolds import FINE, NARROW, ManifoldCurve, ManifoldFamily
from .manifold_search import brackets
from .solutions import FoundList

__all__ = ["Connections", "connections"]

_ASIDE = 1e-3  # Distance from equilibria, in typical sizes, at which runs begin that show the extent.
_SHOWN = 20.0  # Typical times that show the extent of the motion.
_BEND = 3.0  # Typical sizes beyond which distances count less and less.
_ALIKE = 0.6  # Distance up to which curves are alike.
_NEAR = 1.0  # Largest distance of a passage.
_CLOSE = 3e-2  # Distance of a passage from which Newton's method starts.
_TRIED = 1e-6  # Width of an interval from which it starts as well: slow spirals come nearer slowly.
_BESIDE = 1e3  # Widths of an interval within which two connections of one time are the same.
_SOONER = 0.5  # Typical times by which these times differ at most.
_PARTS = 4  # Parts into which an interval is cut.
_MOST = 60_000  # Largest number of marks that are compared.
_SAME = 1e-11  # Relative distance of two results for one connection.


@dataclass(frozen=True)
class _Part:
    """The passage at which two curves part: its begin, and its least distance from an equilibrium.

    `image` is True for the mirror image; `distance` is infinite if no equilibrium parts them.
    """

    came: int
    nearest: int
    image: bool
    distance: float


_Pair = tuple[ManifoldCurve, ManifoldCurve]
_Located = tuple[int, Connection]  # when it came near the equilibrium at its end


class Connections(FoundList[Connection]):
    """Connections in the order of their values.

    See Also
    --------
    udd.connections : makes them.
    udd.plot.cycle : draw a connection.
    """


@renamed(longest="t_max")
@checked_arguments
def connections(
    model: Model,
    parameter: str,
    bounds: Sequence[float],
    *,
    n: int = 300,
    t_max: float | None = None,
) -> Connections:
    """Find the homoclinic and heteroclinic orbits of an interval of a parameter.

    Parameters
    ----------
    model : Model
        Its other parameters stay.
    parameter : str
    bounds : (float, float)
        The bounds of the parameter, both finite.
    n : int
        At so many values, equally far apart, the manifolds are compared at first.
    t_max : float, optional
        Connections are looked for that come near the equilibrium at their end within this time after they
        have left the one at their beginning, by default 20 typical times.

    Returns
    -------
    Connections
        A list of :class:`Connection` in the order of their values; its ``search`` says what was searched.

    Raises
    ------
    ModelError
        A parameter or option that cannot be used, or no equilibrium with one direction on its own.

    See Also
    --------
    udd.connection : the connection at the end of a branch.
    udd.plot.cycle : draw an orbit.

    Notes
    -----
    If one eigenvalue of an equilibrium is alone on its side of the imaginary axis, the manifold along it is a
    pair of curves. These are followed forward or backward in time. An interval at whose ends they take
    different courses is cut again and again. If they pass the equilibrium, or its mirror image, on two sides,
    there is a connection between them, and Newton's method finds it as :func:`udd.connection` does. About a
    connection with a slow spiral there are infinitely many others, which take longer. Missed are those
    between neighbouring values at which the curves take one course, and a few that lie nearer to each other
    than 1e-7.

    References
    ----------
    W.-J. Beyn [34].

    Examples
    --------
    >>> import udd
    >>> connections = udd.connections(udd.DLE(4.0, B=0.2), "w", (4.0, 4.5), n=20, t_max=10.0)
    >>> [(one.kind, round(one.value, 8)) for one in connections]
    [('homoclinic', 4.25994905)]
    """
    low, high = bounds_of(bounds)
    if not np.isfinite([low, high]).all():
        raise ModelError(f"the bounds must be finite, not {low:g} and {high:g}")
    n = whole("n", n, 2)
    require_memory(f"{n} values of a parameter", n, itemsize=1000)  # a model and its course for each
    grid = np.linspace(low, high, n)
    start = beyond_the_edge(model).with_parameters({parameter: float(np.median(grid))})
    there = equilibria(start)
    flow = flow_of(start, _extent(start, [rest.state for rest in there]))
    index = flow.index(parameter)
    span = number("t_max", 20.0 * flow.clock if t_max is None else t_max, above=0.0)
    rests = [flow.reduced(rest.state) for rest in there]
    located: list[Connection] = []
    followed, whole_search = 0, True
    for k, rest in enumerate(rests):
        mirror = flow.mirror
        if mirror is not None and any(np.allclose(mirror * rest, other, atol=1e-9) for other in rests[:k]):
            continue  # the mirror image of one that was followed
        for sign in (1.0, -1.0):
            own = mirror is not None and np.allclose(mirror * rest, rest, atol=1e-9)
            if sign < 0.0 and own:
                continue  # so are the two sides of this one
            manifold = _Scan(ManifoldFamily(flow, index, sign, span), grid, rest)
            followed += manifold.exists
            its, ended = manifold.connections(parameter)
            located += [one for one in its if not any(_same(one, other) for other in located)]
            whole_search &= ended
    if not followed:
        raise ModelError("no equilibrium there has one eigenvalue alone on its side of the imaginary axis")
    located.sort(key=lambda one: one.value)
    search = (
        f"{followed} manifolds compared at {len(grid)} values of {parameter} from {low:g} to {high:g}, "
        f"each followed for {span:.4g}: longer ones may exist"
    )
    if not whole_search:
        search += ", and others in intervals that were not narrowed to the end"
    return Connections(located, search)


def _extent(model: Model, rests: list[Floats]) -> Floats:
    """States that show how large the motion is: of runs that leave the equilibria."""
    clock = flow_of(model, np.ones((1, len(model.state_names)))).clock
    times = np.linspace(0.0, _SHOWN * clock, 10 * FINE)
    seen = [np.ones(len(model.state_names)) if not rests else rests[0]]
    for rest in rests:
        # A run that blows up may last for half of the time, or for a quarter, ...
        for part in 0.5 ** np.arange(8):
            try:
                aside = rest + _ASIDE * (1.0 + np.abs(rest))
                seen += [*simulate(model, part * times, aside, method="auto").state]
                break
            except IntegrationError:
                continue
    states = np.array(seen)
    return states[np.isfinite(states).all(axis=1)]


class _Scan:
    """A family of manifolds at the values of a grid, and the equilibria there."""

    def __init__(self, family: ManifoldFamily, grid: Floats, rest: Floats) -> None:
        self.family, self.flow, self.grid = family, family.flow, grid
        self.rests: list[Floats | None] = [None] * len(grid)
        middle = len(grid) // 2
        for way in (range(middle, len(grid)), range(middle - 1, -1, -1)):
            guess: Floats | None = rest
            for i in way:
                guess = None if guess is None else family.rest_near(grid[i], guess)
                self.rests[i] = guess
        here = self.rests[middle]
        self.exists = here is not None and family.alone(grid[middle], here) is not None

    def connections(self, parameter: str) -> tuple[list[Connection], bool]:
        """Return those at which the curve changes its course, and True if the search is complete."""
        located: list[_Located] = []
        if not self.exists:
            return [], True
        # If the equilibrium is lost between two values, nothing is compared.
        there = [k for k, rest in enumerate(self.rests) if rest is not None]
        marks: list[ManifoldCurve | None] = [None] * len(self.grid)
        curves = self.family.curves(self.grid[there], [rest for rest in self.rests if rest is not None])
        for k, curve in zip(there, curves, strict=True):
            marks[k] = curve
        compared = 0
        while marks and compared < _MOST:
            pairs = brackets(marks, _both_leave, partial(self._tried, parameter, located))
            marks = self._cut(pairs)
            compared += len(marks)
        return [connection for _, connection in located], not marks

    def _cut(self, pairs: list[_Pair]) -> list[ManifoldCurve | None]:
        """Return the marks of wide intervals that are cut, with None after each."""
        pairs = [(a, b) for a, b in pairs if b.value - a.value > NARROW * max(abs(a.value), abs(b.value))]
        values = np.array([np.linspace(a.value, b.value, _PARTS + 1)[1:-1] for a, b in pairs]).ravel()
        guesses = [a.rest for a, _ in pairs for _ in range(_PARTS - 1)]
        rests = [self.family.rest_near(v, guess) for v, guess in zip(values.tolist(), guesses, strict=True)]
        curves = iter(
            self.family.curves(values, [x if y is None else y for x, y in zip(guesses, rests, strict=True)])
        )
        return [m for a, b in pairs for m in (a, *islice(curves, _PARTS - 1), b, None)]

    def _part(self, a: ManifoldCurve, b: ManifoldCurve) -> _Part | None:
        """Return the passage at which two curves part; None if they stay alike."""
        flow = self.flow
        many = min(len(a.path), len(b.path))
        one, other = (_bent(c.path[:many] - c.rest, flow) for c in (a, b))
        apart = np.flatnonzero(np.linalg.norm(one - other, axis=1) > _ALIKE)
        left = max(a.left_at, b.left_at)
        if not len(apart) or not left < apart[0]:
            return None
        first, last = int(left) + 1, int(apart[0])
        latest = left + FINE * self.family.longest / flow.clock
        best = None
        for image, mirror in enumerate(flow.images):
            if image and np.allclose(mirror * a.rest, a.rest, atol=1e-9):
                continue
            away = [(c.path[first : last + 1] - mirror * c.rest) / flow.size for c in (a, b)]
            side = [far @ (mirror * c.left) for far, c in zip(away, (a, b), strict=True)]
            distance = np.maximum(*(np.linalg.norm(far, axis=1) for far in away))
            beside = np.where(side[0] * side[1] < 0.0, distance, np.inf)
            k = int(np.argmin(beside))
            if beside[k] < (_NEAR if best is None else best.distance):
                # It came when it was last further away.
                far = np.flatnonzero(distance[: k + 1] > _NEAR)
                came = first + (int(far[-1]) if len(far) else 0)
                best = _Part(came, first + k, bool(image), float(beside[k]))
        part = best or _Part(last, last, False, np.inf)
        return part if part.came <= latest else None

    def _tried(
        self, parameter: str, located: list[_Located], a: ManifoldCurve, b: ManifoldCurve
    ) -> tuple[ManifoldCurve, ManifoldCurve]:
        """Return curves that part; add the connection between them. ModelError: they take one course."""
        part, width = self._part(a, b), b.value - a.value
        if part is None:
            raise ModelError("the curves do not part")
        narrow = width < _TRIED * max(abs(a.value), abs(b.value))
        tried = part.distance < _CLOSE or (narrow and np.isfinite(part.distance))
        kind, beside = "heteroclinic" if part.image else "homoclinic", _BESIDE * width
        if tried and not any(
            connection.kind == kind
            and abs(came - part.came) < _SOONER * FINE
            and a.value - beside <= connection.value <= b.value + beside
            for came, connection in located
        ):
            with suppress(ModelError, IntegrationError):
                new = self._solved(a, part.nearest, part.image, parameter)
                inside = self.grid[0] <= new.value <= self.grid[-1]
                again = any(_same(new, other) for _, other in located)
                if inside and not again and abs(new.value - a.value) <= 2.0 * beside:
                    located.append((part.came, new))
        return a, b

    def _solved(self, curve: ManifoldCurve, last: int, image: bool, parameter: str) -> Connection:
        flow, step = self.flow, self.flow.clock / FINE
        pieces = flow.pieces_for(last * step)
        every = max(1, last // pieces)
        where = np.arange(last % every, last + 1, every)
        nodes, span = curve.path[where], float((len(where) - 1) * every * step)
        mirror = flow.images[int(image)]
        rest, way = curve.rest, self.family.alone(curve.value, curve.rest)
        if way is not None and way.number < 0.0:
            # Followed backward: the orbit comes from the target.
            nodes, rest = nodes[::-1].copy(), mirror * rest
        values = self.family.values_at(curve.value)
        guess = ConnectingCurve.through(flow, values, self.family.index, rest, mirror, nodes, span)
        return found_by(*guess, parameter)


def _both_leave(a: ManifoldCurve, b: ManifoldCurve) -> bool:
    """Return True if two curves have left their equilibria."""
    return max(a.left_at, b.left_at) < np.inf


def _same(one: Connection, other: Connection) -> bool:
    return one.kind == other.kind and abs(one.value - other.value) < _SAME * abs(one.value)


def _bent(away: Floats, flow: FlowMap) -> Floats:
    """Scaled distances from the equilibrium; beyond what is typical only the direction counts."""
    scaled = np.nan_to_num(away / flow.size, posinf=1e9, neginf=-1e9)
    return np.asarray(scaled / np.sqrt(1.0 + (scaled**2).sum(axis=1, keepdims=True) / _BEND**2))
