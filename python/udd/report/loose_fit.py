"""A fit that leans little on its model, which shows what the model's equations leave over."""

from __future__ import annotations

from udd.fitting import Fit
from udd.fitting.problem import FOLLOWS, levels
from udd.fitting.solve import solve


def loosest(fit: Fit) -> Fit:
    """Solve again with the largest assumed error of the model at which the states are smoother than the data.

    A tight fit of a wrong model bends the states to obey it, and its residuals with them.
    """
    result = fit
    for diffusion in levels(fit.measurement.kind):
        result = solve(fit.measurements, fit.problem.with_model_error(diffusion), fit.point)
        if result.leverage < FOLLOWS:
            break
    return result
