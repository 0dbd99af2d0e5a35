"""Homoclinic and heteroclinic orbits of equilibria, by shooting."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy import optimize

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd.errors import IntegrationError, ModelError

from .bifurcation_location import nearest_bifurcation
from .boundary_value import ConnectingCurve
from .branch import BifurcationPoint, Branch, cycles_of
from .equilibrium_curve import equilibrium_at
from .equilibrium_search import refined
from .error_bounds import COARSE, rounding_of
from .flow_map import Floats
from .manifold_search import until_it_stands
from .pseudo_arclength import CorrectorFailed
from .shooting_curve import PeriodicOrbitCurve
from .solutions import Equilibrium

__all__ = ["Connection", "connection", "found_by"]

_TRIED = 8  # Number of slowest nodes near which an equilibrium is looked for.
_PROLONGED = 8  # Largest number of prolongations.
_BESIDE = 1e-2  # Distance from the fold, along the branch of equilibria, where its location starts.
_NEAR = 0.5  # Largest distance of the fold from the slowest node of the cycle, in typical sizes.
_GROWN = 1.2  # Growth of the period over the places that are compared.
_AGREES = 1.3  # Largest factor by which the square of the period times the distance changes.


@dataclass(frozen=True, eq=False)
class Connection(Drawable):
    """Orbit that leaves an equilibrium and arrives at an equilibrium, both in infinite time.

    Attributes
    ----------
    kind : {"homoclinic", "heteroclinic", "SNIC"}
        "homoclinic" if it comes back to the same equilibrium, "heteroclinic" if it arrives at another one,
        "SNIC" if it comes back to a fold of equilibria (a saddle-node on an invariant circle). With a SNIC,
        `state` is the longest cycle.
    parameter : str
    value : float
        The parameter's value: at others there is no such orbit.
    error : float
        A bound of the value's error: its change with the last prolongation of the orbit at both ends, and
        with runs a hundred times less accurate.
    equilibrium : Equilibrium
        The one that the orbit leaves.
    t : ndarray, shape (n,)
    state : ndarray, shape (n, dim)
        The orbit, forward in time.
    nearest : float
        How near to the equilibrium its ends are, in typical sizes.

    See Also
    --------
    udd.connection : finds it from a branch of cycles.
    udd.connections : finds all of an interval.
    udd.plot.cycle : draw it.
    """

    kind: str
    parameter: str
    value: float
    error: float
    equilibrium: Equilibrium
    t: Floats
    state: Floats
    nearest: float
    _orbit: tuple[ConnectingCurve, Floats] | None = field(default=None, repr=False)

    @property
    def single(self) -> float:
        """The real eigenvalue that is alone on its side of the imaginary axis."""
        values = self.equilibrium.eigenvalues
        growing = values.real > 0
        alone = growing if growing.sum() == 1 else ~growing
        return float(values[alone][0].real)

    @property
    def leading(self) -> complex:
        """The eigenvalue nearest to the axis among the others, with positive imaginary part."""
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
        """Ratio of successive distances of a branch's folds from the value; NaN of saddles.

        They lie on both sides in turn: ``exp(-pi rho/omega)`` for the pair ``rho +- i omega``. This is
        Shil'nikov's limit for many folds; there is no bound of how far any one fold is off.
        """
        pair = self.leading
        return float(np.exp(-np.pi * abs(pair.real) / pair.imag)) if pair.imag else float("nan")

    @property
    def fold_spacing(self) -> float:
        """Limit of the difference of periods of successive folds, ``pi/omega``; NaN of saddles."""
        return float(np.pi / self.leading.imag) if self.leading.imag else float("nan")

    def __repr__(self) -> str:
        eigenvalues = ", ".join(f"{value:.5g}" for value in self.equilibrium.eigenvalues)
        return (
            f"<{self.kind} connection at {self.parameter} = {self.value:.13g} "
            f"(error below {self.error:.1g}), eigenvalues {eigenvalues}>"
        )


@checked_arguments
def connection(branch: Branch) -> Connection:
    """Find the homoclinic or heteroclinic orbit to which a branch of cycles tends.

    Parameters
    ----------
    branch : Branch
        A branch of cycles of :func:`udd.continuation` whose period has grown long.

    Returns
    -------
    Connection

    Raises
    ------
    ModelError
        A branch that tends to no connection.

    See Also
    --------
    udd.connections : all connections of an interval.
    udd.plot.cycle : draw the orbit.

    Notes
    -----
    The equilibrium is the one to which the branch's longest cycle comes nearest. That cycle, cut there, is
    the first guess of an orbit that begins in the plane of the growing eigenvectors and ends in that of the
    decaying ones (W.-J. Beyn, IMA Journal of Numerical Analysis 10 (1990) 379). Multiple shooting solves for
    the orbit, the equilibrium and the parameter. The orbit is then prolonged at both ends until the value
    stands.

    References
    ----------
    W.-J. Beyn [34].

    Examples
    --------
    The cycles born where rotation becomes stable end on an orbit that leaves the saddle at ``z = 1/B`` and
    comes back to it:

    >>> import udd
    >>> rest = udd.equilibria(udd.DLE(2.5, B=0.2))[0]
    >>> hopf = udd.continuation(rest, "w", (1.0, 9.0)).points[0]
    >>> orbit = udd.connection(udd.continuation(hopf, max_period=16.0))
    >>> print(orbit.kind, round(orbit.value, 8), orbit.wild)
    homoclinic 4.25994905 False
    """
    curve, u = cycles_of(branch)[int(np.argmax(branch.periods))]
    fold = saddle_node_on(branch, curve, u)
    if fold is not None and isinstance(fold.solution, Equilibrium):
        nodes, rest = curve.flow.full(curve.nodes(u)), fold.solution
        t: Floats = np.linspace(0.0, curve.span(u), curve.pieces, endpoint=False)
        away = np.linalg.norm(curve.flow.reduced(nodes - rest.state) / curve.flow.size, axis=1)
        return Connection("SNIC", branch.parameter, fold.value, fold.error, rest, t, nodes, float(away.min()))
    return found_by(*through_cycle(curve, u), branch.parameter)


def found_by(curve: ConnectingCurve, guess: Floats, parameter: str) -> Connection:
    """Return the connection near a guess, with the bound of its value. ModelError: no such orbit is near."""
    try:
        (curve, u), error, _ = until_it_stands(
            curve.solved(guess),
            lambda orbit, _, __: prolonged_and_solved(*orbit),
            lambda orbit: float(orbit[0].parameters(orbit[1])[0]),
            np.nan,
            _PROLONGED,
        )
        value = float(curve.parameters(u)[0])
        coarse, moved = replace(curve, loose=COARSE).solved(u)
        error += abs(coarse.parameters(moved)[0] - value) + float(rounding_of(value))
    except (CorrectorFailed, np.linalg.LinAlgError, IntegrationError) as failure:
        raise ModelError(f"no connection is found: {failure}") from None
    rest = equilibrium_at(curve.flow, curve.values_at(u), curve.rests(u)[0])
    nodes = curve.nodes(u)
    t = np.linspace(0.0, curve.span, len(nodes))
    kind = "heteroclinic" if curve.ends > 1 or (curve.mirror < 0).any() else "homoclinic"
    return Connection(
        kind, parameter, value, float(error), rest, t, curve.flow.full(nodes), curve.nearest(u), (curve, u)
    )


def prolonged_and_solved(curve: ConnectingCurve, u: Floats) -> tuple[ConnectingCurve, Floats]:
    """Return the connection as a longer orbit."""
    longer, guess = curve.prolonged(u)
    return longer.solved(guess)


def through_cycle(curve: PeriodicOrbitCurve, u: Floats) -> tuple[ConnectingCurve, Floats]:
    """Return the curve and the unknowns of a long cycle, cut where it is nearest to an equilibrium."""
    flow, values, nodes, m = curve.flow, curve.values_at(u), curve.nodes(u), curve.pieces
    rests = [refined(flow, values, nodes[i]) for i in np.argsort(curve.speeds(u))[:_TRIED]]
    passages = [
        (float(away.min()), int(away.argmin()), rest)
        for rest in rests
        if rest is not None
        for away in [np.linalg.norm((nodes - rest) / flow.size, axis=1)]
    ]
    if not passages:
        raise ModelError("the branch's longest cycle comes near no equilibrium: follow it further")
    _, slowest, rest = min(passages, key=lambda passage: passage[0])
    # One round, from the cut to its image; beyond the end of the curve's round in the mirror.
    order = np.arange(slowest, slowest + m + 1)
    cut = nodes[order % m] * np.where((order >= m)[:, None], curve.mirror, 1.0)
    two = not np.allclose(curve.mirror * rest, rest, atol=1e-9)
    mirror = curve.mirror if two else np.ones(flow.dim)
    return ConnectingCurve.through(flow, values, curve.parameter, rest, mirror, cut, curve.span(u))


def saddle_node_on(branch: Branch, curve: PeriodicOrbitCurve, u: Floats) -> BifurcationPoint | None:
    """Find the fold of equilibria at which the longest cycles of a branch end, or None; `u` is the longest.

    The period grows there with the inverse square root of the distance in the parameter, not with its
    logarithm, as towards an orbit homoclinic to a saddle.
    """
    fold = _fold_near(curve, u)
    if fold is None:
        return None
    near = np.flatnonzero(branch.periods >= branch.periods.max() / _GROWN**3)
    away, periods = np.abs(branch.values[near] - fold.value), branch.periods[near]
    if periods.max() < _GROWN * periods.min():
        return None
    square = periods**2 * away
    return fold if square.min() > 0.0 and square.max() < _AGREES * square.min() else None


def _fold_near(curve: PeriodicOrbitCurve, u: Floats) -> BifurcationPoint | None:
    """Return the fold of equilibria near the slowest node of a cycle."""
    flow, slow = curve.flow, curve.nodes(u)[int(np.argmin(curve.speeds(u)))]
    rests, begin = curve.rests_near(slow, u)

    def equations(y: Floats) -> Floats:
        residual, matrix = rests.equations(y)
        return np.append(residual, np.linalg.det(matrix[:, :-1]))

    try:
        solution = optimize.root(equations, begin)
        guess = solution.x
        if not solution.success or np.linalg.norm(rests.state(guess) / flow.size - slow / flow.size) > _NEAR:
            return None
        along = np.linalg.svd(rests.equations(guess)[1])[2][-1]
        return nearest_bifurcation(rests, guess - _BESIDE * along, along, "fold", 2.0 * _BESIDE)
    except (CorrectorFailed, IntegrationError, ValueError, np.linalg.LinAlgError):
        return None
