"""Periodic orbits by multiple shooting."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from udd._util.arguments import checked_arguments
from udd._util.keywords import renamed
from udd._util.memory import require_memory
from udd._util.validation import array, number
from udd.errors import IntegrationError, ModelError
from udd.models import Model, beyond_the_edge, require_model
from udd.models.parameter_batch import default_state
from udd.simulation.trajectory import simulate

from .flow_map import Floats, FlowMap, flow_of
from .forced_orbits import forcing_of, repeats
from .model_states import state_of_attractor
from .pseudo_arclength import CorrectorFailed, natural_constraint, nearest_of_family, newton_corrector
from .shooting_curve import PeriodicOrbitCurve
from .solution_curve import NO_PARAMETER
from .solutions import PeriodicOrbit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["closed", "flown", "half_of", "periodic_orbit"]

_FINE = 64  # Samples in a typical time.
_CLOSE = 3e-2  # Distance of a return that can be that of a cycle, in typical sizes.
_SAME = 1e-7  # Distance of two states that are the same, in typical sizes.
_HALF = 3e-2  # Largest difference of the halves, in typical sizes, where the parameter turns.
_PRIMES = [k for k in range(2, 100) if all(k % p for p in range(2, k))]
_LOOKS = 100  # States that show the extent of a cycle.
_WHOLE = 0.3  # Least part of a cycle's extent that a few states of one round show.
_SINGULAR = (1e-2, 1e-4, 1e-7)  # Singular values that count as zero, relative to the largest.
_FAMILY = 400  # Largest number of unknowns for which singular values are computed.
_RESIDUAL = 1e-9  # Gaps that are zero.


@renamed(longest="max_period")
@checked_arguments
def periodic_orbit(
    model: Model,
    guess: ArrayLike | xr.Dataset | None = None,
    *,
    period: float | str | None = None,
    settle: float | None = None,
    max_period: float | None = None,
) -> PeriodicOrbit:
    """Find a cycle of a model, with its Floquet multipliers and its symmetry.

    Parameters
    ----------
    model : Model
        If its rates depend on time, they must be periodic, with the `period` given. The disk's edge is
        ignored.
    guess : array_like, shape (dim,) or (n, dim), or xarray.Dataset, optional
        A state near the cycle, or states on it at equal distances of time over one period, which must then
        be given. One attractor of :func:`udd.basins` or :func:`udd.bifurcation`, such as
        ``basins.sel(number=2)`` or ``basins.isel(path=0, start=0).sel(w=6.0)``, gives its state, its period
        and the value of the parameter. By default the search starts where :func:`udd.lyapunov` does.
    period : float or str, optional
        About its period. By default the run from the guess tells it: the first time that it comes back, or
        nearly back, be it to the mirror image. A forced model needs exactly the forcing's period, or a
        multiple of it: a number, or a formula of the parameters such as ``"2*pi/w"``, by which it also
        changes along a branch.
    settle : float, optional
        The time for which the model is run from the guess before, to get near a stable cycle. By default it
        is 0, or 600 typical times (4/sqrt(w) of the DLE, 0.9 s of the disk) without a guess. For a
        forced model this time is rounded up to whole periods; the guess is a state at time 0.
    max_period : float, optional
        The longest period looked for, by default 40 typical times.

    Returns
    -------
    PeriodicOrbit

    Raises
    ------
    ModelError
        A model whose rates depend on time while no period is given or do not repeat after it, a guess of the
        wrong shape, or one from which Newton's method finds no cycle.

    See Also
    --------
    udd.continuation : follows it over a parameter.
    udd.plot.cycle : draw it.
    udd.plot.eigenvalues : draw its multipliers.

    Notes
    -----
    The orbit is cut into pieces. The Taylor method follows them to the tolerance 1e-13 (Dormand & Prince's
    method of order 8 if the law has no power series), with derivatives from dual numbers. Newton's method
    closes the gaps. If energy is kept, so that cycles come in families, the method of Gauss and Newton finds
    one near the guess. Runs land on kinks of the law. A cycle that is its
    own mirror image is solved for over half its period. Cycles need not be stable: near a chaotic motion's
    close returns there are unstable ones.

    A cycle of a forced model lasts as long as the forcing says; its multipliers are those of the stroboscopic
    map, one for each component of the state.

    References
    ----------
    Multiple shooting: S. J. Wright [27]. Multipliers: A. Bojanczyk et al. [32].

    Examples
    --------
    The figure-eight of the diffusionless Lorenz equations:

    >>> import udd
    >>> orbit = udd.periodic_orbit(udd.DLE(10.0))
    >>> print(round(orbit.period, 10), orbit.symmetric, orbit.stable)
    3.3583222491 True True

    From an attractor that a basin belongs to:

    >>> import numpy as np
    >>> axis = np.linspace(-3, 3, 8)
    >>> basins = udd.basins(udd.DLE(6.2), {"omega": axis, "z": axis}, state0=[0, 0.5, 0], n=24)
    >>> udd.periodic_orbit(udd.DLE(6.2), basins.sel(number=2)).symmetric
    False

    Duffing's oscillator, forced, and the frequencies at which its amplitude jumps:

    >>> forced = {"c": 0.1, "F": 0.3, "w": 1.2}
    >>> duffing = udd.Model(["x", "v"], ["v", "-x - x^3 - c*v + F*cos(w*t)"], forced)
    >>> orbit = udd.periodic_orbit(duffing, [0.0, 0.0], period="2*pi/w", settle=200.0)
    >>> branch = udd.continuation(orbit, "w", (0.8, 2.5))
    >>> [(point.kind, round(point.value, 9)) for point in branch.points]
    [('fold', 1.779719524), ('fold', 1.324236201)]
    """
    require_model(model)
    if guess is not None and hasattr(guess, "data_vars"):
        model, guess, lasts = state_of_attractor(model, guess)
        period = lasts if period is None else period
    dim = len(model.state_names)
    given = array("guess", default_state(model) if guess is None else guess)
    if given.ndim not in (1, 2) or given.shape[-1] != dim or given.size == 0:
        raise ModelError(f"the guess must be states of {dim} components, not of shape {given.shape}")
    free = beyond_the_edge(model)
    forcing = None if period is None else forcing_of(free, period)
    flow = flow_of(free, np.atleast_2d(given), forcing=forcing)
    span = 0.0 if forcing is None else forcing.period(flow.values)[0]
    if given.ndim == 2 and len(given) > 1:
        if forcing is None:
            raise ModelError("states over a period need the period")
        nodes = flow.reduced(given)
        return _polished(model, flow, nodes, span, np.ones(flow.dim), _shift_of(flow, nodes, span))
    aside = 600.0 * flow.clock if guess is None else 0.0
    aside = number("settle", aside if settle is None else settle, least=0.0)
    if flow.forcing is not None:
        aside = math.ceil(aside / span) * span
    start = given.reshape(dim)
    if aside > 0.0:
        start = simulate(free, [0.0, aside], start, method="auto").state[-1]
    limit = number("max_period", 40.0 * flow.clock if max_period is None else max_period, above=0.0)
    mirrored = False
    if forcing is None:
        span, mirrored = _return_time(flow, free, start, limit)
    require_memory("pieces of a cycle", 2.0 * span / flow.clock, flow.dim)
    pieces = flow.pieces_for(span)
    run = simulate(free, np.linspace(0.0, span, pieces + 1), start, rtol=1e-11, atol=1e-14, method="auto")
    ends = flow.reduced(run.state)
    mirror = flow.images[int(mirrored)]
    return _polished(model, flow, ends[:-1], span, mirror, flow.turns(mirror * ends[-1] - ends[0]))


def _polished(
    model: Model, flow: FlowMap, nodes: Floats, span: float, mirror: Floats, shift: Floats
) -> PeriodicOrbit:
    """Return the cycle that Newton's method finds, in its simplest form."""
    curve, u = closed(flow, nodes, span, mirror, shift)
    curve, u = _simplest(curve, u)
    # The model as it was given: its edge too.
    return replace(curve.solution(u), model=model)


def closed(
    flow: FlowMap, nodes: Floats, span: float, mirror: Floats, shift: Floats
) -> tuple[PeriodicOrbitCurve, Floats]:
    """Close the orbit: return the curve with its parameters, and the unknowns there."""
    # The parameter is fixed: any that does not vanish will do; a model may have none.
    fixed = int(np.argmax(flow.values != 0.0)) if flow.values.size else NO_PARAMETER
    value = 0.0 if fixed == NO_PARAMETER else float(flow.values[fixed])
    scale = abs(value) or 1.0
    share = 1.0 if flow.forcing is None else span / flow.forcing.period(flow.values)[0]
    curve = PeriodicOrbitCurve(
        flow, flow.values, fixed, scale, span, len(nodes), mirror, shift, nodes, np.zeros_like(nodes), share
    )
    guess = curve.pack(nodes, span, value)
    curve = curve.anchored(guess, first=True)  # the state that is returned is the one near the guess
    tried = f"no cycle of period {curve.period(guess):.6g} is found near the guess"
    row = natural_constraint(guess)
    # If energy is kept, cycles come in families: near one the equations leave a direction nearly free.
    few = _SINGULAR if len(guess) < _FAMILY else ()
    ways: list[Callable[..., Floats]] = [newton_corrector]
    ways += [partial(nearest_of_family, singular=size) for size in few]
    failure = ""
    for way in ways:
        try:
            u = way(curve, guess, row, patience=30)
            reason = _no_cycle(curve, u)
        except (CorrectorFailed, IntegrationError) as error:
            reason = str(error)
        if not reason:
            return curve, u
        failure = failure or reason
    raise ModelError(f"{tried}: {failure}")


def _no_cycle(curve: PeriodicOrbitCurve, u: Floats) -> str:
    """Return the reason why a solution of the equations is no cycle, or an empty text."""
    flow, (residual, _), start = curve.flow, curve.equations(u), curve.nodes(u)[0]
    if not np.isfinite(u).all() or np.abs(residual).max() > _RESIDUAL:
        return "Newton's method does not converge"
    if flow.forcing is not None:
        return ""
    rest = np.abs(flow.rates(curve.values_at(u), start) * flow.clock / flow.size).max()
    short = curve.span(u) < 1e-6 * flow.clock
    return "the orbit shrinks to a state of rest" if rest < 1e-9 or short else ""


def half_of(curve: PeriodicOrbitCurve, u: Floats) -> tuple[str, PeriodicOrbitCurve, Floats]:
    """Return the bifurcation whose orbit closes after half this time, its curve and nodes; "" for none."""
    flow, start, half = curve.flow, curve.nodes(u)[0], curve.span(u) / 2.0
    nodes = flown(flow, curve.values_at(u), start, half, flow.pieces_for(half))
    ways = zip(flow.images, ("period doubling", "symmetry breaking"), strict=False)
    for mirror, kind in () if curve.symmetric else ways:
        gap = mirror * nodes[-1] - start
        shift = flow.turns(gap)
        if np.abs((gap + shift) / flow.size).max() < _HALF:
            share = curve.share / 2.0
            own = replace(curve, pieces=len(nodes) - 1, mirror=mirror, shift=shift, share=share)
            return kind, own.anchored(own.pack(nodes[:-1], half, curve.value(u))), nodes[:-1]
    return "", curve, nodes[:-1]


def _simplest(curve: PeriodicOrbitCurve, u: Floats) -> tuple[PeriodicOrbitCurve, Floats]:
    """Return the cycle over its shortest part: its least period, or half of it if it is symmetric."""
    flow, values = curve.flow, curve.values_at(u)
    span, start = curve.span(u), curve.nodes(u)[0]
    # A symmetric cycle closes in the mirror after odd parts only.
    ways = [(k, curve.mirror) for k in _PRIMES if k > 2 or not curve.symmetric]
    if flow.mirror is not None and not curve.symmetric:
        ways.append((2, flow.mirror))
    ways.sort(key=lambda way: -way[0])
    times = np.array([0.0, *(span / k for k, _ in ways)])
    model = flow.with_values(values)

    def states_at(moments: Floats) -> Floats:
        run = simulate(model, moments, flow.full(start), rtol=1e-12, atol=1e-14, method="auto")
        return flow.reduced(run.state)

    def extent(time: float) -> float:
        # At unequal distances: equal ones may be a round each.
        states = states_at(time * np.linspace(0.0, 1.0, _LOOKS) ** 1.3)
        return float((np.ptp(states, axis=0) / flow.size).max())

    distinct, place = np.unique(times, return_inverse=True)
    ends = states_at(distinct)[place]
    for (parts, mirror), end in zip(ways, ends[1:], strict=True):
        gap = mirror * end - start
        shift = flow.turns(gap)
        if np.abs((gap + shift) / flow.size).max() > _SAME:
            continue
        if flow.forcing is not None and not repeats(model, flow.kept, flow.size, span / parts, mirror):
            continue
        share = span / parts
        if extent(share) < _WHOLE * extent(span):
            continue  # it has hardly left its start, where it is slow
        nodes = flown(flow, values, start, share, flow.pieces_for(share))
        try:
            closing = closed(replace(flow, model=model), nodes[:-1], share, mirror, shift)
        except ModelError:
            continue
        return _simplest(*closing)
    return curve, u


def flown(flow: FlowMap, values: Floats, start: Floats, span: float, pieces: int) -> Floats:
    """States (pieces + 1, r) at equal distances of time along an orbit."""
    states = [start]
    for i in range(pieces):
        begin = np.array([i * span / pieces])
        states.append(flow.fly(values, states[-1][np.newaxis], np.array([span / pieces]), t=begin).x[0])
    return np.array(states)


def _shift_of(flow: FlowMap, nodes: Floats, span: float) -> Floats:
    share = np.array([span / len(nodes)])
    end = flow.fly(flow.values, nodes[-1:], share, t=span - share).x[0]
    return flow.turns(end - nodes[0])


def _return_time(flow: FlowMap, model: Model, start: Floats, longest: float) -> tuple[float, bool]:
    """Return the time after which the run from a state returns, and True if its mirror image returns."""
    require_memory("states up to max_period", _FINE * longest / flow.clock, flow.dim, itemsize=40)
    count = math.ceil(_FINE * longest / flow.clock)
    times = np.linspace(0.0, longest, count + 1)
    states = flow.reduced(simulate(model, times, start, rtol=1e-10, atol=1e-13, method="auto").state)
    returns = []
    for mirrored, mirror in enumerate(flow.images):
        gap = mirror * states - states[0]
        gap = gap + flow.turns(gap)
        away = np.linalg.norm(gap / flow.size, axis=1)
        left = np.maximum.accumulate(away) > 4 * _CLOSE
        # A minimum lies between samples; the distance there, of a straight line between neighbours.
        for i in range(1, count):
            if not (away[i] <= away[i - 1] and away[i] < away[i + 1] and left[i]):
                continue
            before, after = gap[i - 1] / flow.size, gap[i + 1] / flow.size
            line = after - before
            part = float(np.clip(-(before @ line) / (line @ line), 0.0, 1.0)) if line.any() else 0.5
            time = times[i - 1] + part * (times[i + 1] - times[i - 1])
            # Curved between samples: near the minimum the gap's part across the line is what counts.
            middle = gap[i] / flow.size
            across = middle - line * ((middle @ line) / (line @ line)) if line.any() else middle
            returns.append((float(np.linalg.norm(across)), float(time), bool(mirrored)))
    if not returns:
        raise ModelError(f"the run from the guess does not come back within {longest:.4g}")
    best = min(away for away, _, _ in returns)
    if best > 10 * _CLOSE:
        raise ModelError(
            f"the run from the guess does not come near its start within {longest:.4g}: give the period"
        )
    _, time, mirrored = min((r for r in returns if r[0] <= max(3.0 * best, 1e-3)), key=lambda r: r[1])
    return time, mirrored
