"""Steady and periodic drives compared: detuning, ripple, isochrony, and the path of a pumped swing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd import related_systems as systems
from udd.chaos.poincare_sections import poincare
from udd.models import DLE, Model
from udd.paper.canvas import panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.plot.style import AFTER, BEFORE, MEASURED, tidy
from udd.simulation.trajectory import simulate

from .clock import periods

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

CLOCK = 12.0  # drive of the DLE's clock, well above the symmetry breaking
_RIPPLED = {"omega": "y - omega", "y": "omega*z", "z": "-omega*y + w*(1 + a*cos(f*t))"}


def rippled(w: float, ripple: float, frequency: float) -> Model:
    """Return the DLE with a rippled drive, ``w (1 + a cos(f t))``."""
    return Model(["omega", "y", "z"], _RIPPLED, {"w": w, "a": ripple, "f": frequency})


def jitter(ripple: float, ratio: float, n: int = 400) -> float:
    """Compute the relative r.m.s. of the clock's period, with a ripple at `ratio` times its frequency."""
    model = rippled(CLOCK, ripple, ratio * 2 * np.pi / float(periods(np.array([CLOCK]))[0]))
    section = poincare(model, "z", n, state0=[1.0, 1.0, 0.01], direction="up", transient=n, t_max=1e5)
    whole = section.t[2::2] - section.t[:-2:2]  # z = 0 is crossed upward twice a period
    return float(np.std(whole) / np.mean(whole))


def forced_swings(friction: float, n: int = 120) -> Array:
    """Compute successive amplitudes of a pendulum from rest, with a torque 5 % below its frequency."""
    model = systems.torqued_pendulum(1.0, friction, 0.05, 0.95)
    section = poincare(model, "v", n, state0=[0.0, 0.0], direction="down", transient=0, t_max=1e4)
    result: Array = section.component("theta")
    return result


def swing_period(model: Model, amplitude: Array) -> Array:
    """Compute periods of a frictionless pendulum released at these angles, relative to small swings."""
    starts = np.stack([0 * amplitude, amplitude], axis=-1)
    section = poincare(model, "theta", 1, state0=starts, direction="down", transient=0)
    result: Array = 4 * section.t[..., 0] / (2 * np.pi)
    return result


@figure(
    "steady-clock",
    paper="Section 6, natural detuning",
    title="A steady and a periodic drive",
    caption="(a) Amplitude of a pendulum from rest under a torque 5 % below its own frequency. Without "
    "friction it detunes and stays modulated; with friction it locks to the torque and repeats its clock. "
    "(b) Relative r.m.s. of the period of the DLE's figure-eight at w = 12, if the drive ripples by 1 % "
    "or 5 %. It is at most about half of the ripple (dotted), and zero if the ripple is in step. (c) Period "
    "over the size of the swing, without friction: it grows for the plain pendulum and is constant with "
    "Huygens' cheeks.",
)
def steady_clock(_lab: Lab) -> Figure:
    """Draw modulation, ripple and isochrony."""
    made, axes = panels(1, 3, 13.2, 4.2)
    for friction, colour in ((0.0, BEFORE), (0.01, "#e69f00"), (0.2, AFTER)):
        axes[0].plot(
            forced_swings(friction), ".-", color=colour, linewidth=0.8, markersize=3, label=f"{friction:g}"
        )
    axes[0].set_xlabel("swing")
    axes[0].set_ylabel("amplitude [rad]")
    axes[0].set_ylim(top=2.25)
    axes[0].legend(frameon=False, title="friction", loc="upper center", ncols=3)
    titled(axes[0], 0, "periodically forced pendulum")
    ratios = np.linspace(0.05, 3.05, 61)
    for ripple, colour in ((0.05, BEFORE), (0.01, AFTER)):
        values = [jitter(ripple, float(ratio)) for ratio in ratios]
        axes[1].plot(ratios, 100 * np.array(values), color=colour, label=f"ripple {ripple:.0%}")
        axes[1].axhline(50 * ripple, color=colour, linewidth=0.8, linestyle=":")
    axes[1].set_xlabel("ripple's frequency over the clock's")
    axes[1].set_ylabel("jitter of the period [%]")
    axes[1].legend(frameon=False)
    titled(axes[1], 1, "DLE, w = 12, rippled drive")
    amplitude = np.linspace(0.02, 1.5, 40)
    plain, cheeks = systems.pendulum(1.0, 0.0), systems.cycloidal_pendulum(1.0)
    axes[2].plot(amplitude, swing_period(plain, amplitude), color=BEFORE, label="plain pendulum")
    axes[2].plot(amplitude, swing_period(cheeks, amplitude), color=AFTER, label="between cheeks")
    axes[2].set_xlabel("amplitude [rad]")
    axes[2].set_ylabel("period / period of small swings")
    axes[2].legend(frameon=False)
    titled(axes[2], 2, "Huygens")
    for ax in axes:
        tidy(ax)
    return made


def eight(w: float = 10.0) -> tuple[Array, Array]:
    """Compute one period of the figure-eight's path (y, z), after the transient."""
    before = simulate(DLE(w), 500.0, [1, 1, 0.01], method="taylor").state[-1]
    run = simulate(DLE(w), np.linspace(0, float(periods(np.array([w]))[0]), 801), before, method="taylor")
    return run.state[:, 1], run.state[:, 2]


def pumped() -> tuple[Array, Array]:
    """Compute one period of the rider's centre of mass on a pumped swing, in mean lengths of the swing."""
    model = systems.pumped_swing(1.0, friction=0.16, depth=0.1, quickness=10.0, sharpness=20.0)
    before = simulate(model, 800.0, [0.0, 0.5, 1.0]).state[-1]
    times = poincare(model, "theta", 2, state0=before, transient=0, direction="up").t
    run = simulate(model, np.linspace(0, float(times[1] - times[0]), 801), before)
    theta, length = run.state[:, 1], run.state[:, 2]
    return length * np.sin(theta), -length * np.cos(theta)


def lengths(y: Array, z: Array) -> tuple[float, float]:
    """Compute the mean distance from the pivot on the way out (away from straight down) and back."""
    angle, distance = np.unwrap(np.arctan2(y, -z)), np.hypot(y, z)
    out = np.gradient(angle) * angle > 0
    return float(distance[out].mean()), float(distance[~out].mean())


@figure(
    "swing",
    paper="Section 6, the pumped swing",
    title="The figure-eight and a pumped swing",
    caption="Path of the centre of mass over one period, arrows in the direction of motion; the cross is "
    "the contact or the pivot. (a) The DLE at w = 10. (b) A swing whose rider stands on the way out and "
    "squats on the way in. Both are shorter on the way out and longer on the way back; both have a curved "
    "figure-eight.",
)
def swing(_lab: Lab) -> Figure:
    """Draw both paths."""
    made, axes = panels(1, 2, 9.6, 4.6)
    for k, ((y, z), words) in enumerate(((eight(), "DLE, w = 10"), (pumped(), "pumped swing"))):
        axes[k].plot(y, z, color=AFTER, linewidth=1.3)
        for at in (100, 300, 500, 700):
            style = {"arrowstyle": "-|>", "color": AFTER}
            axes[k].annotate("", xy=(y[at + 4], z[at + 4]), xytext=(y[at], z[at]), arrowprops=style)
        axes[k].plot(0, 0, "+", color=MEASURED, markersize=9)
        axes[k].set_aspect("equal", "datalim")
        axes[k].set_xlabel("y [1]")
        axes[k].set_ylabel("z [1]")
        tidy(axes[k])
        titled(axes[k], k, words)
    return made
