"""The assumed model error of a fit, from loose to tight, in sizes that the record shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from udd.models import Model
from udd.models.formula_model import FormulaModel

from .observation_inverse import inverted
from .record import Record

Array = NDArray[np.float64]

#: The model error over a frame, from loose to tight, in units of the loosest. The loosest is a share of the
#: noise of an observed state, but at least a small share of the state's change from frame to frame. For an
#: unobserved state it is a larger share of this change.
_LEVELS = (1.0, 0.3, 0.06, 1e-2, 1e-3, 1e-4)
_OF_NOISE, _OF_CHANGE, _UNSEEN = 0.2, 0.02, 0.3
#: The levels beyond, in units of the last one: there the standard errors no longer depend on the level.
_NEGLIGIBLE = (0.1, 1e-2)
_NOISIER = 0.9  # quantile of the frames' noise that counts as a channel's noise
_SAMPLED = 50  # frames that show how noise enters the states


def model_error_levels(model: Model, record: Record) -> tuple[tuple[float, ...], ...]:
    """Return the assumed model errors, loose to tight, per square root of the unit of time.

    A compiled model and the same law as text get the same levels.

    Parameters
    ----------
    model : Model
    record : Record
        Its states are a first guess.
    """
    loosest = _loosest(model, record)
    return tuple(tuple((level * loosest).tolist()) for level in _LEVELS)


def negligible_levels(schedule: Sequence[tuple[float, ...]]) -> tuple[tuple[float, ...], ...]:
    """Return model errors below the tightest of a schedule."""
    return tuple(tuple((factor * np.array(schedule[-1])).tolist()) for factor in _NEGLIGIBLE)


def _loosest(model: Model, record: Record) -> Array:
    t, states, linked = record.t, record.states, record.linked
    dt = np.diff(t)[linked]
    step = float(np.median(dt)) if len(dt) else 1.0
    change = np.sqrt((np.diff(states, axis=0)[linked] ** 2).sum(axis=0) / max(len(dt), 1))
    # A state of which nothing is known moves as the model says.
    rates = np.median(np.abs(model.rates(t, states)), axis=0) * step
    change = np.where(change > 0, change, rates)
    change = np.where(change > 0, change, float(change.max()) or 1.0)
    noise = state_noise(model, record)
    seen = np.isfinite(noise)
    # With an error as large as its noise an observed state would follow every frame.
    loosest = np.where(seen, np.clip(_OF_NOISE * noise, _OF_CHANGE * change, change), _UNSEEN * change)
    result: Array = loosest / np.sqrt(step)
    return result


def state_noise(model: Model, record: Record) -> Array:
    """Return the noise of each state as sensors show it, (d,); infinite for a state that they do not show."""
    t, states, sigma = record.t, record.states, record.sigma
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(sigma).any(axis=0))
    typical = np.full(len(seen), np.inf)
    for k in np.flatnonzero(seen):
        typical[k] = np.quantile(sigma[np.isfinite(sigma[:, k]), k], _NOISIER)
    if not isinstance(model, FormulaModel):
        columns = dict(zip(model.profile.sensor.columns, typical.tolist(), strict=True))
        return np.array([columns.get(name, np.inf) for name in model.state_names])
    if not model.observe:
        return typical
    frames = np.linspace(0, len(t) - 1, _SAMPLED).astype(int)
    names = [name for name, there in zip(model.channels, seen, strict=True) if there]
    values = dict(zip(names, model.observed(t[frames], states[frames])[:, seen].T, strict=True))
    noise = dict(zip(names, typical[seen].tolist(), strict=True))
    result = inverted(model, t[frames], values, noise, states[0])
    spread = np.sqrt(np.median((result.slopes**2 @ typical[seen] ** 2), axis=0))
    return np.where(result.shown, spread, np.inf)
