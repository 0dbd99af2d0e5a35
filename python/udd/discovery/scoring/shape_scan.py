"""Effects with a place, a power or a time: the best value, by scores from one response."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd import effects
from udd.errors import ModelError
from udd.fitting import Fit
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .candidate import Candidate
from .forcing import Responses, responses
from .friction_terms import DURATIONS, POWERS, frictions, further, places, speeds
from .score_scan import Scored, scored_forcings

Array = NDArray[np.float64]


def strongest_shapes(fit: Fit) -> tuple[list[Scored], int]:
    """Score each effect with a scanned number at each of its values; also count the scores.

    Return the strongest of each effect; two if the number is a place, because a pendulum passes either side
    alike.
    """
    moved = responses(fit)
    strongest, number = [], 0
    for listed in _candidates(fit):
        some = scored_forcings(fit, listed, partial(_column, moved))
        number += len(some)
        strongest += _best(some)
    return strongest, number


def _best(some: Sequence[Scored]) -> list[Scored]:
    """Return the strongest, and for an effect with a place and a width also the strongest elsewhere."""
    if not some:
        return []
    first = max(some, key=lambda s: s.chi2)
    where, *widths = _shape_values(first)
    if not widths:
        return [first]
    # Without this a brake at 0.15 rad is placed at -0.15 rad.
    others = [s for s in some if abs(_shape_values(s)[0] - where) > 2 * max(widths[0], _shape_values(s)[1])]
    return [first, max(others, key=lambda s: s.chi2)] if others else [first]


def _shape_values(scored: Scored) -> list[float]:
    """Return an effect's scanned number, then its widths."""
    effect = scored.candidate.effect
    return [effect.parameters[p.name] for p in effect.spec.parameters if p.role in ("scanned", "shape")]


def _candidates(fit: Fit) -> Iterator[list[Candidate]]:
    """Yield the candidates of each effect."""
    model, duration = fit.model, float(np.ptp(fit.record.t))
    there = {effect.name for effect in model.effects}
    if isinstance(model, FormulaModel):
        yield from (c for c in frictions(model, fit.states, duration) if c[0].effect.name not in there)
        return
    for spec in (*effects.library(), *further()):
        scanned = next((p for p in spec.parameters if p.role == "scanned"), None)
        if scanned is None or spec.name in there or model.kind not in spec.bodies:
            continue
        shapes = [p for p in spec.parameters if p.role == "shape"]
        names = [scanned.name, *(p.name for p in shapes)]
        listed = []
        for widths in itertools.product(*(p.grid for p in shapes)):
            for value in _values(scanned.along, model, fit.states, duration, *widths):
                made: dict[str, Any] = dict(zip(names, (value, *widths), strict=True))
                said = ", ".join(f"{name} = {number:.3g}" for name, number in made.items())
                listed.append(Candidate(spec.make(**made), f"{spec.title} ({said})"))
        yield listed


def _values(along: str, model: Model, states: Array, duration: float, width: float = 0.0) -> Sequence[float]:
    """Return the values to try for a scanned number of the library, by its kind."""
    if along == "power":
        return POWERS
    if along == "duration":
        return [share * duration for share in DURATIONS]
    if along == "speed":
        return speeds(states[:, model.state_names.index("Omega")])
    visited = states[:, model.state_names.index(model.angles[0])]
    return places(np.abs(visited) if along == "side" else visited, width, angle=True)


def _column(moved: Responses, candidate: Candidate) -> Array | None:
    """Return the change of the state at every link's end by a unit amplitude, (n, d, 1), or None."""
    effect = candidate.effect
    (name,) = effect.amplitudes
    added = np.zeros(moved.states.shape)
    for model, film in zip(moved.fit.models, moved.films, strict=True):
        more = model.with_effects((*model.effects, effect.replace(**{name: 1.0})))
        try:
            added[film] = more.rates(moved.t[film], moved.states[film]) - moved.rates[film]
        except ModelError:
            return None
    column: Array = np.einsum("iqdm,iqm->id", moved.response, added)[..., None]
    return column
