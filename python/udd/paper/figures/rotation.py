"""Steadily rotating states and their stability."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd.models import DLE
from udd.paper import device
from udd.paper.branches import RELAXATION, hopf, relaxed, rotation_of_disk, rotation_of_dle
from udd.paper.canvas import panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.plot.style import AFTER, BEFORE, FAINT, MEASURED, label, tidy
from udd.simulation.trajectory import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def _eigenvalue_panel(ax: Axes, damping: float) -> None:
    """Draw eigenvalues: real parts solid, imaginary parts dashed."""
    branch = rotation_of_dle(damping)
    w = branch.values
    eigenvalues = np.array([row[np.argsort(np.abs(row.imag))] for row in branch.multipliers])
    ax.axhline(0, color=FAINT, linewidth=0.8)
    ax.plot(w, eigenvalues[:, 0].real, color=MEASURED, linewidth=1.6, label="the real eigenvalue")
    ax.plot(w, eigenvalues[:, 1].real, color=AFTER, linewidth=1.6, label="the pair, real part")
    for sign, words in ((1, "the pair, imaginary part"), (-1, None)):
        part = sign * np.abs(eigenvalues[:, 1].imag)
        ax.plot(w, part, color=AFTER, linewidth=1.2, linestyle="--", label=words)
    ax.set_xlabel("drive w [1]")
    ax.set_ylabel("eigenvalue λ [1]")
    ax.legend(loc="lower left", fontsize="small", edgecolor="none", framealpha=1)
    tidy(ax)


@figure(
    "eigenvalues",
    paper="Figure 15",
    title="Stability of steady rotation without damping",
    caption="Eigenvalues at ω = y = √w, z = 0. The pair's real part is positive at every drive: unstable.",
)
def eigenvalues_plain(_lab: Lab) -> Figure:
    """Draw the eigenvalues for B = 0."""
    made, axes = panels(1, 1, 6.4, 4.4)
    _eigenvalue_panel(axes[0], 0.0)
    return made


@figure(
    "damped-rotation",
    paper="Figure 16",
    title="Stability with damping of the rolling constraint",
    caption="(a) Eigenvalues with B = 0.2: stable above w_H = (1 − B)/(B (1 + B)) = 10/3. (b) w = 3.7, from "
    "ω = y = √w and z = −3.2 (blue, spirals in) and z = −3.5 (orange, a chaotic transient with a mean "
    "life of tens of thousands of units).",
)
def damped_rotation(_lab: Lab) -> Figure:
    """Draw eigenvalues and orbits for B = 0.2."""
    made, axes = panels(1, 2, 11.2, 4.6)
    _eigenvalue_panel(axes[0], device.B)
    hopf = device.hopf_drive(device.B)
    axes[0].axvline(hopf, color="black", linewidth=0.9, linestyle=":")
    axes[0].annotate("w_H = 10/3", (hopf, 0), (6, 8), textcoords="offset points")
    titled(axes[0], 0, "eigenvalues at B = 0.2")
    model = DLE(3.7, B=device.B)
    start = device.rotating_dle(model)[:2]
    for z, colour, words in ((-3.5, BEFORE, "from z = −3.5"), (-3.2, AFTER, "from z = −3.2")):
        run = simulate(model, np.arange(0, 150, 0.01), [*start, z], method="taylor")
        axes[1].plot(run.y, run.z, color=colour, linewidth=0.8, label=words)
    axes[1].plot(start[1], 0, "o", color="black", markersize=4)
    axes[1].set_xlabel(label("y"))
    axes[1].set_ylabel(label("z"))
    axes[1].set_aspect("equal", "datalim")
    axes[1].legend(frameon=False, loc="upper left", bbox_to_anchor=(1, 1))
    tidy(axes[1])
    titled(axes[1], 1, "orbits at B = 0.2, w = 3.7")
    return made


@figure(
    "rotating-states",
    paper="Section 3 C, Video 4",
    title="The two steadily rotating states of the disk",
    caption="W = 8.8 cm/s, starting close to each rotating state. (a) With the paper's relaxation of the "
    "rolling constraint, b = B/L = 43.6 /m, both states are reached and stable: Ω = ±√(g W/k₀). (b) "
    "Without it the motion leaves them.",
)
def rotating_states(_lab: Lab) -> Figure:
    """Draw both senses of rotation, with and without the relaxation."""
    made, axes = panels(1, 2, 10.4, 4.2)
    W = 0.088
    for k, b in enumerate((RELAXATION, 0.0)):
        for sense, colour, words in ((1, AFTER, "clockwise"), (-1, BEFORE, "anticlockwise")):
            omega, y, _z = device.rotating(W, sense)
            run = simulate(relaxed(W, b), np.arange(0, 12, 0.005), [omega, y, 0.004, 0], method="taylor")
            axes[k].plot(run.t, run.Omega, color=colour, linewidth=1.1, label=words)
            axes[k].axhline(omega, color=FAINT, linewidth=0.9, zorder=0)
        axes[k].set_xlabel(label("t"))
        axes[k].set_ylabel(label("Omega"))
        axes[k].set_ylim(-19, 19)
        tidy(axes[k])
    axes[0].legend(frameon=False, ncols=2, loc="upper right")
    titled(axes[0], 0, "b = 43.6 /m")
    titled(axes[1], 1, "b = 0")
    return made


@figure(
    "relaxation-needed",
    paper="Section 5 E, for the full disk",
    title="The relaxation that keeps the rotation stable",
    caption="Above the curves the full disk's rotating state is stable to small disturbances. The "
    "relaxation −b W Z changes the rolling constraint alone, as in the paper, or the angular momentum, "
    "too. Dashed: the DLE, w_H = (1 − B)/(B (1 + B)).",
)
def relaxation_needed(_lab: Lab) -> Figure:
    """Draw the Hopf points of the full disk over drive and relaxation."""
    made, axes = panels(1, 1, 6.8, 4.6)
    relaxation = np.geomspace(22.5, 85, 14)
    for momentum, colour, words in (
        ("constraint", AFTER, "disk, constraint alone"),
        ("consistent", BEFORE, "disk, angular momentum too"),
    ):
        hopf_drives = [hopf(rotation_of_disk(float(b), momentum)) for b in relaxation]
        drives = [np.nan if point is None else point.value for point in hopf_drives]
        axes[0].plot(100 * np.array(drives), relaxation, color=colour, linewidth=1.8, label=words)
    damping = np.linspace(0.04, 0.5, 200)
    closed = np.array([device.hopf_drive(float(one)) for one in damping]) * device.L / device.TAU
    inside = (closed > 0.02) & (closed < 0.15)
    axes[0].plot(100 * closed[inside], damping[inside] / device.L, "--", color=MEASURED, label="DLE")
    axes[0].axhline(RELAXATION, color=FAINT, linewidth=1)
    axes[0].annotate("the paper's B = 0.2", (15, RELAXATION), (0, 4), textcoords="offset points", ha="right")
    axes[0].set_xlabel("drive W [cm/s]")
    axes[0].set_ylabel("relaxation b [1/m]")
    axes[0].set_ylim(bottom=0)
    axes[0].legend(frameon=False)
    tidy(axes[0])
    return made


def spun_down(drives: NDArray[np.float64], start: list[float], time: float = 60.0) -> NDArray[np.float64]:
    """Compute mean and spread of Omega while the drive changes in steps; shape (drives, 2) [rad/s]."""
    state, rows = np.asarray(start), []
    for W in drives:
        run = simulate(relaxed(float(W), RELAXATION), np.arange(0, time, 0.02), state, method="taylor")
        late = run.Omega[len(run.t) // 2 :]
        rows.append((late.mean(), late.std()))
        state = run.state[-1] + [0.0, 1e-6, 1e-6, 0.0]  # no real disk is exactly at rest
    return np.array(rows)


@figure(
    "spin-down",
    paper="Section 3 C",
    title="Spin-down: the drive is lowered, then raised again",
    caption="The full disk with b = 43.6 /m, 60 s at each drive; line: mean of Ω, band: its standard "
    "deviation. When the drive is lowered, the rotation persists until it becomes unstable (below "
    "5.92 cm/s by linear theory). When it is raised, the chaotic swings last until they happen to reach a "
    "rotating state: at high drives they are a transient. Grey: Ω = √(g W/k₀).",
)
def spin_down(_lab: Lab) -> Figure:
    """Draw the hysteresis of the rotating state."""
    made, axes = panels(1, 1, 7.4, 4.6)
    down = np.arange(0.090, 0.0399, -0.002)
    omega, y, z = device.rotating(float(down[0]))
    lowered = spun_down(down, [omega, y, z, 0.0])
    raised = spun_down(down[::-1], [0.0, 0.011, 0.04, 0.0])
    axes[0].plot(
        100 * down,
        np.sqrt(device.G * down / device.K0),
        color=FAINT,
        linewidth=5,
        zorder=0,
        label="√(g W/k₀)",
    )
    for W, rows, colour, words in ((down, lowered, AFTER, "lowered"), (down[::-1], raised, BEFORE, "raised")):
        mean, spread = rows.T
        axes[0].fill_between(100 * W, mean - spread, mean + spread, color=colour, alpha=0.15, linewidth=0)
        axes[0].plot(100 * W, mean, ".-", color=colour, label=words)
    axes[0].set_xlabel("drive W [cm/s]")
    axes[0].set_ylabel(label("Omega"))
    axes[0].legend(frameon=False, loc="upper left")
    tidy(axes[0])
    return made
