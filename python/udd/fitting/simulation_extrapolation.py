"""Bias of a fit by its inputs' noise, by simulation extrapolation (errors in variables)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.one_line import OneLine
from udd._util.random_generator import generator
from udd._util.validation import whole
from udd.errors import FitError
from udd.measurement import InputSignal, Measurement

from .fit import fit as fit_again
from .fit_result import Fit
from .input_noise import noise_of
from .minimum import SolveError

__all__ = ["InputBias", "input_bias"]

Array = NDArray[np.float64]

#: Added noise relative to the existing one, in variance. A parabola through the results extrapolates to none.
_TIMES, _BACK = (1.0, 2.0), (3.0, -3.0, 1.0)
_FEWEST = 2  # of the draws, that must converge


@dataclass(frozen=True, repr=False)
class InputBias(Drawable, OneLine):
    """Bias by the inputs' noise, estimated by simulation extrapolation.

    Attributes
    ----------
    bias : dict of str to float
        Bias of each parameter: how much too large it is.
    errors : dict of str to float
        Standard errors of the biases, from the draws.
    corrected : dict of str to float
            The parameters minus their bias.

    See Also
    --------
    udd.plot.bias : draw it.
    """

    bias: dict[str, float]
    errors: dict[str, float]
    corrected: dict[str, float]


@checked_arguments(error=FitError)
def input_bias(fit: Fit, draws: int = 6, rng: int | np.random.Generator | None = 0) -> InputBias:
    """Estimate the bias of the fitted numbers by the inputs' noise, by simulation extrapolation (SIMEX).

    The fit is repeated with noise added to every input, once and twice the variance that its samples show. A
    parabola through the three results extrapolates to an input without noise.

    Parameters
    ----------
    fit : Fit
        Fit of a model with inputs.
    draws : int
        Draws of the added noise, for each size.
    rng : int or Generator, optional
        Seed or generator of the draws.

    Returns
    -------
    InputBias
        `bias`, its `errors`, and the `corrected` parameters.

    Raises
    ------
    FitError
            The model has no inputs, or fits with added noise do not converge.

    See Also
    --------
    udd.fit : make the fit.
    udd.plot.bias : draw the result.

    References
    ----------
    Cook and Stefanski, "Simulation-extrapolation estimation in parametric measurement error models" (1994)
    [43].

    Examples
    --------
    >>> import numpy as np
    >>> import udd
    >>> t, rng = np.arange(0.0, 15.0, 0.02), np.random.default_rng(0)
    >>> cart = udd.Model(["x", "v"], ["v", "g*u - 4*x - v"], {"g": 2.0}, inputs=["u"])
    >>> drive = np.sin(1.3 * t) + 0.5 * np.sin(3.7 * t)
    >>> x = udd.simulate(cart, t, [0.0, 0.0], inputs={"u": drive}).x + 1e-3 * rng.normal(size=len(t))
    >>> noisy = drive + 0.3 * rng.normal(size=len(t))
    >>> fit = udd.fit(udd.Measurement(t, {"x": x}, inputs={"u": noisy}), cart)
    >>> bias = udd.input_bias(fit)
    >>> list(bias.bias), abs(bias.bias["g"]) < 0.2
    (['g'], True)
    """
    if not fit.model.inputs:
        raise FitError("the model has no inputs, so there is no bias by their noise")
    draws, random = whole("draws", draws, _FEWEST), generator(rng)
    names = list(dict.fromkeys(f.base for f in fit.problem.free))
    priors = {free.name: (free.mean, free.sd) for free in fit.problem.free if np.isfinite(free.sd)}
    each = list(dict.fromkeys(f.base for f in fit.problem.free if f.film is not None))
    firsts = [int(np.argmax(fit.record.film == film)) for film in range(len(fit.measurements))]
    starts = [dict(zip(fit.model.state_names, fit.states[k].tolist(), strict=True)) for k in firsts]
    draws_by_size: list[list[list[float]]] = [[] for _ in _TIMES]
    for k in range(draws * len(_TIMES)):
        noised = [_noised(measurement, _TIMES[k % len(_TIMES)], random) for measurement in fit.measurements]
        try:
            again = fit_again(noised, list(fit.models), names, priors=priors, each=each, state0=starts)
        except SolveError:
            continue
        draws_by_size[k % len(_TIMES)].append([again.parameters[name] for name in fit.parameters])
    if any(len(values) < _FEWEST for values in draws_by_size):
        raise FitError("fits with added noise on the inputs do not converge: the inputs are too noisy")
    now = np.array(list(fit.parameters.values()))
    means = [now, *(np.mean(values, axis=0) for values in draws_by_size)]
    variances = [np.var(values, axis=0, ddof=1) / len(values) for values in draws_by_size]
    corrected = np.array(_BACK) @ np.array(means)
    errors = np.sqrt(np.square(_BACK[1:]) @ np.array(variances))

    def named(column: Array) -> dict[str, float]:
        return dict(zip(fit.parameters, column.tolist(), strict=True))

    return InputBias(named(now - corrected), named(errors), named(corrected))


def _noised(measurement: Measurement, times: float, rng: np.random.Generator) -> Measurement:
    """Add noise to a measurement's inputs, in variance `times` what they have."""
    signals = {}
    for name, signal in measurement.inputs.items():
        added_noise = np.sqrt(times) * noise_of(signal) * rng.normal(size=len(signal))
        signals[name] = InputSignal(signal.t, signal.values + added_noise, signal.hold)
    return replace(measurement, inputs=signals)
