"""Candidates that act almost like a known explanation along a motion."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from udd.effects import Effect
from udd.errors import ModelError
from udd.fitting import Fit
from udd.models import Model

from .candidate import Candidate

_LIKE = 0.95  # correlation along the motion above which a candidate is a look-alike
_STEP = 1e-5  # relative step of a parameter in difference quotients
_SEEN = 1e-6  # share of a candidate's effect that the free parameters must leave


def look_alikes(base: Model, fitted: Fit, candidates: Iterable[Candidate]) -> list[tuple[Candidate, float]]:
    """Regress the effect that was added on each candidate, along the motion that was fitted with it.

    Around a diverged model the right form may score lower than others, or not at all; next to one that acts
    almost the same it is visible. The part that the model's free parameters absorb is removed from both: with
    a free gain a dead zone resembles a saturation. Candidates with several amplitudes are skipped. `base` is
    the model without the last effect of the fit. The most similar candidate comes first, with its amplitude.
    """
    first = fitted.record.film == 0
    t, states = fitted.record.t[first], fitted.states[first]
    base = base.with_parameters({name: fitted.model.parameters[name] for name in base.parameters})
    without = base.rates(t, states)
    absorbed = by_parameter(base, [name for name in base.parameters if name in fitted.parameters], t, states)

    def added(effect: Effect) -> NDArray[np.float64]:
        try:
            return base.with_effects((*base.effects, effect)).rates(t, states) - without
        except ModelError:  # undefined there
            return np.full_like(without, np.nan)

    def unabsorbed(rates: NDArray[np.float64]) -> NDArray[np.float64]:
        projected = rates.ravel()
        return projected - absorbed @ np.linalg.lstsq(absorbed, projected)[0]

    target, matches = unabsorbed(added(fitted.model.effects[-1])), []
    if not target.any():
        return []
    for candidate in candidates:
        if len(candidate.effect.amplitudes) != 1:
            continue
        (name,) = candidate.effect.amplitudes
        whole = added(candidate.effect.replace(**{name: 1.0}))
        if not np.isfinite(whole).all():
            continue
        projected = unabsorbed(whole)
        size = float((projected**2).sum())
        if not size > _SEEN * float((whole**2).sum()):
            continue
        amplitude = float((projected * target).sum()) / size
        likeness = abs(amplitude) * np.sqrt(size / float((target**2).sum()))
        if likeness > _LIKE:
            matches.append((likeness, candidate, amplitude))
    matches.sort(key=lambda match: -match[0])
    return [(candidate, amplitude) for _likeness, candidate, amplitude in matches]


def by_parameter(
    model: Model, names: Sequence[str], t: NDArray[np.float64], states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Differentiate the rates by parameters, by finite differences: (n d, p)."""
    rates = model.rates(t, states).ravel()
    columns = []
    for name in names:
        value = model.parameters[name]
        step = _STEP * (abs(value) or 1.0)
        columns.append((model.with_parameters({name: value + step}).rates(t, states).ravel() - rates) / step)
    return np.stack(columns, axis=-1) if columns else np.zeros((len(rates), 0))
