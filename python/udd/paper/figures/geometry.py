"""The device and its coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING

from udd import plot
from udd.paper.canvas import panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure(
    "geometry",
    paper="Figures 1 and 2",
    title="The device, its coordinates and signs",
    caption="(a) Along the disk's plane: the wheels squeeze the disk at O, the drive wheel turns clockwise "
    "and drives it upward at speed W. (b) In the disk's plane: the contact O (the wheels' rims dashed), the "
    "centre C at (Y, Z) = R (sin θ, cos θ), and the mark M, which lies φ clockwise of the prolongation "
    "of OC, "
    "so β = θ + φ clockwise of the upward vertical. Ω = dβ/dT is positive clockwise. ℛ is the disk's radius.",
    vector=True,
)
def geometry(_lab: Lab) -> Figure:
    """Draw both views."""
    made, axes = panels(1, 2, 11.0, 5.4)
    for k, (view, words) in enumerate((("side", "along the disk"), ("front", "in its plane"))):
        plot.geometry(axes[k], view=view)
        titled(axes[k], k, words)
    return made
