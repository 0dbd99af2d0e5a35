"""Laws written as formulas."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from udd import effects
from udd.effects.user_defined import written
from udd.models import Model

from .candidate import Candidate

Range = tuple[float, float]

EITHER: Range = (-np.inf, np.inf)
POSITIVE: Range = (0.0, np.inf)
NEGATIVE: Range = (-np.inf, 0.0)


@dataclass(frozen=True)
class Shape:
    """Role, grid and range of a law's parameter, see :class:`udd.effects.Parameter`."""

    role: str
    grid: tuple[float, ...]
    range: Range = POSITIVE


def laws(
    model: Model,
    slot: str,
    text: str,
    title: str,
    amplitudes: Mapping[str, Range],
    shapes: Mapping[str, Shape] | None = None,
    tried: Iterable[tuple[float, ...]] = ((),),
    name: str = "",
) -> list[Candidate]:
    """Make the candidates of one law, one for each choice of its shapes' values.

    Parameters in the text are in braces; they get names that are unused in the model. The effect's name is
    made of the title by default.
    """
    shapes = shapes or {}
    called = dict(zip((*amplitudes, *shapes), unused_names(model, *amplitudes, *shapes), strict=True))
    ranges = {called[p]: limits for p, limits in amplitudes.items()}
    ranges |= {called[p]: shape.range for p, shape in shapes.items()}
    linear, names = [called[p] for p in amplitudes], tuple(called.values())
    spec = written(slot, text.format(**called), name or word_for(title), title, linear, ranges, names)
    shaped = {called[p]: shape for p, shape in shapes.items()}
    listed = (
        replace(p, role=shaped[p.name].role, grid=shaped[p.name].grid) if p.name in shaped else p
        for p in spec.parameters
    )
    spec = replace(spec, parameters=tuple(listed))
    zero = (0.0,) * len(amplitudes)
    return [Candidate(effects.Effect(spec.name, (*zero, *values), made=spec), title) for values in tried]


def unused_names(model: Model, *wanted: str) -> list[str]:
    """Return names for a term's parameters that are unused in the model."""
    taken = {*model.state_names, *model.parameters, *model.inputs, "t", "pi"}
    return [
        next(n for n in (name, *(f"{name}{k}" for k in range(1, 99))) if n not in taken) for name in wanted
    ]


def word_for(text: str) -> str:
    """Make an identifier that describes a term."""
    if text == "1":
        return "constant"
    said = text.replace("^", "").replace(" - ", "_less_").replace("-", "_less_").replace("/", "_over_")
    word = re.sub(r"\W+", "_", said).strip("_")
    return word if word.isidentifier() else f"term_{word}"
