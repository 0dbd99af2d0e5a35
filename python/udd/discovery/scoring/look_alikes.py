"""Candidates that do nearly the same along a motion as one that explains it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from udd.effects import Effect
from udd.errors import ModelError
from udd.fitting import Fit
from udd.models import Model

from .candidate import Candidate

_LIKE = 0.95  # correlation along the motion from which on


def look_alikes(known: Model, fitted: Fit, candidates: Iterable[Candidate]) -> list[tuple[Candidate, float]]:
    """Regression of what was found on each candidate, along the motion that was found with it.

    Around a model that goes astray the right form may score lower than others, or not at all; beside one that
    does nearly the same it is seen.

    Parameters
    ----------
    known : Model
        Without the last effect of the fit.
    fitted : Fit
    candidates : iterable of Candidate
        Those with several amplitudes are passed over.

    Returns
    -------
    list of (Candidate, float)
        Those that are like it, with the amplitude at which they are, the likest first.
    """
    first = fitted.record.film == 0
    t, states = fitted.record.t[first], fitted.states[first]
    without = known.rates(t, states)

    def added(effect: Effect) -> NDArray[np.float64]:
        try:
            return known.with_effects((*known.effects, effect)).rates(t, states) - without
        except ModelError:  # it has no value there
            return np.full_like(without, np.nan)

    wanted = added(fitted.model.effects[-1])
    found = []
    for candidate in candidates:
        if len(candidate.effect.amplitudes) != 1:
            continue
        (name,) = candidate.effect.amplitudes
        own = added(candidate.effect.replace(**{name: 1.0}))
        size = float((own**2).sum())
        if not (np.isfinite(size) and size > 0.0):
            continue
        amplitude = float((own * wanted).sum()) / size
        likeness = abs(amplitude) * np.sqrt(size / float((wanted**2).sum()))
        if likeness > _LIKE:
            found.append((likeness, candidate, amplitude))
    found.sort(key=lambda one: -one[0])
    return [(candidate, amplitude) for _likeness, candidate, amplitude in found]
