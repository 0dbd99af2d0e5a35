"""Computed orbits of the centre."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from udd import plot
from udd.models import DLE
from udd.paper import device
from udd.paper.canvas import panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.simulation.trajectory import Trajectory, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Time that is left out before an orbit is drawn [s], and time that is drawn.
SETTLING, SHOWN = 60.0, 20.0


def settled(W: float) -> Trajectory:
    """Compute the disk's motion after its transient; the equations are valid past the disk's edge."""
    model = device.disk(W, beyond=True)
    before = simulate(model, SETTLING, device.FAST_START, method="taylor").state[-1]
    return simulate(model, np.arange(0, SHOWN, 0.005), before, method="taylor")


@figure(
    "computed-slow",
    paper="Figure 10",
    title="Small drive, computed",
    caption="(a) The disk at W = 1.4 cm/s for 45 s, from rest, almost upright, 4 cm up. (b) The DLE at "
    "w = 0.1 from (y, z) = (−0.175, 1) at rest. Slow ascents near the axis, a fall to either side, swings.",
)
def computed_slow(_lab: Lab) -> Figure:
    """Draw both models at a small drive."""
    made, axes = panels(1, 2, 9.6, 4.6)
    run = simulate(device.disk(device.SLOW), np.arange(0, 45, 0.005), device.SLOW_START, method="taylor")
    plot.orbit(run, axes[0])
    titled(axes[0], 0, "disk, W = 1.4 cm/s")
    plot.orbit(simulate(DLE(0.1), np.arange(0, 250, 0.02), [0, -0.175, 1], method="taylor"), axes[1])
    axes[1].set_aspect("equal", "datalim")
    titled(axes[1], 1, "DLE, w = 0.1")
    return made


@figure(
    "computed-orbits",
    paper="Figure 11",
    title="Intermediate and large drive, computed",
    caption="The disk after 60 s, for 20 s, in which it stays inside the circle (dashed) at which it would "
    "lose contact. In longer runs at 3.9 and 5.5 cm/s it crosses the circle (see the claims); the "
    'equations remain valid there (edge="ignore"). '
    "At 5.5 cm/s these equations are chaotic, not high-periodic.",
)
def computed_orbits(_lab: Lab) -> Figure:
    """Draw the full equations at the paper's three drives."""
    made, axes = panels(1, 3, 12.6, 4.4)
    for k, W in enumerate(device.DRIVES):
        plot.orbit(settled(W), axes[k])
        titled(axes[k], k, f"disk, W = {100 * W:.1f} cm/s")
    return made


@figure(
    "dle-orbits",
    paper="Figure 12",
    title="The diffusionless Lorenz equations",
    caption="After 500 units of time, for 60. At w = 4.5 the orbit is a chaotic transient, which lasts "
    "thousands of units on average before the motion becomes periodic. At w = 7.1, 0.0036 above the "
    "symmetry breaking, it still approaches the symmetric figure-eight.",
)
def dle_orbits(_lab: Lab) -> Figure:
    """Draw the DLE at the paper's three drives."""
    made, axes = panels(1, 3, 12.6, 4.4)
    for k, w in enumerate(device.DLE_DRIVES):
        before = simulate(DLE(w), 500.0, [1, 1, 0.01], method="taylor").state[-1]
        plot.orbit(simulate(DLE(w), np.arange(0, 60, 0.01), before, method="taylor"), axes[k])
        axes[k].set_aspect("equal", "datalim")
        titled(axes[k], k, f"DLE, w = {w}")
    return made
