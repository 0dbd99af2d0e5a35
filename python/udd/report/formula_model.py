"""What the page of a user's own model shows: plain pictures of its states, and its numbers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from udd.plot.style import AFTER, BEFORE, MEASURED, tidy

from . import figures, wording
from .images import Image, blank, png, svg
from .runs import side_by_side

_SHOWN = 8.0  # longest horizons of the held-out errors that the free runs are shown for


def draw(discovery: Any, innovations: list[Any]) -> dict[str, Any]:
    """The pictures by name."""
    return {
        "forecast": _free_runs(discovery),
        "errors": figures.errors(discovery),
        "misfit": _misfits(discovery.fit),
        "whiteness": figures.whiteness(innovations),
        "evidence": [figures.evidence(discovery, stage) for stage in range(len(discovery.scans))],
        "curves": [figures.curve(f.curve) for f in discovery.effects if wording.is_spline(f.effect)],
    }


def parameters(discovery: Any) -> list[SimpleNamespace]:
    """Every free parameter, before and after."""
    rows = []
    for name in discovery.fit.parameters:
        before, after = (
            wording.with_error(fit.parameters[name], fit.errors[name]) if name in fit.parameters else "–"
            for fit in (discovery.baseline, discovery.fit)
        )
        rows.append(SimpleNamespace(name=name, before=before, after=after))
    return rows


def equations(discovery: Any) -> list[str]:
    """The known model."""
    return [f"{name}' = {text}" for name, text in discovery.baseline.model.equations.items()]


def measured(discovery: Any) -> str:
    """What was measured, in a sentence."""
    m, fit = discovery.measurement, discovery.fit
    sd = np.median(fit.noise.sd(fit.record, fit.states[:, 0]), axis=0)
    seen = [(name, s) for name, s in zip(fit.channels, sd, strict=True) if np.isfinite(s)]
    noise = ", ".join(f"{s:.2g} in {name}" for name, s in seen)
    hidden = [name for name in fit.channels if name not in m.names]
    what = f"{', '.join(m.names)} in {len(m)} frames over {m.duration:.4g} s"
    rest = f" Not seen: {', '.join(hidden)}." if hidden else ""
    return f"{what}; noise as the record shows it: {noise}.{rest}"


def _free_runs(discovery: Any) -> Image:
    names = [name for name in discovery.fit.channels if name in discovery.measurement.names]
    t, seen, found = side_by_side(discovery, _SHOWN * discovery.error_before.horizons[-1])
    figure, grid = blank(9.0, 1.7 * len(names) + 0.9, rows=len(names), top=0.4)
    said = (("the known model", BEFORE), ("with what was added", AFTER))
    for (ax,), name in zip(grid, names, strict=True):
        k = discovery.fit.channels.index(name)
        ax.plot(t, seen[:, k], ".", color=MEASURED, markersize=3, label="measured")
        for values, (label, colour) in zip(found, said, strict=False):
            ax.plot(t, values[:, k], color=colour, linewidth=1.4, label=label)
        low, high = np.nanmin(seen[:, k]), np.nanmax(seen[:, k])
        ax.set_ylim(low - 0.3 * (high - low), high + 0.3 * (high - low))
        ax.set_ylabel(name)
        tidy(ax)
    grid[-1][0].set_xlabel("t")
    grid[0][0].legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    return svg(figure, "The states over time: measured, and free runs of the models")


def _misfits(fit: Any) -> Image:
    names = [name for name in fit.channels if name in fit.measurement.names]
    figure, grid = blank(9.0, 1.5 * len(names) + 0.7, rows=len(names))
    sd = fit.noise.sd(fit.record, fit.states[:, 0])
    for (ax,), name in zip(grid, names, strict=True):
        k = fit.channels.index(name)
        ax.plot(fit.record.clock, fit.misfit[:, k], ".", color=MEASURED, markersize=2)
        band = 1.96 * float(np.median(sd[np.isfinite(sd[:, k]), k]))
        ax.axhspan(-band, band, color=AFTER, alpha=0.15)
        ax.set_ylabel(name)
        tidy(ax)
    grid[-1][0].set_xlabel("t")
    return png(figure, "Measured less fitted, with a band for the noise that was found")
