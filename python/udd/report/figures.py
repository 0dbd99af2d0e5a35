"""The page's pictures, each drawn on a figure of its own and embedded as a data URI."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from udd import plot
from udd.measurement import Measurement
from udd.plot import fits
from udd.plot.style import AFTER, BEFORE, CHANNELS, EQUATIONS, MEASURED, label, scale, tidy

from . import runs
from .document import Image
from .images import blank, embedded, png, svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from udd.discovery.nonparametric.curve_scan import Curve
    from udd.discovery.results import Discovery
    from udd.fitting import Fit
    from udd.fitting.innovations import Innovations
    from udd.tracking.metric.pixels_to_metres import Pixels

_FRAMES = 4  # of the film


def orbits(discovery: Discovery) -> Image:
    """Draw the measured orbit, and runs of the models."""
    runs_shown = [("the known model alone", discovery.baseline, BEFORE)]
    if discovery.effects:
        runs_shown.append(("with the added effect", discovery.fit, AFTER))
    n = 1 + len(runs_shown)
    figure, grid = blank(3.5 * n, 3.8, columns=n, top=0.55, shared=True)
    axes = grid[0]
    # A measurement that lacks an axis of the orbit is shown as it was fitted.
    fitted = not set(discovery.fit.model.profile.shown.path) <= set(discovery.measurement.names)
    if not fitted:
        plot.orbit(discovery.measurement, axes[0])
    plot.orbit(runs.smooth(discovery.fit), axes[0])
    axes[0].lines[-1 if fitted else -2].set(color=MEASURED, alpha=0.4)
    axes[0].set_title("fitted to the data" if fitted else "measured")
    for ax, (words, fit, colour) in zip(axes[1:], runs_shown, strict=True):
        run = runs.free_run(fit)
        ax.set_title(words)
        if run is None:
            ax.text(0.5, 0.5, "its free run diverges", ha="center", transform=ax.transAxes)
            continue
        plot.orbit(run, ax)
        ax.lines[0].set_color(colour)
        if run.outcome == "ejected":
            at = run.t[-1] - run.t[0]
            ax.set_title(f"{words}\n(this free run loses contact after {at:.3g} s)")
    for ax in axes[1:]:
        ax.set_ylabel("")
        ax.tick_params(labelleft=False)
    return png(
        figure,
        "The path of the disk's centre as measured, and free runs of the fitted models for the same time",
    )


def forecast(discovery: Discovery) -> Image:
    """Draw the first seconds of the held-out data, and the models' predictions."""
    prediction = runs.forecast(discovery)
    name = discovery.fit.model.profile.shown.columns[-1]
    k = discovery.measurement.names.index(name)
    figure, ((ax,),) = blank(9.0, 3.2, top=0.4)
    ax.plot(
        prediction.t_seen,
        scale(name) * prediction.seen[:, k],
        ".",
        color=MEASURED,
        markersize=5,
        label="measured",
    )
    ax.plot(
        prediction.t,
        scale(name) * prediction.before[:, k],
        color=BEFORE,
        linewidth=1.5,
        label="the known model",
    )
    if discovery.effects:
        ax.plot(
            prediction.t,
            scale(name) * prediction.after[:, k],
            color=AFTER,
            linewidth=1.5,
            label="with the added effect",
        )
    if prediction.start >= prediction.t_seen[0]:
        ax.axvline(prediction.start, color="black", linewidth=0.8)
    ax.set_xlabel(label("t"))
    ax.set_ylabel(label(name))
    ax.legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    tidy(ax)
    return svg(figure, f"{name} over time: measured, and free runs of the models from their start")


def residual_map(loose: Sequence[Fit]) -> Image:
    """Draw the mean residual of each equation along each coordinate, before and after."""
    rows = len(loose[0].model.state_names)
    figure, ((ax,),) = blank(9.4, 0.95 * rows + 0.55, left=1.05, bottom=0.5, top=0.05)
    plot.residual_map(loose[-1], ax, before=loose[0] if len(loose) > 1 else None)
    return svg(figure, "Mean residual of every equation along every coordinate, with bands of two errors")


def residuals(loose: Sequence[Fit]) -> Image:
    """Draw the clearest of these patterns frame by frame, before and after."""
    columns = list(zip(("the known model", "with the added effect"), loose, (BEFORE, AFTER), strict=False))
    equation, against = fits.clearest(loose[0])
    figure, grid = blank(4.6 * len(columns) + (0 if len(columns) > 1 else 1.5), 2.9, columns=len(columns))
    spread = []
    k = loose[0].model.state_names.index(equation)
    for ax, (words, fit, colour) in zip(grid[0], columns, strict=True):
        plot.residuals(fit, ax, equation=equation, against=against, colour=colour)
        y = EQUATIONS[equation][2] * fit.defect[:, k]
        _, mean, error = fits.binned(fits.coordinates(fit)[against], y)
        spread.append(max(float(np.nanquantile(np.abs(y), 0.9)), float(np.max(np.abs(mean) + 3 * error))))
        ax.set_title(words)
    for ax in grid[0]:
        ax.set_ylim(-1.15 * max(spread), 1.15 * max(spread))
    for ax in grid[0][1:]:
        ax.set_ylabel("")
        ax.tick_params(labelleft=False)
    return png(figure, "The residual of one equation, frame by frame, along one coordinate")


def curve(located: Curve) -> Image:
    """Draw a curve that was located without a formula."""
    figure, ((ax,),) = blank(6.4, 3.4, top=0.45)
    plot.curve(located, ax)
    return svg(figure, f"{located.title}, with its band")


def evidence(discovery: Discovery, stage: int) -> Image:
    """Draw the evidence for each candidate at one stage of the search."""
    scan = [s for s in discovery.scans[stage] if not s.absorbed][:12]
    longest = max((len(s.candidate.title) for s in scan), default=10)
    figure, ((ax,),) = blank(9.0, 1.2 + 0.28 * len(scan), left=0.4 + 0.072 * longest, top=0.55)
    plot.evidence(discovery, ax, stage=stage)
    ax.legend(frameon=False, loc="lower right", bbox_to_anchor=(1, 1), ncols=3)
    return svg(figure, "Bars: the evidence for each candidate effect; dashed: what chance hardly reaches")


def errors(discovery: Discovery) -> Image:
    """Held-out errors against the horizon."""
    figure, ((ax,),) = blank(6.4, 3.8, top=0.4)
    plot.errors(discovery, ax)
    return svg(figure, "Median error on held-out data against the forecast horizon")


def whiteness(innovations: Sequence[Innovations]) -> Image:
    """Autocorrelation of the innovations, before and after."""
    names = innovations[0].names
    figure, grid = blank(max(3.1 * len(names), 8.0), 2.7, columns=len(names), top=0.4)
    said = (("the known model", BEFORE), ("with the added effect", AFTER))
    for ax, name in zip(grid[0], names, strict=True):
        for each, (words, colour) in zip(innovations, said, strict=False):
            plot.whiteness(each, ax, channel=name, colour=colour, name=words)
        title = CHANNELS[name][0] if name in CHANNELS else name
        ax.text(0.95, 0.95, title, ha="right", va="top", transform=ax.transAxes)
        ax.set_ylabel("autocorrelation" if ax is grid[0][0] else "")
        low = min(float(np.min(line.get_ydata())) for line in ax.lines)
        ax.set_ylim(-0.5 if low > -0.5 else -1.0, 1.0)
        ax.tick_params(labelleft=ax is grid[0][0])
    grid[0][0].legend(frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=3)
    return svg(figure, "Autocorrelation of the innovations against the lag, with the band of white noise")


def friction(fit: Fit) -> Image:
    """Draw the estimated friction."""
    figure, ((ax,),) = blank(6.4, 3.2)
    plot.friction(fit, ax)
    return svg(
        figure, "The fitted friction coefficient against the angular velocity, with its standard error"
    )


def misfits(fit: Fit) -> Image:
    """Draw measured minus fitted values, per channel."""
    names = fit.measurement.names
    figure, grid = blank(9.0, 1.55 * len(names) + 0.7, rows=len(names))
    for (ax,), name in zip(grid, names, strict=True):
        plot.misfit(fit, ax, channel=name)
        ax.set_ylabel("{} [{}]".format(*CHANNELS[name][:2]))
        if ax is not grid[-1][0]:
            ax.set_xlabel("")
            ax.tick_params(labelbottom=False)
        legend = ax.get_legend()
        if ax is not grid[0][0] and legend is not None:
            legend.remove()
    return png(figure, "Measured less fitted, over time, with a band for the noise that was found")


def frames(discovery: Discovery, film: str | os.PathLike[str]) -> Image:
    """Some frames of the film with the fitted disk drawn over them."""
    from udd.tracking import pictures_between, pixels

    m = discovery.measurement
    # From the stretch that the moving picture shows, so that little of the film is decoded.
    rows = np.flatnonzero(m.seen & (m.t >= discovery.split))
    chosen = rows[np.unique(np.linspace(0, min(len(rows) - 1, 60), _FRAMES).astype(int))]
    geometry = pixels(_fitted(discovery.fit))
    figure, grid = blank(2.6 * _FRAMES, 2.9, columns=_FRAMES, left=0.05, bottom=0.05, between=0.1)
    for ax, picture, row in zip(grid[0], pictures_between(film, m.t[chosen], m), chosen, strict=False):
        plot.overlay(picture, geometry, int(row), ax)
        _look_at(geometry, picture.shape, ax)
        ax.set_axis_off()
        ax.set_title(f"T = {m.t[row]:.2f} s", fontsize="medium")
    return embedded(figure, "jpeg", "Frames of the film with the fitted disk drawn over them", dpi=130)


def _look_at(geometry: Pixels, shape: tuple[int, ...], ax: Axes) -> None:
    """Show what the disk can reach, as far as the picture goes."""
    (u, v), reach = geometry.pivot, 2.1 * geometry.radius
    ax.set_xlim(max(u - reach, -0.5), min(u + reach, shape[1] - 0.5))
    ax.set_ylim(min(v + reach, shape[0] - 0.5), max(v - reach, -0.5))


def _fitted(fit: Fit) -> Measurement:
    """Return the fitted measurement of the observed frames."""
    measurement = fit.measurement
    rest = np.where(np.isfinite(fit.residuals), fit.residuals, 0.0)
    return Measurement(
        measurement.t,
        measurement.values - rest,
        meta=measurement.meta,
        names=measurement.names,
        inputs=measurement.inputs,
    )
