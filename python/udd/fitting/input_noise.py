"""Noise of measured inputs (errors in variables)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.measurement import InputSignal, Measurement
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .record import Record
from .sensor import noise_by_differences

Array = NDArray[np.float64]

#: Factor by which a model error may differ from that caused by the inputs' noise: the ratio of adjacent
#: levels.
LEVEL_RATIO = 3.5
#: Share of an input's variance from which on its noise is reported: a factor of the input is biased by as
#: much.
_REPORTED_SHARE = 0.01
_ORDERS = (4, 8)  # of the differences of samples
_WHITE = 0.8  # share of the noise by the lower order that the higher order must show
_SHORTEST = 50  # samples
_LEVELS = 20  # distinct values of an input, from which on it may be noisy


@dataclass(frozen=True)
class NoisyInput:
    """An input with noisy samples: the noise, and its share of the input's variance."""

    name: str
    noise: float
    share: float

    @property
    def text(self) -> str:
        """The warning, in one sentence."""
        return (
            f"warning: the input {self.name} has noise of {self.noise:.2g} per sample. If that is noise "
            f"of its sensor, the fitted gain of this input is about {100 * self.share:.0f} % too small; "
            "udd.input_bias(fit) estimates the bias"
        )


def noise_of(signal: InputSignal) -> float:
    """Estimate the noise of an input's samples; 0 if it cannot be distinguished from the input's own changes.

    Differences of a high order show the power near the highest frequency of the samples. A sensor's noise is
    white there, so different orders agree; they disagree for an input whose spectrum decays. A white input
    cannot be distinguished from noise by its samples. An input with ``hold="zero"``, as from a controller,
    and one with few levels count as exact.
    """
    if len(signal) < _SHORTEST or signal.hold == "zero" or len(np.unique(signal.values)) < _LEVELS:
        return 0.0
    lower, higher = (float(noise_by_differences(signal.values, order)) for order in _ORDERS)
    return higher if higher > _WHITE * lower else 0.0


def noisy_inputs(measurements: tuple[Measurement, ...], names: tuple[str, ...]) -> list[NoisyInput]:
    """Return the inputs whose noise exceeds a small share of their variance."""
    result = []
    for name in names:
        noise = np.array([noise_of(measurement.inputs[name]) for measurement in measurements])
        size = np.array([measurement.inputs[name].values.std() for measurement in measurements])
        share = float(np.median((noise / np.where(size > 0, size, np.inf)) ** 2))
        if share > _REPORTED_SHARE:
            result.append(NoisyInput(name, float(np.median(noise)), min(share, 1.0)))
    return result


def diffusion_by_noise(models: Sequence[Model], record: Record) -> Array:
    """Compute the model error caused by the inputs' noise, (d,), per square root of the unit of time.

    To first order, independent errors of samples add up as in a random walk.
    """
    squares = np.zeros((len(models), record.states.shape[1]))
    there = np.unique(record.film)  # a part of a record may lack some measurements
    for film in there:
        model, of_film = models[film], record.film == film
        assert isinstance(model, FormulaModel)  # no other model has inputs
        t, states = record.t[of_film], record.states[of_film]
        plain = model.rates(t, states)
        for name in model.inputs:
            signal = model.records[model.record][name]
            moved = InputSignal(signal.t, signal.values + noise_of(signal), signal.hold)
            noised = model.with_inputs({**model.records[model.record], name: moved})
            step = float(np.median(np.diff(signal.t)))
            squares[film] += np.mean((noised.rates(t, states) - plain) ** 2, axis=0) * step
    result: Array = np.sqrt(squares[there].mean(axis=0))
    return result
