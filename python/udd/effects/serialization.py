"""Formulas, curves and surfaces as JSON, both ways."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import signature
from typing import Any

import numpy as np

from udd.errors import ModelError

from .spec import Effect
from .user_defined import UNLIMITED, CurveSpec, FormulaSpec, SurfaceSpec, curve, surface, written

#: What stands in each kind of effect.
_KEYS = {
    "formula": ("slot", "expression", "parameters", "name", "title", "amplitudes", "ranges", "momentum"),
    "curve": tuple(signature(curve).parameters),
    "surface": tuple(signature(surface).parameters),
}


def to_dict(effect: Effect) -> dict[str, Any]:
    """A formula, a curve or a surface as JSON knows it; :func:`from_dict` makes the same effect of it."""
    spec = effect.made
    common = {"slot": effect.slots[0], "name": effect.name, "momentum": effect.momentum}
    if isinstance(spec, CurveSpec):
        where = {"coordinate": spec.coordinate, "low": spec.low, "high": spec.high, "periodic": spec.periodic}
        return {"curve": {**common, **where, "coefficients": list(effect.values)}}
    if isinstance(spec, SurfaceSpec):
        where = {"coordinates": spec.coordinates, "low": spec.low, "high": spec.high}
        grid = np.reshape(effect.values, spec.shape).tolist()
        return {"surface": {**common, **where, "periodic": spec.periodic, "coefficients": grid}}
    if not isinstance(spec, FormulaSpec):
        raise ModelError(f"{effect.name} is an effect of the library")
    ranges = {p.name: [None if np.isinf(x) else x for x in p.range] for p in spec.parameters}
    what = {"expression": spec.text, "title": spec.title, "amplitudes": list(effect.amplitudes)}
    return {"formula": {**common, **what, "ranges": ranges, "parameters": effect.parameters}}


def from_dict(data: Mapping[str, Any]) -> Effect:
    """The formula, curve or surface that :func:`to_dict`, or a person, wrote down.

    Raises
    ------
    ModelError
        Something is missing, unknown or unusable.
    """
    if not isinstance(data, Mapping) or len(data) != 1 or not data.keys() <= {"formula", "curve", "surface"}:
        raise ModelError(f"an effect of no library must be a formula, a curve or a surface, not {data!r}")
    ((kind, content),) = data.items()
    try:
        given = dict(content)
        for key in given:
            if key not in _KEYS[kind]:
                raise ModelError(f"it has no {key!r:.80}; there are {', '.join(_KEYS[kind])}")
        momentum = given.pop("momentum", None)
        if kind == "curve":
            return curve(**given, momentum=momentum)
        if kind == "surface":
            return surface(**given, momentum=momentum)
        values = dict(given.pop("parameters", {}))
        limits: dict[str, Any] = {
            name: tuple(own if x is None else x for x, own in zip(pair, UNLIMITED, strict=True))
            for name, pair in dict(given.pop("ranges", {})).items()
        }
        defaults: dict[str, Any] = {"name": "formula", "title": None, "amplitudes": None}
        spec = written(**(defaults | given), ranges=limits, names=tuple(values))
        # Not `make`: fitted amplitudes may lie outside their physical ranges.
        return Effect(spec.name, tuple(values.values()), momentum, made=spec)
    except (TypeError, ValueError, OverflowError) as error:
        raise ModelError(f"this {kind} cannot be read: {error}") from None
