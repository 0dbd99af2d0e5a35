"""Cycles, connecting orbits, loci, cascades, lifetimes: what the analyses of bifurcations give."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from udd.errors import UddError

from .style import AFTER, BEFORE, FAINT, MEASURED, SHADES, axis_of, legend_above, new_axes, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def cycle(result: Any, ax: Axes | None = None, *, components: tuple[str, str] | None = None) -> Axes:
    """Draw a closed or connecting orbit in the plane of two components, with the equilibrium it touches.

    Parameters
    ----------
    result : PeriodicOrbit, Connection, CycleConnection or Crisis
        For a crisis it is the saddle cycle that the attractor meets.
    ax : Axes, optional
    components : (str, str), optional
        Across and up; by default the first two components of the state.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result holds no orbit, or has no such component.

    See Also
    --------
    udd.periodic_orbit : computes a cycle.
    udd.connections : computes connecting orbits.
    udd.plot.eigenvalues : draw its multipliers.

    Examples
    --------
    >>> import udd
    >>> udd.plot.cycle(udd.periodic_orbit(udd.DLE(8.0))).get_xlabel()
    'ω [1]'
    """
    orbit = getattr(result, "cycle", result)
    rest = getattr(result, "equilibrium", None)
    if hasattr(orbit, "trajectory"):
        model, states = orbit.model, orbit.trajectory().state
        words = f"{'stable' if orbit.stable else 'neutral' if orbit.neutral else 'unstable'} cycle"
    elif rest is not None and hasattr(orbit, "state"):
        model, states, words = rest.model, orbit.state, f"{result.kind} orbit"
    else:
        raise UddError(f"a cycle or a connection can be drawn, not {type(result).__name__}")
    names = components or model.state_names[:2]
    if len(names) != 2 or not set(names) <= set(model.state_names):
        raise UddError(f"components must be two of {', '.join(model.state_names)}, not {names}")
    (x_label, x_factor), (y_label, y_factor) = (axis_of(model, name) for name in names)
    i, j = (model.state_names.index(name) for name in names)
    ax = new_axes(ax)
    ax.plot(x_factor * states[:, i], y_factor * states[:, j], color=AFTER, linewidth=1.6, label=words)
    if rest is not None:
        place = x_factor * rest.state[i], y_factor * rest.state[j]
        ax.plot(*place, "o", color=BEFORE, markersize=6, label=f"equilibrium: {rest.kind}")
    ax.set_xlabel(x_label)
    ax.set_ylabel(y_label)
    legend_above(ax)
    tidy(ax)
    return ax


def eigenvalues(result: Any, ax: Axes | None = None) -> Axes:
    """Draw the eigenvalues of an equilibrium, or the multipliers of a cycle, in the complex plane.

    Parameters
    ----------
    result : Equilibrium or PeriodicOrbit
        An equilibrium is stable if all its eigenvalues lie left of the axis, a cycle if all its multipliers
        lie inside the unit circle.
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is neither.

    See Also
    --------
    udd.equilibria : computes equilibria.
    udd.periodic_orbit : computes a cycle.
    udd.plot.cycle : draw the orbit.

    Examples
    --------
    >>> import udd
    >>> udd.plot.eigenvalues(udd.equilibria(udd.DLE(8.0))[0]).get_xlabel()
    'real part [1]'
    """
    if hasattr(result, "eigenvalues"):
        values, unit = result.eigenvalues, result.model.profile.dynamics.rate_unit
    elif hasattr(result, "multipliers"):
        values, unit = result.multipliers, "1"
    else:
        raise UddError(f"an equilibrium has eigenvalues, not {type(result).__name__}")
    ax = new_axes(ax)
    inside = np.abs(values) < 1 if hasattr(result, "multipliers") else values.real < 0
    if hasattr(result, "multipliers"):
        turn = np.linspace(0, 2 * np.pi, 200)
        ax.plot(np.cos(turn), np.sin(turn), color=FAINT, linewidth=1.2)
        ax.set_aspect("equal", "datalim")
    else:
        ax.axvline(0, color=FAINT, linewidth=1.2)
    ax.axhline(0, color=FAINT, linewidth=0.8)
    for chosen, shade, words in ((inside, AFTER, "decaying"), (~inside, BEFORE, "growing or neutral")):
        if chosen.any():
            ax.plot(values[chosen].real, values[chosen].imag, "o", color=shade, markersize=7, label=words)
    ax.margins(0.2)
    ax.set_xlabel(f"real part [{unit}]")
    ax.set_ylabel(f"imaginary part [{unit}]")
    legend_above(ax)
    tidy(ax)
    return ax


def locus(result: Any, ax: Axes | None = None) -> Axes:
    """Draw a curve of bifurcations in the plane of its two parameters.

    Parameters
    ----------
    result : Locus
        Of :func:`udd.locus`.
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no locus.

    See Also
    --------
    udd.locus : computes it.
    udd.plot.branches : draw over a single parameter.
    """
    if not hasattr(result, "parameters") or not hasattr(result, "solutions"):
        raise UddError(f"a locus is of udd.locus, not {type(result).__name__}")
    ax = new_axes(ax)
    ax.plot(*result.values.T, color=AFTER, linewidth=1.6, label=f"{result.kind}")
    units = result.solutions[0].model.units
    across, up = (f"{name} [{units.get(name) or '1'}]" for name in result.parameters)
    ax.set_xlabel(across)
    ax.set_ylabel(up)
    legend_above(ax)
    tidy(ax)
    return ax


def cascade(result: Any, ax: Axes | None = None) -> Axes:
    """Draw how the doublings of a cascade come nearer to their limit.

    Parameters
    ----------
    result : Cascade
        Of :func:`udd.cascade`.
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no cascade.

    See Also
    --------
    udd.cascade : computes it.
    udd.plot.branches : draw the branches.
    """
    if not hasattr(result, "ratios") or not hasattr(result, "points"):
        raise UddError(f"a cascade is of udd.cascade, not {type(result).__name__}")
    ax = new_axes(ax)
    number = np.arange(1, len(result.values))
    ax.semilogy(number, np.abs(np.diff(result.values)), "o-", color=AFTER, label="spacing of doublings")
    ratios = result.ratios
    if len(ratios):
        slope = np.abs(np.diff(result.values))[0] * 4.669201609 ** (1.0 - number)
        ax.semilogy(number, slope, "--", color=MEASURED, label=f"by 4.6692 each; last ratio {ratios[-1]:.5g}")
    unit = result.branches[0].model.units.get(result.parameter) or "1"
    ax.set_xticks(number)
    ax.set_xlabel("doubling [number]")
    ax.set_ylabel(f"distance to the next in {result.parameter} [{unit}]")
    legend_above(ax)
    tidy(ax)
    return ax


def lifetimes(result: Any, ax: Axes | None = None) -> Axes:
    """Draw the share of motions that have not settled over time, with the exponential of their mean lifetime.

    Parameters
    ----------
    result : Lifetimes
        Of :func:`udd.lifetimes`.
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is none.

    See Also
    --------
    udd.lifetimes : computes them.
    """
    if not hasattr(result, "settled") or not hasattr(result, "mean"):
        raise UddError(f"lifetimes are of udd.lifetimes, not {type(result).__name__}")
    ax = new_axes(ax)
    ended = np.sort(result.time[result.settled])
    n = len(result.time)
    share = 1.0 - np.arange(1, len(ended) + 1) / n
    ax.step(np.r_[0.0, ended], np.r_[1.0, share], where="post", color=AFTER, linewidth=1.5, label="measured")
    if np.isfinite(result.mean):
        t = np.linspace(result.after, float(result.time.max()), 200)
        begin = float((result.time > result.after).mean())
        words = f"mean {result.mean:.3g} ± {result.standard_error:.1g}"
        ax.plot(t, begin * np.exp(-(t - result.after) / result.mean), "--", color=BEFORE, label=words)
    ax.set_yscale("log")
    ax.set_xlabel("time [unit of the model]")
    ax.set_ylabel("share not settled [1]")
    legend_above(ax)
    tidy(ax)
    return ax


def ensemble(result: Any, ax: Axes | None = None, *, coordinate: str | None = None, most: int = 50) -> Axes:
    """Draw one coordinate of many runs over time.

    Parameters
    ----------
    result : Ensemble
        Of :func:`udd.ensemble`.
    ax : Axes, optional
    coordinate : str, optional
        A component of the state; by default the last that is no angle.
    most : int
        How many runs are drawn at most, evenly chosen.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no ensemble, or has no such component.

    See Also
    --------
    udd.ensemble : computes the runs.
    udd.plot.time_series : draw a single run.

    Examples
    --------
    >>> import numpy as np, udd
    >>> many = udd.ensemble(udd.DLE(5.0), np.arange(0, 5, 0.1), [[1, 1, 0], [2, 1, 0]])
    >>> udd.plot.ensemble(many).get_ylabel()
    'z [1]'
    """
    if not hasattr(result, "t_end") or not hasattr(result, "model"):
        raise UddError(f"an ensemble is of udd.ensemble, not {type(result).__name__}")
    model = result.model
    names = model.state_names
    name = coordinate or ([n for n in names if n not in ("beta", "theta")] or list(names))[-1]
    if name not in names:
        raise UddError(f"the state has no {name!r}; it has {', '.join(names)}")
    runs = result.state[..., names.index(name)].reshape(-1, len(result.t))
    chosen = np.unique(np.linspace(0, len(runs) - 1, min(most, len(runs))).astype(int))
    label, factor = axis_of(model, name)
    ax = new_axes(ax)
    for k, run in enumerate(runs[chosen]):
        shade = SHADES[k % len(SHADES)] if len(chosen) <= len(SHADES) else AFTER
        alpha = 1.0 if len(chosen) <= len(SHADES) else 0.35
        ax.plot(result.t, factor * run, color=shade, alpha=alpha, linewidth=0.8)
    unit = model.profile.dynamics.time_unit
    ax.set_xlabel("t" if model.profile.written else f"time [{unit or '1'}]")
    ax.set_ylabel(label)
    tidy(ax)
    return ax


def input_signal(result: Any, ax: Axes | None = None) -> Axes:
    """Draw a measured input: its samples, and what a model takes between them.

    Parameters
    ----------
    result : InputSignal
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no signal.

    See Also
    --------
    udd.InputSignal : the signal.
    udd.plot.bias : the effect of its noise.

    Examples
    --------
    >>> import udd
    >>> udd.plot.input_signal(udd.InputSignal([0.0, 0.5, 1.0], [0.0, 1.0, 0.0])).get_xlabel()
    'time t [s]'
    """
    if not hasattr(result, "hold") or not callable(result):
        raise UddError(f"an input signal can be drawn, not {type(result).__name__}")
    ax = new_axes(ax)
    between = np.linspace(result.t[0], result.t[-1], max(2000, 4 * len(result.t)))
    ax.plot(between, result(between), color=AFTER, linewidth=1.2, label=f"between samples: {result.hold}")
    ax.plot(result.t, result.values, ".", color=MEASURED, markersize=3, label="samples")
    ax.set_xlabel("time t [s]")
    ax.set_ylabel("input [unit of the model]")
    legend_above(ax)
    tidy(ax)
    return ax


def bias(result: Any, ax: Axes | None = None) -> Axes:
    """Draw how far the noise of the inputs moves each fitted number.

    Parameters
    ----------
    result : InputBias
        Of :func:`udd.input_bias`.
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is none.

    See Also
    --------
    udd.input_bias : computes it.
    udd.plot.input_signal : draw the inputs.
    """
    if not hasattr(result, "corrected"):
        raise UddError(f"a bias is of udd.input_bias, not {type(result).__name__}")
    names = list(result.bias)
    size = np.array([100.0 * result.bias[n] / (abs(result.corrected[n]) or 1.0) for n in names])
    error = np.array([100.0 * 1.96 * result.errors[n] / (abs(result.corrected[n]) or 1.0) for n in names])
    ax = new_axes(ax)
    ax.errorbar(size, range(len(names)), xerr=error, fmt="o", color=AFTER, capsize=3)
    ax.axvline(0, color="black", linewidth=0.8)
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlabel("bias, with its 95 % interval [% of the corrected value]")
    ax.set_ylabel("parameter [name]")
    tidy(ax)
    return ax


def energy(result: Any, ax: Axes | None = None) -> Axes:
    """Draw the work of the motor, of friction and of added effects, and the stored energy, over time.

    Parameters
    ----------
    result : EnergyBalance
        Of :func:`udd.energy_balance`.
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no balance.

    See Also
    --------
    udd.energy_balance : computes it.
    udd.plot.time_series : draw the motion.
    """
    if not hasattr(result, "stored") or not hasattr(result, "work"):
        raise UddError(f"a balance is of udd.energy_balance, not {type(result).__name__}")
    ax = new_axes(ax)
    lines = [("motor", AFTER, 1.0), ("friction", BEFORE, -1.0), ("effects", SHADES[2], 1.0)]
    for name, shade, sign in lines:
        work = sign * result.work(name)
        if np.any(work):
            ax.plot(result.t, work, color=shade, linewidth=1.4, label=f"work of {name}")
    change = result.stored - result.stored[0]
    ax.plot(result.t, change, color=MEASURED, linewidth=1.0, label="change of stored energy")
    ax.axhline(0, color="black", linewidth=0.8)
    ax.set_xlabel("time T [s]")
    ax.set_ylabel("energy per unit mass [m²/s²]")
    legend_above(ax)
    tidy(ax)
    return ax
