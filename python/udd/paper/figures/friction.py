"""The friction law, fitted to the film without a drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from udd import plot
from udd.paper import device
from udd.paper.canvas import FILMED, panels, titled
from udd.paper.lab import Lab
from udd.paper.registry import figure
from udd.plot.style import BEFORE, MEASURED, label, scale, tidy
from udd.trajectory import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure(
    "friction",
    paper="Figure 9",
    title="The friction law from the swings without a drive",
    caption="(a, b) Tracked motion and a run of the fitted model from the fitted first state. (c) The "
    "fitted k(Ω) with one standard "
    "error, the law that the film was made with dashed. The film was made with the paper's law: that the "
    "fit gives it back "
    "is a check of film maker, tracker and fit on one another, not of the law. The scale of the picture "
    "is taken "
    "from the disk's known radius; were it free within 1 %, all three constants would share that 1 % at "
    "least.",
    filmed=True,
)
def friction(lab: Lab) -> Figure:
    """Y, Z and k."""
    measured, fit = lab.measured("0.0"), lab.friction_fit()
    made, axes = panels(1, 3, 13.2, 4.0, note=FILMED)
    run = simulate(fit.model, np.arange(0, measured.t[-1], 0.005), fit.states[0], method="taylor")
    for k, name in enumerate(("Y", "Z")):
        axes[k].plot(
            measured.t, scale(name) * measured[name], ".", color=MEASURED, markersize=4, label="tracked"
        )
        axes[k].plot(
            run.t, scale(name) * run.state[:, 1 + k], color=BEFORE, linewidth=1.1, label="fitted model"
        )
        axes[k].set_xlabel(label("t"))
        axes[k].set_ylabel(label(name))
        tidy(axes[k])
        titled(axes[k], k, "W = 0")
    axes[0].legend(frameon=False)
    plot.friction(fit, axes[2], fastest=6.0)
    speed = np.linspace(0, 6, 300)
    law = np.maximum(device.K1 - device.K2 * speed, device.K0)
    axes[2].plot(speed, law, "--", color="black", linewidth=1.0, label="the film's own law")
    axes[2].legend(frameon=False)
    titled(axes[2], 2, "friction coefficient")
    return made
