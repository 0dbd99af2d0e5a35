"""Motion of the centre from tracked synthetic films."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from udd import plot
from udd.paper import device, films
from udd.paper.canvas import FILMED, panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.plot.style import AFTER, BEFORE, FAINT, label, scale, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure(
    "marks",
    paper="Figure 3",
    title="The disk in a frame",
    caption="Frames of the film at W = 1.4 cm/s, as slow and as fast as the disk gets. Rings: the four "
    "marks; light blue: the disk and its "
    "centre; cross: the contact. The paper loses its marks in the blur; this tracker fits the blurred marks.",
    filmed=True,
)
def marks(lab: Lab) -> Figure:
    """Draw a sharp and a blurred frame."""
    from udd.tracking import pictures_at, pixels

    measured, smooth = lab.measured("1.4"), lab.smoothed("1.4")
    omega = np.interp(measured.t, smooth.t, smooth.state[:, 0])
    speed = np.abs(omega)
    chosen = sorted(int(k) for k in (np.argmin(speed[50:]) + 50, np.argmax(speed)))
    pictures = pictures_at(films.film_of("1.4", lab.folder), chosen)
    made, axes = panels(1, 2, 8.4, 5.4, note=FILMED)
    for k, (frame, picture) in enumerate(zip(chosen, pictures, strict=True)):
        plot.overlay(picture, pixels(measured), frame, axes[k])
        titled(axes[k], k, f"T = {measured.t[frame]:.2f} s, Ω = {omega[frame]:.1f} rad/s")
    return made


@figure(
    "zero-drive",
    paper="Figure 4",
    title="Zero drive",
    caption="The wheels stand still; the disk swings out from R = 5.8 cm, 127° from upright.",
    filmed=True,
)
def zero_drive(lab: Lab) -> Figure:
    """Draw Y and Z over time."""
    made, axes = panels(1, 2, 10.4, 3.8, note=FILMED)
    for k, name in enumerate(("Y", "Z")):
        plot.time_series(lab.measured("0.0"), axes[k], coordinates=[name])
        titled(axes[k], k, "W = 0")
    return made


@figure(
    "slow-drive",
    paper="Figure 5",
    title="Small drive: the centre over time",
    caption="W = 1.4 cm/s. Dots: tracked, one for each frame; line: smoothed.",
    filmed=True,
)
def slow_drive(lab: Lab) -> Figure:
    """Draw Y and Z, raw and smoothed."""
    made, axes = panels(2, 1, 10.4, 5.4, note=FILMED)
    measured, smooth = lab.measured("1.4"), lab.smoothed("1.4")
    for k, name in enumerate(("Y", "Z")):
        axes[k].plot(
            measured.t, scale(name) * measured[name], ".", color=AFTER, markersize=3, label="tracked"
        )
        values = scale(name) * smooth.state[:, 1 + k]
        axes[k].plot(smooth.t, values, color=BEFORE, linewidth=0.9, label="smoothed")
        axes[k].set_ylabel(label(name))
        tidy(axes[k])
        titled(axes[k], k, "W = 1.4 cm/s")
    axes[1].set_xlabel(label("t"))
    axes[0].legend(frameon=False, ncols=2, loc="upper right", bbox_to_anchor=(1, 1.18))
    return made


@figure(
    "slow-orbit",
    paper="Figure 6",
    title="Small drive: angular momentum and orbit",
    caption="W = 1.4 cm/s. J = I Ω − W Y with Ω from the smoothed orientation.",
    filmed=True,
)
def slow_orbit(lab: Lab) -> Figure:
    """Draw J over time and the path of the centre."""
    made, axes = panels(1, 2, 11.4, 4.4, note=FILMED)
    smooth = lab.smoothed("1.4")
    axes[0].plot(smooth.t, scale("J") * smooth.J, color=AFTER, linewidth=0.9)
    axes[0].set_xlabel(label("t"))
    axes[0].set_ylabel(label("J"))
    tidy(axes[0])
    titled(axes[0], 0, "angular momentum about the contact")
    plot.orbit(smooth, axes[1])
    titled(axes[1], 1, "the centre's path")
    return made


@figure(
    "slow-polar",
    paper="Figure 7",
    title="Small drive: polar coordinates",
    caption="W = 1.4 cm/s. (a) Θ = θ − π, the direction of the centre from hanging, clockwise, "
    "unwrapped: it rests at multiples of 2π. "
    "(b) The distance R of the centre from the contact.",
    filmed=True,
)
def slow_polar(lab: Lab) -> Figure:
    """Draw theta and R over time."""
    made, axes = panels(2, 1, 10.4, 5.4, note=FILMED)
    smooth = lab.smoothed("1.4")
    y, z = smooth.state[:, 1], smooth.state[:, 2]
    angle = np.unwrap(np.arctan2(y, z) - np.pi)
    turns = angle / (2 * np.pi)
    turns -= np.round(turns[0] + 0.5)
    axes[0].plot(smooth.t, turns, color=AFTER, linewidth=1.1)
    axes[0].set_ylabel("Θ / 2π")
    axes[1].plot(smooth.t, scale("R") * np.hypot(y, z), color=AFTER, linewidth=1.1)
    axes[1].set_ylabel(label("R"))
    axes[1].set_xlabel(label("t"))
    axes[1].set_ylim(bottom=0)
    for whole in range(int(np.floor(turns.min())), int(np.ceil(turns.max())) + 1):
        axes[0].axhline(whole, color=FAINT, linewidth=0.8, zorder=0)
    for k, words in enumerate(("direction", "distance")):
        tidy(axes[k])
        titled(axes[k], k, words)
    return made


@figure(
    "measured-orbits",
    paper="Figure 8",
    title="Intermediate and large drive, measured",
    caption="The starts were chosen so that the disk stays between the wheels for the 16 s of the film; "
    "from many others at 3.9 and 5.5 cm/s it loses contact.",
    filmed=True,
)
def measured_orbits(lab: Lab) -> Figure:
    """Draw the centre's path at the paper's three drives."""
    made, axes = panels(1, 3, 12.6, 4.6, note=FILMED)
    for k, W in enumerate(device.DRIVES):
        plot.orbit(lab.smoothed(f"{100 * W:.1f}"), axes[k])
        titled(axes[k], k, f"W = {100 * W:.1f} cm/s")
    return made
