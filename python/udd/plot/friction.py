"""Friction against angular velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd.errors import UddError
from udd.models import Model

from .inputs import is_fit
from .style import AFTER, FAINT, label, legend_above, new_axes, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@checked_arguments(error=UddError)
def friction(result: Any, ax: Axes | None = None, *, fastest: float | None = None) -> Axes:
    """Draw the friction coefficient k(Omega) of a model; of a fit with a band of one standard error.

    It is read off the model's own rates at the contact, where gravity and the drive exert no torque, so that
    every drag that was added is in it: k = -I (dOmega/dT)/Omega.

    Parameters
    ----------
    result : Disk, Pendulum or Fit
    ax : Axes, optional
    fastest : float, optional
        Largest angular velocity, rad/s; by default the largest fitted one, or 15.

    Returns
    -------
    Axes

    See Also
    --------
    udd.fit : estimates the friction.
    udd.plot.residuals : draw the residuals.
    """
    fit = result if is_fit(result) else None
    model = fit.model if fit is not None else result
    if not isinstance(model, Model) or model.profile.dynamics.inertia is None:
        raise UddError(f"a disk, a pendulum or a fit has friction, not {type(model).__name__}")
    speeds = np.abs(fit.states[:, 0]) if fit is not None else np.empty(0)
    top = fastest or (float(speeds.max()) if speeds.size else 15.0)
    omega = np.linspace(top / 400, top, 400)
    ax = new_axes(ax)
    best = coefficient(model, omega)
    if fit is not None:
        low, high = np.quantile(speeds, [0.05, 0.95])
        ax.axvspan(low, high, color="#dedede", zorder=0, label="90 % of the frames")
        error = _error(fit, omega)
        ax.fill_between(
            omega,
            best - error,
            best + error,
            color=AFTER,
            alpha=0.25,
            linewidth=0,
            label="± 1 standard error",
        )
    ax.plot(omega, best, color=AFTER, linewidth=1.8, label="k(Ω)")
    ax.axhline(0, color=FAINT, linewidth=0.8)
    ax.set_xlabel("angular velocity |Ω| [rad/s]")
    ax.set_ylabel(label("k"))
    ax.set_xlim(0, top)
    ax.set_ylim(bottom=min(0.0, 1.1 * float(best.min())))
    if fit is not None:
        legend_above(ax)
    tidy(ax)
    return ax


def coefficient(model: Any, omega: Array) -> Array:
    """Friction coefficient, m^2/s; what does not change sign with Omega is no friction."""
    state = np.zeros((2, len(omega), len(model.state_names)))
    state[:, :, 0] = omega, -omega
    rate = model.rates(0.0, state)[..., 0]
    inertia = model.profile.dynamics.inertia(model, state[0])
    result: Array = -inertia * (rate[0] - rate[1]) / 2 / omega
    return result


def _error(fit: Any, omega: Array) -> Array:
    """Standard error of k from the parameters' covariance, to first order."""
    names = list(fit.parameters)
    friction_names = [n for n in names if n in fit.model.parameters]
    slopes = []
    for name in friction_names:
        step = 0.1 * fit.errors[name]
        if not (np.isfinite(step) and step > 0):
            slopes.append(np.zeros(len(omega)))
            continue
        value = fit.model.parameters[name]
        sides = []
        for s in (-step, step):
            try:
                sides.append((value + s, coefficient(fit.model.with_parameters({name: value + s}), omega)))
            except UddError:  # beyond what the parameter may be
                sides.append((value, coefficient(fit.model, omega)))
        (a, ka), (b, kb) = sides
        slopes.append((kb - ka) / (b - a) if b > a else np.zeros(len(omega)))
    jacobian = np.array(slopes).T if slopes else np.zeros((len(omega), 0))
    pick = [names.index(n) for n in friction_names]
    block = fit.covariance[np.ix_(pick, pick)]
    result: Array = np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", jacobian, block, jacobian), 0.0))
    return result
