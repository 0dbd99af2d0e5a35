"""A discovery as the page shows it: the verdict and its numbers."""

from __future__ import annotations

import math
from typing import Any

from udd.errors import ModelError
from udd.fitting.diagnostics import units
from udd.fitting.parameter_meanings import meaning
from udd.models import Disk
from udd.models.serialization import model_to_dict
from udd.plot.evidence import decreases
from udd.report import tables, wording
from udd.report.document import text_of

from .driven_models import CONSTANTS
from .spec import model_of


def of(discovery: Any) -> dict[str, Any]:
    """Return the top of the result: the verdict and its numbers."""
    numbers = wording.headline(discovery)
    origin = [str(text)] if (text := discovery.measurement.meta.get("origin")) else []
    return {
        "verdict": discovery.verdict,
        "sentence": _symbols(wording.verdict(discovery)),
        "effects": [
            {
                "title": _symbols(e.title),
                "equation": _symbols(e.equation),
                "values": _values(e),
                "p": e.p,
            }
            for e in discovery.effects
        ],
        "limits": [*origin, *(_symbols(text) for text in wording.short_limits(discovery))],
        "constants": _constants(discovery),
        "of_spread": discovery.error_before.unit == "spread",
        "no_more_than_noise": [bool(numbers.before_note), bool(numbers.after_note)],
        "before": numbers.before,
        "after": numbers.after if discovery.effects else None,
        "floor": numbers.floor,
        "horizon": discovery.horizon,
        "ratio": numbers.ratio if discovery.effects else None,
        "interval": numbers.interval if discovery.effects else None,
        "errors": [{key: text_of(text) for key, text in row.items()} for row in tables.errors(discovery)],
        "evidence": _evidence(discovery),
        "explore": _explore(discovery),
    }


def _evidence(discovery: Any) -> list[dict[str, Any]]:
    """Return the decrease of chi2 by the best candidates, the largest first: of a fit if there is one."""
    scored = discovery.scans[0][:8] if discovery.scans else []
    fitted = decreases(discovery, 0) if scored else {}
    chi2 = [(s.candidate.title, fitted.get(s.candidate.title, s.chi2)) for s in scored]
    best_first = sorted(chi2, key=lambda pair: -pair[1] if math.isfinite(pair[1]) else math.inf)
    return [
        {"title": _symbols(title), "chi2": value if math.isfinite(value) else None}
        for title, value in best_first
    ]


def _symbols(text: str) -> str:
    """Return a formula or a sentence with Greek letters and minus signs, and indices as in W_c."""
    return text_of(wording.pretty(text))


def _constants(discovery: Any) -> list[dict[str, str]]:
    """Return the fitted constants of the model: name, meaning, value with its standard error, unit."""
    fit, rows = discovery.fit, []
    for name, unit in units(fit).items():
        if name not in fit.model.parameters or "." in name:
            continue  # a parameter of the camera, or of an effect, which the formula shows
        words, known_unit = CONSTANTS.get(name, ("", "")) if fit.model.profile.written else ("", "")
        value = wording.with_error(fit.parameters[name], fit.errors[name])
        rows.append(
            {
                "name": text_of(wording.pretty(name)),
                "meaning": words or meaning(name, discovery.measurement.kind),
                "value": text_of(value),
                "unit": text_of(wording.pretty(unit or known_unit)),
            }
        )
    return rows


def _values(effect: Any) -> list[str]:
    units = {p.name: p.unit for p in effect.effect.spec.parameters}
    return [
        text_of(
            f"{wording.pretty(name)} = {wording.with_error(value, effect.errors.get(name))}"
            f" {units.get(name, '')}"
        )
        for name, value in effect.parameters.items()
        if not wording.is_spline(effect.effect)
    ]


def _explore(discovery: Any) -> dict[str, Any] | None:
    """Return the fitted model and its first state, to run on the page; None if the page cannot show it."""
    model = discovery.fit.models[0]
    if not isinstance(model, Disk) or any(e.made is not None for e in model.effects):
        return None
    written = model_to_dict(model)
    try:
        model_of(written)
    except ModelError:  # a fitted value outside its physical range
        return None
    return {"model": written, "state": discovery.fit.states[0].tolist()}
