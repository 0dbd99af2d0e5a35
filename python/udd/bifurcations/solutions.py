"""Equilibria and cycles, one at a time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from udd._util.drawable import Drawable
from udd._util.memory import require_memory
from udd._util.validation import whole
from udd.models import Model, beyond_the_edge

from .flow_map import Floats

if TYPE_CHECKING:
    from udd.simulation.trajectory import Trajectory

    from .shooting_curve import PeriodicOrbitCurve

__all__ = ["Equilibrium", "PeriodicOrbit", "as_plain", "kind_of_rest"]

Complex = NDArray[np.complex128]
Found = TypeVar("Found")

_ON = 1e-7  # from the unit circle: a double multiplier 1 is known to the square root of rounding


class FoundList(list[Found]):
    """The results of a search.

    Attributes
    ----------
    search : str
        A sentence about the extent and method of the search: other solutions may exist.
    """

    def __init__(self, solutions: Iterable[Found], search: str) -> None:
        super().__init__(solutions)
        self.search = search

    def __repr__(self) -> str:
        return f"<{super().__repr__()}; {self.search}>"


def as_plain(thing: object, *names: str) -> dict[str, Any]:
    """Return attributes as plain numbers, texts and lists."""
    values = {name: getattr(thing, name) for name in names}
    return {n: value.tolist() if isinstance(value, np.ndarray) else value for n, value in values.items()}


def kind_of_rest(eigenvalues: Complex) -> str:
    """Return the name of the flow near an equilibrium with these eigenvalues."""
    growing, turning = eigenvalues.real > 0, np.abs(eigenvalues.imag) > 0
    if (eigenvalues.real == 0.0).all() and turning.all():
        return "centre"
    if growing.all() or not growing.any():
        word = "unstable" if growing.all() else "stable"
        return f"{word} focus" if turning.any() else f"{word} node"
    return "saddle-focus" if turning.any() else "saddle"


@dataclass(frozen=True, eq=False)
class Equilibrium(Drawable):
    """State at which nothing changes but angles that nothing depends on.

    Attributes
    ----------
    model : Model
    state : ndarray, shape (dim,)
        Angles that nothing depends on are 0; they turn at their constant rates.
    eigenvalues : ndarray of complex, shape (r,)
        Those of the rates' derivative by the components that the rates depend on; largest real part first.
    kind : str
        "stable focus", "stable node", "saddle", "saddle-focus", "unstable node", "unstable focus", or
        "centre" if small swings neither grow nor decay. It is "degenerate" for a multiple root of the rates,
        "not isolated" for a point of a curve or surface of equilibria.
    residual : float
        The largest rate, in typical sizes per typical time.
    lyapunov_coefficient : float
        The first Lyapunov coefficient of the complex pair nearest to the imaginary axis, NaN without a pair.
        If the pair crosses the axis, the Hopf bifurcation is supercritical if the coefficient is negative.
    isolated : bool
        True if no other equilibria lie arbitrarily near.

    See Also
    --------
    udd.equilibria : finds them.
    udd.continuation : follows one over a parameter.
    udd.plot.eigenvalues : draw its eigenvalues.
    """

    model: Model
    state: Floats
    eigenvalues: Complex
    kind: str
    residual: float
    lyapunov_coefficient: float
    isolated: bool = True

    @property
    def stable(self) -> bool:
        """True if all eigenvalues have negative real parts."""
        return bool((self.eigenvalues.real < 0).all())

    def __repr__(self) -> str:
        state = ", ".join(
            f"{name}={value:.6g}" for name, value in zip(self.model.state_names, self.state, strict=True)
        )
        values = ", ".join(f"{value:.5g}" for value in self.eigenvalues)
        return f"<Equilibrium of {self.model!r} at {state}: {self.kind}, eigenvalues {values}>"


@dataclass(frozen=True, eq=False)
class PeriodicOrbit(Drawable):
    """Cycle of a model.

    Attributes
    ----------
    model : Model
    state : ndarray, shape (dim,)
        A state on it; angles that nothing depends on are 0.
    period : float
        Its period, the time after which all that the rates depend on is as before.
    multipliers : ndarray of complex, shape (r - 1,)
        The Floquet multipliers over the period, largest first; the one along the flow, 1, is left out. A
        forced model has those of the stroboscopic map, shape (r,).
    symmetric : bool
        True if it is its own image under the model's symmetry, half a period later.
    nodes : ndarray, shape (m, dim)
        States on it at equal distances of time, from `state` on; of a symmetric one over half the period.
    residual : float
        The largest gap between the pieces of orbits that it was found of, in typical sizes.

    See Also
    --------
    udd.periodic_orbit : finds it.
    udd.continuation : follows it over a parameter.
    udd.plot.cycle : draw it.
    udd.plot.eigenvalues : draw its multipliers.
    """

    model: Model
    state: Floats
    period: float
    multipliers: Complex
    symmetric: bool
    nodes: Floats
    residual: float
    _solved: tuple[PeriodicOrbitCurve, Floats] | None = field(default=None, repr=False)

    @property
    def stable(self) -> bool:
        """True if all multipliers are inside the unit circle, and not on it but for rounding."""
        return bool((np.abs(self.multipliers) < 1.0 - _ON).all())

    @cached_property
    def multiplier_errors(self) -> Floats:
        """Bounds of the errors of the multipliers, to first order; NaN if their curve is not known."""
        if self._solved is None:
            return np.full(len(self.multipliers), np.nan)
        curve, u = self._solved
        return curve.multiplier_errors(u)

    @property
    def neutral(self) -> bool:
        """True if no multiplier is outside the unit circle, and one on it but for rounding."""
        return not self.stable and bool((np.abs(self.multipliers) <= 1.0 + _ON).all())

    @cached_property
    def period_error(self) -> float:
        """A bound of the period's error: how far it moves when runs are a hundred times less accurate.

        NaN of a cycle that is one of a family, unless its period or energy is fixed.
        """
        if self._solved is None:
            return float("nan")
        curve, u = self._solved
        return curve.period_error(u)

    def trajectory(self, n: int = 400, **options: Any) -> Trajectory:
        """Run the cycle over one period.

        Parameters
        ----------
        n : int
            The run has `n` + 1 times.
        **options
            As for :func:`udd.simulate`.

        Returns
        -------
        Trajectory
            From the state of the cycle.
        """
        from udd.simulation.trajectory import simulate

        n = whole("n", n, 1)
        require_memory(f"the states at {n} times", n, itemsize=8)
        times = np.linspace(0.0, self.period, n + 1)
        tight: dict[str, Any] = {"rtol": 1e-12, "atol": 1e-14, "method": "auto"} | options
        return simulate(beyond_the_edge(self.model), times, self.state, **tight)

    def __repr__(self) -> str:
        stable = "stable" if self.stable else "neutral" if self.neutral else "unstable"
        mirror = "symmetric, " if self.symmetric else ""
        largest = ", ".join(f"{value:.6g}" for value in self.multipliers)
        bound = f"error below {self.period_error:.1g}" if np.isfinite(self.period_error) else "no bound"
        return (
            f"<PeriodicOrbit of {self.model!r}: period {self.period:.13g} ({bound}), "
            f"{mirror}{stable}, multipliers {largest}>"
        )
