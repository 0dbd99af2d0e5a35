"""Basins of attraction on a grid of initial states."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod
from typing import TYPE_CHECKING, Unpack

import numpy as np
from numpy.typing import ArrayLike

from udd._util.arguments import checked_arguments
from udd._util.keywords import renamed, with_defaults
from udd._util.labelled import require_xarray
from udd._util.memory import require_memory
from udd._util.progress import progress_bar
from udd._util.validation import whole
from udd.errors import ModelError, interrupted
from udd.models import Model
from udd.models.state_scaling import Floats
from udd.simulation.batch import RUN_OPTIONS, RunOptions
from udd.simulation.outcomes import FINISHED, OUTCOMES

from .arguments import increasing, parameter_rows, section_runner, start_states
from .attractor import KINDS, Attractor
from .basin_sampling import InitialStates
from .basin_statistics import basin_fractions, uncertainty
from .catalogue import AttractorCatalogue
from .classification import MotionClassifier
from .dataset import (
    Variables,
    of_flags,
    of_outcomes,
    of_result,
    of_state,
    time_unit,
)
from .matching import mirror_images
from .motion_size import sized_by_motion
from .section_runs import ALL_OUTCOMES, INTERRUPTED, START_OUTSIDE

if TYPE_CHECKING:
    import xarray as xr

_NOT_RUN = [INTERRUPTED, START_OUTSIDE]
_FINAL = [OUTCOMES.index("ejected"), OUTCOMES.index("escaped")]


@renamed(extend="max_extension")
@checked_arguments
def basins(
    model: Model,
    grid: Mapping[str, ArrayLike],
    *,
    state0: ArrayLike | None = None,
    section: str | None = None,
    direction: str | None = None,
    n: int = 100,
    transient: int = 100,
    max_extension: int = 16,
    t_max: float | None = None,
    **options: Unpack[RunOptions],
) -> xr.Dataset:
    """Compute the basins of attraction on a grid of initial states.

    Parameters
    ----------
    model : Model
        The model.
    grid : mapping of str to array_like
        One to three components of the initial state, usually two. Their values increase.
    state0 : array_like, shape (dim,), optional
        The other components at the start; by default those of :func:`udd.lyapunov`.
    section : str, optional
        The surface, as :func:`udd.poincare` takes it; by default ``"z"`` (``"Z"``, ``"theta"``).
    direction : {"up", "down", "both"}, optional
        Direction of the crossings that count. The default is upward.
    n : int
        Number of section points by which a motion is recognised, at least 12. Periods up to a third of this
        number are recognised.
    transient : int
        How many points are left out before.
    max_extension : int
        An unclear motion is followed further, up to this many times ``transient + n`` points.
    t_max : float, optional
        The longest time for the first ``transient + n`` points; by default generous.
    **options
        ``rtol`` (1e-9) and ``atol`` (1e-12) are the tolerances of the runs. ``max_step`` is their longest
        step. ``threads`` is one per core by default. ``progress`` is True for a progress bar, False for
        none, or a function that gets the state of the work as a text. By default a bar shows after 2 s in a
        terminal or a notebook. With ``partial``, Ctrl-C returns the finished part with a warning, instead of
        raising an exception.

    Returns
    -------
    xarray.Dataset
        Over the components of the grid:

        - ``attractor``: its number, from 1 on, the largest basin first; 0 without an attractor;
        - ``outcome``: how it ended.

        Over ``number``, the attractors: ``kind`` (equilibrium, periodic, aperiodic), ``period`` in section
        points, ``period_time``, ``mirror`` (the number of the mirror image, 0 where none was met), and an
        orbit: the components of the state at ``point``.

        Over ``ending``, the attractors and other outcomes: ``fraction`` of the initial states that end so, of
        those that were run, and ``fraction_error``.

        Over ``stride``: ``uncertain``, the fraction of pairs of initial states at this distance that end
        differently; ``uncertainty_exponent`` and ``uncertainty_exponent_error`` from it.

    Raises
    ------
    ModelError
        A component, value or option that cannot be used.
    UddError
        The extra ``scale`` is not installed.

    Interrupted
        On Ctrl-C, with the dataset as its ``partial``: what is not finished has the outcome "interrupted".

    Warns
    -----
    IncompleteWarning
        After Ctrl-C, where a partial result was asked for.
    ToleranceWarning
        A component falls below `atol` and grows again, and an error of `atol` changes what follows.

    See Also
    --------
    udd.bifurcation : attractors over a parameter.
    udd.sweep : grids too large for memory.
    udd.plot.basins : draw the basins.

    Notes
    -----
    Periodic orbits are identified by their section points, aperiodic attractors by overlapping point sets.
    At an equilibrium no eigenvalue has a positive real part, and the orbit comes nearer to it for several
    times the slowest decay. A slow transient is integrated until it converges. Aperiodic motions are
    integrated for twice the time, and again as long as some of them leave; those that still do so at
    `max_extension` are "undecided".

    The fractions' errors are those of a sample on a grid: binomial where neighbours have nothing in common,
    smaller where the basins are large. With f ~ distance^alpha, the basins' boundary has the dimension of the
    grid less alpha (Grebogi et al., Phys. Lett. A 99 (1983) 415 [23]). Initial states without an attractor or
    a final outcome are left out. The exponent is NaN where too few distances are small enough, as on a coarse
    grid. If the rates depend on time, every motion begins at time 0 again when it is followed further.

    Examples
    --------
    At w = 6.2 two asymmetric orbits, mirror images of each other, share the states between them.

    >>> import numpy as np
    >>> import udd
    >>> axis = np.linspace(-3, 3, 12)
    >>> basins = udd.basins(udd.DLE(6.2), {"omega": axis, "z": axis}, state0=[0, 0.5, 0], n=24)
    >>> basins["period"].values.tolist(), basins["mirror"].values.tolist()
    ([2, 2], [2, 1])
    """
    xarray = require_xarray()
    n, transient = whole("n", n, 12), whole("transient", transient, 0)
    chosen = with_defaults("basins", RUN_OPTIONS, options)
    extend = whole("max_extension", max_extension, 1)
    axes, starts = _starts(model, grid, state0)
    rows = parameter_rows(model, {}, 1)
    runner = section_runner(model, rows, section, direction, chosen, t_max, transient + n)
    coordinates, stopped = sized_by_motion(runner, rows[0], starts, transient, n)
    judge = MotionClassifier(model, None, coordinates, runner)
    samples = InitialStates(runner, AttractorCatalogue(judge), starts, n, extend * (transient + n))

    with progress_bar(len(starts), "start", chosen["progress"], title="basins") as bar:
        stopped = stopped or samples.run(transient, bar)
    told_of = {"n": n, "transient": transient, "max_extension": extend, "complete": int(not stopped)}
    attrs = of_result(runner, "basins of attraction", told_of)
    for k, name in enumerate(model.state_names):
        if name not in axes:
            attrs[f"start_{name}"] = float(starts[0, k])

    def made() -> xr.Dataset:
        data, coords = _arrays(samples, axes)
        dataset: xr.Dataset = xarray.Dataset(data, coords, {**attrs, "grid": " ".join(axes)})
        return dataset

    if stopped:
        left = int((samples.outcome == INTERRUPTED).sum())
        message = (
            f"{left} of {len(starts)} initial states are not finished: stopped by Ctrl-C"
            if left
            else "stopped by Ctrl-C before the aperiodic motions were followed further"
        )
        interrupted(made, message, chosen["partial"])
    return made()


def _starts(
    model: Model, grid: Mapping[str, ArrayLike], state0: ArrayLike | None
) -> tuple[dict[str, Floats], Floats]:
    """Return the axes of the grid, and its states (jobs, dim), the last axis first to vary."""
    if not isinstance(grid, Mapping) or not 1 <= len(grid) <= 3:
        raise ModelError("grid must name one to three components of the state with their values")
    if state0 is None and isinstance(model, Model) and set(model.state_names) <= set(grid):
        state0 = np.zeros(len(model.state_names))  # the grid says everything
    base = start_states(model, state0)
    if len(base) != 1:
        raise ModelError("state0 must be one state")
    for name in grid:
        if name not in model.state_names:
            raise ModelError(f"the state has no {name!r}; it has {', '.join(model.state_names)}")
    axes = {name: increasing(name, values) for name, values in grid.items()}
    sizes = [len(values) for values in axes.values()]
    cells = prod(sizes)
    # The states and the grid, and what is known of each.
    require_memory(f"{cells} initial states", cells, 2 * len(base[0]) + len(sizes) + 8, itemsize=8)
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    starts = np.tile(base[0], (mesh[0].size, 1))
    for name, values in zip(axes, mesh, strict=True):
        starts[:, model.state_names.index(name)] = values.ravel()
    return axes, starts


def _arrays(samples: InitialStates, axes: dict[str, Floats]) -> tuple[Variables, Variables]:
    """Return the arrays and the coordinates of the result."""
    model = samples.runner.model
    shape = tuple(len(values) for values in axes.values())
    attractors, number = samples.ranked()
    others = [k for k in range(1, len(ALL_OUTCOMES)) if k not in _NOT_RUN and (samples.outcome == k).any()]
    endings = [f"attractor {k + 1}" for k in range(len(attractors))] + [ALL_OUTCOMES[k] for k in others]
    ends = number - 1
    for place, k in enumerate(others):
        ends[samples.outcome == k] = len(attractors) + place
    run = np.where(np.isin(samples.outcome, _NOT_RUN), -1, ends).reshape(shape)
    final = np.where(np.isin(samples.outcome, [FINISHED, *_FINAL]), ends, -1).reshape(shape)
    share, error = basin_fractions(run, len(endings))
    fine = uncertainty(final)

    data: Variables = {
        "attractor": (tuple(axes), number.reshape(shape), {"long_name": "number of the attractor"}),
        "outcome": (tuple(axes), samples.outcome.astype(np.int8).reshape(shape), of_outcomes()),
        "fraction": ("ending", share, {"long_name": "fraction of the initial states", "units": "1"}),
        "fraction_error": ("ending", error, {"long_name": "its standard error", "units": "1"}),
        "uncertain": ("stride", fine.fraction, {"long_name": "fraction of pairs that end differently"}),
        "fitted": ("stride", fine.fitted.astype(np.int8), {"long_name": "whether the exponent is from it"}),
        "uncertainty_exponent": ((), fine.exponent, {"long_name": "exponent of uncertain over stride"}),
        "uncertainty_exponent_error": ((), fine.standard_error, {"long_name": "its standard error"}),
        **_table(samples, attractors),
    }
    coords: Variables = {
        **{name: (name, values, of_state(model, name, "at the start")) for name, values in axes.items()},
        "number": ("number", np.arange(1, len(attractors) + 1, dtype=np.int32)),
        "ending": ("ending", np.array(endings, dtype=str)),
        "stride": ("stride", fine.stride, {"long_name": "distance in steps of the grid"}),
    }
    return data, coords


def _table(samples: InitialStates, attractors: list[Attractor]) -> Variables:
    """Return the table of the attractors."""
    judge, model = samples.register.judge, samples.runner.model
    mirror = np.zeros(len(attractors), dtype=np.int32)
    for k in range(len(attractors)):
        images = mirror_images(attractors, k, judge.coordinates, judge.tight)
        mirror[k] = images[0] + 1 if images else 0
    longest = max((len(attractor.states) for attractor in attractors), default=0)
    orbits = np.full((len(attractors), longest, len(model.state_names)), np.nan)
    for k, attractor in enumerate(attractors):
        orbits[k, : len(attractor.states)] = attractor.states
    kind = of_flags("kind", KINDS)
    time = {"long_name": "duration of a period", "units": time_unit(model)}
    return {
        "kind": (
            "number",
            np.array([KINDS.index(attractor.kind) for attractor in attractors], dtype=np.int8),
            kind,
        ),
        "period": (
            "number",
            np.array([attractor.period for attractor in attractors], dtype=np.int32),
            {"long_name": "number of distinct section points, 0 where aperiodic"},
        ),
        "period_time": ("number", np.array([attractor.duration for attractor in attractors]), time),
        "mirror": ("number", mirror, {"long_name": "number of the mirror image, 0 where none was met"}),
        **{
            f"orbit_{name}": (("number", "point"), orbits[:, :, k], of_state(model, name, "on the orbit"))
            for k, name in enumerate(model.state_names)
        },
    }
