"""A curve that an equation lacks, with its band, where the data are, and formulas for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

from .style import AFTER, ALIKE, AXES, BEFORE, FLOOR, MEASURED, new_axes, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

#: What a curve adds to, its unit, and by what its SI value is multiplied.
_SLOTS: dict[str, tuple[str, str, float]] = {
    "torque": ("torque", "cm²/s²", 1e4),
    "friction": ("friction coefficient", "cm²/s", 1e4),
    "lateral": ("contact's velocity to the right", "mm/s", 1e3),
    "vertical": ("contact's velocity upwards", "mm/s", 1e3),
}
_COORDINATES: dict[str, tuple[str, str, float]] = {
    **AXES,
    "|Omega|": ("speed |Ω|", "rad/s", 1.0),
    "theta": ("direction θ of the centre from the contact", "rad", 1.0),
}
_COLOURS = (BEFORE, FLOOR, ALIKE)
_PLACES = 300


def curve(curve: Any, ax: Axes | None = None, *, formulas: Sequence[Any] = ()) -> Axes:
    """What an equation lacks as a function of a coordinate, with a band that holds it with 95 %.

    The band is drawn where the record has been; how often it was where, the marks at the bottom say.

    Parameters
    ----------
    curve : Curve
        Of one coordinate.
    ax : Axes, optional
    formulas : sequence of Formula
        Drawn beside it, three at most, each with as much of what the model's own parameters can do.

    Returns
    -------
    Axes
    """
    if not hasattr(curve, "coefficients") or not hasattr(curve, "slot"):
        raise UddError(f"a curve of a scan can be drawn, not {type(curve).__name__}")
    if len(curve.coordinates) != 1:
        raise UddError("a curve of one coordinate can be drawn, not a surface")
    name = curve.coordinates[0].name
    plain = (name, "", 1.0)
    words, unit, across = _COORDINATES.get(name, plain)
    slot, slot_unit, up = _SLOTS.get(curve.slot.name, (f"d{curve.slot.name}/dt", "", 1.0))
    places = curve.places[0]
    places = np.mod(places, 2 * np.pi) if curve.splines[0].periodic else places
    low, high = np.quantile(places, (0.002, 0.998))
    x = np.linspace(low, high, _PLACES)
    value, error = up * curve.values(x), up * curve.errors(x)
    ax = new_axes(ax)
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
    for one, colour in zip(formulas, _COLOURS, strict=False):
        ax.plot(
            across * x, up * curve.beside(one.values(x), x), "--", color=colour, linewidth=1.4, label=one.text
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
    ax.set_xlabel(f"{words} [{unit}]" if unit else words)
    ax.set_ylabel(f"{slot} [{slot_unit}]" if slot_unit else slot)
    ax.legend(frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    tidy(ax)
    return ax
