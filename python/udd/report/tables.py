"""The page's tables: rows of text."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from udd._util.odds import odds
from udd._util.small_units import small_unit
from udd.fitting.diagnostics import units
from udd.fitting.parameter_meanings import meaning
from udd.plot.evidence import decreases
from udd.plot.whiteness import shown_lags

from . import wording
from .loose_fit import loosest

if TYPE_CHECKING:
    from udd.discovery.results import Discovery
    from udd.fitting import Fit
    from udd.fitting.innovations import Innovations


def parameters(discovery: Discovery) -> list[dict[str, str]]:
    """List the model's free parameters: name, meaning, before, after, unit."""
    hidden, model_parameters = _knots(discovery), discovery.fit.model.parameters
    return _rows(discovery, lambda name: _base(name) in model_parameters and _base(name) not in hidden)


def camera(discovery: Discovery) -> list[dict[str, str]]:
    """List the fitted parameters of the camera: name, meaning, before, after, unit."""
    model_parameters = discovery.fit.model.parameters
    return _rows(discovery, lambda name: _base(name) not in model_parameters, share=("%", 100.0))


def _base(name: str) -> str:
    """Return a parameter's name without the number of its film."""
    return name.partition("[")[0]


def _of_film(name: str) -> str:
    """Return the film of a parameter in brackets; empty if there is only one."""
    film = name.partition("[")[2].rstrip("]")
    return f" (film {int(film) + 1})" if film else ""


def _knots(discovery: Discovery) -> set[str]:
    """Return the parameters of curves, which a picture shows better."""
    curves = [e for e in discovery.fit.model.effects if wording.is_spline(e)]
    return {f"{e.name}.{p}" for e in curves for p in e.parameters}


def _rows(
    discovery: Discovery, wanted: Callable[[str], bool], share: tuple[str, float] = ("", 1.0)
) -> list[dict[str, str]]:
    unit_of = units(discovery.fit)
    # Numbers as of `udd fit`: their standard errors contain what the known model misses.
    baseline = loosest(discovery.baseline).with_diagnostics() if discovery.effects else discovery.baseline
    rows = []
    for name in filter(wanted, discovery.fit.parameters):
        if _base(name) == "shutter":
            rows.append(
                {
                    "name": wording.pretty("shutter"),
                    "meaning": "time for which the shutter is open" + _of_film(name),
                    "before": _open_time(baseline, name),
                    "after": _open_time(discovery.fit, name),
                    "unit": wording.pretty("ms"),
                }
            )
            continue
        unit, factor = small_unit(unit_of[name]) if unit_of[name] else share
        rows.append(
            {
                "name": wording.pretty(_base(name).split(".")[-1]),
                "meaning": _meaning(_base(name), discovery) + _of_film(name),
                "before": _value(baseline, name, factor),
                "after": _value(discovery.fit, name, factor),
                "unit": wording.pretty(unit),
            }
        )
    return rows


def fixed(discovery: Discovery) -> list[dict[str, str]]:
    """List the fixed parameters of the model: name, meaning, value, unit."""
    model = discovery.fit.model
    rows = []
    for name, value in model.parameters.items():
        if name not in {_base(n) for n in discovery.fit.parameters} | _knots(discovery):
            rows.append(
                {
                    "name": wording.pretty(name.split(".")[-1]),
                    "meaning": _meaning(name, discovery),
                    "value": f"{value:.5g}",
                    "unit": wording.pretty(model.units[name]),
                }
            )
    return rows


def _value(fit: Fit, name: str, factor: float) -> str:
    if name not in fit.parameters:
        return "–"
    return wording.with_error(factor * fit.parameters[name], factor * fit.errors[name])


def _open_time(fit: Fit, name: str) -> str:
    """Format the time for which the shutter is open [ms]; the fit has its square, divided by 24 [s^2]."""
    if name not in fit.parameters:
        return "–"
    square, error = 24.0 * fit.parameters[name], 24.0 * fit.errors[name]
    if square <= 2.0 * error:
        return f"at most {1e3 * math.sqrt(max(square, 0.0) + 2.0 * error):.2g}"
    time = math.sqrt(square)
    return wording.with_error(1e3 * time, 1e3 * error / (2.0 * time))


def _meaning(name: str, discovery: Discovery) -> str:
    effect, dot, parameter = name.partition(".")
    if not dot:
        return meaning(name, discovery.measurement.kind) or name
    added = next((f for f in discovery.effects if f.effect.name == effect), None)
    return f"{added.title if added else effect}: {wording.pretty(parameter)}"


def measured(discovery: Discovery) -> Markup:
    """Describe the measured data in a few sentences."""
    m, model = discovery.measurement, discovery.baseline.model
    several = len(discovery.fit.measurements)
    usable = int(m.seen.sum())
    rate = 1.0 / float(np.median(np.diff(m.t)))
    frames = f"{len(m)} frames" + ("" if usable == len(m) else f", {usable} of them usable,")
    what = model.profile.shown.measured(model, discovery.baseline.problem.models[0])
    if several > 1:
        what = f"{several} records, fitted together; the pictures of the motion show the first. {what}"
    return Markup(f"{what}: {frames} over {m.duration:.1f}\u00a0s, {rate:.3g} in a second.")


def whiteness(innovations: Sequence[Innovations]) -> list[dict[str, str]]:
    """List the tests of the innovations, channel by channel, before and after."""
    rows = []
    for k, name in enumerate(innovations[0].names):
        for model_innovations, model in zip(innovations, ("known model", "with the effect"), strict=False):
            lags = shown_lags(model_innovations)
            rho, _ = model_innovations.autocorrelation(lags)
            rows.append(
                {
                    "name": wording.pretty(name) if model == "known model" else "",
                    "model": model,
                    "square": f"{model_innovations.chi2[k]:.3g}",
                    "largest": f"{rho[int(np.abs(rho[:, k]).argmax()), k]:+.2f}".replace("-", "−"),
                    "p": wording.probability(float(model_innovations.ljung_box(lags)[1][k])),
                }
            )
    return rows


def noise_beforehand(fit: Fit) -> str:
    """Name the noise at the start of a fit: stated, or assumed if the record has no standard errors."""
    stated = any(m.sigma is not None for m in fit.measurements)
    return "the measurement said" if stated else "assumed beforehand"


def noise(fit: Fit) -> list[dict[str, str]]:
    """List the fitted noise: channel, at rest, growth with the speed, value at the start."""
    rows = []
    for k, name in enumerate(fit.measurement.names):
        sigma = fit.record.sigma[:, k]
        stated = float(np.median(sigma[np.isfinite(sigma)]))
        unit = "m" if name in ("Y", "Z") else "rad"
        rows.append(
            {
                "name": wording.pretty(name),
                "found": wording.length(stated * float(fit.noise.factor[k]), unit),
                "growth": wording.length(float(fit.noise.blur[k]), unit) + " per rad/s",
                "stated": wording.length(stated, unit),
            }
        )
    return rows


def errors(discovery: Discovery) -> list[dict[str, str]]:
    """List the held-out errors at every horizon."""
    before, after = discovery.error_before, discovery.error_after
    rows = []
    for h in before.horizons:
        b, a = before.at(h), after.at(h)
        rows.append(
            {
                "horizon": f"{h:.3g} s",
                "before": _interval(b, before.unit),
                "after": _interval(a, after.unit),
                "floor": wording.length(a[3], after.unit),
            }
        )
    if discovery.horizon is None:
        whole = {key: wording.length(e.whole, e.unit) for key, e in (("before", before), ("after", after))}
        rows.append({"horizon": "all of it (r.m.s.)", **whole, "floor": "–"})
    return rows


def _interval(e: tuple[float, float, float, float], unit: str) -> str:
    low, high = wording.length(e[1], unit).split()[0], wording.length(e[2], unit).split()[0]
    return f"{wording.length(e[0], unit)} ({low} to {high})"


def curves(discovery: Discovery, stage: int, most: int = 6) -> list[dict[str, str]]:
    """List the best curves."""
    scans = discovery.curves
    return [
        {"title": c.title, "evidence": odds(c.evidence), "p": wording.probability(c.p)}
        for c in (scans[stage][:most] if stage < len(scans) else [])
    ]


def candidates(discovery: Discovery, stage: int, most: int = 12) -> list[dict[str, str]]:
    """List the scores of the best candidates."""
    rows = []
    accepted = {f.tried or f.title for f in discovery.effects}
    alike = {a.title for a in discovery.alternatives}
    fitted = decreases(discovery, stage)
    for s in discovery.scans[stage][:most] if stage < len(discovery.scans) else []:
        title = s.candidate.title
        rows.append(
            {
                "title": title,
                "equation": s.candidate.effect.equation,
                "chi2": "–" if s.absorbed else f"{fitted.get(title, s.chi2):.1f}",
                "estimate": "–"
                if s.absorbed
                else Markup(", ").join(
                    Markup("{} = {}").format(wording.pretty(p), wording.with_error(v, e))
                    for p, v, e in zip(s.candidate.effect.amplitudes, s.amplitudes, s.errors, strict=True)
                ),
                "said": "found"
                if title in accepted
                else "cannot be distinguished"
                if title in alike
                else "not visible in this record"
                if s.absorbed
                else "unphysical"
                if not s.physical
                else "",
            }
        )
    return rows
