"""Orbits in phase space: angular momentum J, Y and Z."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from udd import plot
from udd.paper import device
from udd.paper.canvas import FILMED, panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab

from .computed import settled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure(
    "measured-phase",
    paper="Figure 13",
    title="Phase space, measured",
    caption="J, Y, Z from tracked films; J = I Ω − W Y takes Ω from the smoothed orientation.",
    filmed=True,
)
def measured_phase(lab: Lab) -> Figure:
    """Draw the tracked and smoothed motion."""
    made, axes = panels(1, 3, 12.6, 4.6, note=FILMED, projection="3d")
    for k, W in enumerate(device.DRIVES):
        plot.phase_space(lab.smoothed(f"{100 * W:.1f}"), axes[k])
        _room(axes[k])
        titled(axes[k], k, f"W = {100 * W:.1f} cm/s")
    return made


@figure(
    "computed-phase",
    paper="Figure 14",
    title="Phase space, computed",
    caption="The same from the equations, as in the figure of the computed orbits.",
)
def computed_phase(_lab: Lab) -> Figure:
    """Draw the full equations."""
    made, axes = panels(1, 3, 12.6, 4.6, projection="3d")
    for k, W in enumerate(device.DRIVES):
        plot.phase_space(settled(W), axes[k])
        _room(axes[k])
        titled(axes[k], k, f"disk, W = {100 * W:.1f} cm/s")
    return made


def _room(ax: Any) -> None:
    """Make tick labels fewer and smaller and move axis labels out, so that they do not overlap."""
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.get_major_locator().set_params(nbins=4)
        axis.labelpad = 6
        axis.label.set_size("small")
    ax.tick_params(labelsize="small", pad=1)
    ax.set_box_aspect(None, zoom=0.8)
