"""Style of all pictures: colours, names of axes, and new Axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from udd.errors import UddError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's palette, for colour-blind readers; lightness differs too, for grey prints.
MEASURED = "#4d4d4d"
BEFORE = "#d55e00"
AFTER = "#0072b2"
ALIKE = "#e69f00"
FLOOR = "#000000"
FAINT = "#c4c4c4"
#: Colours of curves that differ in nothing else.
SHADES = (AFTER, BEFORE, "#009e73", "#cc79a7", "#e69f00", "#56b4e9")

MANY = 20_000
"""Dots that are drawn as a picture."""

#: By coordinate: its name on an axis, its unit, and the factor from SI.
AXES: dict[str, tuple[str, str, float]] = {
    "t": ("time T", "s", 1.0),
    "Omega": ("angular velocity Ω", "rad/s", 1.0),
    "Y": ("Y (to the right)", "cm", 100.0),
    "Z": ("Z (up)", "cm", 100.0),
    "beta": ("orientation β", "rad", 1.0),
    "theta": ("direction θ from the pivot", "rad", 1.0),
    "omega": ("ω", "1", 1.0),
    "y": ("y", "1", 1.0),
    "z": ("z", "1", 1.0),
    "tau": ("time t", "1", 1.0),
    "J": ("J = I Ω − W Y", "cm²/s = 10⁻⁴ m²/s", 1e4),
    "k": ("friction coefficient k", "m²/s", 1.0),
    "R": ("distance R from the contact", "cm", 100.0),
    "load": ("load F/g − 1", "1", 1.0),
}

#: Residual of the equation for a state's rate, likewise.
EQUATIONS: dict[str, tuple[str, str, float]] = {
    "Omega": ("dΩ/dT", "rad/s²", 1.0),
    "Y": ("dY/dT", "mm/s", 1e3),
    "Z": ("dZ/dT", "mm/s", 1e3),
    "beta": ("dβ/dT", "rad/s", 1.0),
    "theta": ("dθ/dT", "rad/s", 1.0),
}

#: A channel of a measurement, likewise: misfits are small.
CHANNELS: dict[str, tuple[str, str, float]] = {
    "Y": ("Y", "mm", 1e3),
    "Z": ("Z", "mm", 1e3),
    "beta": ("β", "mrad", 1e3),
    "theta": ("θ", "mrad", 1e3),
}


def label(name: str) -> str:
    """Name and unit of a coordinate, as an axis says it."""
    words, unit, _ = AXES[name]
    return f"{words} [{unit}]"


def scale(name: str) -> float:
    """Return the factor of a coordinate's SI value on its axis."""
    return AXES[name][2]


def axis_of(model: Any, name: str) -> tuple[str, float]:
    """Return the label of a component of a model's state, and its factor."""
    if name in AXES:
        return label(name), scale(name)
    units = dict(zip(model.state_names, model.state_units, strict=True))
    return f"{name} [{units.get(name) or '1'}]", 1.0


WIDE, SQUARE = (6.4, 4.4), (5.6, 5.2)
"""Sizes of new figures in inches; a square one for axes with equal scales."""


def new_axes(ax: Axes | None = None, projection: str | None = None, size: tuple[float, float] = WIDE) -> Axes:
    """Return the given Axes, or those of a new figure of this size."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=size, layout="constrained")
    made: Axes = figure.add_subplot(projection=projection)
    return made


def legend_above(
    ax: Axes, handles: Sequence[Any] | None = None, words: Sequence[str] | None = None, **options: Any
) -> None:
    """Put the legend above the axes, in as many columns as fit: next to the axes it would squeeze them."""
    if handles is None or words is None:
        handles, words = ax.get_legend_handles_labels()
    width = ax.get_window_extent().width
    for columns in range(min(len(words), 5), 0, -1):
        legend = ax.legend(
            handles,
            words,
            frameon=False,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.2,
            ncols=columns,
            **options,
        )
        if legend.get_window_extent().width <= width:
            return


def require_colour(colour: object) -> None:
    """Refuse what Matplotlib knows no colour by.

    Raises
    ------
    UddError
    """
    from matplotlib.colors import is_color_like

    if not is_color_like(colour):
        raise UddError(f'colour must be one that Matplotlib knows, such as "#0072b2", not {colour!r:.80}')


def tidy(ax: Axes, grid: bool = True) -> None:
    """Take away what says nothing."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_axisbelow(True)
    if grid:
        ax.grid(color="#e4e4e4", linewidth=0.6)
