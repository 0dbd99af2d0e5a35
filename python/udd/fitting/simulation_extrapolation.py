"""Simulation extrapolation: what the inputs' noise does to a fit's numbers (errors in variables)."""

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
from .input_noise import noise_of
from .problem import Fit
from .solve import SolveError

__all__ = ["InputBias", "input_bias"]

Array = NDArray[np.float64]

#: Noise is added as much as is there and twice as much; a parabola through what comes out goes back to none.
_TIMES, _BACK = (1.0, 2.0), (3.0, -3.0, 1.0)
_FEWEST = 2  # of the draws, that must end


@dataclass(frozen=True, repr=False)
class InputBias(Drawable, OneLine):
    """Bias by the inputs' noise, estimated by simulation extrapolation.

    Attributes
    ----------
    bias : dict of str to float
        By how much each parameter comes out too large.
    errors : dict of str to float
        Standard errors of these, from the draws.
    corrected : dict of str to float
        The parameters less their bias.
    """

    bias: dict[str, float]
    errors: dict[str, float]
    corrected: dict[str, float]


@checked_arguments(error=FitError)
def input_bias(fit: Fit, draws: int = 6, rng: int | np.random.Generator | None = 0) -> InputBias:
    """Simulation extrapolation (SIMEX): what the inputs' noise does to the fitted numbers.

    The fit is made again with noise added to every input, once and twice as much in variance as its samples
    show. A parabola through the three results goes back to an input without noise.

    Parameters
    ----------
    fit : Fit
        Of a model with inputs.
    draws : int
        Of the noise that is added, for each size.
    rng : int or Generator, optional
        Seed or generator of the draws.

    Returns
    -------
    InputBias

    Raises
    ------
    FitError
        A model without inputs, or fits with added noise that do not end.

    References
    ----------
    Cook and Stefanski, "Simulation-extrapolation estimation in parametric measurement error models", 1994.

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
    >>> found = udd.input_bias(fit)
    >>> list(found.bias), abs(found.bias["g"]) < 0.2
    (['g'], True)
    """
    if not fit.model.inputs:
        raise FitError("the model has no inputs whose noise could bias it")
    draws, random = whole("draws", draws, _FEWEST), generator(rng)
    names = list(dict.fromkeys(free.name.partition("[")[0] for free in fit.problem.free))
    priors = {free.name: (free.mean, free.sd) for free in fit.problem.free if np.isfinite(free.sd)}
    each = list(dict.fromkeys(f.name.partition("[")[0] for f in fit.problem.free if f.film is not None))
    firsts = [int(np.argmax(fit.record.film == film)) for film in range(len(fit.measurements))]
    starts = [dict(zip(fit.model.state_names, fit.states[k].tolist(), strict=True)) for k in firsts]
    found: list[list[list[float]]] = [[] for _ in _TIMES]
    for k in range(draws * len(_TIMES)):
        noised = [_noised(one, _TIMES[k % len(_TIMES)], random) for one in fit.measurements]
        try:
            again = fit_again(noised, list(fit.models), names, priors=priors, each=each, state0=starts)
        except SolveError:
            continue
        found[k % len(_TIMES)].append([again.parameters[name] for name in fit.parameters])
    if any(len(own) < _FEWEST for own in found):
        raise FitError("fits with as much noise again on the inputs do not end: the inputs are too noisy")
    now = np.array(list(fit.parameters.values()))
    means = [now, *(np.mean(own, axis=0) for own in found)]
    variances = [np.var(own, axis=0, ddof=1) / len(own) for own in found]
    corrected = np.array(_BACK) @ np.array(means)
    errors = np.sqrt(np.square(_BACK[1:]) @ np.array(variances))

    def named(column: Array) -> dict[str, float]:
        return dict(zip(fit.parameters, column.tolist(), strict=True))

    return InputBias(named(now - corrected), named(errors), named(corrected))


def _noised(measurement: Measurement, times: float, rng: np.random.Generator) -> Measurement:
    """A measurement with noise added to its inputs, so many times as much in variance as they have."""
    signals = {}
    for name, signal in measurement.inputs.items():
        more = np.sqrt(times) * noise_of(signal) * rng.normal(size=len(signal))
        signals[name] = InputSignal(signal.t, signal.values + more, signal.hold)
    return replace(measurement, inputs=signals)
