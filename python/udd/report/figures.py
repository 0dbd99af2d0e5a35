"""The page's pictures, each drawn on a figure of its own and embedded as a data URI."""

from __future__ import annotations

import base64
import io
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from udd import plot
from udd.errors import UddError
from udd.measurement import Measurement
from udd.plot import fits
from udd.plot.style import AFTER, BEFORE, CHANNELS, EQUATIONS, MEASURED, label, scale, tidy

from . import runs
from .loose import loosest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FRAMES = 4  # of the film


@dataclass(frozen=True)
class Image:
    """A picture with what it shows in words."""

    uri: str
    alt: str


def draw(discovery: Any, film: str | os.PathLike[str] | None) -> dict[str, Any]:
    """All pictures of a discovery; what cannot be shown is absent."""
    result: dict[str, Any] = {
        "orbit": orbits(discovery),
        "forecast": forecast(discovery),
        "residuals": residuals(discovery),
        "evidence": [evidence(discovery, stage) for stage in range(len(discovery.scans))],
        "errors": errors(discovery),
        "friction": friction(discovery.fit),
        "misfit": misfits(discovery.fit),
        "film": frames(discovery, film) if film is not None else None,
    }
    return result


def orbits(discovery: Any) -> Image:
    """The orbit as measured, and as the models run."""
    runs_shown = [("the known model alone", discovery.baseline, BEFORE)]
    if discovery.effects:
        runs_shown.append(("with the added effect", discovery.fit, AFTER))
    n = 1 + len(runs_shown)
    figure = _figure(3.6 * n, 3.8)
    axes = figure.subplots(1, n, sharex=True, sharey=True, squeeze=False)[0]
    pendulum = discovery.measurement.kind == "pendulum"
    if not pendulum:
        plot.orbit(discovery.measurement, axes[0])
    plot.orbit(runs.smooth(discovery.fit), axes[0])
    axes[0].lines[-1 if pendulum else -2].set(color=MEASURED, alpha=0.4)
    axes[0].set_title("fitted to the data" if pendulum else "measured")
    for ax, (words, fit, colour) in zip(axes[1:], runs_shown, strict=True):
        run = runs.free_run(fit)
        ax.set_title(words)
        if run is None:
            ax.text(0.5, 0.5, "its free run diverges", ha="center", transform=ax.transAxes)
            continue
        plot.orbit(run, ax)
        ax.lines[0].set_color(colour)
        if run.outcome == "ejected":
            ax.set_title(f"{words}\n(leaves the wheels after {run.t[-1] - run.t[0]:.3g} s)")
    for ax in axes[1:]:
        ax.set_ylabel("")
    return _svg(
        figure,
        "The path of the disk's centre as measured, and free runs of the fitted models for the same time",
    )


def forecast(discovery: Any) -> Image:
    """The first seconds of the held-out data, and what the models make of them."""
    found = runs.forecast(discovery)
    name = "Z" if discovery.measurement.kind == "disk" else "theta"
    k = discovery.measurement.names.index(name)
    figure = _figure(9.0, 3.2)
    ax = figure.subplots()
    ax.plot(found.t_seen, scale(name) * found.seen[:, k], ".", color=MEASURED, markersize=5, label="measured")
    ax.plot(found.t, scale(name) * found.before[:, k], color=BEFORE, linewidth=1.5, label="the known model")
    if discovery.effects:
        ax.plot(
            found.t,
            scale(name) * found.after[:, k],
            color=AFTER,
            linewidth=1.5,
            label="with the added effect",
        )
    if found.start >= found.t_seen[0]:
        ax.axvline(found.start, color="black", linewidth=0.8)
    ax.set_xlabel(label("t"))
    ax.set_ylabel(label(name))
    ax.legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    tidy(ax)
    return _svg(
        figure, f"{name} over time: measured, and free runs of the models from the moment they are let go"
    )


def residuals(discovery: Any) -> Image:
    """What each equation leaves over, before and after."""
    columns = [("the known model", discovery.baseline, BEFORE)]
    if discovery.effects:
        columns.append(("with the added effect", discovery.fit, AFTER))
    columns = [(words, loosest(fit), colour) for words, fit, colour in columns]
    names = discovery.baseline.model.state_names
    figure = _figure(4.6 * len(columns) + (0 if len(columns) > 1 else 1.5), 2.3 * len(names) + 0.3)
    axes = figure.subplots(len(names), len(columns), squeeze=False, sharey="row")
    for row, name in zip(axes, names, strict=True):
        against = fits.clearest(columns[0][1], name)[1]
        spread = []
        for ax, (_, fit, colour) in zip(row, columns, strict=True):
            plot.residuals(fit, ax, equation=name, against=against, colour=colour)
            y = EQUATIONS[name][2] * fit.defect[:, names.index(name)]
            _, mean, error = fits.binned(fits.coordinates(fit)[against], y)
            spread.append(max(float(np.nanquantile(np.abs(y), 0.9)), float(np.max(np.abs(mean) + 3 * error))))
        row[0].set_ylim(-1.15 * max(spread), 1.15 * max(spread))
        for ax in row[1:]:
            ax.set_ylabel("")
    for ax, (words, _, _) in zip(axes[0], columns, strict=True):
        ax.set_title(words)
    return _svg(
        figure,
        "The residual of each equation against the coordinate along which it shows the clearest pattern",
    )


def evidence(discovery: Any, stage: int) -> Image:
    """The evidence for each candidate at one stage of the search."""
    figure = _figure(9.0, 1.1 + 0.28 * min(12, len(discovery.scans[stage])))
    plot.evidence(discovery, figure.subplots(), stage=stage)
    return _svg(figure, "Bars: the evidence for each candidate effect; dashed: what chance hardly reaches")


def errors(discovery: Any) -> Image:
    """Held-out errors against the horizon."""
    figure = _figure(6.0, 3.8)
    plot.errors(discovery, figure.subplots())
    return _svg(figure, "Median error on held-out data against the time since the model was let go")


def friction(fit: Any) -> Image:
    """The friction that was found."""
    figure = _figure(6.0, 3.2)
    plot.friction(fit, figure.subplots())
    return _svg(
        figure, "The fitted friction coefficient against the angular velocity, with its standard error"
    )


def misfits(fit: Any) -> Image:
    """What was seen less what was fitted, per channel."""
    names = fit.measurement.names
    figure = _figure(9.0, 1.7 * len(names) + 0.4)
    axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for ax, name in zip(axes, names, strict=True):
        plot.misfit(fit, ax, channel=name)
        ax.set_ylabel("{} [{}]".format(*CHANNELS[name][:2]))
        if ax is not axes[-1]:
            ax.set_xlabel("")
        if ax is not axes[0]:
            ax.get_legend().remove()
    return _svg(figure, "Measured less fitted, over time, with a band for the noise that was found")


def frames(discovery: Any, film: str | os.PathLike[str]) -> Image:
    """Some frames of the film with the fitted disk drawn over them."""
    from udd.tracking import pictures_at, pixels

    m = discovery.measurement
    if "px_per_m" not in m.meta:
        raise UddError(f"the measurement was not tracked in a film, so {film} cannot be drawn on")
    rows = discovery.fit.record.row
    seen = np.flatnonzero(rows >= 0)
    chosen = rows[seen[(np.linspace(0.05, 0.95, _FRAMES) * (len(seen) - 1)).astype(int)]]
    geometry = pixels(_fitted(discovery.fit))
    figure = _figure(2.6 * _FRAMES, 3.6)
    axes = figure.subplots(1, _FRAMES, squeeze=False)[0]
    for ax, picture, row in zip(axes, pictures_at(film, [int(r) for r in chosen]), chosen, strict=True):
        plot.overlay(picture, geometry, int(row), ax)
        _look_at(geometry, picture.shape, ax)
        ax.set_axis_off()
        ax.set_title(f"T = {m.t[row]:.2f} s", fontsize="medium")
    return _embedded(figure, "jpeg", "Frames of the film with the fitted disk drawn over them", dpi=130)


def _look_at(geometry: Any, shape: tuple[int, ...], ax: Any) -> None:
    """Show what the disk can reach, as far as the picture goes."""
    (u, v), reach = geometry.pivot, 2.1 * geometry.radius
    ax.set_xlim(max(u - reach, -0.5), min(u + reach, shape[1] - 0.5))
    ax.set_ylim(min(v + reach, shape[0] - 0.5), max(v - reach, -0.5))


def _fitted(fit: Any) -> Measurement:
    """The measurement as the fit says it should have been, where it was seen."""
    measurement = fit.measurement
    rest = np.where(np.isfinite(fit.residuals), fit.residuals, 0.0)
    return Measurement(
        measurement.t, measurement.values - rest, meta=measurement.meta, names=measurement.names
    )


def _figure(width: float, height: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _svg(figure: Figure, alt: str) -> Image:
    return _embedded(figure, "svg", alt, dpi=150)


def _embedded(figure: Figure, kind: str, alt: str, dpi: int) -> Image:
    import matplotlib as mpl

    buffer = io.BytesIO()
    metadata = {"Date": None, "Creator": None} if kind == "svg" else None
    # Without the salt, and with the date, the same result would give another file every time.
    with mpl.rc_context({"svg.hashsalt": "udd"}):
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=metadata, bbox_inches="tight")
    mime = "image/svg+xml" if kind == "svg" else f"image/{kind}"
    return Image(f"data:{mime};base64,{base64.b64encode(buffer.getvalue()).decode()}", alt)
