"""An effect that a model may lack."""

from __future__ import annotations

from dataclasses import dataclass

from udd import effects
from udd.models import Model


@dataclass(frozen=True)
class Candidate:
    """An effect with its amplitudes at zero.

    Attributes
    ----------
    effect : Effect
        With the shape parameters that it is tried with.
    title : str
        What a reader calls it.
    usual : bool
        Whether machines have such a term; a product of states that merely could be must explain more.
    form : str
        What kind of friction it is that every joint may have; empty for anything else.
    """

    effect: effects.Effect
    title: str
    usual: bool = True
    form: str = ""

    def added_to(self, model: Model) -> Model:
        """The model with this effect added, all its amplitudes zero."""
        return model.with_effects((*model.effects, self.effect))

    def amplitude_indices(self, model: Model) -> list[int]:
        """Where the amplitudes stand among the parameters of :meth:`added_to`'s model."""
        names = list(self.added_to(model).parameters)
        return [names.index(name) for name in self.amplitude_names]

    @property
    def parameters(self) -> int:
        """How many numbers a fit would find: the amplitudes, a frequency, and shapes of any value."""
        return sum(p.sought for p in self.effect.spec.parameters)

    @property
    def scanned(self) -> int:
        """How many numbers a scan chose for it: it can look like laws that have none."""
        return sum(p.role == "scanned" for p in self.effect.spec.parameters)

    @property
    def amplitude_names(self) -> list[str]:
        """The amplitudes' names among a model's parameters."""
        return [f"{self.effect.name}.{p}" for p in self.effect.amplitudes]
