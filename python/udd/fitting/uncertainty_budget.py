"""The uncertainty budget of a fit, by the Guide to the expression of uncertainty in measurement (GUM)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.keywords import renamed
from udd._util.one_line import OneLine
from udd._util.validation import number
from udd.errors import FitError

from .estimator_input import FilmParameters
from .problem import Point
from .solve import solve

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .problem import Fit

_CAMERA, _NOISE, _MODEL = "camera", "noise", "model error"


@dataclass(frozen=True, repr=False)
class Budget(OneLine):
    """From what the uncertainty of each fitted number comes.

    Attributes
    ----------
    values : dict of str to float
        The fitted numbers.
    units : dict of str to str
    sources : tuple of str
        What uncertainty comes from: ``noise`` of the frames, ``camera`` (what is known of it beforehand),
        ``scale`` and the model's parameters with a prior, by name; what was fixed, by name; and
        ``model error``, where the fit shows that something is missing.
    contributions : ndarray, shape (number of values, number of sources)
        Standard uncertainties, in the values' units; what comes from different sources is independent.
    k : float
        The coverage factor of the expanded uncertainty.
    """

    values: dict[str, float]
    units: dict[str, str]
    sources: tuple[str, ...]
    contributions: NDArray[np.float64]
    k: float = 2.0

    @property
    def standard(self) -> dict[str, float]:
        """Combined standard uncertainties."""
        combined = np.sqrt(np.square(self.contributions).sum(axis=1))
        return dict(zip(self.values, combined.tolist(), strict=True))

    @property
    def expanded(self) -> dict[str, float]:
        """Expanded uncertainties, k times the standard ones."""
        return {name: self.k * u for name, u in self.standard.items()}

    @property
    def shares(self) -> NDArray[np.float64]:
        """Which part of the variance of each value comes from each source; each row adds up to 1."""
        squares = np.square(self.contributions)
        result: NDArray[np.float64] = squares / squares.sum(axis=1, keepdims=True)
        return result

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return {
            "k": self.k,
            "budget": {
                name: {
                    "value": value,
                    "unit": self.units[name],
                    "standard": self.standard[name],
                    "expanded": self.expanded[name],
                    "contributions": dict(zip(self.sources, row.tolist(), strict=True)),
                }
                for (name, value), row in zip(self.values.items(), self.contributions, strict=True)
            },
        }

    def __str__(self) -> str:
        """A table: values with expanded uncertainties, and the shares of the variance in %."""
        shares = 100 * self.shares
        head = f"{'':<16}{'value':>12}  {f'U (k = {self.k:g})':<20}" + "".join(
            f"{s:>12}" for s in self.sources
        )
        rows = [
            f"{name:<16}{value:>12.5g}  {f'{self.expanded[name]:.2g} {self.units[name]}':<20}"
            + "".join(f"{share:>10.1f} %" for share in row)
            for (name, value), row in zip(self.values.items(), shares, strict=True)
        ]
        return "\n".join([head, *rows])


@renamed(held="fixed")
def budget(fit: Fit, fixed: Mapping[str, float] | None = None, k: float = 2.0) -> Budget:
    """Uncertainty budget (GUM) of a fit's numbers.

    Parameters
    ----------
    fit : Fit
    fixed : mapping of str to float, optional
        Standard uncertainties of the parameters that the fit fixed; by default 0.1 mm for the radius R and
        0.01 m/s^2 for gravity g.
    k : float
        The coverage factor; 2 covers 95 % of a normal distribution.

    Returns
    -------
    Budget
        Of the model's free parameters; the camera's are among the sources.

    Raises
    ------
    FitError
        A name that the model does not have or that was free, an uncertainty that is not positive.

    Notes
    -----
    The fit's covariance is ``C = (N + P)^-1`` with the information N of the frames and P of the priors, so
    ``C = C N C + C P C``: the prior of a parameter j, of standard deviation s_j, contributes ``|C_ij|/s_j``
    to the uncertainty of i, and the rest is the noise's. What was fixed is moved by its standard uncertainty
    and the model fitted again: what moves with it is its contribution.

    References
    ----------
    JCGM 100:2008, Evaluation of measurement data: Guide to the expression of uncertainty in measurement, 5.1.

    Examples
    --------
    >>> import numpy as np, udd
    >>> t = np.arange(0, 20, 0.05)
    >>> theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.5]).state[:, 1]
    >>> noise = 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    >>> fit = udd.fit(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0, k0=0.1), free=["k0"])
    >>> fit.budget().sources
    ('noise', 'camera', 'g')
    """
    k = number("k", k, above=0.0)
    free = fit.problem.free
    known = {f.name.partition("[")[0] for f in free}
    if fixed is None:
        fixed = {name: sd for name, sd in fit.model.profile.fit.fixed.items() if name not in known}
    fixed = {name: number(name, value, above=0.0) for name, value in fixed.items()}
    for name in fixed:
        if name not in fit.model.parameters:
            raise FitError(f"the model has no parameter {name!r}; it has {', '.join(fit.model.parameters)}")
        if name in known:
            raise FitError(f"{name} was free, and what is known of it is its prior")
    rows = [i for i, f in enumerate(free) if f.role == "model"]
    factor = fit.widened
    covariance = fit.covariance / factor**2  # without what the model may miss
    variances: dict[str, NDArray[np.float64]] = {_NOISE: np.diag(covariance)[rows].copy()}
    for j, one in enumerate(free):
        if not np.isfinite(one.sd):
            continue
        share = np.square(covariance[rows, j] / one.sd)
        source = one.name if one.role == "model" or one.name.startswith("scale") else _CAMERA
        variances[source] = variances.get(source, 0.0) + share
        variances[_NOISE] -= share
    for name, sd in fixed.items():
        variances[name] = np.square(_moved(fit, name, sd)[rows])
    if factor > 1:
        variances[_MODEL] = (factor**2 - 1) * np.diag(covariance)[rows]
    names = [free[i].name for i in rows]
    units = fit.model.units
    return Budget(
        values={name: fit.parameters[name] for name in names},
        units={name: units.get(name.partition("[")[0], "") for name in names},
        sources=tuple(variances),
        contributions=np.sqrt(np.maximum(np.stack(list(variances.values()), axis=1), 0.0)),
        k=k,
    )


def _moved(fit: Fit, name: str, by: float) -> NDArray[np.float64]:
    """By how much each free parameter moves where one that was fixed is moved."""
    problem = fit.problem
    order = list(fit.model.parameters).index(name)
    models = tuple(own.with_parameters({name: own.parameters[name] + by}) for own in problem.models)
    sets = [FilmParameters([*values], camera, clock) for values, camera, clock in fit.point.sets]
    for values, _camera, _clock in sets:
        values[order] += by
    again = solve(fit.measurements, replace(problem, models=models), Point(fit.states, tuple(sets)))
    return np.array([again.parameters[f.name] - fit.parameters[f.name] for f in problem.free])
