"""Conversion of formulas, curves and surfaces to JSON and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from udd._util.tables import arguments, table
from udd.errors import ModelError, UddError

from .spec import Effect
from .user_defined import UNLIMITED, CurveSpec, FormulaSpec, SurfaceSpec, curve, surface, written

_FORMULA = ("slot", "expression", "name", "title", "amplitudes", "parameters", "ranges", "momentum")


def to_dict(effect: Effect) -> dict[str, Any]:
    """Convert a formula, a curve or a surface to JSON-ready values; :func:`from_dict` is the inverse."""
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
        raise ModelError(f"{effect.name} is an effect of the library; write its name and parameters instead")
    ranges = {p.name: [None if np.isinf(x) else x for x in p.range] for p in spec.parameters}
    what = {"expression": spec.text, "title": spec.title, "amplitudes": list(effect.amplitudes)}
    return {"formula": {**common, **what, "ranges": ranges, "parameters": effect.parameters}}


def from_dict(data: Mapping[str, Any]) -> Effect:
    """Make a formula, a curve or a surface from what :func:`to_dict` or a person wrote.

    Raises
    ------
    ModelError
        A key is missing, unknown or has an unusable value.
    """
    if len(table("an effect", data, ("formula", "curve", "surface"))) != 1:
        raise ModelError(f"expected one key, 'formula', 'curve' or 'surface', not {data!r:.80}")
    ((kind, content),) = data.items()
    try:
        if kind == "curve":
            return curve(**arguments("a curve", content, curve))
        if kind == "surface":
            return surface(**arguments("a surface", content, surface))
        given = table("a formula", content, _FORMULA, needed=_FORMULA[:2])
        momentum = given.pop("momentum", None)
        values = dict(given.pop("parameters", {}))
        limits: dict[str, Any] = {
            name: tuple(unlimited if x is None else x for x, unlimited in zip(pair, UNLIMITED, strict=True))
            for name, pair in dict(given.pop("ranges", {})).items()
        }
        defaults: dict[str, Any] = {"name": "formula", "title": None, "amplitudes": None}
        spec = written(**(defaults | given), ranges=limits, names=tuple(values))
        # Not `make`: fitted amplitudes may lie outside their physical ranges.
        return Effect(spec.name, tuple(values.values()), momentum, made=spec)
    except UddError:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        raise ModelError(f"this {kind} cannot be read: {error}") from None
