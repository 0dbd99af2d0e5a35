"""Measured inputs whose samples scatter (errors in variables)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.measurement import InputSignal, Measurement
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .record import Record

__all__ = ["LEVELS_APART", "NoisyInput", "diffusion_by_noise", "noise_of", "noisy_inputs"]

Array = NDArray[np.float64]

#: Times by which a model's error may differ from what the inputs' noise makes: its levels are as far apart.
LEVELS_APART = 3.5
#: Of an input's variance, from which on its noise is told: as much too small a factor of it may come out.
_TOLD = 0.01
_ORDERS = (4, 8)  # of the differences of samples
_WHITE = 0.8  # of the noise by the lower order that the higher one must show
_SHORTEST = 50  # samples
_LEVELS = 20  # different values of a drive that may be noisy


@dataclass(frozen=True)
class NoisyInput:
    """An input whose samples scatter: its noise, and the share of its variance that this is."""

    name: str
    noise: float
    share: float

    @property
    def text(self) -> str:
        """In a sentence."""
        return (
            f"warning: the input {self.name} scatters by {self.noise:.2g} from sample to sample; if that is "
            f"noise of its sensor, what it drives comes out too small, by some {100 * self.share:.0f} %: "
            "udd.input_bias(fit) estimates by how much"
        )


def noise_of(signal: InputSignal) -> float:
    """The noise of an input's samples; 0 where none is told from what the input does itself.

    Differences of a high order show what is left near the highest frequency that the samples hold. Noise of
    a sensor is white there: orders agree. Of a drive that falls off before they do not. A drive that is white
    itself cannot be told from noise by its samples: a held one, which a controller put out, and one of few
    levels count as exact.
    """
    if len(signal) < _SHORTEST or signal.hold == "zero" or len(np.unique(signal.values)) < _LEVELS:
        return 0.0
    lower, higher = (noise_by_differences(signal.values, order) for order in _ORDERS)
    return higher if higher > _WHITE * lower else 0.0


def noise_by_differences(values: Array, order: int) -> float:
    """The standard deviation of white noise that makes differences of this order as large as they are."""
    size = np.median(np.abs(np.diff(values, order))) / 0.6745
    return float(size / np.sqrt(math.comb(2 * order, order)))


def noisy_inputs(measurements: tuple[Measurement, ...], names: tuple[str, ...]) -> list[NoisyInput]:
    """The inputs whose noise is more than a small share of what they drive with."""
    found = []
    for name in names:
        noise = np.array([noise_of(one.inputs[name]) for one in measurements])
        size = np.array([one.inputs[name].values.std() for one in measurements])
        share = float(np.median((noise / np.where(size > 0, size, np.inf)) ** 2))
        if share > _TOLD:
            found.append(NoisyInput(name, float(np.median(noise)), min(share, 1.0)))
    return found


def diffusion_by_noise(models: Sequence[Model], record: Record) -> Array:
    """What the noise of inputs adds to the states' model error, per square root of the unit of time, (d,).

    Errors of samples that are independent add up as a random walk does, to first order.
    """
    squares = np.zeros((len(models), record.states.shape[1]))
    there = np.unique(record.film)  # a part of a record may lack some measurements
    for film in there:
        model, own = models[film], record.film == film
        assert isinstance(model, FormulaModel)  # no other has inputs
        t, states = record.t[own], record.states[own]
        plain = model.rates(t, states)
        for name in model.inputs:
            signal = model.records[model.record][name]
            moved = InputSignal(signal.t, signal.values + noise_of(signal), signal.hold)
            noised = model.with_inputs({**model.records[model.record], name: moved})
            step = float(np.median(np.diff(signal.t)))
            squares[film] += np.mean((noised.rates(t, states) - plain) ** 2, axis=0) * step
    result: Array = np.sqrt(squares[there].mean(axis=0))
    return result
