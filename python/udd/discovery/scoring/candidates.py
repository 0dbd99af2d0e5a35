"""Candidate effects of a model from the library."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd import effects
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .candidate import Candidate, is_driven
from .friction_terms import load_frictions, one_way
from .term_library import delays, dry, terms, thresholds
from .written_laws import EITHER, laws


def renamed(effect: effects.Effect, model: Model) -> effects.Effect | None:
    """Return the effect under an unused name; None if it is the library's and the model has it.

    A model has an effect of the library only once, under the library's name.
    """
    taken = {effect_of_model.name for effect_of_model in model.effects}
    if effect.name not in taken:
        return effect
    if effect.made is None:
        return None
    name = next(n for n in (f"{effect.name}_{k}" for k in itertools.count(2)) if n not in taken)
    return replace(effect, name=name, made=replace(effect.made, name=name))


def library(
    model: Model, given: Sequence[Candidate] = (), states: NDArray[np.float64] | None = None
) -> list[Candidate]:
    """List every effect that can be added to a model, in each of its variants, except scanned ones.

    For a user's own model they are made of its states (:mod:`udd.discovery.scoring.term_library`). Dry
    friction is included if a motion, (n, d), is given: it determines the width of its smoothed sign. For
    other models friction that depends on the direction is included, and a pull that drifts. `given`
    candidates come first. Terms that the free parameters absorb are not removed here, because that depends
    on the data.
    """
    there = {effect.name for effect in model.effects}
    if isinstance(model, FormulaModel):
        turning: list[Candidate] = []
        if states is not None:
            turning = [*dry(model, states), *thresholds(model, states), *load_frictions(model, states)]
        listed = [c for c in (*given, *terms(model), *delays(model), *turning) if c.effect.name not in there]
        return list({(c.effect.name, c.effect.values): c for c in listed}.values())
    result = []
    for spec in effects.library():
        if spec.name in there or model.kind not in spec.bodies:
            continue
        if any(p.role in ("frequency", "scanned") for p in spec.parameters):
            continue
        shapes = [p for p in spec.parameters if p.role == "shape"]
        for momentum in spec.momenta or (None,):
            for values in itertools.product(*(p.grid for p in shapes)):
                chosen = dict(zip((p.name for p in shapes), values, strict=True))
                effect = spec.make(momentum=momentum, treatment=None, **chosen)
                notes = [str(momentum)] if len(spec.momenta) > 1 else []
                notes += [f"{p.name} = {chosen[p.name]:g}" for p in shapes if len(p.grid) > 1]
                title = spec.title + (f" ({', '.join(notes)})" if notes else "")
                result.append(Candidate(effect, title))
    if states is None:
        return result
    speed = states[:, model.state_names.index("Omega")]
    further = [*one_way(model, speed), *drifting_pull(model)]
    return result + [candidate for candidate in further if candidate.effect.name not in there]


def drifting_pull(model: Model) -> list[Candidate]:
    """List a pendulum's pull that changes with time, as a string that stretches changes it."""
    # Without this a drift of the length is called a torque over the angle: a swing decays in that time.
    if "theta" not in model.state_names:
        return []
    title = "a pull of gravity that changes with time"
    listed = laws(model, "torque", "-{a}*t*sin(theta)", title, {"a": EITHER}, name="drifting_pull")
    return [replace(candidate, usual=False) for candidate in listed]


def ripples(model: Model, t: NDArray[np.float64]) -> list[Candidate]:
    """List drive ripples at every frequency that a record can resolve.

    The frequencies go from two periods in the record to a quarter of the frame rate (6 Hz at most), half a
    line apart, within the effect's own range. `t` are the times of the record's frames.
    """
    spec = effects.drive_ripple().spec
    if model.kind not in spec.bodies or not is_driven(model):
        return []
    if spec.name in {e.name for e in model.effects}:
        return []
    duration, step = t[-1] - t[0], np.median(np.diff(t))
    low, high = next(p.range for p in spec.parameters if p.role == "frequency")
    frequencies = np.arange(max(2.0 / duration, low), min(0.25 / step, 6.0, high), 0.5 / duration)
    return [Candidate(effects.drive_ripple(f=float(f)), f"drive ripple at {f:.3g} Hz") for f in frequencies]
