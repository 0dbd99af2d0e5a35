"""Test whether a camera that was assumed to be perfect would explain the effects."""

from __future__ import annotations

import itertools

from udd._util import chi_squared
from udd.discovery.thresholds import ALPHA
from udd.errors import FitError
from udd.fitting import Fit, extend, ran_away, released, with_noise_of
from udd.fitting.parameters import Free, free_parameters
from udd.fitting.sensor import is_encoder

from .confirmation import same_level

_MOST = 0.5  # ratio of chi2 with a free camera, below which a form found without it is unreliable


def camera_shows(base: Fit, extended: Fit) -> list[str] | None:
    """Test whether the residuals of a model with effects show a fixed camera's errors; None if they do not.

    Parameters
    ----------
    base, extended : Fit
        Fits of all data, without the effects and with them.

    Returns
    -------
    list of str or None
        Names of the effects that are not needed once the camera's parameters are free: the camera then
        explains the data better than they did. Empty if that is only possible, as with a formula.
    """
    camera_parameters = _fixed(base)
    there = {e.name for e in base.model.effects}
    effects = [e for e in extended.model.effects if e.name not in there]
    if not camera_parameters or not effects:
        return None
    names = [e.name for e in effects]
    camera_alone = _freed(with_noise_of(base, extended), camera_parameters)
    for kept in (some for size in range(len(names)) for some in itertools.combinations(names, size)):
        if camera_alone is not None and _explains(camera_alone, extended, kept):
            return [name for name in names if name not in kept]
    if any(e.made for e in effects):  # a formula may imitate the camera's errors
        return []
    freed = _freed(extended, camera_parameters)
    if freed is None:
        return None
    before, after = same_level(extended, freed)
    fall = (before.chi2 - after.chi2) / after.inflation(before)
    shows = after.chi2 < _MOST * before.chi2 and chi_squared.sf(fall, len(camera_parameters)) < ALPHA
    return [] if shows else None


def _fixed(fit: Fit) -> tuple[Free, ...]:
    """Return the parameters of a film's camera that were not free."""
    if all(is_encoder(measurement) for measurement in fit.measurements):
        return ()
    names = set(fit.parameters)
    return tuple(f for f in free_parameters(fit.models, [], True) if f.name not in names)


def _freed(fitted: Fit, more: tuple[Free, ...]) -> Fit | None:
    """Fit again with the camera free; None if that diverges."""
    try:
        freed = released(fitted, (*more, *fitted.problem.free))
    except FitError:
        return None
    return freed if freed.converged and not ran_away(freed) else None


def _explains(alone: Fit, full: Fit, kept: tuple[str, ...]) -> bool:
    """Return True if some of the effects and a free camera fit better than all effects without one."""
    effects = [e for e in full.model.effects if e.name in kept]
    values = [full.parameters.get(f"{e.name}.{p}", e.parameters[p]) for e in effects for p in e.amplitudes]
    try:
        some = extend(alone, effects, values) if effects else alone
    except FitError:
        return False
    partial, complete = same_level(some, full)
    return partial.chi2 < complete.chi2
