"""Friction law, fitted to the film without a drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from udd import plot
from udd.paper import device
from udd.paper.canvas import FILMED, panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.plot.style import BEFORE, MEASURED, label, scale, tidy
from udd.simulation.trajectory import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure(
    "friction-computed",
    paper="Figure 9",
    title="The friction law and the swings without a drive, computed",
    caption="(a, b) The disk released at rest at R = 5.8 cm, 127° from upright, by the paper's law; "
    "crosses: turning points. (c) The coefficient k(Ω) = max(k₁ − k₂ |Ω|, k₀), which falls to its minimum "
    "at 1.65 rad/s (dotted). (d) The torque k Ω: N-shaped, and without a threshold at rest.",
)
def friction_law(_lab: Lab) -> Figure:
    """Draw Y, Z, k and the torque."""
    made, axes = panels(2, 2, 9.6, 6.6)
    run = simulate(device.disk(0.0), np.arange(0, 4, 0.002), device.ZERO_START, method="taylor")
    turns = np.flatnonzero(run.Omega[1:-1] * run.Omega[2:] < 0) + 1
    for k, name in enumerate(("Y", "Z")):
        values = scale(name) * run.state[:, 1 + k]
        axes[k].plot(run.t, values, color=BEFORE, linewidth=1.3)
        axes[k].plot(run.t[turns], values[turns], "x", color=MEASURED, markersize=5)
        axes[k].set_xlabel(label("t"))
        axes[k].set_ylabel(label(name))
        titled(axes[k], k, "W = 0")
    speed = np.linspace(0, 6, 601)
    law = np.maximum(device.K1 - device.K2 * speed, device.K0)
    for ax, values, words in ((axes[2], law, label("k")), (axes[3], law * speed, "torque k Ω [m²/s²]")):
        ax.plot(speed, values, color=BEFORE, linewidth=1.3)
        ax.axvline(device.KINK, color=MEASURED, linewidth=0.8, linestyle=":")
        ax.set_xlabel("|Ω| [rad/s]")
        ax.set_ylabel(words)
        ax.set_ylim(bottom=0)
    titled(axes[2], 2, "friction coefficient")
    titled(axes[3], 3, "friction torque")
    for ax in axes:
        tidy(ax)
    return made


@figure(
    "friction",
    paper="Figure 9",
    title="The friction law from the swings without a drive",
    caption="(a, b) Tracked motion and a run of the fitted model from the fitted first state. (c) The "
    "fitted k(Ω) with one standard error, and the film's law (dashed). The film was made with the paper's "
    "law: the agreement checks renderer, tracker and fit against each other, not the law. The scale of "
    "the picture is taken from the disk's known radius; if it were free within 1 %, all three constants "
    "would have an error of at least 1 %.",
    filmed=True,
)
def friction(lab: Lab) -> Figure:
    """Draw Y, Z and k."""
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
