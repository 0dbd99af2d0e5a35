"""The largest Lyapunov exponent."""

from __future__ import annotations

import warnings
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._validate import array, number
from udd.errors import ConvergenceWarning, ModelError
from udd.models import DLE, Disk, Model
from udd.trajectory import initial_state, tolerances

__all__ = ["ConvergenceWarning", "lyapunov"]


@overload
def lyapunov(
    w: float | Model,
    *,
    t: float | None = None,
    tol: float | None = None,
    transient: float | None = None,
    state0: ArrayLike | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    with_error: Literal[False] = False,
) -> float: ...


@overload
def lyapunov(
    w: ArrayLike,
    *,
    t: float | None = None,
    tol: float | None = None,
    transient: float | None = None,
    state0: ArrayLike | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    with_error: Literal[False] = False,
) -> NDArray[np.float64]: ...


@overload
def lyapunov(
    w: float | Model,
    *,
    t: float | None = None,
    tol: float | None = None,
    transient: float | None = None,
    state0: ArrayLike | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    with_error: Literal[True],
) -> tuple[float, float]: ...


@overload
def lyapunov(
    w: ArrayLike,
    *,
    t: float | None = None,
    tol: float | None = None,
    transient: float | None = None,
    state0: ArrayLike | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    with_error: Literal[True],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...


def lyapunov(
    w: ArrayLike | Model,
    *,
    t: float | None = None,
    tol: float | None = None,
    transient: float | None = None,
    state0: ArrayLike | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    with_error: bool = False,
) -> float | NDArray[np.float64] | tuple[float, float] | tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The largest Lyapunov exponent: the mean rate at which neighbouring orbits part.

    Parameters
    ----------
    w : float, array_like or Model
        Drive of the undamped diffusionless Lorenz equations, or any model. Arrays of any shape are spread
        over all cores.
    t : float, optional
        Time to run at most; by default 1e5, or 25000 s for a model with units.
    tol : float, optional
        The run ends once the standard error is down to this; by default 2e-3 per unit of time, or 8e-3 /s.
    transient : float, optional
        Time at the start that is left out in any case, by default 400, or 100 s (less for a short `t`).
        Should the first half of what follows disagree with the second, it is left out too.
    state0 : array_like, shape (dim,), optional
        Initial state. Where several attractors coexist it decides between them.
    rtol, atol : float
        Tolerances of the run.
    with_error : bool
        Whether to return the standard error too.

    Returns
    -------
    exponent : float, or ndarray of the shape of `w`
        Per unit of time (1/s for a model with units).
    standard_error : float or ndarray
        Where `with_error` is set: from the scatter of the means over blocks of the run.

    Raises
    ------
    ModelError
        A drive or an option that cannot be used.
    IntegrationError
        The disk leaves the wheels (use ``edge="ignore"``), or the solution blows up.
    KeyboardInterrupt
        On Ctrl-C, at once.

    Warns
    -----
    ConvergenceWarning
        Where the standard error does not meet `tol` after the time `t`.

    Notes
    -----
    The tangent vector is the derivative part of a run over dual numbers, scaled back after every block
    (Benettin et al., Meccanica 15 (1980) 9). The exponent is that of the orbit from `state0`: a transient
    longer than `t`, as near w = 4.5, is not seen as one.

    Examples
    --------
    >>> import udd
    >>> value, error = udd.lyapunov(1.0, tol=5e-3, with_error=True)
    >>> abs(value - 0.21016) < 4 * error
    True
    """
    if isinstance(w, Model):
        model, values = w, np.array([next(iter(w.parameters.values()))])
        shape: tuple[int, ...] = ()
    else:
        drives = array("w", w)
        if (drives < 0).any():
            raise ModelError(f"w must not be negative, not {drives[drives < 0].flat[0]:g}")
        model, values, shape = DLE(1.0), drives.ravel(), drives.shape
    slow = 1.0 if isinstance(model, DLE) else 0.25  # the disk's unit of time is 0.27 s
    time = number("t", 1e5 * slow if t is None else t, above=0.0)
    goal = number("tol", 2e-3 / slow if tol is None else tol, above=0.0)
    skipped = number(
        "transient", min(400.0 * slow, 0.1 * time) if transient is None else transient, least=0.0
    )
    if skipped >= time:
        raise ModelError(f"transient must be below t = {time:g}, not {skipped:g}")
    rtol, atol = tolerances(rtol, atol)
    start = initial_state(model, _start(model) if state0 is None else state0)

    found = _core.lyapunov(model, 0, values, start.tolist(), time, skipped, goal, rtol, atol)
    exponents, errors = found[0].reshape(shape), found[1].reshape(shape)
    missed = errors[~found[2].reshape(shape)]
    if missed.size:
        which = "the exponent has" if shape == () else f"{missed.size} of {errors.size} exponents have"
        warnings.warn(
            f"{which} a standard error up to {missed.max():.2g}, above tol = {goal:g}; "
            f"a longer t (now {time:g}) would help",
            ConvergenceWarning,
            stacklevel=2,
        )
    if shape == ():
        return (float(exponents), float(errors)) if with_error else float(exponents)
    return (exponents, errors) if with_error else exponents


def _start(model: Model) -> list[float]:
    """An initial state from which orbits reach the main attractor."""
    if isinstance(model, DLE):
        return [1.0, 1.0, 0.01]
    if isinstance(model, Disk):
        # The same state in the disk's units, for the paper's constants.
        return [3.75, 0.0046, 5e-5, 0.0]
    return [0.0, 1.0]
