"""Measured inputs whose samples scatter (errors in variables)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.measurement import InputSignal, Measurement
from udd.models.formula_model import FormulaModel

from .sensor import roughness

__all__ = ["NoisyInput", "noise_of", "noisy_inputs", "rates_by_noise"]

Array = NDArray[np.float64]

#: Of an input's variance, from which on its noise is told: as much too small a factor of it may come out.
_TOLD = 0.01


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
    """The noise of an input's samples, from the least of what differences of several orders show."""
    return float(roughness(signal.values[:, None])[0])


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


def rates_by_noise(model: FormulaModel, t: Array, states: Array, noisy: list[NoisyInput]) -> Array:
    """What the noise of inputs makes of each state's rate, r.m.s. over a step of `t`, (d,).

    Errors of samples that are independent add up as a random walk does, to first order.
    """
    plain = model.rates(t, states)
    step = float(np.median(np.diff(t)))
    squares = np.zeros(states.shape[1])
    for one in noisy:
        signal = model.records[model.record][one.name]
        moved = InputSignal(signal.t, signal.values + one.noise, signal.hold)
        signals = {**model.records[model.record], one.name: moved}
        change = model.with_inputs(signals).rates(t, states) - plain
        squares += np.mean(change**2, axis=0) * float(np.median(np.diff(signal.t))) / step
    result: Array = np.sqrt(squares)
    return result
