"""One model from many states, or with many values of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.labelled import axes, of_states
from udd._util.progress import progress_bar, thread_count
from udd.errors import ModelError, interrupted
from udd.models import Model, require_model
from udd.models.parameter_batch import orbits_of

from .batch import Batch
from .below_tolerance import warn_of_some
from .model_inputs import driven
from .outcomes import OUTCOMES
from .trajectory import checked_times, longest_step, method_for, tolerances

if TYPE_CHECKING:
    import xarray as xr

    from udd.measurement import InputSignal

__all__ = ["Ensemble", "ensemble"]


@dataclass(frozen=True, eq=False)
class Ensemble(Drawable):
    """Runs of one model at common times.

    Attributes
    ----------
    t : ndarray, shape (times,)
        Times, in s (dimensionless for the DLE).
    state : ndarray, shape (..., times, dim)
        States, in the order of ``model.state_names``; NaN after a run's end.
    outcome : ndarray of str, shape (...)
        Outcome of each run. It is ``"finished"``, ``"ejected"`` (the disk left the wheels), ``"failed"`` (the
        solution blew up), ``"chattering"`` or ``"interrupted"``.
    end : ndarray, shape (..., dim)
        Last state of each run. It is given for runs that end early, too.
    t_end : ndarray, shape (...)
        Time of the last state.
    model : Model
        The model of the runs, before parameters were varied.

    See Also
    --------
    udd.ensemble : makes it.
    udd.plot.ensemble : draw the runs.
    """

    t: NDArray[np.float64]
    state: NDArray[np.float64]
    outcome: NDArray[Any]
    end: NDArray[np.float64]
    t_end: NDArray[np.float64]
    model: Model

    def to_xarray(self) -> xr.Dataset:
        """Return labelled arrays: every state over the runs' axes and ``t``, with its unit.

        Returns
        -------
        xarray.Dataset
            With each run's ``outcome``.

        Examples
        --------
        >>> import udd
        >>> many = udd.ensemble(udd.DLE(5.0), [0.0, 0.1], [[1, 1, 0], [2, 1, 0]])
        >>> dict(many.to_xarray().sizes)
        {'run': 2, 't': 2}
        """
        model, runs = self.model, axes(self.outcome.shape, "run")
        dims, coords, of_model = [*runs, "t"], {"t": self.t}, repr(model)
        dataset = of_states(model.state_names, model.state_units, self.state, dims, coords, model=of_model)
        return dataset.assign(outcome=(runs, np.asarray(self.outcome)))

    def __repr__(self) -> str:
        return f"<Ensemble of {self.model!r}: runs {self.outcome.shape}, {len(self.t)} times>"


@checked_arguments
def ensemble(
    model: Model,
    t: ArrayLike,
    state0: ArrayLike | None = None,
    *,
    parameters: Mapping[str, ArrayLike] | None = None,
    rtol: float = 1e-9,
    atol: float = 1e-12,
    max_step: float | None = None,
    method: str = "auto",
    threads: int | None = None,
    progress: bool | Callable[[str], object] | None = None,
    partial: bool = False,
    inputs: Mapping[str, InputSignal | ArrayLike] | None = None,
) -> Ensemble:
    """Run a model from many states, or with many values of its parameters, on all cores.

    Parameters
    ----------
    model : Model
    t : array_like, shape (times,), or float
        Increasing times of the states. The first is the initial time. A number is the end of runs from 0, and
        only the last states are returned.
    state0 : array_like, shape (..., dim), optional
        Initial states. Their leading axes are those of the result.
    parameters : mapping of str to array_like, optional
        Other values of some of the model's parameters. Their shapes broadcast with each other and with the
        leading axes of `state0`. The result has these axes.
    rtol, atol, max_step : float
        As for :func:`udd.simulate`.
    method : {"auto", "taylor", "dopri5", "dop853"}
        As for :func:`udd.simulate`; ``"auto"`` is the fastest at equal error.
    threads : int, optional
        How many threads to use, by default one per core. No bit of the result depends on it.
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. By default a
        bar shows after 2 s in a terminal or a notebook.
    partial : bool
        If True, Ctrl-C returns the finished runs with a warning, instead of raising an exception.
    inputs
        As for :func:`udd.simulate`.

    Returns
    -------
    Ensemble
        Runs that end early say why; they raise nothing.

    Raises
    ------
    ModelError
        Times, states or parameters that cannot be used.

    Interrupted
        On Ctrl-C, with the ensemble as its ``partial``: the runs that are not finished are NaN.
    MemoryError
        There is no room for so many states.

    Warns
    -----
    IncompleteWarning
        Ctrl-C, where a partial result was asked for.
    ToleranceWarning
        A component falls below `atol` and grows again, and an error of `atol` changes what follows; some of
        the runs are checked.

    See Also
    --------
    udd.simulate : one run, with events.
    udd.sweep : grids too large for memory.
    udd.plot.ensemble : draw the runs.

    Examples
    --------
    Ten thousand orbits spread over the attractor, on which <omega^2> = w:

    >>> import numpy as np
    >>> import udd
    >>> starts = np.random.default_rng(1).normal(size=(10_000, 3))
    >>> end = udd.ensemble(udd.DLE(1.0), 50.0, starts, rtol=1e-6).end
    >>> bool(abs((end[:, 0] ** 2).mean() - 1.0) < 0.03)
    True
    """
    rtol, atol = tolerances(rtol, atol)
    times, wanted = checked_times(t), slice(None)
    longest = longest_step(max_step, times if isinstance(times, float) else float(np.ptp(times)))
    if isinstance(times, float):  # of the way there only the end is kept
        times, wanted = np.array([0.0, times] if times else [0.0]), slice(-1, None)
    require_model(model)
    model = driven(model, times, inputs)
    shape, rows, starts = orbits_of(model, parameters or {}, state0)
    runs = max(len(rows), len(starts))
    stepper = method_for(model, method, rtol)
    if stepper == "rodas":
        raise ModelError('method="rodas" is for single runs, by udd.simulate')
    with progress_bar(runs, "run", progress) as bar:
        batch = Batch(model, rows, starts, rtol, atol, thread_count(threads), bar.since(), longest)
        raw = _core.ensemble(batch, times, stepper)
    names = np.array(OUTCOMES)[raw["outcome"]]
    states = raw["states"][:, wanted]
    made = Ensemble(
        times[wanted],
        states.reshape(*shape, *states.shape[1:]),
        names.reshape(shape),
        raw["end"].reshape(*shape, -1),
        raw["t_end"].reshape(shape),
        model,
    )
    stopped = int((names == "interrupted").sum())
    if stopped:
        interrupted(lambda: made, f"{stopped} of {runs} runs were interrupted and are NaN", partial)
    else:
        span = float(times[-1] - times[0])
        warn_of_some(model, rows, starts, span, rtol, atol, float(times[0]))
    return made
