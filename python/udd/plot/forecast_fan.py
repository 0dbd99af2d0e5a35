"""A forecast: the fan of its members, and what was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .inputs import require
from .style import AFTER, FAINT, MEASURED, label, legend_above, new_axes, scale, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BEFORE = 1.0  # s of data shown before the start
_MEMBERS = 12  # drawn one by one


@checked_arguments(error=UddError)
def forecast(result: Any, ax: Axes | None = None, *, coordinate: str | None = None) -> Axes:
    """Draw the median and the band of a forecast, some of its members, and the measurement.

    Parameters
    ----------
    result : Forecast
    ax : Axes, optional
    coordinate : str, optional
        One of the forecast's channels; by default Z of a disk.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        No such channel, or not a forecast.

    See Also
    --------
    udd.forecast : computes it.
    udd.plot.time_series : draw the record.
    """
    require(result, "a forecast has a fan", "members", "valid_time")
    names = result.names
    coordinate = coordinate or ("Z" if "Z" in names else names[0])
    if coordinate not in names:
        raise UddError(f"the forecast has {', '.join(names)}, not {coordinate}")
    of_own = result.fit.model.profile.written  # its states may be called as the disk's are
    k, factor = names.index(coordinate), 1.0 if of_own else scale(coordinate)
    ax = new_axes(ax)
    t = result.t
    for number, member in enumerate(result.members[:_MEMBERS, :, k]):
        ax.plot(t, factor * member, color=FAINT, linewidth=0.6, label=None if number else "some members")
    band = f"{100 * result.level:g} % of the members"
    ax.fill_between(
        t,
        factor * result.low[:, k],
        factor * result.high[:, k],
        color=AFTER,
        alpha=0.25,
        linewidth=0,
        label=band,
    )
    ax.plot(t, factor * result.median[:, k], color=AFTER, linewidth=1.6, label="median")
    m = result.measurement
    shown = m.seen & (m.t >= t[0] - _BEFORE) & (m.t <= t[-1])
    ax.plot(
        m.t[shown], factor * m.values[shown, k], ".", color=MEASURED, markersize=4, label="measured", zorder=3
    )
    ax.axvline(t[0], color="black", linewidth=0.8)
    if np.isfinite(result.valid_time):
        ax.axvline(t[0] + result.valid_time, color="black", linestyle="--", linewidth=1, label="valid until")
    ax.set_xlabel("t" if of_own else label("t"))
    ax.set_ylabel(coordinate if of_own else label(coordinate))
    legend_above(ax)
    tidy(ax)
    return ax
