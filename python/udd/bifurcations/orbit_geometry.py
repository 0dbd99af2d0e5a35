"""Shapes of cycles between their nodes: states, extremes and crossings."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from udd import _core
from udd.errors import IncompleteWarning, ModelError
from udd.models import Model
from udd.simulation.batch import Batch
from udd.simulation.trajectory import simulate

from .equilibrium_curve import expansion
from .floquet_multipliers import multipliers_at
from .flow_map import Floats

if TYPE_CHECKING:
    from udd.chaos.poincare_sections import Section

    from .shooting_curve import PeriodicOrbitCurve

__all__ = ["as_liouville", "crossings_of", "distance_of_nodes", "extremes_of", "orbit_states", "section_of"]

_BETWEEN = 12  # states in a piece
_LIOUVILLE = 1e-2  # between the logarithms of the product of all multipliers and of Liouville's formula


def orbit_states(curve: PeriodicOrbitCurve, u: Floats) -> Floats:
    """States (k, dim) all around a cycle; of a symmetric one over the whole period."""
    flow, m = curve.flow, curve.pieces
    times = np.linspace(0.0, curve.span(u) / m, _BETWEEN + 1)
    starts = flow.full(curve.nodes(u))
    model = flow.with_values(curve.values_at(u))
    rows = curve.values_at(u)[np.newaxis]
    if flow.forcing is None:
        method = "auto" if _core.has_series(model) else "dop853"
        runs = _core.ensemble(Batch(model, rows, starts, 1e-10, 1e-13), times, method)["states"]
    else:
        tight: dict[str, Any] = {"rtol": 1e-10, "atol": 1e-13, "method": "auto"}
        each = zip(curve.begins(u), starts, strict=True)
        runs = np.array([simulate(model, t + times, start, **tight).state for t, start in each])
    states: Floats = runs[:, :-1].reshape(m * _BETWEEN, -1)
    if curve.symmetric:
        image = flow.full(curve.mirror * flow.reduced(states))
        states = np.vstack([states, image])
    return states


def distance_of_nodes(first: PeriodicOrbitCurve, u: Floats, second: PeriodicOrbitCurve, v: Floats) -> float:
    """Return the largest distance of an orbit's nodes from the polygon of the other, in typical sizes."""
    flow = first.flow
    around = flow.reduced(orbit_states(second, v))
    nodes = first.around(u)
    gaps = nodes[:, None] - around[None]
    gaps = (gaps + flow.turns(gaps)) / flow.size
    sides = np.roll(around, -1, axis=0) - around
    sides = (sides + flow.turns(sides)) / flow.size
    squared = np.maximum((sides**2).sum(axis=1), 1e-300)
    part = np.clip((gaps * sides).sum(axis=2) / squared, 0.0, 1.0)
    away = np.linalg.norm(gaps - part[:, :, None] * sides, axis=2)
    return float(away.min(axis=1).max())


def extremes_of(curve: PeriodicOrbitCurve, u: Floats) -> tuple[Floats, Floats]:
    """Return the least and the largest values of a cycle's components; 0 for irrelevant angles."""
    states = orbit_states(curve, u)
    kept = curve.flow.kept
    low, high = np.zeros(states.shape[1]), np.zeros(states.shape[1])
    # A parabola through the largest sample and its neighbours: samples miss the peak.
    for k in kept:
        x = states[:, k]
        high[k], low[k] = _peak(x), -_peak(-x)
    return low, high


def _peak(x: Floats) -> float:
    i = int(np.argmax(x))
    before, top, after = x[i - 1], x[i], x[(i + 1) % len(x)]
    bend = before - 2.0 * top + after
    return float(top - 0.125 * (after - before) ** 2 / bend) if bend < 0.0 else float(top)


def crossings_of(curve: PeriodicOrbitCurve, u: Floats, section: str | None, direction: str | None) -> Floats:
    """Return the states (k, dim) at which a cycle crosses a section."""
    flow, model = curve.flow, curve.flow.with_values(curve.values_at(u))
    if flow.forcing is not None:
        raise ModelError("a forced cycle's section is its state at the forcing's phase 0: Branch.states")
    starts, time = flow.full(curve.around(u)), curve.span(u) / curve.pieces
    # Pieces end before their fourth crossing.
    crossings = section_of(
        model, section, 4, starts, direction=direction, t_max=time, rtol=1e-10, atol=1e-13, threads=1
    )
    states: Floats = crossings.state[np.isfinite(crossings.t)]
    return states


def section_of(model: Model, section: str | None, n: int, starts: Floats, **options: Any) -> Section:
    """Return the first crossings of orbits with a surface, without a warning if they are fewer than `n`."""
    from udd.chaos.poincare_sections import poincare

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IncompleteWarning)
        return poincare(model, section, n, state0=starts, transient=0, progress=False, **options)


def as_liouville(curve: PeriodicOrbitCurve, u: Floats) -> bool:
    """Return True if the product of the multipliers is the exponential of the divergence along the orbit.

    Not asked where the law has kinks, across which volumes may jump.
    """
    flow, values, multipliers = curve.flow, curve.values_at(u), multipliers_at(curve, u)
    if len(expansion(flow, values, curve.nodes(u)[0]).surfaces):
        return True
    states = flow.reduced(orbit_states(curve, u))
    # The mean over equal distances of time around a period converges faster than any power of their number.
    times = np.arange(len(states)) * (curve.period(u) / len(states))
    if flow.forcing is None:
        times = np.zeros(len(states))
    each = zip(states, times.tolist(), strict=True)
    divergence = np.mean([np.trace(expansion(flow, values, x, t=t).by_state) for x, t in each])
    known = float(divergence) * curve.span(u)
    rough = _LIOUVILLE * max(1.0, abs(known)) + float(np.minimum(multipliers.error, 1e3).sum())
    return bool(abs(float(multipliers.log.sum()) - known) < rough)
