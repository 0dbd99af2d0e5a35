"""A fit that weights its model little and so shows the residuals of its equations."""

from __future__ import annotations

from udd.fitting import Fit, minimise
from udd.fitting.problem import FOLLOWS


def loosest(fit: Fit) -> Fit:
    """Solve again with the largest assumed model error at which the states are smoother than the data.

    A tight fit of a wrong model distorts the states and with them its residuals. A model that is written as
    text keeps its fit.
    """
    if fit.model.profile.written:
        return fit
    result = fit
    for diffusion in fit.problem.schedule:
        result = minimise(fit.problem.with_model_error(diffusion), fit.point)
        if result.leverage < FOLLOWS:
            break
    return result
