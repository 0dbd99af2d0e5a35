"""Picture of the test for white innovations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .inputs import require
from .style import AFTER, CHANNELS, FAINT, new_axes, require_colour, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHOWN = 1.0  # s, or 25 frames if that is more


@checked_arguments(error=UddError)
def whiteness(
    innovations: Any,
    ax: Axes | None = None,
    *,
    channel: str | None = None,
    colour: str = AFTER,
    name: str = "innovations",
) -> Axes:
    """Draw the autocorrelation of a fit's innovations, with the 95 % band of white noise.

    Parameters
    ----------
    innovations : Innovations
    ax : Axes, optional
        Drawn on again, a second fit's are added.
    channel : str, optional
        One of the measurement's columns; by default the first.
    colour, name : str
        Name of the line in the legend.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        No such channel, or no innovations.

    See Also
    --------
    udd.fit : makes the fit.
    udd.plot.misfit : draw the misfits over time.

    References
    ----------
    G. M. Ljung and G. E. P. Box, Biometrika 65 (1978) 297 [45].
    """
    require(innovations, "innovations (udd.discovery) have an autocorrelation", "autocorrelation")
    require_colour(colour)
    names = innovations.names
    channel = names[0] if channel is None else channel
    if channel not in names:
        raise UddError(f"the measurement has {', '.join(names)}, not {channel}")
    k, lags = names.index(channel), shown_lags(innovations)
    rho, sd = innovations.autocorrelation(lags)
    lag = innovations.dt * np.arange(1, lags + 1)
    ax = new_axes(ax)
    if not ax.has_data():
        band = 1.96 * sd[:, k]
        ax.fill_between(lag, -band, band, color=FAINT, alpha=0.6, linewidth=0, label="95 % of white noise")
        ax.axhline(0, color="black", linewidth=0.8)
    ax.plot(lag, rho[:, k], color=colour, marker=".", markersize=5, linewidth=1.2, label=name)
    ax.set_xlabel("lag [s]")
    title = CHANNELS[channel][0] if channel in CHANNELS else channel
    ax.set_ylabel(f"autocorrelation of {title} [1]")
    tidy(ax)
    return ax


def shown_lags(innovations: Any) -> int:
    """Return the number of lags that are shown."""
    return int(min(max(25, round(_SHOWN / innovations.dt)), len(innovations.values) // 4))
