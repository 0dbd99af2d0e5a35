"""Branches of equilibria and cycles, and the points where they change."""

from __future__ import annotations

import operator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.labelled import of_states
from udd.errors import IntegrationError, ModelError
from udd.models import Model

from .equilibrium_curve import EquilibriumCurve
from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed, CurvePoint, guess_at, natural_constraint, newton_corrector
from .shooting_curve import PeriodicOrbitCurve
from .solution_curve import NO_PARAMETER
from .solutions import Equilibrium, PeriodicOrbit, as_plain

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["AnyCurve", "BifurcationPoint", "Branch", "cycles_of"]

Complex = NDArray[np.complex128]
AnyCurve = EquilibriumCurve | PeriodicOrbitCurve


@dataclass(frozen=True, eq=False)
class BifurcationPoint(Drawable):
    """Bifurcation point of a branch.

    Attributes
    ----------
    kind : str
        "fold" and "branch point" for equilibria and cycles. For equilibria also "Hopf", "border collision"
        (on a surface at which the law changes, the branch goes on) and "nonsmooth fold" (there, it turns
        back). For cycles "symmetry breaking", "period doubling" and "Neimark-Sacker". For families of cycles
        "Krein collision": two pairs of multipliers meet on the unit circle and leave it.
    parameter : str
    value : float
        The parameter's value.
    error : float
        A bound of the value's error: of cycles how far it moves when runs are a hundred times less accurate,
        of equilibria what rounding makes of it.
    period_error : float
        The same of the cycle's period, and of that of cycles born at a Hopf bifurcation; else NaN.
    solution : Equilibrium or PeriodicOrbit
        What changes there.
    arclength : float
        The place on the branch.
    frequency : float
        The frequency of the motion born at a Hopf or Neimark-Sacker bifurcation (the latter per unit of time,
        from the angle of the multipliers), else NaN.
    lyapunov_coefficient : float
        The first Lyapunov coefficient of a Hopf bifurcation, else NaN.

    See Also
    --------
    udd.continuation : finds it on a branch.
    udd.locus : follows it over a second parameter.
    udd.plot.branches : draw the branch with its points.

    References
    ----------
    Kinds and normal forms: Yu. A. Kuznetsov [24].
    """

    kind: str
    parameter: str
    value: float
    error: float
    period_error: float
    solution: Equilibrium | PeriodicOrbit
    arclength: float
    frequency: float = float("nan")
    lyapunov_coefficient: float = float("nan")
    _curve: AnyCurve | None = field(default=None, repr=False)
    _place: CurvePoint | None = field(default=None, repr=False)

    @property
    def period(self) -> float:
        """The cycle's period; of a Hopf bifurcation that of the cycles born there; else NaN."""
        if isinstance(self.solution, PeriodicOrbit):
            return self.solution.period
        return 2.0 * np.pi / self.frequency

    @cached_property
    def lyapunov_error(self) -> float:
        """A bound of the error of the first Lyapunov coefficient; NaN of what is no Hopf bifurcation."""
        curve, place = self._curve, self._place
        if self.kind != "Hopf" or curve is None or place is None:
            return float("nan")
        return curve.lyapunov_error(place, self.error)

    @property
    def criticality(self) -> str:
        """The type of a Hopf point: "supercritical" (cycles are born stable) or "subcritical"; else empty."""
        if np.isnan(self.lyapunov_coefficient):
            return ""
        return "supercritical" if self.lyapunov_coefficient < 0 else "subcritical"

    def __repr__(self) -> str:
        criticality = f", {self.criticality} (first Lyapunov coefficient {self.lyapunov_coefficient:.6g})"
        bound = f"error below {self.period_error:.1g}" if np.isfinite(self.period_error) else "no bound"
        period = f", period {self.period:.12g} ({bound})" if np.isfinite(self.period) else ""
        return (
            f"<{self.kind} at {self.parameter} = {self.value:.13g} (error below {self.error:.1g}){period}"
            f"{criticality if self.criticality else ''}>"
        )


@dataclass(frozen=True, eq=False)
class Branch(Drawable):
    """Family of equilibria or cycles over a parameter, in the order in which the curve was followed.

    Attributes
    ----------
    model : Model
        That of the start.
    parameter : str
    kind : {"equilibrium", "cycle"}
    values : ndarray, shape (n,)
        The parameter along the branch.
    states : ndarray, shape (n, dim)
        The equilibrium, or a state on the cycle.
    periods : ndarray, shape (n,)
        The cycle's periods; NaN for equilibria.
    multipliers : ndarray of complex, shape (n, r - 1) or (n, r)
        Floquet multipliers of cycles, eigenvalues of equilibria.
    stable : ndarray of bool, shape (n,)
    symmetric : bool
        True if the solutions are their own mirror images.
    arclength : ndarray, shape (n,)
    points : tuple of BifurcationPoint
        In the order of the arclength.
    ends : tuple of str
        Why the branch ends, at its beginning and at its end.

    See Also
    --------
    udd.continuation : makes it.
    udd.plot.branches : draw it.
    udd.diagram : several branches with section points.
    """

    model: Model
    parameter: str
    kind: str
    values: Floats
    states: Floats
    periods: Floats
    multipliers: Complex
    stable: NDArray[np.bool_]
    symmetric: bool
    arclength: Floats
    points: tuple[BifurcationPoint, ...]
    ends: tuple[str, str]
    _places: tuple[tuple[AnyCurve, CurvePoint], ...] = field(default=(), repr=False)

    def __len__(self) -> int:
        return len(self.values)

    @cached_property
    def extremes(self) -> tuple[Floats, Floats]:
        """The least and the largest value of each component on each orbit, two arrays of shape (n, dim)."""
        pairs = [curve.extremes(place.u) for curve, place in self._places]
        return np.array([low for low, _ in pairs]), np.array([high for _, high in pairs])

    @checked_arguments
    def crossings(
        self, section: str | None = None, direction: str | None = None
    ) -> tuple[NDArray[np.intp], Floats]:
        """Find the crossings of the cycles with a section.

        Parameters
        ----------
        section, direction : str, optional
            As :func:`udd.poincare` takes them; by default ``"z"`` (``"Z"``, ``"theta"``) upward.

        Returns
        -------
        which : ndarray of int, shape (k,)
            The places on the branch.
        states : ndarray, shape (k, dim)
            The states there; of cycles that are not symmetric those of the mirror image are not among them.
        """
        each = [curve.crossings(place.u, section, direction) for curve, place in self._places]
        which = np.repeat(np.arange(len(each)), [len(states) for states in each])
        return which, np.concatenate([np.zeros((0, self.states.shape[1])), *each])

    @checked_arguments
    def solution(self, i: int) -> Equilibrium | PeriodicOrbit:
        """Return the equilibrium or cycle of one point of the branch.

        Parameters
        ----------
        i : int
            Number of the point, counted from 0.

        Returns
        -------
        Equilibrium or PeriodicOrbit
            At the value ``values[i]``.
        """
        try:
            curve, place = self._places[operator.index(i)]
        except IndexError:
            raise ModelError(
                f"the branch has {len(self._places)} points, counted from 0: none is {i}"
            ) from None
        return curve.solution(place.u)

    @checked_arguments
    def find(self, kind: str) -> list[BifurcationPoint]:
        """Return the bifurcation points of one kind.

        Parameters
        ----------
        kind : str
            A value of `BifurcationPoint.kind`, such as ``"fold"``.

        Returns
        -------
        list of BifurcationPoint
            In the order of the branch.
        """
        return [point for point in self.points if point.kind == kind]

    @checked_arguments
    def at(self, value: float) -> list[Equilibrium | PeriodicOrbit]:
        """Return the solutions at a value of the parameter, polished by Newton steps.

        Parameters
        ----------
        value : float
            The value of the parameter.

        Returns
        -------
        list of Equilibrium or PeriodicOrbit
            More than one if the branch folds.
        """
        solutions: list[Equilibrium | PeriodicOrbit] = []
        for i, (a, b) in enumerate(pairwise(self.values)):
            if not min(a, b) <= value <= max(a, b) or (value == b and i + 2 < len(self)):
                continue
            curve, place = self._places[i if abs(value - a) <= abs(value - b) else i + 1]
            guess = guess_at(place, value / curve.scale, 1e-3)
            with suppress(CorrectorFailed, IntegrationError):
                curve = curve.anchored(place.u)
                u = newton_corrector(curve, guess, natural_constraint(guess), patience=20)
                solutions.append(curve.solution(u))
        return solutions

    def to_xarray(self) -> xr.Dataset:
        """Return labelled arrays over ``place``: every state, the parameter, periods and multipliers.

        Returns
        -------
        xarray.Dataset
            The bifurcation points are those of the dimension ``bifurcation``.

        Examples
        --------
        >>> import udd
        >>> rest = udd.equilibria(udd.Model(["x"], ["r - x^2"], {"r": 1.0}))[0]
        >>> table = udd.continuation(rest, "r", (-1.0, 2.0)).to_xarray()
        >>> print(table.bifurcation.values, table.bifurcation_value.values.round(9) + 0.0)
        ['fold'] [0.]
        """
        model, points = self.model, self.points
        attrs = {"model": repr(model), "parameter": self.parameter, "kind": self.kind}
        dataset = of_states(model.state_names, model.state_units, self.states, ["place"], {}, **attrs)
        return dataset.assign_coords(bifurcation=[point.kind for point in points]).assign(
            {
                self.parameter: ("place", self.values),
                "period": ("place", self.periods),
                "stable": ("place", self.stable),
                "arclength": ("place", self.arclength),
                "multiplier": (("place", "number"), self.multipliers),
                "bifurcation_value": ("bifurcation", np.array([point.value for point in points])),
                "bifurcation_error": ("bifurcation", np.array([point.error for point in points])),
            }
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the branch as plain numbers, for JSON.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
        low, high = self.extremes
        lists = ("values", "states", "periods", "stable")
        return as_plain(self, "parameter", "kind", "symmetric", *lists) | {
            "low": low.tolist(),
            "high": high.tolist(),
            "points": [
                as_plain(point, "kind", "value", "error", "period", "period_error")
                | {"state": point.solution.state.tolist()}
                | as_plain(point, "frequency", "lyapunov_coefficient", "criticality")
                for point in self.points
            ],
            "ends": list(self.ends),
        }

    def __repr__(self) -> str:
        ends = f"{self.values[0]:.6g} to {self.values[-1]:.6g}" if len(self) else "nowhere"
        listed = "; ".join(f"{point.kind} at {point.value:.10g}" for point in self.points)
        what = "equilibria" if self.kind == "equilibrium" else "cycles"
        what = f"symmetric {what}" if self.symmetric else what
        return (
            f"<Branch of {what}, {self.parameter} = {ends}, {len(self)} points: {listed or 'no bifurcation'}>"
        )


def cycles_of(branch: Branch) -> list[tuple[PeriodicOrbitCurve, Floats]]:
    """Return the curves and unknowns of the cycles of a branch over a parameter of an autonomous model."""
    if not isinstance(branch, Branch) or branch.kind != "cycle":
        raise ModelError("a branch of cycles is needed, of udd.continuation")
    cycles = [(curve, place.u) for curve, place in branch._places if curve.kind == "cycle"]
    curve = cycles[0][0]
    if curve.parameter == NO_PARAMETER:
        raise ModelError(
            "a branch over a parameter of a model is needed: follow the cycles over a parameter of the "
            f"model, not over {branch.parameter}"
        )
    if curve.flow.forcing is not None:
        raise ModelError("the branch must be followed over a parameter of a model that is not forced")
    return cycles
