"""The models that there are, by kind."""

from __future__ import annotations

from .base import Model
from .disk import Disk
from .dle import DLE
from .formula_model import FormulaModel
from .pendulum import Pendulum
from .profile import ModelProfile

#: Those that are compiled into the core; a new model is one more name here.
COMPILED: dict[str, type[Model]] = {cls.kind: cls for cls in (DLE, Disk, Pendulum)}
MODELS: dict[str, type[Model]] = COMPILED | {FormulaModel.kind: FormulaModel}


def profile_of(kind: str) -> ModelProfile:
    """The profile of models of this kind: ``model.kind``, or a measurement's."""
    return MODELS[kind].profile
