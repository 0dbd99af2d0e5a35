"""The disk as a clock: its period over the drive, and after a push."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd.chaos.poincare_sections import poincare
from udd.models import DLE
from udd.paper import device
from udd.paper.canvas import panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.plot.style import AFTER, BEFORE, MEASURED, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: A start of the disk [Omega, Y, Z, beta] that ends on the figure-eight at the drives below.
EIGHT = (3.75, 0.0046, 5e-5, 0.0)

#: Large drives: ``T sqrt(w) -> C + D/w``.
C, D = 10.603754512, 0.1616


def periods(w: Array) -> Array:
    """Compute periods of the DLE's symmetric figure-eight, which crosses z = 0 upward twice in each."""
    section = poincare(DLE(10.0), n=3, transient=3000, parameters={"w": w})
    result: Array = section.t[..., 2] - section.t[..., 0]
    return result


def disk_periods(W: Array) -> Array:
    """Compute periods of the disk [s], likewise."""
    section = poincare(device.disk(0.1, beyond=True), n=3, transient=600, parameters={"W": W}, state0=EIGHT)
    result: Array = section.t[..., 2] - section.t[..., 0]
    return result


@figure(
    "clock",
    paper="Section 6, the clock",
    title="The upward-driven disk as a clock",
    caption="(a) Period of the DLE's figure-eight: T √w tends to 10.60375 as the drive grows, so T falls "
    "as w^(−1/2). (b) "
    "The full disk does the same from 7.6 to 12.5 cm/s; its orbit grows, and at 15 cm/s it is limited "
    "by the disk's edge. (c) At w = 12 the DLE forgets a push of the state by 1 % to 50 %: the half "
    "periods return to the old value to ten digits.",
)
def clock(_lab: Lab) -> Figure:
    """Draw the period over the drive, and after a push."""
    made, axes = panels(1, 3, 13.2, 4.0)
    w = np.geomspace(7.3, 300, 60)
    axes[0].plot(w, periods(w) * np.sqrt(w), color=AFTER, linewidth=1.8, label="computed")
    axes[0].plot(w, C + D / w, "--", color=MEASURED, label="10.60375 + 0.1616/w")
    axes[0].set_xscale("log")
    axes[0].set_xlabel("drive w [1]")
    axes[0].set_ylabel("T √w [1]")
    axes[0].legend(frameon=False)
    titled(axes[0], 0, "DLE")
    W = np.linspace(0.076, 0.125, 40)
    T = disk_periods(W)
    axes[1].plot(100 * W, T, color=AFTER, linewidth=1.8, label="computed")
    axes[1].plot(100 * W, T[-1] * np.sqrt(W[-1] / W), "--", color=MEASURED, label="as W^(−1/2)")
    axes[1].set_xlabel("drive W [cm/s]")
    axes[1].set_ylabel("period T [s]")
    axes[1].legend(frameon=False)
    titled(axes[1], 1, "disk")
    for push, colour in ((0.5, BEFORE), (0.1, "#e69f00"), (0.01, AFTER)):
        axes[2].semilogy(*after_a_push(12.0, push, 160), ".", markersize=3, color=colour, label=f"{push:.0%}")
    axes[2].set_xlabel("half periods since the push")
    axes[2].set_ylabel("relative deviation of the half period")
    axes[2].legend(frameon=False, title="push")
    titled(axes[2], 2, "DLE, w = 12, after a push")
    for ax in axes:
        tidy(ax)
    return made


def after_a_push(w: float, push: float, n: int) -> tuple[Array, Array]:
    """Compute the deviations of successive half periods from the undisturbed one, after a push."""
    still = poincare(DLE(w), n=2, transient=3000)
    half = float(still.return_times[0])
    pushed = poincare(DLE(w), n=n, transient=0, state0=still.state[-1] * (1 + push) + [0, 0, push])
    return np.arange(1.0, n), np.abs(pushed.return_times / half - 1)
