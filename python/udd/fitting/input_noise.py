"""Measured inputs whose samples scatter (errors in variables)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from udd.measurement import InputSignal, Measurement

from .sensor import roughness

__all__ = ["NoisyInput", "noise_of", "noisy_inputs"]

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
