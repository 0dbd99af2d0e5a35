"""Residuals of a fit: of each equation and of each observed channel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .inputs import first_film, require_fit
from .style import (
    AFTER,
    CHANNELS,
    EQUATIONS,
    MEASURED,
    axis_of,
    label,
    legend_above,
    new_axes,
    require_colour,
    tidy,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_BINS = 24


@checked_arguments(error=UddError)
def residuals(
    fit: Any,
    ax: Axes | None = None,
    *,
    equation: str | None = None,
    against: str | None = None,
    colour: str = AFTER,
) -> Axes:
    """Draw the residual of one equation, frame by frame, with its mean along a coordinate.

    The residual is the fitted state minus the model's prediction from the state before, per second. If the
    model is right, the residual is noise about zero along every coordinate.

    Parameters
    ----------
    fit : Fit
    ax : Axes, optional
    equation : str, optional
        The state whose rate it is; by default the one with the clearest pattern.
    against : str, optional
        ``"t"``, a state, ``"R"`` or the direction ``"theta"`` of a disk (angles modulo one turn); by default
        that, but for t, along which the pattern is clearest.
    colour : str
        Of the means.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        No such equation or coordinate, or not a fit.

    See Also
    --------
    udd.fit : makes the fit.
    udd.plot.residual_map : all equations and coordinates.
    udd.plot.misfit : draw over time.
    """
    require_fit(fit)
    require_colour(colour)
    names = fit.model.state_names
    if equation is not None and equation not in names:
        raise UddError(f"the model has equations for {', '.join(names)}, not for {equation}")
    places = coordinates(fit)
    if against is not None and against not in places:
        raise UddError(f"a residual can be drawn against {', '.join(places)}, not {against}")
    if equation is None or against is None:
        equation, against = clearest(fit, equation, against)
    words, unit, factor = EQUATIONS.get(equation, (f"{equation}'", "1", 1.0))
    along, times = axis_of(fit.model, against)
    x, y = times * places[against], factor * fit.defect[:, names.index(equation)]
    ax = new_axes(ax)
    ax.plot(x, y, ".", color=MEASURED, alpha=0.35, markersize=2.5, rasterized=True)
    centre, mean, error = binned(x, y)
    ax.errorbar(
        centre,
        mean,
        2 * error,
        color=colour,
        marker="o",
        markersize=4,
        linewidth=1.6,
        capsize=2,
        label="mean ± 2 s.e.",
    )
    ax.axhline(0, color="black", linewidth=0.8)
    ax.set_xlabel(along)
    ax.set_ylabel(f"residual of {words} [{unit}]")
    tidy(ax)
    return ax


@checked_arguments(error=UddError)
def misfit(fit: Any, ax: Axes | None = None, *, channel: str | None = None) -> Axes:
    """Draw measured minus fitted values over time, with a band of two standard deviations of the noise.

    Parameters
    ----------
    fit : Fit
    ax : Axes, optional
    channel : str, optional
        One of the measurement's columns, or of a model's sensors; by default the first.

    Returns
    -------
    Axes

    See Also
    --------
    udd.fit : makes the fit.
    udd.plot.residuals : draw the residuals of the equations.
    udd.plot.whiteness : draw the autocorrelation.

    Notes
    -----
    If several measurements were fitted together, the first is drawn.
    """
    require_fit(fit)
    fit = first_film(fit)
    names = fit.measurement.names
    channel = names[0] if channel is None else channel
    if channel not in names:
        raise UddError(f"the measurement has {', '.join(names)}, not {channel}")
    words, unit, factor = CHANNELS.get(channel, (channel, "1", 1.0))
    k = fit.channels.index(channel)
    sd = fit.noise.sd(fit.record, fit.states[:, 0])[:, k]
    there = np.isfinite(sd)
    ax = new_axes(ax)
    t = fit.record.t + fit.record.origin
    ax.fill_between(
        t[there],
        -2 * factor * sd[there],
        2 * factor * sd[there],
        color=AFTER,
        alpha=0.2,
        linewidth=0,
        label="noise, ± 2 s.d.",
    )
    # A few outliers would press all else flat: they are shown on the edge.
    y, edge = factor * fit.misfit[:, k], 6 * factor * float(np.median(sd[there]))
    looks: dict[str, Any] = {"color": MEASURED, "linestyle": "none", "rasterized": len(t) > 3000}
    ax.plot(t, y, marker=".", markersize=2.5, label="measured − fitted", **looks)
    if np.nanmax(np.abs(y)) > edge:
        ax.set_ylim(-edge, edge)
        for sign, marker in ((1, "^"), (-1, "v")):
            out = sign * y > edge
            ax.plot(t[out], np.full(int(out.sum()), sign * 0.96 * edge), marker=marker, markersize=4, **looks)
    ax.axhline(0, color="black", linewidth=0.8)
    ax.set_xlabel(label("t"))
    ax.set_ylabel(f"{words}: measured − fitted [{unit}]")
    legend_above(ax)
    tidy(ax)
    return ax


def coordinates(fit: Any) -> dict[str, Array]:
    """Return the coordinates of a residual, at the frame from which each flow starts."""
    columns = dict(zip(fit.model.state_names, fit.states[:-1].T, strict=True))
    result = {"t": fit.record.clock[:-1], **columns}
    if "beta" in columns:
        result["beta"] = np.mod(columns["beta"], 2 * np.pi)
    for coordinate in fit.model.profile.discovery.coordinates(fit.model):
        values = coordinate.of(result["t"], fit.states[:-1])
        result[coordinate.name] = np.mod(values, 2 * np.pi) if coordinate.angle else values
    return result


def clearest(fit: Any, equation: str | None = None, against: str | None = None) -> tuple[str, str]:
    """Return the equation and the coordinate for which the residual has the clearest pattern."""
    names = fit.model.state_names
    best, panel = -1.0, (names[0], "t")
    for name in [equation] if equation else names:
        for place, x in coordinates(fit).items():
            if place != against and (against is not None or place == "t"):
                continue  # along time, whatever changes slowly looks like a pattern
            share = pattern(x, fit.defect[:, names.index(name)])
            if share > best:
                best, panel = share, (name, place)
    return panel


def pattern(x: Array, y: Array) -> float:
    """Share of the variance of `y` that its means along `x` explain, less what chance explains."""
    there = np.isfinite(x) & np.isfinite(y)
    n = int(there.sum())
    if n < 3 * _BINS:
        return 0.0
    x, y = x[there], y[there] - y[there].mean()
    number = np.argsort(np.argsort(x, kind="stable"), kind="stable") * _BINS // n
    count = np.bincount(number, minlength=_BINS)
    mean = np.bincount(number, y, minlength=_BINS) / count
    total = float(y @ y)
    return float(count @ mean**2) / total - (_BINS - 1) / (n - 1) if total > 0 else 0.0


def binned(x: Array, y: Array, bins: int = _BINS) -> tuple[Array, Array, Array]:
    """Means of `y` along `x` with their standard errors, in bins that hold equally many frames.

    Neighbouring frames go together. The errors come from the scatter of stretches of frames much longer than
    `y` remembers; those of white noise would be too small by a half or more.
    """
    there = np.isfinite(x) & np.isfinite(y)
    n = int(there.sum())
    bins = min(bins, max(n // 8, 1))
    if n < 2:
        return np.empty(0), np.empty(0), np.empty(0)
    stretch = np.flatnonzero(there) // min(_remembered(y), max(n // bins // 6, 1))
    x, y = x[there], y[there]
    number = np.argsort(np.argsort(x, kind="stable"), kind="stable") * bins // n
    count = np.bincount(number, minlength=bins)
    centre = np.bincount(number, x, minlength=bins) / count
    mean = np.bincount(number, y, minlength=bins) / count
    _, stretch = np.unique(stretch, return_inverse=True)
    cells = number * (int(stretch.max()) + 1) + stretch
    size = bins * (int(stretch.max()) + 1)
    sums = np.bincount(cells, y - mean[number], minlength=size).reshape(bins, -1)
    used = (np.bincount(cells, minlength=size).reshape(bins, -1) > 0).sum(axis=1)
    share = used / np.maximum(used - 1, 1)
    return centre, mean, np.sqrt(share * (sums**2).sum(axis=1)) / count


def _remembered(y: Array) -> int:
    """Return a number of frames three times as long as the correlation of `y`."""
    x = np.nan_to_num(y - np.nanmean(y))
    power = float(x @ x)
    for lag in range(1, min(len(x) // 4, 400)):
        if float(x[lag:] @ x[:-lag]) < 0.1 * power:
            return 3 * lag
    return max(len(x) // 4, 1)
