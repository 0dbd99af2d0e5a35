"""Compare the effects with a camera that was assumed to be perfect, by the log evidence."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

from udd.discovery.hypotheses import log_evidence
from udd.discovery.thresholds import EVIDENCE_MARGIN
from udd.discovery.trial_fits import attempted
from udd.fitting import Fit, extend, most_probable, ran_away, released
from udd.fitting.parameters import Free, free_parameters
from udd.fitting.sensor import is_encoder


def camera_shows(base: Fit, extended: Fit) -> list[str] | None:
    """Test whether a fixed camera's errors are a rival of the effects; None if they are not.

    Return the names of the effects that are not needed once the camera's parameters are free: the other
    effects with a free camera are at most ten nats behind. There are none if all effects with a free camera
    are more than ten nats ahead, or if one is a formula, which may imitate the camera's errors.
    """
    camera_parameters = _fixed(base)
    there = {e.name for e in base.model.effects}
    effects = [e for e in extended.model.effects if e.name not in there]
    if not camera_parameters or not effects:
        return None
    names = [e.name for e in effects]
    log_z = _log_z(extended, names)
    free = _freed(base, camera_parameters)
    for kept in (some for size in range(len(names)) for some in itertools.combinations(names, size)):
        if _log_z(_with_effects(free, extended, kept), kept) > log_z - EVIDENCE_MARGIN:
            return [name for name in names if name not in kept]
    is_formula = any(e.made for e in effects)
    all_free = None if is_formula else _freed(extended, camera_parameters)
    return [] if is_formula or _log_z(all_free, names) > log_z + EVIDENCE_MARGIN else None


def _log_z(fitted: Fit | None, effects: Iterable[str]) -> float:
    """Compute the log evidence of a fit with these effects at its most probable noise and model error."""
    if fitted is None:
        return float("-inf")
    model = {e.name: e for e in fitted.model.effects}
    names = [f"{name}.{p}" for name in effects for p in model[name].amplitudes]
    return log_evidence(most_probable(fitted), [name for name in names if name in fitted.parameters])


def _fixed(fit: Fit) -> tuple[Free, ...]:
    """Return the parameters of a film's camera that were not free."""
    if all(is_encoder(measurement) for measurement in fit.measurements):
        return ()
    names = set(fit.parameters)
    return tuple(f for f in free_parameters(fit.models, [], True) if f.name not in names)


def _freed(fitted: Fit, more: tuple[Free, ...]) -> Fit | None:
    """Fit again with the camera free; None if that diverges."""
    freed = attempted(released, fitted, (*more, *fitted.problem.free))
    return freed if freed and freed.converged and not ran_away(freed) else None


def _with_effects(fitted: Fit | None, extended: Fit, kept: tuple[str, ...]) -> Fit | None:
    """Extend a fit by some of the effects, which start at their fitted amplitudes; None if that fails."""
    effects = [e for e in extended.model.effects if e.name in kept]
    if fitted is None or not effects:
        return fitted
    values = [
        extended.parameters.get(f"{e.name}.{p}", e.parameters[p]) for e in effects for p in e.amplitudes
    ]
    return attempted(extend, fitted, effects, values)
