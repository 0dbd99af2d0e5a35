"""Frequencies at which a system swings by itself, and the mains': no drive is told from either."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from udd.fitting import Fit
from udd.models import Model

Array = NDArray[np.float64]

_HARMONICS = 5
_MAINS = (50.0, 60.0)  # Hz, which a sensor hears
_WANDERS = 0.004  # share of it by which the mains' frequency may be off
_SLOWEST = 0.5  # Hz, below which hum that is sampled too slowly is no wave but a drift
_LINES = 1.0  # of the record, 1/s over its length, within which two frequencies are one
_NEAR = 0.2  # share of a mode's frequency within which the motion's own line is that mode
_STEP = 1e-5  # of each state's size, for the rates' slopes


def modes(model: Model, t: Array, states: Array) -> Array:
    """Frequencies of a model's modes, linearised around the mean of a motion, and of their lines in it.

    Parameters
    ----------
    model : Model
    t, states : ndarray (n,), (n, d)
        Evenly spaced.

    Returns
    -------
    ndarray (k,)
        Cycles per unit of time. Of a mode that the motion shows as a line beside its linear frequency, as a
        swing of large amplitude does, both are among them.

    Examples
    --------
    >>> import numpy as np, udd
    >>> from udd.discovery.scoring.natural_modes import modes
    >>> t = np.arange(0, 50, 0.05)
    >>> swing = udd.Model(["x", "v"], ["v", "-k*x"], {"k": 4 * np.pi**2})
    >>> modes(swing, t, udd.simulate(swing, t, [1.0, 0.0]).state).round(2)
    array([1.])
    """
    middle = states.mean(axis=0)
    size = np.maximum(np.ptp(states, axis=0), 1e-300)
    moved = middle + np.concatenate([np.diag(_STEP * size), -np.diag(_STEP * size)])
    rates = model.rates(np.full(len(moved), float(t.mean())), moved)
    d = len(middle)
    slopes = (rates[:d] - rates[d:]).T / (2 * _STEP * size)
    if not np.isfinite(slopes).all():
        return np.zeros(0)
    turning = np.linalg.eigvals(slopes).imag / (2 * np.pi)
    linear = np.unique(turning[turning > 0.5 / np.ptp(t)].round(9))
    frequencies = np.fft.rfftfreq(4 * len(t), (t[-1] - t[0]) / (len(t) - 1))
    window = np.hanning(len(t))[:, None]
    power = (np.abs(np.fft.rfft((states - middle) * window / size, 4 * len(t), axis=0)) ** 2).sum(axis=1)
    found = list(linear)
    for f in linear:
        near = np.flatnonzero(np.abs(frequencies - f) < _NEAR * f)
        if len(near):
            peak = frequencies[near[np.argmax(power[near])]]
            if abs(peak - f) > _LINES / np.ptp(t):
                found.append(float(peak))
    return np.unique(found)


def belongs(frequencies: Array, fit: Fit) -> NDArray[np.bool_]:
    """Which frequencies are the system's own or the mains'.

    Its modes', up to the fifth harmonic, and the sums and differences of two modes. The mains' hum also where
    the record, sampled too slowly for it, shows it.
    """
    own = fit.record.film == 0
    t, states = fit.record.t[own], fit.states[own]
    single = modes(fit.model, t, states)
    listed = [n * f for f in single for n in range(1, _HARMONICS + 1)]
    listed += [abs(a + sign * b) for a, b in itertools.combinations(single, 2) for sign in (1, -1)]
    line = _LINES / float(np.ptp(t))
    result = np.zeros(len(frequencies), dtype=bool)
    for f in listed:
        result |= np.abs(frequencies - f) < line
    for f in _MAINS:
        for shown in (f, alias(f, t)):
            result |= np.abs(frequencies - shown) < max(line, _WANDERS * f if shown > _SLOWEST else 0.0)
    return result


def alias(frequency: float, t: Array) -> float:
    """Where a frequency appears in a record that is sampled evenly, and too slowly for it.

    Parameters
    ----------
    frequency : float
    t : ndarray (n,)
        Times, s; in a record that was averaged in blocks, the blocks'.

    Examples
    --------
    Hum of 60 Hz at 100 frames a second, averaged over three:

    >>> import numpy as np
    >>> round(alias(60.0, np.arange(0, 60, 0.03)), 3)
    6.667
    """
    rate = 1.0 / float(np.median(np.diff(t)))
    return abs(frequency - rate * round(frequency / rate))
