"""Quantities of sweeps: a table from a quantity's name to the function that computes it.

Such a function takes the model, n rows of all parameters, n initial states, the options, and the number of
threads (0: one per core). It returns arrays whose first axis is the
trajectory. A trajectory that fails has an outcome and NaN, and disturbs no other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.validation import number
from udd.chaos.largest_exponent import span
from udd.errors import IntegrationError, ModelError
from udd.models import Model
from udd.models.parameter_batch import outside_domain
from udd.simulation.batch import Batch
from udd.simulation.outcomes import EJECTED, FAILED, FINISHED, INTERRUPTED, OUTCOMES
from udd.simulation.trajectory import integrated, longest_step, method_for, tolerances

NOT_RUN = -1
"""In the array ``outcome`` before the work is done; the others are those of `udd.simulation.outcomes`."""

Floats: TypeAlias = NDArray[np.float64]
Options: TypeAlias = dict[str, float]
Found: TypeAlias = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Variable:
    """An array of the result; `dimensions` names axes after those of the sweep, with their lengths."""

    name: str
    unit: str
    meaning: str
    dtype: str = "float64"
    dimensions: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True)
class Quantity:
    """A quantity: the check of its options, its arrays (besides `outcome`), and its function."""

    options: Callable[[Model, Mapping[str, Any]], Options]
    variables: Callable[[Model], tuple[Variable, ...]]
    run: Callable[[Model, Floats, Floats, Options, int], Found]


def _chosen(given: Mapping[str, Any], defaults: Mapping[str, float | None]) -> dict[str, Any]:
    for name in given:
        if name not in (*defaults, "max_step"):
            raise ModelError(f"there is no option {name!r}; there are {', '.join(defaults)}, max_step")
    chosen = {**defaults, **given}
    chosen["rtol"], chosen["atol"] = tolerances(chosen["rtol"], chosen["atol"])
    if "max_step" in given:
        chosen["max_step"] = longest_step(given["max_step"])
    return chosen


def _longest(options: Options) -> float:
    return float(options.get("max_step", math.inf))


def _time_unit(model: Model) -> str:
    return model.profile.dynamics.time_unit or "1"


# --- Lyapunov exponents


def _lyapunov_options(model: Model, given: Mapping[str, Any]) -> Options:
    time_scale = model.time_scale
    defaults = {"t": None, "tol": 2e-3 / time_scale, "transient": None, "rtol": 1e-8, "atol": 1e-10}
    chosen = _chosen(given, defaults)
    t, skipped = span(chosen["t"], chosen["transient"], longest=1e5 * time_scale, skip=400.0 * time_scale)
    longest_step(chosen.get("max_step"), t)
    return {**chosen, "t": t, "tol": number("tol", chosen["tol"], above=0.0), "transient": skipped}


def _lyapunov_variables(model: Model) -> tuple[Variable, ...]:
    unit = model.profile.dynamics.rate_unit
    return (
        Variable("value", unit, "largest Lyapunov exponent"),
        Variable("standard_error", unit, "its standard error"),
        Variable("converged", "1", "whether the standard error met tol", "bool"),
    )


def _spectrum_variables(model: Model) -> tuple[Variable, ...]:
    unit = model.profile.dynamics.rate_unit
    numbers = (("number", len(model.state_names)),)
    return (
        Variable("value", unit, "Lyapunov exponents", dimensions=numbers),
        Variable("standard_error", unit, "their standard errors", dimensions=numbers),
        Variable("converged", "1", "whether the first one's standard error met tol", "bool"),
    )


def _lyapunov(model: Model, rows: Floats, states: Floats, options: Options, threads: int) -> Found:
    arrays = _spectrum(model, rows, states, options, threads, all=False)
    return {**arrays, **{name: arrays[name][:, 0] for name in ("value", "standard_error")}}


def _spectrum(
    model: Model, rows: Floats, states: Floats, options: Options, threads: int, all: bool = True
) -> Found:
    time = options["t"], options["transient"], options["tol"]
    batch = Batch(model, rows, states, options["rtol"], options["atol"], threads, None, _longest(options))
    raw = _core.lyapunov(batch, all, *time)
    done = raw["outcome"] == FINISHED
    return {
        "value": np.where(done[:, None], raw["value"], np.nan),
        "standard_error": np.where(done[:, None], raw["standard_error"], np.nan),
        "converged": done & (raw["standard_error"][:, 0] <= options["tol"]),
        "outcome": raw["outcome"].astype(np.int8),
    }


# --- where a run ends, and how


def _run_options(model: Model, given: Mapping[str, Any]) -> Options:
    chosen = _chosen(given, {"t": None, "rtol": 1e-9, "atol": 1e-12})
    if chosen["t"] is None:
        raise ModelError("the option t, the length of the runs, must be given")
    t = number("t", chosen["t"], above=0.0)
    longest_step(chosen.get("max_step"), t)
    return {**chosen, "t": t}


def _outcome_variables(model: Model) -> tuple[Variable, ...]:
    return (Variable("t_end", _time_unit(model), "time at which the run ended"),)


def _state_variables(model: Model) -> tuple[Variable, ...]:
    columns = zip(model.state_names, model.state_units, strict=True)
    ends = (Variable(f"final_{name}", unit or "1", f"{name} at the end") for name, unit in columns)
    return (*_outcome_variables(model), *ends)


def _runs(model: Model, rows: Floats, states: Floats, options: Options, threads: int) -> Found:
    off = outside_domain(model, rows, states)
    # A disk that starts off the wheels has lost contact already.
    t_end = np.where(off, 0.0, np.nan)
    ends = np.where(off[:, None], states, np.nan)
    outcome = np.full(len(states), EJECTED, dtype=np.int8)
    if not off.all():
        arrays = _ended(model, rows[~off], states[~off], options, threads)
        failed = arrays["outcome"] == FAILED
        t_end[~off] = np.where(failed, np.nan, arrays["t_end"])
        ends[~off] = np.where(failed[:, None], np.nan, arrays["end"])
        outcome[~off] = arrays["outcome"]
    columns = {f"final_{name}": ends[:, k] for k, name in enumerate(model.state_names)}
    return {"t_end": t_end, **columns, "outcome": outcome}


def _ended(model: Model, rows: Floats, states: Floats, options: Options, threads: int) -> Found:
    times, rtol, atol = np.array([0.0, options["t"]]), options["rtol"], options["atol"]
    if "bristle" in model.state_names:
        return _ended_one_by_one(model, rows, states, times, options)
    method = method_for(model, "auto", rtol)
    raw = _core.ensemble(
        Batch(model, rows, states, rtol, atol, threads, None, _longest(options)), times, method
    )
    if (raw["outcome"] == INTERRUPTED).any():
        raise KeyboardInterrupt
    return {name: raw[name] for name in ("t_end", "end", "outcome")}


def _ended_one_by_one(model: Model, rows: Floats, states: Floats, times: Floats, options: Options) -> Found:
    """Run the models with bristle friction one by one, because ensembles do not have them."""
    limits: dict[str, Any] = {name: options.get(name) for name in ("rtol", "atol", "max_step")}
    t_end, ends = np.full(len(states), np.nan), np.full(states.shape, np.nan)
    outcome = np.full(len(states), FAILED, dtype=np.int8)
    for k, (row, state) in enumerate(zip(rows, states, strict=True)):
        one = model.with_parameters(dict(zip(model.parameters, row.tolist(), strict=True)))
        try:
            run = integrated(one, times, state, method="auto", **limits)
        except IntegrationError:
            continue
        t_end[k], ends[k], outcome[k] = run.t[-1], run.state[-1], OUTCOMES.index(run.outcome)
    return {"t_end": t_end, "end": ends, "outcome": outcome}


def _outcomes(model: Model, rows: Floats, states: Floats, options: Options, threads: int) -> Found:
    arrays = _runs(model, rows, states, options, threads)
    return {name: arrays[name] for name in ("t_end", "outcome")}


QUANTITIES: dict[str, Quantity] = {
    "lyapunov": Quantity(_lyapunov_options, _lyapunov_variables, _lyapunov),
    "spectrum": Quantity(_lyapunov_options, _spectrum_variables, _spectrum),
    "final_state": Quantity(_run_options, _state_variables, _runs),
    "outcome": Quantity(_run_options, _outcome_variables, _outcomes),
}
