"""The motion itself: over time, in the picture's plane, in phase space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd.errors import UddError
from udd.simulation.energy import angular_momentum

from .inputs import Motion, motions, only
from .style import (
    AFTER,
    AXES,
    BEFORE,
    FAINT,
    MEASURED,
    SQUARE,
    WIDE,
    legend_above,
    new_axes,
    scale,
    tidy,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = (AFTER, BEFORE, "#009e73", "#cc79a7")


@checked_arguments(error=UddError)
def time_series(result: Any, ax: Axes | None = None, *, coordinates: Sequence[str] | None = None) -> Axes:
    """Draw coordinates over time; of a fit the measured ones as dots and the fitted ones as lines.

    Parameters
    ----------
    result : Trajectory, Measurement or Fit
    ax : Axes, optional
    coordinates : sequence of str, optional
        Which, all in the same unit. By default Y and Z of a disk, theta of a pendulum, y and z of the DLE, of
        another model its first states of one unit.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        A coordinate that the result does not have, or coordinates with different units.

    See Also
    --------
    udd.simulate : makes a run.
    udd.fit : makes a fit.
    udd.plot.orbit : draw the path.

    Examples
    --------
    >>> import numpy as np, udd
    >>> m = udd.Measurement(np.arange(20) / 25, {"theta": 0.1 * np.cos(np.arange(20) / 6)})
    >>> udd.plot.time_series(m).get_xlabel()
    'time T [s]'
    """
    drawn = motions(result)
    first = drawn[0]
    names = tuple(coordinates) if coordinates is not None else first.series
    usable = first.columns if first.is_own else AXES
    units = {first.axis(n)[1] for n in names if n in usable}
    if not names or not all(n in usable for n in names) or len(units) != 1:
        raise UddError(
            f"coordinates must share a unit and be of {', '.join(first.columns)}, not {', '.join(names)}"
        )
    ax = new_axes(ax)
    for motion in drawn:
        dots = motion.title == "measured"
        for name, colour in zip(names, _COLOURS, strict=False):
            what = motion.axis(name)[0] + (f", {motion.title}" if len(drawn) > 1 else "")
            style: dict[str, Any] = (
                {"linestyle": "none", "marker": ".", "markersize": 3} if dots else {"linewidth": 1.2}
            )
            values = (
                motion[name] if name in motion.columns or len(drawn) == 1 else np.full(len(motion.t), np.nan)
            )
            shade = MEASURED if dots and len(drawn) > 1 else colour
            ax.plot(motion.t, motion.axis(name)[2] * values, color=shade, label=what, **style)
    ax.set_xlabel(first.time)
    ax.set_ylabel(first.label(names[0]) if len(names) == 1 else f"{' and '.join(names)} [{units.pop()}]")
    if len(names) * len(drawn) > 1:
        legend_above(ax)
    tidy(ax)
    return ax


@checked_arguments(error=UddError)
def orbit(result: Any, ax: Axes | None = None) -> Axes:
    """Draw the path of the disk's centre in the picture's plane, with the contact and the wheels' reach.

    A pendulum's path is drawn in its phase plane, the DLE's as (y, z), that of another model as its first two
    states.

    Parameters
    ----------
    result : Trajectory, Measurement or Fit
        For a pendulum it must not be a measurement, which has no angular velocity.
    ax : Axes, optional

    Returns
    -------
    Axes

    See Also
    --------
    udd.simulate : makes a run.
    udd.plot.phase_space : draw in three dimensions.
    udd.plot.time_series : draw over time.
    """
    drawn = motions(result)
    first = drawn[0]
    shown, columns = first.profile.shown, () if first.is_own else first.profile.sensor.columns
    contact = shown.contact and not first.is_own
    if len(first.path) != 2:
        raise UddError(f"nothing says how the orbit of {first.model!r} is drawn")
    across, up = first.path
    if columns and up not in columns:
        if up not in drawn[-1].columns:
            raise UddError(
                f"a {shown.noun}'s measurement holds no angular velocity: fit it first, then draw the fit"
            )
        drawn = drawn[-1:]
    ax = new_axes(ax, size=SQUARE if contact else WIDE)
    for motion in drawn:
        x, y = motion.axis(across)[2] * motion[across], motion.axis(up)[2] * motion[up]
        if motion.title == "measured":
            ax.plot(x, y, ".", color=MEASURED, markersize=2.5, label="measured", rasterized=len(x) > 3000)
        else:
            ax.plot(x, y, color=AFTER, linewidth=0.9, label=motion.title)
    ax.set_xlabel(first.label(across))
    ax.set_ylabel(first.label(up))
    if contact:
        _device(ax, drawn)
    if len(drawn) > 1:
        legend_above(ax)
    tidy(ax)
    return ax


def _device(ax: Axes, drawn: Sequence[Motion]) -> None:
    """Draw the contact in the middle, and the circle at which the disk loses contact."""
    from matplotlib.patches import Circle

    ax.plot(0, 0, "+", color="black", markersize=9, markeredgewidth=1.5)
    radius = next((m.radius for m in drawn if m.radius is not None), None)
    if radius is not None:
        reach = scale("Y") * radius
        ax.add_patch(Circle((0, 0), reach, fill=False, edgecolor=FAINT, linewidth=1.5, linestyle="--"))
        ax.set_xlim(-1.1 * reach, 1.1 * reach)
        ax.set_ylim(-1.22 * reach, 1.1 * reach)
        words = "beyond this circle the disk leaves the wheels"
        ax.text(0, -1.04 * reach, words, ha="center", va="top", fontsize="x-small", color="#666666")
    ax.set_aspect("equal", adjustable="box")


@checked_arguments(error=UddError)
def phase_space(result: Any, ax: Axes | None = None) -> Axes:
    """Draw the orbit in three dimensions: J, Y, Z of the disk, or omega, y, z of the DLE.

    Parameters
    ----------
    result : Trajectory or Fit
    ax : Axes3D, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        Of a pendulum, whose phase space is a plane (see :func:`orbit`), of a measurement, which holds no
        angular velocity, or of Axes without a third dimension.

    See Also
    --------
    udd.simulate : makes a run.
    udd.plot.orbit : draw in the plane.
    """
    from matplotlib.ticker import MaxNLocator

    motion = only(result)
    if motion.is_own:
        raise UddError("phase_space draws the disk and the DLE: use udd.plot.orbit")
    space, noun = motion.profile.shown.space, motion.profile.shown.noun
    if space is None:
        raise UddError(f"a {noun}'s phase space is a plane: use udd.plot.orbit")
    if motion.title == "measured":
        raise UddError("a measurement holds no angular velocity: fit it first, then draw the fit")
    if "J" in space:
        if motion.model is None:
            raise UddError("J needs the model's W and R: the trajectory has no model")
        y, z = motion["Y"], motion["Z"]
        state = np.stack([motion["Omega"], y, z], axis=-1)
        coordinates = {"J": angular_momentum(motion.model, state), "Y": y, "Z": z}
    else:
        coordinates = {name: motion[name] for name in space}
    drawn: Any = new_axes(ax, projection="3d", size=SQUARE)
    if drawn.name != "3d":
        raise UddError('phase_space needs three-dimensional Axes (projection="3d")')
    names = tuple(coordinates)
    drawn.plot(*(scale(n) * v for n, v in coordinates.items()), color=AFTER, linewidth=0.7)
    for axis, name in zip("xyz", names, strict=True):
        unit = AXES[name][1].partition(" = ")[0]
        words = AXES[name][0].partition(" = ")[0]
        getattr(drawn, f"set_{axis}label")(f"{words} [{unit}]", labelpad=8)
        getattr(drawn, f"{axis}axis").set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    drawn.set_box_aspect(None, zoom=0.85)
    made: Axes = drawn
    return made
