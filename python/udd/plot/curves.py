"""A curve or a surface that an equation lacks, with its error, where the data are, and formulas for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .inputs import require
from .style import AFTER, ALIKE, AXES, BEFORE, FLOOR, MEASURED, legend_above, new_axes, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

#: By slot: the quantity that a curve adds to, its unit, and the factor from SI.
_SLOTS: dict[str, tuple[str, str, float]] = {
    "torque": ("torque", "cm²/s²", 1e4),
    "friction": ("friction coefficient", "cm²/s", 1e4),
    "lateral": ("contact's velocity to the right", "mm/s", 1e3),
    "vertical": ("contact's velocity upwards", "mm/s", 1e3),
}
_COORDINATES: dict[str, tuple[str, str, float]] = {
    **AXES,
    "|Omega|": ("speed |Ω|", "rad/s", 1.0),
}
_COLOURS = (BEFORE, FLOOR, ALIKE)
_PLACES = 300
_ACROSS = 60  # along each coordinate of a surface


@checked_arguments(error=UddError)
def curve(curve: Any, ax: Axes | None = None, *, formulas: Sequence[Any] = ()) -> Axes:
    """Draw the missing term of an equation as a function of a coordinate, with its 95 % band.

    The band covers the range of the record; marks at the bottom show how often the record visits each place.
    A surface is drawn in colours, with the places of the record; within the hatched parts it may be zero.

    Parameters
    ----------
    curve : Curve
        Curve over one coordinate, or over two.
    ax : Axes, optional
    formulas : sequence of Formula
        At most three, drawn for comparison; each may use the model's other parameters to the same degree.

    Returns
    -------
    Axes

    See Also
    --------
    udd.discover : estimates the curve.
    udd.effects.curve : an effect from a curve.
    udd.plot.residuals : draw the residuals.
    """
    require(curve, "a curve of a scan can be drawn", "coefficients", "slot")
    ax = new_axes(ax)
    if len(curve.coordinates) == 2:
        return _surface(curve, ax)
    label, across = _axis(curve.coordinates[0].name)
    said, up = _value(curve)
    places, x = _range(curve, 0, _PLACES)
    value, error = up * curve.values(x), up * curve.errors(x)
    ax.fill_between(
        across * x,
        value - 1.96 * error,
        value + 1.96 * error,
        color=AFTER,
        alpha=0.2,
        linewidth=0,
        label="95 % band",
    )
    ax.plot(across * x, value, color=AFTER, linewidth=2, label="the curve")
    for formula, colour in zip(formulas, _COLOURS, strict=False):
        ax.plot(
            across * x,
            up * curve.aligned_with(formula.values(x), x),
            "--",
            color=colour,
            linewidth=1.4,
            label=formula.text,
        )
    ax.axhline(0, color="black", linewidth=0.8)
    shown = np.quantile(places, np.linspace(0.002, 0.998, 200))
    ax.plot(
        across * shown,
        np.full(len(shown), 0.015),
        "|",
        transform=ax.get_xaxis_transform(),
        color=MEASURED,
        markersize=5,
        alpha=0.5,
    )
    ax.set_xlabel(label)
    ax.set_ylabel(said)
    legend_above(ax)
    tidy(ax)
    return ax


def _axis(name: str) -> tuple[str, float]:
    """Return the label of a coordinate's axis, and the factor of its SI value."""
    words, unit, across = _COORDINATES.get(name, (name, "", 1.0))
    return f"{words} [{unit}]" if unit else words, across


def _value(curve: Any) -> tuple[str, float]:
    """Return the label of the quantity that a curve adds to, and the factor from SI."""
    slot, unit, up = _SLOTS.get(curve.slot.name, (curve.slot.name, "", 1.0))
    return f"{slot} [{unit}]" if unit else slot, up


def _range(curve: Any, k: int, number: int) -> tuple[Array, Array]:
    """Return the places of the record along a coordinate, and evenly spaced places over their range."""
    places = np.mod(curve.places[k], 2 * np.pi) if curve.splines[k].periodic else curve.places[k]
    low, high = np.quantile(places, (0.002, 0.998))
    return places, np.linspace(low, high, number)


def _surface(curve: Any, ax: Axes) -> Axes:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.ticker import MaxNLocator

    (first_visited, x), (second_visited, y) = (_range(curve, k, _ACROSS) for k in (0, 1))
    (first, by), (second, times) = (_axis(c.name) for c in curve.coordinates)
    said, up = _value(curve)
    grid = np.meshgrid(x, y, indexing="ij")
    value, error = up * curve.values(*grid), up * curve.errors(*grid)
    most = float(np.abs(value).max())
    levels = MaxNLocator(20, symmetric=True).tick_values(-most, most)
    shown = ax.contourf(by * grid[0], times * grid[1], value, levels, cmap="RdBu_r")
    doubtful = np.abs(value) < 1.96 * error
    ax.contourf(by * grid[0], times * grid[1], doubtful, [0.5, 1.5], colors="none", hatches=["///"])
    ax.plot(by * first_visited, times * second_visited, ".", color=MEASURED, markersize=1.5, alpha=0.4)
    ax.figure.colorbar(shown, ax=ax, label=said)
    unsure = Patch(facecolor="none", edgecolor="black", hatch="///", label="0 lies in the 95 % band")
    been = Line2D([], [], color=MEASURED, linestyle="", marker=".", markersize=4, label="the record")
    legend_above(ax, [unsure, been], [str(unsure.get_label()), str(been.get_label())])
    ax.set_xlabel(first)
    ax.set_ylabel(second)
    ax.set_xlim(by * x[0], by * x[-1])
    ax.set_ylim(times * y[0], times * y[-1])
    tidy(ax)
    return ax
