"""What can be swept: a table from a quantity's name to the function that computes it.

Such a function takes the model, a value of every swept parameter for each of n trajectories, their initial
states, and the options. It returns arrays whose first axis is the trajectory. A trajectory that fails has an
outcome and NaN, and disturbs no other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._validate import number
from udd.errors import IntegrationError, ModelError
from udd.models import DLE, Model
from udd.trajectory import simulate, tolerances

OUTCOMES = ("not_run", "finished", "ejected", "failed", "start_outside")
"""The meanings of the array ``outcome``, by its values."""

Floats: TypeAlias = NDArray[np.float64]
Options: TypeAlias = dict[str, float]
Found: TypeAlias = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Variable:
    """An array of the result; `more` names axes after those of the sweep, with their lengths."""

    name: str
    unit: str
    meaning: str
    dtype: str = "float64"
    more: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True)
class Quantity:
    """What is computed: the check of its options, its arrays (beside `outcome`), and the work."""

    options: Callable[[Model, Mapping[str, Any]], Options]
    variables: Callable[[Model], tuple[Variable, ...]]
    run: Callable[[Model, Mapping[str, Floats], Floats, Options], Found]


def _chosen(given: Mapping[str, Any], defaults: Mapping[str, float | None]) -> dict[str, Any]:
    for name in given:
        if name not in defaults:
            raise ModelError(f"there is no option {name!r}; there are {', '.join(defaults)}")
    chosen = {**defaults, **given}
    chosen["rtol"], chosen["atol"] = tolerances(chosen["rtol"], chosen["atol"])
    return chosen


def _time_unit(model: Model) -> str:
    return "1" if isinstance(model, DLE) else "s"


# --- the largest Lyapunov exponent


def _lyapunov_options(model: Model, given: Mapping[str, Any]) -> Options:
    slow = 1.0 if isinstance(model, DLE) else 0.25  # as in `udd.lyapunov`
    defaults = {"t": 1e5 * slow, "tol": 2e-3 / slow, "transient": None, "rtol": 1e-8, "atol": 1e-10}
    chosen = _chosen(given, defaults)
    t = number("t", chosen["t"], above=0.0)
    tol = number("tol", chosen["tol"], above=0.0)
    skipped = chosen["transient"]
    skipped = number("transient", min(400.0 * slow, 0.1 * t) if skipped is None else skipped, least=0.0)
    if skipped >= t:
        raise ModelError(f"transient must be below t = {t:g}, not {skipped:g}")
    return {**chosen, "t": t, "tol": tol, "transient": skipped}


def _lyapunov_variables(model: Model) -> tuple[Variable, ...]:
    unit = "1" if isinstance(model, DLE) else "1/s"
    return (
        Variable("value", unit, "largest Lyapunov exponent"),
        Variable("standard_error", unit, "its standard error"),
        Variable("converged", "1", "whether the standard error met tol", "bool"),
    )


def _lyapunov(model: Model, parameters: Mapping[str, Floats], states: Floats, options: Options) -> Found:
    n = len(states)
    found: Found = {
        "value": np.full(n, np.nan),
        "standard_error": np.full(n, np.nan),
        "converged": np.zeros(n, dtype=bool),
        "outcome": np.zeros(n, dtype=np.int8),
    }
    for group, index, values, fixed, state in _groups(model, parameters, states):

        def some(values: Floats, index: int = index, fixed: Model = fixed, state: Floats = state) -> Any:
            o = options
            time = o["t"], o["transient"], o["tol"]
            return _core.lyapunov(fixed, index, values, state.tolist(), *time, o["rtol"], o["atol"])

        try:
            _keep(found, group, some(values))
        except IntegrationError:
            # One failure fails the whole call; the others are as good as ever.
            for k in range(len(group)):
                try:
                    _keep(found, group[k : k + 1], some(values[k : k + 1]))
                except IntegrationError as error:
                    left = "left the wheels" in str(error)
                    found["outcome"][group[k]] = OUTCOMES.index("ejected" if left else "failed")
    return found


def _keep(found: Found, group: NDArray[np.intp], part: Any) -> None:
    for name, column in zip(("value", "standard_error", "converged"), part, strict=True):
        found[name][group] = column
    found["outcome"][group] = OUTCOMES.index("finished")


def _groups(
    model: Model, parameters: Mapping[str, Floats], states: Floats
) -> Iterator[tuple[NDArray[np.intp], int, Floats, Model, Floats]]:
    """Trajectories that differ in one parameter only, which the core takes together.

    Yields which they are, the parameter's index and values, the model with the others, the state.
    """
    names = list(model.parameters)
    # The parameter with the most values makes the fewest groups.
    inner = max(parameters, key=lambda name: len(np.unique(parameters[name])), default=names[0])
    outer = {name: values for name, values in parameters.items() if name != inner}
    groups: dict[bytes, list[int]] = {}
    for k, row in enumerate(np.column_stack([*outer.values(), states])):
        groups.setdefault(row.tobytes(), []).append(k)
    for members in groups.values():
        first = members[0]
        fixed = model.with_parameters({name: float(values[first]) for name, values in outer.items()})
        values = parameters[inner][members] if parameters else np.full(len(members), fixed.parameters[inner])
        yield np.array(members), names.index(inner), values, fixed, states[first]


# --- where a run ends, and how


def _run_options(model: Model, given: Mapping[str, Any]) -> Options:
    chosen = _chosen(given, {"t": None, "rtol": 1e-9, "atol": 1e-12})
    if chosen["t"] is None:
        raise ModelError("the option t, the length of the runs, must be given")
    return {**chosen, "t": number("t", chosen["t"], above=0.0)}


def _outcome_variables(model: Model) -> tuple[Variable, ...]:
    return (Variable("t_end", _time_unit(model), "time at which the run ended"),)


def _state_variables(model: Model) -> tuple[Variable, ...]:
    columns = zip(model.state_names, model.state_units, strict=True)
    ends = (Variable(f"final_{name}", unit or "1", f"{name} at the end") for name, unit in columns)
    return (*_outcome_variables(model), *ends)


def _runs(model: Model, parameters: Mapping[str, Floats], states: Floats, options: Options) -> Found:
    n = len(states)
    names = ("t_end", *(f"final_{name}" for name in model.state_names))
    found: Found = {name: np.full(n, np.nan) for name in names}
    found["outcome"] = np.zeros(n, dtype=np.int8)
    for k, state in enumerate(states):
        one = model.with_parameters({name: float(values[k]) for name, values in parameters.items()})
        try:
            run = simulate(one, [0.0, options["t"]], state, rtol=options["rtol"], atol=options["atol"])
        except IntegrationError:
            outcome = "failed"
        except ModelError:
            # All else was checked when the spec was made.
            outcome = "start_outside"
        else:
            outcome = run.outcome
            for name, value in zip(names, (run.t[-1], *run.state[-1]), strict=True):
                found[name][k] = value
        found["outcome"][k] = OUTCOMES.index(outcome)
    return found


def _outcomes(model: Model, parameters: Mapping[str, Floats], states: Floats, options: Options) -> Found:
    found = _runs(model, parameters, states, options)
    return {name: found[name] for name in ("t_end", "outcome")}


QUANTITIES: dict[str, Quantity] = {
    "lyapunov": Quantity(_lyapunov_options, _lyapunov_variables, _lyapunov),
    "final_state": Quantity(_run_options, _state_variables, _runs),
    "outcome": Quantity(_run_options, _outcome_variables, _outcomes),
}
