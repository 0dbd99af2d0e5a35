"""Candidates that do nearly the same along a motion as one that explains it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from udd.effects import Effect
from udd.errors import ModelError
from udd.fitting import Fit
from udd.models import Model

from .candidate import Candidate

_LIKE = 0.95  # correlation along the motion from which on
_STEP = 1e-5  # of a parameter, by which differences are taken
_SEEN = 1e-6  # of a candidate's work that the free parameters must leave


def look_alikes(known: Model, fitted: Fit, candidates: Iterable[Candidate]) -> list[tuple[Candidate, float]]:
    """Regression of what was found on each candidate, along the motion that was found with it.

    Around a model that goes astray the right form may score lower than others, or not at all; beside one that
    does nearly the same it is seen. What the model's free parameters can do as well is left out of both: with
    the gain free a dead zone is like a saturation.

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
    known = known.with_parameters({name: fitted.model.parameters[name] for name in known.parameters})
    without = known.rates(t, states)
    absorbed = by_parameter(
        known, [name for name in known.parameters if name in fitted.parameters], t, states
    )

    def added(effect: Effect) -> NDArray[np.float64]:
        try:
            return known.with_effects((*known.effects, effect)).rates(t, states) - without
        except ModelError:  # it has no value there
            return np.full_like(without, np.nan)

    def left(rates: NDArray[np.float64]) -> NDArray[np.float64]:
        own = rates.ravel()
        return own - absorbed @ np.linalg.lstsq(absorbed, own)[0]

    wanted, found = left(added(fitted.model.effects[-1])), []
    if not wanted.any():
        return []
    for candidate in candidates:
        if len(candidate.effect.amplitudes) != 1:
            continue
        (name,) = candidate.effect.amplitudes
        whole = added(candidate.effect.replace(**{name: 1.0}))
        if not np.isfinite(whole).all():
            continue
        own = left(whole)
        size = float((own**2).sum())
        if not size > _SEEN * float((whole**2).sum()):
            continue
        amplitude = float((own * wanted).sum()) / size
        likeness = abs(amplitude) * np.sqrt(size / float((wanted**2).sum()))
        if likeness > _LIKE:
            found.append((likeness, candidate, amplitude))
    found.sort(key=lambda one: -one[0])
    return [(candidate, amplitude) for _likeness, candidate, amplitude in found]


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
