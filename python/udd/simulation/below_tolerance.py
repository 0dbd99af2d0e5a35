"""Components that fall below `atol` and grow again: runs lose them without a large error of any step."""

from __future__ import annotations

import math
import warnings
from functools import cache

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.errors import StiffnessWarning, ToleranceWarning, UddError, outside
from udd.models import Model

__all__ = ["growing_components", "warn_from", "warn_of", "warn_of_some"]

_Floats = NDArray[np.float64]

_RETURNS = 1e4  # times atol, and
_LARGE = 1e-3  # of its largest value: a component above both matters again
_CHANGES = 0.01  # relative change of a component that shows
_SAMPLES = 2001
_ORBITS = 8  # of many are looked at
_FEW = 200  # a run with fewer states is looked at again


def growing_components(model: Model, size: _Floats, t: float = 0.0) -> NDArray[np.intp]:
    """Return the components whose rates are proportional to them, as that of a population is.

    Only these grow again from below `atol` as from any other size. `size` (dim,) is how large they are.
    """
    if not model.profile.written or model.inputs:
        return np.zeros(0, dtype=np.intp)
    probes = np.where(size > 0.0, size, 1.0) * _parts(len(size))
    return np.array(_core.growing_components(model, t, probes.ravel()), dtype=np.intp)


@cache
def _parts(count: int) -> _Floats:
    return np.random.default_rng(5).uniform(0.1, 1.0, (4, count))


def warn_from(model: Model, start: _Floats, begin: float, span: float, rtol: float, atol: float) -> bool:
    """Warn if a component of the run from a state (dim,) falls below `atol` and matters again.

    Return True after a warning.
    """
    if not len(growing_components(model, np.abs(start), begin)) or not math.isfinite(span) or span <= 0.0:
        return False
    times = np.linspace(begin, begin + span, _SAMPLES)
    try:
        run = _states(model, times, start, rtol, atol)
    except UddError:
        return False
    return warn_along(model, run["t"], run["state"], rtol, atol)


def warn_of_some(
    model: Model,
    rows: _Floats,
    starts: _Floats,
    spans: _Floats | float,
    rtol: float,
    atol: float,
    begin: float = 0.0,
) -> None:
    """Warn as :func:`warn_from` of some orbits, with parameters (n or 1, p) and states (n or 1, dim)."""
    fine = np.isfinite(starts).all(axis=-1)
    if not len(growing_components(model, np.abs(starts[fine]).max(axis=0, initial=0.0))):
        return
    count = max(len(rows), len(starts))
    each = np.broadcast_to(spans, count)
    for job in np.unique(np.linspace(0, count - 1, min(_ORBITS, count)).astype(int)).tolist():
        start = starts[job if len(starts) > 1 else 0]
        if not np.isfinite(start).all():
            continue
        values = rows[job if len(rows) > 1 else 0].tolist()
        varied = model.with_parameters(dict(zip(model.parameters, values, strict=True)))
        if warn_from(varied, start, begin, float(each[job]), rtol, atol):
            return


def warn_of(model: Model, times: _Floats, states: _Floats, rtol: float, atol: float) -> None:
    """Warn as :func:`warn_along` of a run's states (n, dim), which may be too few to show it."""
    if len(times) >= _FEW:
        warn_along(model, times, states, rtol, atol)
    elif len(times) > 1:
        warn_from(model, states[0], float(times[0]), float(times[-1] - times[0]), rtol, atol)


def warn_along(model: Model, times: _Floats, states: _Floats, rtol: float, atol: float) -> bool:
    """Warn if a component of states (n, dim) of a run falls below `atol` and matters again.

    Return True after a warning.
    """
    if len(times) < 2 or not np.isfinite(states).all():
        return False
    sizes = np.abs(states)
    for k in growing_components(model, sizes.max(axis=0), float(times[0])).tolist():
        back = max(_RETURNS * atol, _LARGE * float(sizes[:, k].max()))
        below = np.flatnonzero((sizes[:, k] < atol / _CHANGES) & (sizes[:, k] > 0.0))
        large = np.flatnonzero(sizes[:, k] > back)
        returns = below[np.searchsorted(large, below) < len(large)]
        if not len(returns):
            continue
        least = int(returns[np.argmin(sizes[returns, k])])
        later = int(large[np.searchsorted(large, least)])
        if _matters(model, k, times[[least, later]], states[least], rtol, atol):
            falls = (
                f"{model.state_names[k]} falls to {sizes[least, k]:.2g} at atol = {atol:g} and grows again"
            )
            message = (
                f"{falls}: its error there changes what follows. Use a much smaller atol, such as 1e-40, or "
                "its logarithm as the state."
            )
            warnings.warn(ToleranceWarning(message), stacklevel=outside())
            return True
    return False


def _states(model: Model, times: _Floats, start: _Floats, rtol: float, atol: float) -> _core._Run:
    """Return states of a run by the method that sections and exponents use."""
    method = "taylor" if _core.has_series(model) else "dop853"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StiffnessWarning)
        return _core.simulate(model, times, math.nan, start.tolist(), rtol, atol, math.inf, method, False)


def _matters(model: Model, k: int, times: _Floats, state: _Floats, rtol: float, atol: float) -> bool:
    """Return True if an error of `atol` in component `k` changes it after it has grown again."""
    fine = 1e-6 * float(np.abs(state[k]))
    moved = state.copy()
    moved[k] += math.copysign(atol, state[k])
    try:
        ends = [_states(model, times, one, rtol, fine)["state"][-1, k] for one in (state, moved)]
    except UddError:
        return False
    return bool(abs(ends[1] - ends[0]) > _CHANGES * abs(ends[0]))
