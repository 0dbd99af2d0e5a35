"""Checks of what is asked of a diagram or of basins."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._util.progress import thread_count
from udd._util.validation import array, number
from udd.chaos.poincare_sections import CLOCKS, clock_of, surfaces_of
from udd.errors import ModelError
from udd.models import Model, require_model
from udd.models.parameter_batch import default_state
from udd.models.state_scaling import Floats
from udd.simulation.batch import RunOptions
from udd.simulation.trajectory import initial_state, longest_step, tolerances

from .section_runs import SectionRunner


def section_runner(
    model: Model,
    rows: Floats,
    section: str | None,
    direction: str | None,
    options: RunOptions,
    t_max: float | None,
    each: int,
) -> SectionRunner:
    """Return the checked runner from section to section.

    `rows` are the parameters of the jobs, `each` is the number of points of one.
    """
    if not isinstance(section, str | None):
        raise ModelError(f"section must be one expression such as 'z', not {section!r}")
    surfaces, ways = surfaces_of(model, section, direction)
    rtol, atol = tolerances(options["rtol"], options["atol"])
    mean = None if t_max is None else number("t_max", t_max, above=0.0) / each
    t_each = CLOCKS * clock_of(model, rows) if mean is None else mean
    longest, threads = longest_step(options["max_step"], t_each), thread_count(options["threads"])
    return SectionRunner(model, surfaces, ways, rtol, atol, threads, t_each, longest)


def start_states(model: Model, starts: ArrayLike | None) -> Floats:
    """Return the initial states (n, dim)."""
    require_model(model)
    if starts is None:
        return np.array([default_state(model)])
    given = np.atleast_2d(array("initial_states", starts))
    if given.ndim != 2 or not len(given):
        raise ModelError("initial_states must be a list of states")
    return np.stack([initial_state(model, state) for state in given])


def parameter_values(model: Model, parameter: str, values: ArrayLike) -> Floats:
    """Return the values of the parameter along a diagram."""
    require_model(model)
    if parameter not in model.parameters:
        raise ModelError(
            f"{type(model).__name__} has no parameter {parameter!r}; it has {', '.join(model.parameters)}"
        )
    axis = increasing(parameter, values)
    for value in (float(axis[0]), float(axis[-1])):
        model.replace(**{parameter: value})
    return axis


def increasing(name: str, values: ArrayLike) -> Floats:
    """Check a list of increasing numbers."""
    axis = array(f"the values of {name}", values)
    if axis.ndim != 1 or not len(axis):
        raise ModelError(f"the values of {name} must be a list of at least one number")
    if not (np.diff(axis) > 0).all():
        raise ModelError(f"the values of {name} must increase, without duplicates")
    return axis


def parameter_rows(model: Model, changes: dict[str, Floats], jobs: int) -> NDArray[np.float64]:
    """Return the parameters of each job, shape (jobs, parameters)."""
    rows = np.tile(np.array(list(model.parameters.values())), (jobs, 1))
    for name, values in changes.items():
        rows[:, list(model.parameters).index(name)] = values
    return rows
