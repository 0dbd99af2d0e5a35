"""Models as JSON, both ways."""

from __future__ import annotations

from typing import Any

from udd._util.tables import table
from udd.effects import Effect, library, serialization
from udd.errors import ModelError, UddError

from .base import Model
from .formula_model import FormulaModel
from .mechanisms import mechanism
from .registry import COMPILED

#: The kind of a model given as formulas, in files; older files have ``"own"``.
_FORMULA = "formula"
_OWN = FormulaModel._options
#: The three of these that a mechanism's equations of motion ``M q'' = f`` take the place of.
_ACCELERATIONS = ("states", "equations", "mass")
_MECHANISM = ("coordinates", "mass", "forces")


def model_to_dict(model: Model) -> dict[str, Any]:
    """Return the model's kind and constructor arguments, an effect as its name and parameters.

    Raises
    ------
    ModelError
        It would not come back the same.
    """
    if isinstance(model, FormulaModel):
        entry = {
            "kind": _FORMULA,
            "states": list(model.state_names),
            "equations": model.equations,
            "parameters": [list(pair) for pair in model.values],  # in order, which a table need not keep
            "angles": list(model.angles),
            "effects": [effect_to_dict(effect) for effect in model.effects],
        }
        if model.mass:
            entry["mass"] = [list(row) for row in model.mass]
        if model.inputs:
            entry["inputs"] = list(model.inputs)
        if model.delays:
            entry["delays"] = dict(model.delays)
        if model.observe:
            entry["observe"] = dict(model.observe)
        return entry
    cls = type(model)
    result: dict[str, Any] = {"kind": cls.kind}
    if COMPILED.get(cls.kind) is cls:
        for name in (*cls._plain, *cls._options):
            result[name] = getattr(model, name)
        if "effects" in result:
            result["effects"] = [effect_to_dict(effect) for effect in model.effects]
        if model_from_dict(result, fitted=True) == model:
            return result
    raise ModelError(f"this model cannot be written down: {model!r}")


def model_from_dict(data: object, *, fitted: bool = False) -> Model:
    """Make the model that `model_to_dict` or a person wrote down.

    Parameters
    ----------
    data : mapping
    fitted : bool
        If True, it may come from a fit: friction and drive may then be outside their physical ranges, as in
        :meth:`udd.Model.with_parameters`.

    Raises
    ------
    ModelError
        An unknown kind or argument, or one that is missing or unusable.
    """
    given = table("the model", data)
    kind = given.pop("kind", None)
    if kind in (_FORMULA, FormulaModel.kind):
        return formula_model_from_dict(given)
    if not isinstance(kind, str) or kind not in COMPILED:
        raise ModelError(f"the model's kind must be one of {', '.join((*COMPILED, _FORMULA))}, not {kind!r}")
    if "effects" in given:
        if not isinstance(given["effects"], list):
            raise ModelError(f"the model's effects must be a list, not {given['effects']!r}")
        given["effects"] = [effect_from_dict(effect) for effect in given["effects"]]
    cls = COMPILED[kind]
    entry_names = (*cls._plain, *cls._options)
    arguments = table(f"a {kind}", given, entry_names, needed=entry_names[:1])
    if not fitted:
        return cls(**arguments)
    plain = {name: value for name, value in arguments.items() if name in cls._plain}
    return cls(**arguments | dict.fromkeys(plain, 1.0)).with_parameters(plain)


def formula_model_from_dict(data: object) -> FormulaModel:
    """Make a user-defined model from its file form, whatever its kind.

    Its equations are the states' rates, or those of a mechanism: ``{"mechanism": {"coordinates": {"q": "v"},
    "mass": [["m"]], "forces": ["-k*q"]}, ...}``.

    Raises
    ------
    ModelError
        An unknown argument, or one that is missing or unusable.
    """
    given = table("a model of your own", data)
    given.pop("kind", None)
    if isinstance(given.get("effects"), list):
        given["effects"] = [effect_from_dict(effect) for effect in given["effects"]]
    try:
        if "mechanism" in given:
            return _mechanism_from_dict(given)
        given = table("a model of your own", given, _OWN, needed=_OWN[:2])
        return FormulaModel(**given | {"parameters": dict(given.get("parameters", {}))})
    except UddError:
        raise
    except (TypeError, ValueError) as error:
        raise ModelError(f"the model cannot be read: {error}") from None


def _mechanism_from_dict(given: dict[str, Any]) -> FormulaModel:
    """Make the model of a mechanism from coordinates, mass matrix and forces."""
    if twice := [name for name in _ACCELERATIONS if name in given]:
        raise ModelError(
            f"a model has a mechanism (M q'' = forces) or equations that are accelerations, not both: "
            f"leave out mechanism, or {', '.join(twice)}"
        )
    equations = table("the mechanism", given.pop("mechanism"), _MECHANISM, needed=_MECHANISM)
    rest = [name for name in _OWN if name not in _ACCELERATIONS]
    given = table("a model with a mechanism", given, ("mechanism", *rest))
    effects = given.pop("effects", ())
    given["parameters"] = dict(given.get("parameters", {}))
    return mechanism(**equations, **given).with_effects(effects)


def effect_to_dict(effect: Effect) -> dict[str, Any]:
    """Return an effect as its name and parameters, or as the user's arguments."""
    if effect.made is not None:
        return serialization.to_dict(effect)
    choices = {"momentum": effect.momentum, "treatment": effect.treatment}
    made = {key: choice for key, choice in choices.items() if choice is not None}
    return {"name": effect.name, **effect.parameters, **made}


def effect_from_dict(data: object) -> Effect:
    """Make an effect from the form of `effect_to_dict`, or from a user's.

    Raises
    ------
    ModelError
        An unknown effect or parameter, or one that is unusable.
    """
    given = table("an effect", data)
    if given.keys() & {"formula", "curve", "surface"}:
        return serialization.from_dict(given)
    name = given.get("name")
    specs = {spec.name: spec for spec in library()}
    if not isinstance(name, str) or name not in specs:
        raise ModelError(f"no effect is called {name!r}; there are {', '.join(specs)}")
    parameters = specs[name].parameters
    table(name, given, [*(p.name for p in parameters), "name", "momentum", "treatment"])
    # `Effect` rather than its constructor: fitted amplitudes may lie outside their physical ranges.
    values = tuple(given.get(p.name, p.default) for p in parameters)
    return Effect(name, values, given.get("momentum"), given.get("treatment"))
