"""Falls to either side, whole turns of theta, and durations of ascent and fall."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np

from udd.paper import device
from udd.paper.canvas import panels, titled
from udd.paper.falls import Falls, falls
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.plot.style import AFTER, BEFORE, FAINT, MEASURED, label, tidy
from udd.simulation.trajectory import Trajectory, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Length of the runs [s].
LONG = 1200.0


@functools.cache
def long_run(W: float) -> Trajectory:
    """Run the disk for twenty minutes; the equations are valid past its edge."""
    start = device.SLOW_START if W <= device.SLOW else device.FAST_START
    return simulate(device.disk(W, beyond=True), np.arange(0, LONG, 0.005), start, method="taylor")


@functools.cache
def falls_at(W: float) -> Falls:
    """Compute the falls of the long run."""
    run = long_run(W)
    return falls(run.t, run.Y, run.Z)


@figure(
    "falls",
    paper="Section 3 B, Figure 7",
    title="Falls to one side and the other",
    caption="The computed disk. (a) Whole turns of Θ = θ − π. A fall to the side on which the centre rose "
    "returns to the same plateau; a fall to the other side leads to the next. At 1.4 cm/s the centre "
    "always falls to the side on which it rose. (b) Falls in a row to the same side, in twenty minutes; "
    "dots: a fair coin's. "
    "(c) Median times from the last low point to the top (rising) and from there to the lowest point "
    "(falling).",
)
def sides(_lab: Lab) -> Figure:
    """Draw theta, runs to one side, and durations."""
    made, axes = panels(1, 3, 13.2, 4.2)
    colours = (AFTER, BEFORE, "#009e73")
    for W, colour in zip((device.SLOW, 0.039, 0.055), colours, strict=True):
        run = long_run(W)
        shown = run.t <= 120.0
        turns = np.unwrap(np.arctan2(run.Y[shown], run.Z[shown])) / (2 * np.pi) - 0.5
        axes[0].plot(run.t[shown], turns, color=colour, linewidth=0.9, label=f"{100 * W:.1f} cm/s")
    for whole in range(-6, 7):
        axes[0].axhline(whole, color=FAINT, linewidth=0.6, zorder=0)
    axes[0].set_ylim(-6.6, 3.6)
    axes[0].set_xlabel(label("t"))
    axes[0].set_ylabel("Θ / 2π")
    axes[0].legend(frameon=False, loc="lower left")
    titled(axes[0], 0, "direction of the centre")
    most = 6
    for k, (W, colour) in enumerate(zip((device.SLOW, 0.039, 0.055), colours, strict=True)):
        share = np.bincount(falls_at(W).lengths, minlength=most + 1)[1 : most + 1]
        axes[1].bar(np.arange(1, most + 1) + 0.27 * (k - 1), share / share.sum(), 0.25, color=colour)
    axes[1].plot(np.arange(1, most + 1), 0.5 ** np.arange(1, most + 1), "o", color=MEASURED, markersize=4)
    axes[1].set_xlabel("falls in a row to the same side")
    axes[1].set_ylabel("share")
    titled(axes[1], 1, "runs to one side")
    drives = np.linspace(0.010, 0.075, 27)
    times = np.array([(falls_at(float(W)).ascent, falls_at(float(W)).descent) for W in drives])
    axes[2].plot(100 * drives, times[:, 0], color=AFTER, label="rising")
    axes[2].plot(100 * drives, times[:, 1], color=BEFORE, label="falling")
    axes[2].set_xlabel("drive W [cm/s]")
    axes[2].set_ylabel("median time [s]")
    axes[2].set_ylim(bottom=0)
    axes[2].legend(frameon=False)
    titled(axes[2], 2, "slow ascent, fast descent")
    for ax in axes:
        tidy(ax)
    return made
