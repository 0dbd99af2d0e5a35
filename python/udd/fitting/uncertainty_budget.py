"""The uncertainty budget of a fit, by the Guide to the expression of uncertainty in measurement (GUM)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.keywords import renamed
from udd._util.one_line import OneLine
from udd._util.validation import number
from udd.errors import FitError

from .minimum import minimum
from .problem import Point

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .fit_result import Fit

_CAMERA, _NOISE, _MODEL = "camera", "noise", "model error"


@dataclass(frozen=True, repr=False)
class Budget(OneLine):
    """Uncertainty of each fitted number, by source.

    Attributes
    ----------
    values : dict of str to float
        The fitted numbers.
    units : dict of str to str
    sources : tuple of str
        Names of the sources: ``noise`` of the frames; ``camera`` (its priors); ``scale`` and the model's
        parameters with a prior; the fixed parameters; and ``model error`` if the fit shows that something is
        missing.
    contributions : ndarray, shape (number of values, number of sources)
        Standard uncertainties, in the values' units. Different sources are independent.
    k : float
        The coverage factor of the expanded uncertainty.

    See Also
    --------
    udd.Fit.budget : compute it.
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
        """Share of each source in the variance of each value; each row adds up to 1."""
        squares = np.square(self.contributions)
        result: NDArray[np.float64] = squares / squares.sum(axis=1, keepdims=True)
        return result

    def to_dict(self) -> dict[str, Any]:
        """Return the budget as JSON-ready values.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
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
        """Format a table: values with expanded uncertainties, and the shares of the variance in %."""
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
@checked_arguments(error=FitError)
def budget(fit: Fit, fixed: Mapping[str, float] | None = None, k: float = 2.0) -> Budget:
    """Compute the uncertainty budget (GUM) of a fit's numbers.

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
        Values, units, sources and contributions of the model's free parameters; the camera's are among the
        sources.

    Raises
    ------
    FitError
        A name is not a parameter of the model, or was free; or an uncertainty is not positive.

    See Also
    --------
    udd.Fit.budget : the same as a method.
    udd.input_bias : bias by noisy inputs.

    Notes
    -----
    The fit's covariance is ``C = (N + P)^-1`` with the information N of the frames and P of the priors, so
    ``C = C N C + C P C``. The prior of a parameter j, of standard deviation s_j, contributes ``|C_ij|/s_j``
    to the uncertainty of i, and the rest comes from the noise. Each fixed parameter is changed by its
    standard uncertainty and the model is fitted again; the changes of the free parameters are its
    contributions.

    References
    ----------
    JCGM 100:2008, Evaluation of measurement data: Guide to the expression of uncertainty in measurement,
    5.1 [44].

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
    free_names = {f.base for f in free}
    if fixed is None:
        fixed = {name: sd for name, sd in fit.model.profile.fit.fixed.items() if name not in free_names}
    fixed = {name: number(name, value, above=0.0) for name, value in fixed.items()}
    for name in fixed:
        if name not in fit.model.parameters:
            raise FitError(f"the model has no parameter {name!r}; it has {', '.join(fit.model.parameters)}")
        if name in free_names:
            raise FitError(f"{name} was free: its prior already counts; give a prior in udd.fit instead")
    rows = [i for i, f in enumerate(free) if f.role == "model"]
    factor = fit.widened
    covariance = fit.covariance / factor**2  # without the inflation for missing physics
    variances: dict[str, NDArray[np.float64]] = {_NOISE: np.diag(covariance)[rows].copy()}
    for j, parameter in enumerate(free):
        if not np.isfinite(parameter.sd):
            continue
        share = np.square(covariance[rows, j] / parameter.sd)
        source = (
            parameter.name if parameter.role == "model" or parameter.name.startswith("scale") else _CAMERA
        )
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
    """Compute the change of each free parameter if a fixed one is changed."""
    problem = fit.problem.with_model_error(fit.limit or fit.problem.diffusion)
    order = list(fit.model.parameters).index(name)
    models = tuple(model.with_parameters({name: model.parameters[name] + by}) for model in problem.models)
    sets = fit.point.with_values(
        lambda values: [*values[:order], values[order] + by, *values[order + 1 :]]
    ).sets
    end = minimum(replace(problem, models=models), Point(fit.states, sets)).point
    return np.array([end.value(f) - fit.parameters[f.name] for f in problem.free])
