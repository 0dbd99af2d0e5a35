"""What the parameters of a camera that was held as perfect would explain, were they free."""

from __future__ import annotations

import itertools

from udd._util import chi_squared
from udd.discovery.thresholds import ALPHA
from udd.errors import FitError
from udd.fitting import Fit, extend, ran_away, released, with_noise_of
from udd.fitting.parameters import Free, free_parameters
from udd.fitting.sensor import is_encoder

from .confirmation import same_level

_MOST = 0.5  # of chi2 that a camera takes away, from which on a form found without it is not to be trusted


def camera_shows(known: Fit, found: Fit) -> list[str] | None:
    """Whether a camera that was held shows in what a model with effects leaves; None where it does not.

    Parameters
    ----------
    known, found : Fit
        Of all data, without the effects and with them.

    Returns
    -------
    list of str or None
        Names of the effects that are not needed once the camera's parameters are free: without them a
        camera explains the data better than they did. None of them where it only may, as where a formula was
        found.
    """
    more = _fixed(known)
    there = {e.name for e in known.model.effects}
    effects = [e for e in found.model.effects if e.name not in there]
    if not more or not effects:
        return None
    names = [e.name for e in effects]
    alone = _freed(with_noise_of(known, found), more)
    for kept in (some for size in range(len(names)) for some in itertools.combinations(names, size)):
        if alone is not None and _explains(alone, found, kept):
            return [name for name in names if name not in kept]
    if any(e.made for e in effects):  # a formula bends until it hides what a camera does
        return []
    freed = _freed(found, more)
    if freed is None:
        return None
    before, after = same_level(found, freed)
    fall = (before.chi2 - after.chi2) / after.inflation(before)
    shows = after.chi2 < _MOST * before.chi2 and chi_squared.sf(fall, len(more)) < ALPHA
    return [] if shows else None


def _fixed(known: Fit) -> tuple[Free, ...]:
    """The parameters of a film's camera that were not to be free."""
    if all(is_encoder(own) for own in known.measurements):
        return ()
    names = set(known.parameters)
    return tuple(f for f in free_parameters(known.models, [], True) if f.name not in names)


def _freed(fitted: Fit, more: tuple[Free, ...]) -> Fit | None:
    """The same with the camera free; None where that goes astray."""
    try:
        freed = released(fitted, (*more, *fitted.problem.free))
    except FitError:
        return None
    return freed if freed.converged and not ran_away(freed) else None


def _explains(alone: Fit, found: Fit, kept: tuple[str, ...]) -> bool:
    """Whether some of the effects and a free camera explain the data better than all without one."""
    effects = [e for e in found.model.effects if e.name in kept]
    values = [found.parameters.get(f"{e.name}.{p}", e.parameters[p]) for e in effects for p in e.amplitudes]
    try:
        some = extend(alone, effects, values) if effects else alone
    except FitError:
        return False
    one, other = same_level(some, found)
    return one.chi2 < other.chi2
