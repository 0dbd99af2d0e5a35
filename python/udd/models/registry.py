"""The models that there are, by kind."""

from __future__ import annotations

from importlib import import_module

from udd import _core

from .base import Model
from .compiled import CompiledModel
from .formula_model import FormulaModel
from .profile import ModelProfile


def _compiled() -> dict[str, type[Model]]:
    """Import the compiled models, each from the file with the name of its kind."""
    kinds = _core.model_kinds()
    for kind in kinds:
        import_module(f"{__package__}.{kind}")
    class_of = {cls.kind: cls for cls in CompiledModel.__subclasses__()}
    return {kind: class_of[kind] for kind in kinds}


#: Those that are compiled into the core.
COMPILED: dict[str, type[Model]] = _compiled()
MODELS: dict[str, type[Model]] = COMPILED | {FormulaModel.kind: FormulaModel}


def profile_of(kind: str) -> ModelProfile:
    """Return the profile of models of this kind: ``model.kind``, or a measurement's."""
    return MODELS[kind].profile
