"""Effect that a model may lack."""

from __future__ import annotations

import re
from dataclasses import dataclass

from udd import effects
from udd.models import Model


@dataclass(frozen=True)
class Candidate:
    """Effect with its amplitudes at zero.

    Attributes
    ----------
    effect : Effect
        With the shape parameters of this trial.
    title : str
        Name for a reader.
    usual : bool
        True for terms that machines have. Others, such as a wave, have a prior penalty.
    form : str
        Kind of friction that every joint may have; else empty.
    """

    effect: effects.Effect
    title: str
    usual: bool = True
    form: str = ""

    def added_to(self, model: Model) -> Model:
        """Add this effect to the model, with all its amplitudes zero."""
        return model.with_effects((*model.effects, self.effect))

    def scored_in(self, model: Model) -> tuple[Model, list[int]]:
        """Return the model with this effect, and the indices of its amplitudes among the parameters."""
        added = self.added_to(model)
        names = list(added.parameters)
        return added, [names.index(name) for name in self.amplitude_names]

    @property
    def parameters(self) -> int:
        """Count of parameters that a fit estimates: amplitudes, a frequency, and free shapes."""
        return sum(p.sought for p in self.effect.spec.parameters)

    @property
    def scanned(self) -> int:
        """Count of parameters chosen by a scan; such a candidate can resemble laws without them."""
        return sum(p.role == "scanned" for p in self.effect.spec.parameters)

    @property
    def shapes(self) -> int:
        """Count of parameters that give the effect its shape: a place, a width, an exponent."""
        return sum(p.role in ("scanned", "shape") for p in self.effect.spec.parameters)

    @property
    def amplitude_names(self) -> list[str]:
        """Names of the amplitudes among a model's parameters."""
        return [f"{self.effect.name}.{p}" for p in self.effect.amplitudes]


#: Frictions of a pendulum or a disk that are even in the speed.
ONE_WAY = ("one_way", "one_way_drag")


def like_geometry(effect: effects.Effect) -> bool:
    """Return True if faults of a film's geometry resemble an effect.

    Laws of the angle itself do. So does friction that depends on the direction: it moves the middle of a
    swing as its size changes.
    """
    # Without the second a real pendulum on a string has such friction.
    return bool(re.search(r"\b(theta|beta)\b", effect.equation)) or effect.name in ONE_WAY


def is_driven(model: Model) -> bool:
    """Return True if a drive keeps the motion going."""
    drive = model.profile.dynamics.drive
    return drive is not None and model.parameters[drive] != 0.0


def changes_with_time(effect: effects.Effect) -> bool:
    """Return True if an effect is friction or a torque that changes with time, but for a wave.

    As a swing decays, the effects of time and of amplitude are confounded.
    """
    is_wave = any(p.role == "frequency" for p in effect.spec.parameters)
    in_time = effect.slots[0] in ("friction", "torque") and bool(re.search(r"\b[tT]\b", effect.equation))
    return in_time and not is_wave
