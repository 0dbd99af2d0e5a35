"""Natural frequencies of a system, and the mains': a drive at either cannot be identified."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from udd.fitting import Fit
from udd.models import Model

Array = NDArray[np.float64]

_HARMONICS = 5
_MAINS = (50.0, 60.0)  # Hz; sensors pick up hum
_WANDERS = 0.004  # relative error of the mains' frequency
_SLOWEST = 0.5  # Hz, below which undersampled hum is not a wave but a drift
_LINES = 1.0  # spectral lines (1/duration) within which two frequencies are equal
_NEAR = 0.2  # share of a mode's frequency within which the motion's line is that mode
_STEP = 1e-5  # relative step of each state in difference quotients


def modes(model: Model, t: Array, states: Array) -> Array:
    """Compute frequencies of a model's modes, linearised around a motion's mean, and of their spectral lines.

    They are in cycles per unit of time. A mode whose line in the evenly sampled motion is away from its
    linear frequency, as for a swing of large amplitude, has both.

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
    result = list(linear)
    for f in linear:
        in_range = np.flatnonzero(np.abs(frequencies - f) < _NEAR * f)
        if len(in_range):
            peak = frequencies[in_range[np.argmax(power[in_range])]]
            if abs(peak - f) > _LINES / np.ptp(t):
                result.append(float(peak))
    return np.unique(result)


def belongs(frequencies: Array, fit: Fit) -> NDArray[np.bool_]:
    """Return True for each frequency of the system's own or of the mains'.

    These are its modes', up to the fifth harmonic, and the sums and differences of two modes. The mains' hum
    also counts at its alias in the record.
    """
    first_film = fit.record.film == 0
    t, states = fit.record.t[first_film], fit.states[first_film]
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
    """Return the alias of a frequency in an evenly sampled record, or in its block averages.

    Examples
    --------
    Hum of 60 Hz at 100 frames a second, averaged over three:

    >>> import numpy as np
    >>> round(alias(60.0, np.arange(0, 60, 0.03)), 3)
    6.667
    """
    rate = 1.0 / float(np.median(np.diff(t)))
    return abs(frequency - rate * round(frequency / rate))
