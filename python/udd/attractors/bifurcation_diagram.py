"""Bifurcation diagrams by brute force: attractors over a parameter, up and down."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._util.arguments import checked_arguments
from udd._util.keywords import renamed, with_defaults
from udd._util.labelled import require_xarray
from udd._util.memory import require_memory
from udd._util.progress import progress_bar
from udd._util.validation import number, whole
from udd.chaos.recurrence import SETTLING
from udd.errors import ModelError, interrupted
from udd.models import Model
from udd.models.state_scaling import Floats, coordinates_of
from udd.simulation.batch import RUN_OPTIONS, RunOptions
from udd.simulation.below_tolerance import warn_of_some

from .arguments import parameter_rows, parameter_values, section_runner, start_states
from .classification import Classification, MotionClassifier, again, decided, follow, put
from .dataset import (
    Variables,
    of_flags,
    of_outcomes,
    of_parameter,
    of_result,
    of_state,
    time_unit,
)
from .kinds import MOTIONS, kinds_of
from .labelling import DiagramLabels, tell
from .matching import intervals
from .section_runs import INTERRUPTED, UNDECIDED, parts
from .sweep_order import PATHS, nothing, perturbation, run_in_order

if TYPE_CHECKING:
    import xarray as xr


class DiagramOptions(RunOptions, TypedDict, total=False):
    """Keyword arguments of :func:`bifurcation` in addition to those of all runs."""

    max_extension: int
    perturbation: float
    match_distance: float


_OPTIONS: DiagramOptions = {**RUN_OPTIONS, "max_extension": 64, "perturbation": 1e-4, "match_distance": 0.25}


@renamed(starts="initial_states", extend="max_extension", nudge="perturbation", reach="match_distance")
@checked_arguments
def bifurcation(
    model: Model,
    parameter: str,
    values: ArrayLike,
    *,
    section: str | None = None,
    direction: str | None = None,
    n: int = 200,
    transient: int = 200,
    initial_states: ArrayLike | None = None,
    path: Literal["independent", "up", "down", "both"] = "independent",
    component: str | Sequence[str] | None = None,
    attractors: bool = True,
    t_max: float | None = None,
    **options: Unpack[DiagramOptions],
) -> xr.Dataset:
    """Compute section points over a parameter, with each attractor labelled.

    Parameters
    ----------
    model : Model
        The model. Its `parameter` is varied.
    parameter : str
        One of ``model.parameters``. That of an effect is ``"effect.name"``.
    values : array_like, shape (v,)
        Increasing values of the parameter.
    section : str, optional
        The surface, as :func:`udd.poincare` takes it. The default is ``"z"`` (``"Z"``, ``"theta"``).
    direction : {"up", "down", "both"}, optional
        Direction of the crossings that count. The default is upward.
    n : int
        How many points are kept, at least 12. Periods up to a third of this are recognised.
    transient : int
        Number of points that are left out first.
    initial_states : array_like, shape (s, dim) or (dim,), optional
        Initial states. The default is that of :func:`udd.lyapunov`.
    path : {"independent", "up", "down", "both"}
        Every value begins at the initial states, or at the end of the value before (after) it.
    component : str or sequence of str, optional
        Components of the state that are kept. By default all are.
    attractors : bool
        True to classify attractors and count periods. If False, the result has points and outcomes only.
    t_max : float, optional
        The longest time for the first ``transient + n`` points. The default is generous.
    **options
        ``max_extension`` (64): a motion that still settles is followed further, up to this many times
        ``transient + n`` points. ``perturbation`` (1e-4) is added to a state that is carried over, so that it
        leaves an orbit that became unstable. It is relative to the size of the motion.
        ``match_distance`` (0.25) is the largest mean distance of an attractor's points from one value to the
        next, relative to the size of the motion. ``rtol`` (1e-9) and ``atol`` (1e-12) are the tolerances of
        the runs. ``max_step`` is their longest step. ``threads`` is one per core by default.
        ``progress`` is True for a progress bar, False for none, or a function that
        gets the state of the work as a text. By default a bar shows after 2 s in a terminal or a notebook.
        With ``partial``, Ctrl-C returns the finished part with a warning, instead of raising an exception.

    Returns
    -------
    xarray.Dataset
        Dimensions ``path``, ``start``, the parameter and ``point``.

        - the components of the state at the section, NaN where there are fewer points;
        - ``outcome``: how each job ended;
        - ``kind``: a number with a name in ``flag_meanings``: equilibrium, rotating state, cycle, torus,
          chaos, left, or none (no verdict). It is aperiodic if the exponents do not distinguish torus and
          chaos;
        - ``period``: the number of distinct points (the rounds of a cycle, 1 at rest). It is 0 if the motion
          is not periodic, and -1 without a verdict;
        - ``period_time``: how long a period takes;
        - ``attractor``: a label from 1 on, 0 without an attractor; attractors of neighbouring values have the
          same one where the points hardly move;
        - ``symmetric``: 1 where it is its own mirror image under the model's symmetry, 0 where not, -1 where
          there is no symmetry or no attractor;
        - ``hysteresis``: whether the way up and the way down end on different attractors (mirror images count
          as the same); ``hysteresis_interval``: the stretches of such values, which a value without a verdict
          does not end.

    Raises
    ------
    ModelError
        A parameter, value or option that cannot be used.
    UddError
        The extra ``scale`` is not installed.

    Interrupted
        On Ctrl-C, with the dataset as its ``partial``: what is not finished is NaN with the outcome
        "interrupted", and attractors have neither labels nor kinds.

    Warns
    -----
    IncompleteWarning
        After Ctrl-C, where a partial result was asked for.

    See Also
    --------
    udd.diagram : the same with branches and their bifurcations.
    udd.basins : which start ends where.
    udd.plot.bifurcation : draw the section points.

    Notes
    -----
    The exponents of a short further run classify what is not periodic. A chaotic transient that outlives the
    run looks like chaos. If the ways up and down differ, all are followed to the length of
    `max_extension` before the difference counts as hysteresis. A job that leaves the disk (or fails) on the
    way up or down begins at its initial state again with the next value.

    The numbers do not depend on the number of threads. If the rates depend on time, every run begins at
    time 0, carried over or not.

    Examples
    --------
    The figure-eight, stable at large drives, loses its symmetry at w = 7.0964; at 5.3947 its period doubles.

    >>> import udd
    >>> diagram = udd.bifurcation(udd.DLE(1.0), "w", [5.3, 6.0, 7.5, 9.0])
    >>> diagram["period"].values.squeeze().tolist()
    [4, 2, 2, 2]
    """
    xarray = require_xarray()
    axis = parameter_values(model, parameter, values)
    n, transient = whole("n", n, 12 if attractors else 1), whole("transient", transient, 0)
    chosen = with_defaults("bifurcation", _OPTIONS, options)
    extension = whole("max_extension", chosen["max_extension"], 1)
    longest = extension * (transient + n)
    nudge = number("perturbation", chosen["perturbation"], least=0.0)
    reach = number("match_distance", chosen["match_distance"], above=0.0)
    partial = chosen["partial"]
    if path not in PATHS:
        raise ModelError(f"path must be one of {', '.join(PATHS)}, not {path!r}")
    kept = _components(model, component)
    begin = start_states(model, initial_states)
    middle = model.with_parameters({parameter: float(axis[len(axis) // 2])})
    shape = (len(PATHS[path]), len(begin), len(axis))
    require_memory(f"{n} points of each of {prod(shape)} jobs", *shape, n, len(begin[0]) + 1, itemsize=16)
    places = np.arange(np.prod(shape)).reshape(shape)
    of_job = np.broadcast_to(axis, shape).ravel()
    rows = parameter_rows(model, {parameter: of_job}, places.size)
    runner = section_runner(model, rows, section, direction, chosen, t_max, transient + n)
    judge = MotionClassifier(model, parameter, coordinates_of(middle, begin), runner)
    crossings = nothing(places.size, n, begin.shape[1])
    verdicts = Classification.none(places.size)

    def work(these: NDArray[np.intp], states: Floats) -> None:
        if attractors:
            points, job_verdicts = follow(
                runner, judge, rows[these], of_job[these], states, transient, n, longest
            )
            verdicts.put(these, job_verdicts)
        else:
            points = runner(rows[these], states, transient, n)
        put(crossings, these, points)

    with progress_bar(places.size, "run", chosen["progress"], title="bifurcation") as bar:
        added = perturbation(judge.coordinates.size, nudge)
        stopped = run_in_order(work, crossings, begin, places, PATHS[path], added, transient + n, bar.update)
    if not stopped:
        each = np.minimum(crossings.t_end, runner.t_each * (transient + n))
        warn_of_some(model, rows, begin[:1], each, runner.rtol, runner.atol)
    labels, kinds = DiagramLabels.nothing(places.size, len(axis)), np.zeros(places.size, dtype=np.int8)
    try:
        if attractors and (partial or not stopped):
            labels = tell(judge, crossings, verdicts, places, reach)
        if labels.differ.any() and not stopped:
            unsure = places[:, :, labels.differ].ravel()
            unsure = unsure[decided(crossings, verdicts)[unsure]]
            for part in parts(len(unsure), longest + n):
                if not again(runner, judge, rows, of_job, crossings, verdicts, unsure[part], longest, n):
                    raise KeyboardInterrupt
            crossings.outcome[unsure[verdicts.period[unsure] == SETTLING]] = UNDECIDED
            labels = tell(judge, crossings, verdicts, places, reach)
        if attractors and (partial or not stopped):
            kinds = kinds_of(runner, judge, crossings, verdicts, rows, of_job)
    except KeyboardInterrupt:
        stopped = True
    dims = ("path", "start", parameter)
    data: Variables = {
        name: (
            (*dims, "point"),
            crossings.points[:, :, k].reshape(*shape, n),
            of_state(model, name, "on the section"),
        )
        for k, name in enumerate(model.state_names)
        if name in kept
    }
    data["outcome"] = (dims, crossings.outcome.astype(np.int8).reshape(shape), of_outcomes())
    if attractors:
        data |= _of_attractors(model, parameter, shape, verdicts, labels, kinds)
        if path == "both":
            data |= _of_hysteresis(model, parameter, axis, labels)
    coords: Variables = {
        "path": ("path", list(PATHS[path])),
        "start": ("start", np.arange(len(begin), dtype=np.int32)),
        parameter: (parameter, axis, of_parameter(model, parameter)),
    }
    for k, name in enumerate(model.state_names):
        coords[f"start_{name}"] = ("start", begin[:, k], of_state(model, name, "at the start"))
    told_of = {"parameter": parameter, "n": n, "transient": transient, "max_extension": extension}
    attributes = {"perturbation": nudge, "match_distance": reach, "complete": int(not stopped)}
    made: xr.Dataset = xarray.Dataset(
        data, coords, of_result(runner, "bifurcation diagram", {**told_of, **attributes})
    )
    if stopped:
        left = int((crossings.outcome == INTERRUPTED).sum())
        missing = f"{left} of {places.size} runs are" if left else "telling the attractors apart is"
        interrupted(lambda: made, f"{missing} not finished: stopped by Ctrl-C", partial)
    return made


def _of_attractors(
    model: Model,
    parameter: str,
    shape: tuple[int, ...],
    verdicts: Classification,
    labels: DiagramLabels,
    kinds: NDArray[np.int8],
) -> Variables:
    dims = ("path", "start", parameter)
    period = np.where(labels.label > 0, verdicts.period, SETTLING).astype(np.int32)
    time = {"long_name": "duration of a period", "units": time_unit(model)}
    return {
        "kind": (dims, kinds.reshape(shape), of_flags("kind of motion", MOTIONS)),
        "period": (dims, period.reshape(shape), {"long_name": "number of distinct section points"}),
        "period_time": (dims, labels.duration.reshape(shape), time),
        "attractor": (dims, labels.label.reshape(shape), {"long_name": "label of the attractor"}),
        "symmetric": (
            dims,
            labels.symmetric.reshape(shape),
            {"long_name": "whether it is its own mirror image"},
        ),
    }


def _of_hysteresis(model: Model, parameter: str, axis: Floats, labels: DiagramLabels) -> Variables:
    words = {"long_name": "whether the ways up and down end on different attractors"}
    edges = {**of_parameter(model, parameter), "long_name": f"first and last {parameter} with hysteresis"}
    return {
        "hysteresis": (parameter, labels.differ.astype(np.int8), words),
        "hysteresis_interval": (("interval", "edge"), intervals(labels.differ, labels.unknown, axis), edges),
    }


def _components(model: Model, component: str | Sequence[str] | None) -> tuple[str, ...]:
    if component is None:
        return tuple(model.state_names)
    names = (component,) if isinstance(component, str) else tuple(component)
    for name in names:
        if name not in model.state_names:
            raise ModelError(f"the state has no {name!r}; it has {', '.join(model.state_names)}")
    return names
