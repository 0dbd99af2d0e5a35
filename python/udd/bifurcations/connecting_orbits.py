"""Homoclinic and heteroclinic orbits of equilibria, by shooting."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field

import numpy as np
from scipy import linalg

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd.errors import IntegrationError, ModelError

from .branch import Branch
from .equilibrium_curve import expansion
from .equilibrium_search import equilibrium_at, refined
from .error_bounds import COARSE, rounding_of
from .flow_map import Floats, FlowMap
from .saddle_node_cycles import saddle_node_on
from .shooting_curve import HELD, PeriodicOrbitCurve
from .solutions import Equilibrium

__all__ = ["Connection", "Problem", "connection", "found_by"]

_LONGER = 2.0  # typical times that are added at both ends
_SOLVED = 1e-11  # a Newton step below this, in scaled unknowns, is the last
_NOISE = 1e-8  # where rounding keeps the steps from getting smaller, this will do
_TRIED = 8  # slowest nodes near which an equilibrium is looked for
_AHEAD = 1e-6  # of the parameter, for differences of the conditions at the ends


@dataclass(frozen=True, eq=False)
class Connection(Drawable):
    """An orbit that takes for ever to leave an equilibrium and for ever to arrive.

    Attributes
    ----------
    kind : {"homoclinic", "heteroclinic", "SNIC"}
        Whether it comes back to the same equilibrium, or arrives at its mirror image; "SNIC" if it comes back
        to a fold of equilibria, a saddle-node on an invariant circle: then `state` is the longest cycle.
    parameter : str
    value : float
        The parameter's value: at others there is no such orbit.
    error : float
        A bound of the value's error: how far it moved when the orbit was prolonged at both ends for the last
        time, and how far it moves when runs are a hundred times less accurate.
    equilibrium : Equilibrium
    t : ndarray, shape (n,)
    state : ndarray, shape (n, dim)
        The orbit, forward in time.
    nearest : float
        How near to the equilibrium its ends are, in typical sizes.
    """

    kind: str
    parameter: str
    value: float
    error: float
    equilibrium: Equilibrium
    t: Floats
    state: Floats
    nearest: float
    _problem: Problem | None = field(default=None, repr=False)

    @property
    def single(self) -> float:
        """The real eigenvalue that is alone on its side of the imaginary axis."""
        values = self.equilibrium.eigenvalues
        growing = values.real > 0
        alone = growing if growing.sum() == 1 else ~growing
        return float(values[alone][0].real)

    @property
    def leading(self) -> complex:
        """Of the other eigenvalues the one nearest to the axis, of positive imaginary part."""
        values = self.equilibrium.eigenvalues
        others = values[np.sign(values.real) != np.sign(self.single)]
        near = others[np.argsort(np.abs(others.real), kind="stable")]
        if not len(near):
            return complex("nan")
        return complex(near[0].real, abs(near[0].imag))

    @property
    def wild(self) -> bool:
        """Shil'nikov's condition for infinitely many cycles near by: a pair slower than the single one."""
        return abs(self.leading.imag) > 0 and abs(self.leading.real) < abs(self.single)

    @property
    def fold_ratio(self) -> float:
        """By what the distance of a branch's folds from the value shrinks from fold to fold; NaN of saddles.

        They lie on both sides in turn: ``exp(-pi rho/omega)`` for the pair ``rho +- i omega``. This is
        Shil'nikov's limit for many folds; there is no bound of how far any one fold is off.
        """
        pair = self.leading
        return float(np.exp(-np.pi * abs(pair.real) / pair.imag)) if pair.imag else float("nan")

    @property
    def fold_spacing(self) -> float:
        """By what the period grows from fold to fold in that limit: ``pi/omega``; NaN of saddles."""
        return float(np.pi / self.leading.imag) if self.leading.imag else float("nan")

    def __repr__(self) -> str:
        eigenvalues = ", ".join(f"{value:.5g}" for value in self.equilibrium.eigenvalues)
        return (
            f"<{self.kind} connection at {self.parameter} = {self.value:.13g} "
            f"(error below {self.error:.1g}), eigenvalues {eigenvalues}>"
        )


@checked_arguments
def connection(branch: Branch) -> Connection:
    """The homoclinic or heteroclinic orbit to which a branch of cycles tends.

    Parameters
    ----------
    branch : Branch
        Of cycles, of :func:`udd.continuation`, whose period has grown long.

    Returns
    -------
    Connection

    Raises
    ------
    ModelError
        A branch that tends to no connection.

    Notes
    -----
    The equilibrium is the one to which the branch's longest cycle comes nearest. That cycle, cut there, is
    the first guess of an orbit that begins in the plane of the growing eigenvectors and ends in that of the
    decaying ones (W.-J. Beyn, IMA Journal of Numerical Analysis 10 (1990) 379): multiple shooting finds it
    together with the parameter. It is then prolonged at both ends until the value stands.

    Examples
    --------
    The cycles born where rotation becomes stable end on an orbit that leaves the saddle at ``z = 1/B`` and
    comes back to it:

    >>> import udd
    >>> rest = udd.equilibria(udd.DLE(2.5, B=0.2))[0]
    >>> hopf = udd.continuation(rest, "w", (1.0, 9.0)).points[0]
    >>> found = udd.connection(udd.continuation(hopf, max_period=16.0))
    >>> print(found.kind, round(found.value, 8), found.wild)
    homoclinic 4.25994905 False
    """
    if not isinstance(branch, Branch) or branch.kind != "cycle":
        raise ModelError("a branch of cycles is needed, of udd.continuation")
    curve, place = branch._places[int(np.argmax(branch.periods))]
    assert isinstance(curve, PeriodicOrbitCurve)
    if curve.flow.forcing is not None:
        raise ModelError("a forced model has no equilibria that an orbit could connect")
    if curve.parameter == HELD:
        raise ModelError(
            f"a connection is looked for over a parameter of the model, not over {branch.parameter}"
        )
    fold = saddle_node_on(branch)
    if fold is not None and isinstance(fold.solution, Equilibrium):
        nodes, rest = curve.flow.full(curve.nodes(place.u)), fold.solution
        t: Floats = np.linspace(0.0, curve.span(place.u), curve.pieces, endpoint=False)
        away = np.linalg.norm(curve.flow.reduced(nodes - rest.state) / curve.flow.size, axis=1)
        return Connection("SNIC", branch.parameter, fold.value, fold.error, rest, t, nodes, float(away.min()))
    return found_by(Problem.of(curve, place.u), branch.parameter)


def found_by(problem: Problem, parameter: str) -> Connection:
    """The connection near a guess.

    Raises
    ------
    ModelError
        None is found.
    """
    try:
        value, error = problem.solve(), float("nan")
        for _ in range(8):
            before = value
            problem.prolong()
            value = problem.solve()
            error = abs(value - before)
            if error < 1e-13 * abs(value):
                break
        coarse = copy.copy(problem)
        coarse.loose = COARSE
        error += abs(coarse.solve() - value) + float(rounding_of(value))
    except (np.linalg.LinAlgError, IntegrationError) as failure:
        raise ModelError(f"no connection is found: {failure}") from None
    rest = equilibrium_at(problem.flow, problem.values_at(value), problem.rest(value))
    t = np.linspace(0.0, problem.span, len(problem.nodes))
    kind = "heteroclinic" if (problem.mirror < 0).any() else "homoclinic"
    state = problem.flow.full(problem.nodes)
    return Connection(kind, parameter, value, error, rest, t, state, problem.nearest(), problem)


@dataclass(eq=False)
class Problem:
    """An orbit from an equilibrium to itself or to its mirror image, and the parameter."""

    flow: FlowMap
    values: Floats
    parameter: int
    guess: Floats
    mirror: Floats
    nodes: Floats
    span: float
    value: float
    loose: float = 1.0
    _planes: tuple[Floats, Floats] = field(init=False)
    _rests: dict[float, Floats] = field(default_factory=dict, init=False)

    @classmethod
    def of(cls, curve: PeriodicOrbitCurve, u: Floats) -> Problem:
        """From a long cycle, cut where it is nearest to an equilibrium."""
        flow, values, nodes, m = curve.flow, curve.values_at(u), curve.nodes(u), curve.pieces
        model = flow.with_values(values)
        speed = np.linalg.norm(
            model.rates(0.0, flow.full(nodes))[:, flow.kept] * flow.clock / flow.size, axis=1
        )
        rests = [refined(flow, values, nodes[i]) for i in np.argsort(speed)[:_TRIED]]
        apart = [
            (float(away.min()), int(away.argmin()), rest)
            for rest in rests
            if rest is not None
            for away in [np.linalg.norm((nodes - rest) / flow.size, axis=1)]
        ]
        if not apart:
            raise ModelError("the branch's longest cycle comes near no equilibrium: follow it further")
        _, slowest, rest = min(apart, key=lambda one: one[0])
        # One round, from the cut to its image; beyond the end of the curve's own round in the mirror.
        order = np.arange(slowest, slowest + m + 1)
        cut = nodes[order % m] * np.where((order >= m)[:, None], curve.mirror, 1.0)
        two = not np.allclose(curve.mirror * rest, rest, atol=1e-9)
        mirror = curve.mirror if two else np.ones(flow.dim)
        return cls(flow, values, curve.parameter, rest, mirror, cut, curve.span(u), curve.value(u))

    def values_at(self, value: float) -> Floats:
        """All parameters."""
        values = self.values.copy()
        values[self.parameter] = value
        return values

    def rest(self, value: float) -> Floats:
        """The equilibrium; searched for once at each value."""
        if value not in self._rests:
            found = refined(self.flow, self.values_at(value), self.guess)
            if found is None:
                raise ModelError(f"the equilibrium is lost at {value:.10g}")
            self._rests[value] = found
        return self._rests[value]

    def matrix(self, value: float) -> Floats:
        """The rates' scaled derivative at the equilibrium."""
        return self.flow.scaled(expansion(self.flow, self.values_at(value), self.rest(value)).by_state)

    def projectors(self, value: float) -> tuple[Floats, Floats]:
        """On the plane of the decaying eigenvectors along that of the growing ones, and the reverse."""
        numbers, right = np.linalg.eig(self.matrix(value))
        decaying = (right * (numbers.real < 0)) @ np.linalg.inv(right)
        return decaying.real, np.eye(len(numbers)) - decaying.real

    def ends(self, value: float) -> tuple[Floats, Floats]:
        """Rows that vanish on an orbit: at its first state less the equilibrium, and at its last."""
        decaying, growing = self.projectors(value)
        return self._planes[0] @ decaying, self._planes[1] @ growing

    def missed(self, value: float, first: Floats, last: Floats) -> Floats:
        """What the ends, scaled, have of the wrong directions."""
        size, rest = self.flow.size, self.rest(value)
        begin, end = self.ends(value)
        away = self.mirror * last - rest / size
        return np.concatenate([begin @ (first - rest / size), end @ away])

    def solve(self) -> float:
        """The parameter, with the nodes, by Newton's method."""
        flow, size, r = self.flow, self.flow.size, self.flow.dim
        decaying, growing = self.projectors(self.value)
        # Fixed rows: projectors times these change smoothly with the parameter.
        self._planes = tuple(  # type: ignore[assignment]
            np.linalg.svd(p.T)[0][:, : round(float(np.trace(p)))].T for p in (decaying, growing)
        )
        m, middle = len(self.nodes) - 1, len(self.nodes) // 2
        scale = abs(self.value) or 1.0
        spans = np.full(m, self.span / m)
        model = flow.with_values(self.values_at(self.value))
        rate = model.rates(0.0, flow.full(self.nodes[middle]))[flow.kept] / size
        across, reference = rate / np.linalg.norm(rate), self.nodes[middle] / size
        before = np.inf
        for _ in range(40):
            x = self.nodes / size
            values = self.values_at(self.value)
            found = flow.fly(values, self.nodes[:-1], spans, (self.parameter,), self.loose)
            n = (m + 1) * r
            matrix, right = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
            for i in range(m):
                rows = slice(i * r, i * r + r)
                matrix[rows, rows] = flow.scaled(found.by_state[i])
                matrix[rows, (i + 1) * r : (i + 2) * r] = -np.eye(r)
                matrix[rows, n] = found.by_parameter[i, :, 0] / size * scale
                right[rows] = x[i + 1] - found.x[i] / size
            begin, end = self.ends(self.value)
            rows = slice(m * r, m * r + len(begin))
            matrix[rows, :r] = begin
            matrix[m * r + len(begin) : n, m * r : n] = end * self.mirror
            h = _AHEAD * scale
            later, earlier = (self.missed(self.value + d, x[0], x[-1]) for d in (h, -h))
            matrix[m * r : n, n] = (later - earlier) / (2 * _AHEAD)
            right[m * r : n] = -self.missed(self.value, x[0], x[-1])
            matrix[n, middle * r : middle * r + r] = across
            right[n] = across @ (reference - x[middle])
            step = np.linalg.solve(matrix, right)
            largest = float(np.abs(step).max())
            # Far from the orbit only part of the way.
            step *= min(1.0, 0.3 / largest) if largest > 0 else 1.0
            self.nodes = self.nodes + step[:-1].reshape(m + 1, r) * size
            self.value += float(step[-1]) * scale
            if largest < _SOLVED or (largest < _NOISE and largest > 0.1 * before):
                return self.value
            before = largest
            if not np.isfinite(largest):
                break
        raise ModelError("no connection is found: Newton's method does not converge")

    def prolong(self) -> None:
        """Add what the linear flow near the equilibrium adds to the orbit at its ends."""
        size, rest, m = self.flow.size, self.rest(self.value), len(self.nodes) - 1
        share = self.span / m
        more = max(1, int(np.ceil(_LONGER * self.flow.clock / share)))
        matrix = self.matrix(self.value)
        decaying, growing = self.projectors(self.value)
        first = growing @ ((self.nodes[0] - rest) / size)
        last = decaying @ ((self.mirror * self.nodes[-1] - rest) / size)
        before = [rest + size * (linalg.expm(-k * share * matrix) @ first) for k in range(more, 0, -1)]
        after = [
            self.mirror * (rest + size * (linalg.expm(k * share * matrix) @ last)) for k in range(1, more + 1)
        ]
        self.nodes = np.vstack([before, self.nodes, after])
        self.span = share * (len(self.nodes) - 1)

    def nearest(self) -> float:
        """How near to the equilibrium the ends are, the further one."""
        rest = self.rest(self.value)
        gaps = (self.nodes[0] - rest, self.mirror * self.nodes[-1] - rest)
        return max(float(np.linalg.norm(gap / self.flow.size)) for gap in gaps)
