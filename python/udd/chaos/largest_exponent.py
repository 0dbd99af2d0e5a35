"""The largest Lyapunov exponent, by the variational equations."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import Any, Literal, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.progress import progress_bar, thread_count
from udd._util.validation import number
from udd.errors import ConvergenceWarning, IntegrationError, ModelError, outside
from udd.models import DLE, Model
from udd.models.parameter_batch import default_state, parameter_batch
from udd.simulation.batch import Batch
from udd.simulation.below_tolerance import warn_of_some
from udd.simulation.outcomes import FINISHED, OUTCOMES
from udd.simulation.trajectory import initial_state, longest_step, tolerances

__all__ = ["ConvergenceWarning", "lyapunov"]


class _Options(TypedDict, total=False):
    t: float | None
    tol: float | None
    transient: float | None
    state0: ArrayLike | None
    rtol: float
    atol: float
    max_step: float | None
    threads: int | None
    progress: bool | None


@overload
def lyapunov(
    w: float | Model, *, with_error: Literal[False] = False, **options: Unpack[_Options]
) -> float: ...


@overload
def lyapunov(
    w: ArrayLike, *, with_error: Literal[False] = False, **options: Unpack[_Options]
) -> NDArray[np.float64]: ...


@overload
def lyapunov(
    w: float | Model, *, with_error: Literal[True], **options: Unpack[_Options]
) -> tuple[float, float]: ...


@overload
def lyapunov(
    w: ArrayLike, *, with_error: Literal[True], **options: Unpack[_Options]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...


@overload
def lyapunov(
    w: ArrayLike | Model,
    *,
    parameters: Mapping[str, ArrayLike] | None,
    with_error: bool = False,
    **options: Unpack[_Options],
) -> Any: ...


@checked_arguments
def lyapunov(
    w: ArrayLike | Model,
    *,
    parameters: Mapping[str, ArrayLike] | None = None,
    t: float | None = None,
    tol: float | None = None,
    transient: float | None = None,
    state0: ArrayLike | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    max_step: float | None = None,
    threads: int | None = None,
    progress: bool | Callable[[str], object] | None = None,
    with_error: bool = False,
) -> Any:
    """Compute the largest Lyapunov exponent: the mean rate at which neighbouring orbits separate.

    Parameters
    ----------
    w : float, array_like or Model
        Drive of the undamped diffusionless Lorenz equations, or any model. Arrays of any shape are spread
        over all cores.
    parameters : mapping of str to array_like, optional
        Other values of some of the model's parameters. Their shapes broadcast with each other and with `w`.
        The result has the common shape.
    t : float, optional
        Longest time of the run. The default is 1e5, or 25000 s for a model with units.
    tol : float, optional
        The run ends when the standard error is below this. The default is 2e-3 per unit of time, or 8e-3 /s.
    transient : float, optional
        Time at the start that is left out in any case, by default 400, or 100 s (less for a short `t`).
        Should the first half of what follows disagree with the second, it is left out too.
    state0 : array_like, shape (dim,), optional
        Initial state. If several attractors coexist, it decides between them.
    rtol, atol : float
        Relative and absolute tolerance of the run. See :func:`udd.simulate`.
    max_step : float, optional
        The longest step, as for :func:`udd.simulate`.
    threads : int, optional
        Number of threads. By default there is one per core, and no bit of the result depends on it.
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. By default a
        bar shows after 2 s in a terminal or a notebook.
    with_error : bool
        If True, return the standard error too.

    Returns
    -------
    exponent : float, or ndarray of the shape of `w` and the `parameters`
        Rate per unit of time. The unit is 1/s for a model with units.
    standard_error : float or ndarray
        Only if `with_error` is set. It follows from the scatter of the means over blocks of the run. Blocks
        of a short run are hardly longer than the memory of the motion. Then the error is too large: by a half
        at t = 3000 and w = 1.

    Raises
    ------
    ModelError
        A drive or an option that cannot be used.
    IntegrationError
        The disk leaves the wheels (use ``edge="ignore"``), or the solution blows up. In an array such an
        exponent is NaN, with a warning.
    KeyboardInterrupt
        On Ctrl-C, at once.

    Warns
    -----
    ConvergenceWarning
        Where the standard error does not meet `tol` after the time `t`, or an orbit of an array has no
        exponent.
    ToleranceWarning
        A component falls below `atol` and grows again, and an error of `atol` changes what follows; some of
        many orbits are checked.

    See Also
    --------
    udd.lyapunov_spectrum : all exponents and a verdict.
    udd.sweep : grids too large for memory.
    udd.plot.exponents : draw exponents over a parameter.

    Notes
    -----
    The tangent vector is the derivative part of a run over dual numbers, kept at length 1
    (Benettin et al., Meccanica 15 (1980) 9 [20]). The Taylor method advances many orbits at once. The
    exponent is that of the orbit from `state0`: a transient longer than `t`, as near w = 4.5, is not seen as
    one. See :func:`udd.lyapunov_spectrum` for a verdict. Drives are taken in portions, so that memory hardly
    grows beyond the result.

    Examples
    --------
    >>> import udd
    >>> value, error = udd.lyapunov(1.0, tol=5e-3, with_error=True)
    >>> abs(value - 0.21016) < 4 * error
    True

    With damping, and of a model with units:

    >>> udd.lyapunov([1.0, 2.0, 3.0], parameters={"B": 0.2}, tol=0.02).shape
    (3,)
    >>> disk = udd.Disk(0.05, edge="ignore")
    >>> udd.lyapunov(disk, parameters={"W": [0.055, 0.06], "k0": [[0.012], [0.013]]}, tol=0.2).shape
    (2, 2)
    """
    model, swept = (w, {}) if isinstance(w, Model) else (DLE(1.0), {"w": w})
    for name in swept.keys() & (parameters or {}).keys():
        raise ModelError(f"{name} is given twice, also among the parameters")
    orbits = parameter_batch(model, {**swept, **(parameters or {})})
    n, shape = len(orbits), orbits.shape
    for drives in (orbits.values[name] for name in swept if n):
        DLE(float(drives.min()))  # refuses what is negative
    time_scale = model.time_scale
    time, skipped = span(t, transient, longest=1e5 * time_scale, skip=400.0 * time_scale)
    goal = number("tol", 2e-3 / time_scale if tol is None else tol, above=0.0)
    rtol, atol = tolerances(rtol, atol)
    longest = longest_step(max_step, time)
    start = initial_state(model, default_state(model) if state0 is None else state0)
    workers = thread_count(threads)

    exponents, errors = np.empty(n), np.empty(n if with_error else 0)
    missed, worst = 0, 0.0
    outcomes: list[int] = []
    with progress_bar(n, "exponent", progress) as bar:
        for first in range(0, n, PORTION):
            part = slice(first, min(first + PORTION, n))
            rows = orbits.rows(part)
            batch = Batch(model, rows, start[None, :], rtol, atol, workers, bar.since(first), longest)
            raw = _core.lyapunov(batch, False, time, skipped, goal)
            if first == 0:
                warn_of_some(model, rows, raw["end"], min(time, LOOK * time_scale), rtol, atol)
            done = raw["outcome"] == FINISHED
            exponents[part] = np.where(done, raw["value"][:, 0], np.nan)
            if with_error:
                errors[part] = np.where(done, raw["standard_error"][:, 0], np.nan)
            error = np.nan_to_num(raw["standard_error"][:, 0], nan=np.inf)  # too short for blocks
            short = done & (error > goal)
            if short.any():
                missed += int(short.sum())
                worst = max(worst, float(error[short].max()))
            if not done.all():
                outcomes += raw["outcome"][~done].tolist()
    if outcomes:
        _tell(outcomes, n, shape == (), raw["failure"])
    if missed:
        which = "the exponent has" if shape == () else f"{missed} of {n} exponents have"
        warnings.warn(
            f"{which} a standard error up to {worst:.2g}, above tol = {goal:g}; "
            f"a longer t (now {time:g}) would help",
            ConvergenceWarning,
            stacklevel=outside(),
        )
    if shape == ():
        return (float(exponents[0]), float(errors[0])) if with_error else float(exponents[0])
    exponents = exponents.reshape(shape)
    return (exponents, errors.reshape(shape)) if with_error else exponents


LOOK = 2000.0
"""So many typical times an orbit is checked for components below `atol`."""

PORTION = 1 << 10
"""So many orbits are handed to the core at a time."""


def _tell(outcomes: list[int], n: int, single: bool, failure: str | None) -> None:
    """Says what became of the orbits that have no exponent."""
    counts = {OUTCOMES[code]: outcomes.count(code) for code in sorted(set(outcomes))}
    if single:
        (outcome,) = counts
        raise IntegrationError(f"there is no exponent: {reason(outcome, failure)}")
    list_ = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    warnings.warn(
        f"{len(outcomes)} of {n} orbits have no exponent ({list_}) and are NaN",
        ConvergenceWarning,
        stacklevel=outside(),
    )


def reason(outcome: str, failure: str | None) -> str:
    """Return the reason why a run with this failure has no exponents."""
    reasons = {
        "ejected": 'the disk left the wheels; use edge="ignore" for the exponents of the equations',
        "failed": failure or "the solution blew up",
    }
    return reasons.get(outcome, outcome)


def span(t: float | None, transient: float | None, *, longest: float, skip: float) -> tuple[float, float]:
    """Return the checked time of the run and the part of it that is left out at the start."""
    time = number("t", longest if t is None else t, above=0.0)
    skipped = number("transient", min(skip, 0.1 * time) if transient is None else transient, least=0.0)
    if skipped >= time:
        raise ModelError(f"transient must be below t = {time:g}, not {skipped:g}")
    return time, skipped
