"""User-defined models in a fit: first guesses of states, and sizes from the record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from udd.errors import FitError
from udd.measurement import Measurement
from udd.models.formula_model import FormulaModel

from .observation_inverse import inverted

Array = NDArray[np.float64]

#: The assumed model error over a frame, from large to small, in units of the largest. For an observed state
#: the largest is a share of its noise, as for disk and pendulum, but at least a small share of its change
#: from frame to frame. For an unobserved state it is a larger share of that change.
_LEVELS = (1.0, 0.3, 0.06, 1e-2, 1e-3, 1e-4)
_OF_NOISE, _OF_CHANGE, _UNSEEN = 0.2, 0.02, 0.3
#: Samples of an input that may be missing at a measurement's ends; the nearest sample is used there.
_LATE = 2.0
_NOISIER = 0.9  # quantile over the frames that counts as a channel's noise
_SAMPLED = 50  # frames that show how noise enters the states


def slope(t: Array, x: Array, linked: NDArray[np.bool_]) -> Array:
    """Compute the rate of an observed column from neighbouring frames; zero if a frame has none."""
    rate = np.zeros(len(t))
    for run in np.split(np.arange(len(t)), np.flatnonzero(~linked) + 1):
        if len(run) > 1:
            rate[run] = np.gradient(x[run], t[run])
    return rate


def driven(
    models: Sequence[FormulaModel], measurements: Sequence[Measurement], origin: float | None = None
) -> tuple[FormulaModel, ...]:
    """Attach each measurement's inputs to its model, on a clock that starts at its first row.

    `origin` is another zero on the measurements' clock.

    Raises
    ------
    FitError
        A measurement lacks an input, or an input does not cover its rows.
    """
    records = []
    for model, measurement in zip(models, measurements, strict=True):
        signals = {}
        for name in model.inputs:
            if name not in measurement.inputs:
                names = ", ".join(measurement.inputs) or "none"
                raise FitError(f"the measurement lacks the model's input {name}; its inputs are: {names}")
            signal, (start, end) = measurement.inputs[name], measurement.t[[0, -1]].tolist()
            # A sample may come just after the row that it belongs to.
            slack = _LATE * float(np.median(np.diff(signal.t)))
            if lacks := signal.lacks(start, end, slack, "measurement"):
                raise FitError(f"the input {name} {lacks}")
            signals[name] = signal.shifted(-(start if origin is None else origin))
        records.append(signals)
    return tuple(model.with_inputs(*records, record=k) for k, model in enumerate(models))


def guessed(
    model: FormulaModel,
    t: Array,
    seen: Mapping[str, Array],
    linked: NDArray[np.bool_],
    state0: Mapping[str, float] | None,
    noise: Mapping[str, float],
) -> Array:
    """Guess all states: observed values, else the rate or the integral of an observed state, else zero.

    Hidden states with a start value follow their own equations from there, driven by the observed columns.
    Sensor readings are inverted first, each weighed by its `noise`.
    """
    state0 = state0 or {}
    if model.observe:
        first = np.array([state0.get(name, 0.0) for name in model.state_names])
        shown = inverted(model, t, dict(seen), dict(noise), first)
        seen = {name: shown.states[:, k] for k, name in enumerate(model.state_names) if shown.shown[k]}
    rates = {text.strip(): name for name, text in model.equations.items() if name in seen}
    columns = []
    for name in model.state_names:
        if name in seen:
            columns.append(seen[name])
        elif name in rates:
            columns.append(slope(t, seen[rates[name]], linked))
        elif (rate := model.equations[name].strip()) in seen:
            integral = cumulative_trapezoid(seen[rate], t, initial=0.0)
            columns.append(integral + state0[name] if name in state0 else integral - integral.mean())
        else:
            columns.append(np.zeros(len(t)))
    states = np.column_stack(columns)
    given = {name: value for name, value in state0.items() if name not in seen}
    given = given or _off_the_edge(model, t, states, seen)
    return _followed(model, t, states, given) if given else states


def _off_the_edge(
    model: FormulaModel, t: Array, states: Array, seen: Mapping[str, Array]
) -> dict[str, float]:
    """Return start values of hidden states with a law that is undefined or flat below zero.

    A tank's level is one. Each value is the typical size of the observations.
    """
    columns = [np.abs(column) for column in seen.values()]
    size = float(np.median(np.concatenate(columns))) if columns else 1.0
    hidden = [k for k, name in enumerate(model.state_names) if name not in seen and not states[:, k].any()]
    result = {}
    for k in hidden:
        aside = states[0] - 1e-3 * size * (np.arange(states.shape[1]) == k)
        beyond = model.rates(t[0], aside)
        if not np.isfinite(beyond).all() or (beyond == model.rates(t[0], states[0])).all():
            result[model.state_names[k]] = size
    return result


def _followed(model: FormulaModel, t: Array, states: Array, start: Mapping[str, float]) -> Array:
    """Let some states follow their own equations from a start, by Heun's method from frame to frame.

    If a state diverges it keeps its last value.
    """
    places = [model.state_names.index(name) for name in start]
    result = states.copy()
    now = result[0]
    now[places] = list(start.values())
    for k in range(len(t) - 1):
        dt, following = t[k + 1] - t[k], result[k + 1]
        rate = model.rates(t[k], now)[places]
        following[places] = now[places] + dt * rate
        moved = now[places] + 0.5 * dt * (rate + model.rates(t[k + 1], following)[places])
        following[places] = moved if np.isfinite(moved).all() else now[places]
        now = following
    return result


def checked_start(model: FormulaModel | None, state0: object) -> dict[str, float]:
    """Check the start values of states that a user gave, by the states' names.

    Raises
    ------
    FitError
        A value is not a finite number, or not for a state of a user's own model.
    """
    if model is None:
        raise FitError(
            "state0 is for a model of your own; a disk's and a pendulum's states are all observed: omit it"
        )
    if not isinstance(state0, Mapping):
        raise FitError(f"state0 must be a table of start values by state, not {state0!r:.80}")
    result = {}
    for name, value in state0.items():
        if name not in model.state_names:
            raise FitError(f"state0 has {name!r}, but the states are {', '.join(model.state_names)}")
        if (
            isinstance(value, bool)
            or not isinstance(value, (int, float, np.integer))
            or not np.isfinite(value)
        ):
            raise FitError(f"the start value of {name} must be a finite number, not {value!r}")
        result[str(name)] = float(value)
    return result


def levels_of(
    model: FormulaModel, t: Array, states: Array, sigma: Array, linked: NDArray[np.bool_]
) -> tuple[tuple[float, ...], ...]:
    """Return the assumed model errors, large to small, per square root of the unit of time.

    Parameters
    ----------
    model : FormulaModel
    t, states : ndarray (n,), (n, d)
        First guess of the states, with its times.
    sigma : ndarray (n, c)
        Noise of the observations, for each channel of the model. It is infinite if not observed.
    linked : ndarray of bool (n - 1,)
        True if the model leads from a frame to the next.
    """
    dt = np.diff(t)[linked]
    step = float(np.median(dt)) if len(dt) else 1.0
    change = np.sqrt((np.diff(states, axis=0)[linked] ** 2).sum(axis=0) / max(len(dt), 1))
    # An unknown state changes as the model says.
    rates = np.median(np.abs(model.rates(t, states)), axis=0) * step
    change = np.where(change > 0, change, rates)
    change = np.where(change > 0, change, float(change.max()) or 1.0)
    noise = state_noise(model, t, states, sigma)
    seen = np.isfinite(noise)
    # With a larger model error an observed state would follow every frame.
    loosest = np.where(seen, np.clip(_OF_NOISE * noise, _OF_CHANGE * change, change), _UNSEEN * change)
    return tuple(tuple((level * loosest / np.sqrt(step)).tolist()) for level in _LEVELS)


def state_noise(model: FormulaModel, t: Array, states: Array, sigma: Array) -> Array:
    """Return the noise of each state as sensors show it, (d,); infinite if they do not show it."""
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(sigma).any(axis=0))
    typical = np.full(len(seen), np.inf)
    for k in np.flatnonzero(seen):
        typical[k] = np.quantile(sigma[np.isfinite(sigma[:, k]), k], _NOISIER)
    if not model.observe:
        return typical
    frames = np.linspace(0, len(t) - 1, _SAMPLED).astype(int)
    names = [name for name, there in zip(model.channels, seen, strict=True) if there]
    values = dict(zip(names, model.observed(t[frames], states[frames])[:, seen].T, strict=True))
    noise = dict(zip(names, typical[seen].tolist(), strict=True))
    result = inverted(model, t[frames], values, noise, states[0])
    spread = np.sqrt(np.median((result.slopes**2 @ typical[seen] ** 2), axis=0))
    return np.where(result.shown, spread, np.inf)
