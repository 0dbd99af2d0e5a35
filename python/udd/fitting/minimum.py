"""A single Gauss-Newton minimisation by the core, and its errors in words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from udd import _core
from udd._util.time_limit import check_time
from udd.errors import FitError, ModelError
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .estimator_input import FilmParameters
from .formula_models import state_noise
from .problem import Point, Problem

#: Maximum of steps of a single fit.
MOST = 40
#: A step that promises a smaller decrease of chi2 is the last: it changes no parameter by 0.1 standard
#: errors.
DONE = 0.01


class SolveError(FitError):
    """A fit that could not be solved, unlike one that was set up wrongly.

    Attributes
    ----------
    undetermined : tuple of str
        Parameters that can change together without changing the fit.
    """

    undetermined: tuple[str, ...] = ()


class Minimum(NamedTuple):
    """End of a minimisation: the fitted models, all unknowns, and the core's other results by name."""

    models: tuple[Model, ...]
    point: Point
    numbers: _core._Solution


def minimum(problem: Problem, point: Point, iterations: int = MOST, decrease: float = DONE) -> Minimum:
    """Minimise once, for the problem's assumed model error, from a point.

    It stops when a step promises to decrease chi2 by less than `decrease`. It does not start once the time of
    a search is up.
    """
    check_time()
    try:
        result = _core.solve(problem.at(point), iterations, decrease)
    except ValueError as error:
        unsolved = SolveError(_said(error, problem))
        if len(error.args) == 2:
            unsolved.undetermined = tuple(problem.free[k].name for k in error.args[1])
        raise unsolved from error
    sets = tuple(FilmParameters(*film) for film in result["sets"])
    try:
        models = tuple(
            model.with_parameters(dict(zip(model.parameters, film.model, strict=True)))
            for model, film in zip(problem.models, sets, strict=True)
        )
    except ModelError as error:  # a shape left its range
        raise SolveError(f"the fit reached parameters that are invalid for the model: {error}") from error
    return Minimum(models, Point(result["states"], sets, result["linear"]), result)


def _said(error: ValueError, problem: Problem) -> str:
    """Explain an error of the core; name parameters that can change together."""
    if len(error.args) == 2:
        together = [problem.free[k].name for k in error.args[1]]
        return (
            f"the data do not determine the free parameters: {' and '.join(together)} can change "
            "together without changing the fit; give one of them a prior, or fix it"
            if len(together) > 1
            else f"the data do not depend on {together[0]}; give it a prior, or fix it"
        )
    model = problem.models[0]
    if "do not determine the state" in str(error) and isinstance(model, FormulaModel):
        noise = state_noise(model, problem.record.t, problem.record.states, problem.record.sigma)
        hidden = [name for name, sd in zip(model.state_names, noise, strict=True) if not np.isfinite(sd)]
        asked = ", ".join(f"'{name}': ..." for name in hidden)
        if hidden:
            is_not = "is" if len(hidden) == 1 else "are"
            return (
                f"the fit failed: {error}; {', '.join(hidden)} {is_not} not observed: "
                f"say where the motion starts, state0={{{asked}}}"
            )
    return f"the fit failed: {error}"
