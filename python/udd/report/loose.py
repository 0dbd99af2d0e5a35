"""A fit that leans little on its model, which shows what the model's equations leave over."""

from __future__ import annotations

from dataclasses import replace

from udd.fitting import Fit
from udd.fitting.problem import levels
from udd.fitting.solve import solve

_FOLLOWS = 0.7  # of the noise's variance: above it the states merely follow each frame


def loosened(fit: Fit) -> Fit:
    """Solve again with a larger assumed error of the model.

    A tight fit of a wrong model bends the states to obey it, and its residuals with them. Of the levels that
    the fit went through, the loosest is taken at which the states are still smoother than the data.
    """
    result = fit
    for diffusion in levels(fit.measurement.kind):
        result = solve(fit.measurement, replace(fit.problem, diffusion=diffusion), fit.point)
        sd = result.noise.sd(result.record, result.states[:, 0])
        share = (result.misfit_variance / sd**2)[result.record.observed]
        if share.mean() < _FOLLOWS:
            break
    return result
