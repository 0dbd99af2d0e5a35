"""Crises of chaotic attractors: homoclinic tangencies of the saddle cycle on the edge of the basin."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.memory import require_memory
from udd._util.validation import whole
from udd.errors import IncompleteWarning, IntegrationError, ModelError

from .branch import Branch, cycles_of
from .error_bounds import COARSE, rounding_of
from .flow_map import Floats, FlowMap
from .periodic_orbits import cycle_at
from .shooting_curve import PeriodicOrbitCurve
from .solutions import PeriodicOrbit

__all__ = ["Crisis", "crises"]

_AWAY = 1e-4  # from the cycle, in typical sizes, the manifold begins as a straight line
_SLOW = 1.1  # with a smaller multiplier the cycle is too near its fold: the manifold hardly leaves it
_LEFT = 0.3  # typical sizes along the manifold: further away it has left the cycle
_NEAR = 0.1  # a passage within this distance of the cycle, also one round later, is one beside the cycle
_AGREES = 2.0  # by this factor at most a passage differs from what the multiplier says
_HALVINGS = 12  # of an interval at most, until passages lie close to the stable manifold
_CLOSE = 1e-3  # typical sizes: so near the stable manifold the fold of the unstable one is looked at
_TIPS = 4  # folds that are tried at a time, earliest first
_TRIES = 4
_STENCIL = np.linspace(-1.0, 1.0, 7)
_FOLDS = 40  # steps to a fold at most
_ROUNDS = 8  # about the cycle at most, until the parameter stands
_STANDS = 1e-13  # by this relative change
_STEPS = 30
_STAYS = 20  # crossings in a row near the attractor that mean that an orbit stays there
_AGE = 400  # typical times for which the manifold's other side is followed, twice
_OTHERS = 48  # orbits of it
_MOST, _SOME = 0.9, 0.05  # shares of them
_ASIDE = 1e-5  # relative: so far from the crisis the attractor is looked at


@dataclass(frozen=True, eq=False)
class Crisis(Drawable):
    """Where a chaotic attractor meets a saddle cycle.

    Attributes
    ----------
    kind : {"boundary crisis", "interior crisis", "attractor merging crisis"}
        Beyond a boundary crisis the attractor is a transient, beyond an interior crisis it is suddenly
        larger, and beyond a merging crisis one with its mirror image. The verdict depends on where the other
        side of the cycle's unstable manifold goes in a finite time; it has no bound.
    parameter : str
    value : float
        The parameter's value.
    error : float
        A bound of the tangency's error: how far it moved with the last round about the cycle, how far it
        moves when runs are a hundred times less accurate, and when the manifold begins ten times further from
        the cycle. It does not cover an earlier tangency that the `returns` do not show.
    side : {"below", "above"}
        Where the attractor is the smaller one: of the value.
    returns : int
        How many passages beside the cycle were looked at just before the value. None of them is beyond the
        stable manifold, so there is no earlier tangency among them.
    cycle : PeriodicOrbit
        The saddle cycle at the value.
    """

    kind: str
    parameter: str
    value: float
    error: float
    side: str
    returns: int
    cycle: PeriodicOrbit

    def as_dict(self) -> dict[str, Any]:
        """The crisis as plain numbers, for JSON."""
        return {
            "kind": self.kind,
            "parameter": self.parameter,
            "value": self.value,
            "error": self.error,
            "side": self.side,
            "returns": self.returns,
            "period": self.cycle.period,
            "state": self.cycle.state.tolist(),
        }

    def __repr__(self) -> str:
        return (
            f"<{self.kind} at {self.parameter} = {self.value:.13g} (error below {self.error:.1g}), attractor "
            f"{self.side} it, saddle cycle of period {self.cycle.period:.8g}>"
        )


@checked_arguments
def crises(branch: Branch, *, n: int = 100, depth: int = 40) -> list[Crisis]:
    """Where chaotic attractors meet the saddle cycles of a branch: boundary, interior and merging crises.

    Parameters
    ----------
    branch : Branch
        Of cycles over a parameter, from :func:`udd.continuation`. Its saddle cycles with one multiplier
        above 1 are looked at, such as those born with a window at its fold.
    n : int
        How many orbits of the unstable manifold are followed.
    depth : int
        For how many rounds about the cycle, after they have left it.

    Returns
    -------
    list of Crisis
        In the order of their values.

    Raises
    ------
    ModelError
        No branch of cycles over a parameter of a model that is not forced.

    Notes
    -----
    One side of the saddle cycle's unstable manifold goes to the attractor and is folded there. As long as it
    does not cross the cycle's stable manifold, the attractor is shut in; a crisis is the first tangency of
    the two (C. Grebogi, E. Ott and J. Yorke, Physical Review Letters 48 (1982) 1507; Physica D 7 (1983) 181).
    The tangency is solved for: the fold of the unstable manifold that comes nearest, flown for more and more
    rounds about the cycle. That no other fold is earlier is tested on `n` orbits; one that they miss would
    move the value, and there is no bound of that. Two crises between neighbouring points of the branch are
    missed, and so are those at cycles with multipliers below -1 that are not symmetric (their sides change
    every round).

    Examples
    --------
    The small chaotic attractors of the diffusionless Lorenz equations just below w = 6; 15 orbits show
    their crisis:

    >>> import udd
    >>> model = udd.DLE(6.0)
    >>> orbit = udd.periodic_orbit(model, [0.7266504, -8.8243717, 0.0], settle=0.0)
    >>> (one,) = udd.crises(udd.continuation(orbit, "w", (5.9, 6.1)), n=15, depth=15)
    >>> print(one.kind, one.side)
    boundary crisis above
    """
    cycles_of(branch)
    count, rounds = whole("n", n, 10), whole("depth", depth, 5)
    require_memory(f"{count} orbits of {rounds} rounds", count, rounds, 8, itemsize=8)
    found = [one for side in (1.0, -1.0) for one in _Search(branch, side, count, rounds).crises()]
    distinct: list[Crisis] = []
    for one in sorted(found, key=lambda one: one.value):
        # The two sides of a symmetric cycle may be mirror images.
        near = one.error + distinct[-1].error if distinct else 0.0
        if not distinct or one.value - distinct[-1].value > max(near, 1e-9 * abs(one.value)):
            distinct.append(one)
    return distinct


@dataclass(frozen=True, eq=False)
class _Saddle:
    """A cycle with one multiplier above 1: a state, the rate there, and the directions of that multiplier."""

    flow: FlowMap
    values: Floats
    value: float
    state: Floats
    rate: Floats
    right: Floats
    left: Floats
    multiplier: float
    cycle: PeriodicOrbit

    def facing(self, other: _Saddle | None) -> _Saddle:
        """With the directions turned to those of a neighbour: an eigenvector's sign is arbitrary."""
        if other is None or self.right @ other.right > 0.0:
            return self
        return replace(self, right=-self.right, left=-self.left)

    @property
    def period(self) -> float:
        """The cycle's."""
        return self.cycle.period

    def height(self, x: Floats) -> Floats:
        """How far states (..., r) are from the stable manifold's tangent, along the unstable direction."""
        height: Floats = ((x - self.state) / self.flow.size) @ self.left
        return height

    def distance(self, x: Floats) -> Floats:
        """How far states (..., r) are from the cycle's state."""
        gap: Floats = np.linalg.norm((x - self.state) / self.flow.size, axis=-1)
        return gap

    @cached_property
    def plane(self) -> str:
        """The plane through the state across the flow, as an expression."""
        names = [self.flow.model.state_names[k] for k in self.flow.kept]
        weights = self.rate / self.flow.size / np.linalg.norm(self.rate)
        terms = zip(names, weights.tolist(), self.state.tolist(), strict=True)
        return " + ".join(f"({weight!r})*({name} - ({x!r}))" for name, weight, x in terms)

    def start(self, u: Floats, side: float, away: float) -> Floats:
        """States on one side of the unstable manifold: after one round `u` is larger by 1."""
        along = side * away * self.multiplier ** np.asarray(u)[:, None] * self.right
        return np.asarray(self.state + self.flow.size * along)


def _saddle_of(curve: PeriodicOrbitCurve, u: Floats) -> _Saddle | None:
    """The cycle, if one multiplier is above 1 and all others are inside the unit circle."""
    flow, values = curve.flow, curve.values_at(u)
    closing = curve.monodromy(u)
    # A symmetric cycle is taken over the whole period: in the mirror the sides may change.
    around = flow.scaled(closing @ closing if curve.symmetric else closing)
    numbers, right = np.linalg.eig(around)
    across = np.abs(numbers - 1.0) > 1e-6
    outside = np.flatnonzero(across & (np.abs(numbers) > 1.0))
    if len(outside) != 1 or abs(numbers[outside[0]].imag) > 0.0 or numbers[outside[0]].real < _SLOW:
        return None
    place = int(outside[0])
    vector = right[:, place].real
    left = np.linalg.inv(right)[place]
    turned = left.real * (right[:, place] @ left).real  # both may have been scaled by the same phase
    state = curve.nodes(u)[0]
    rate = curve.rate_at(values, state) / flow.size
    norm = float(np.linalg.norm(vector))
    return _Saddle(
        flow,
        values,
        curve.value(u),
        state,
        rate,
        vector / norm,
        turned * norm,
        float(numbers[place].real),
        cycle_at(curve, u),
    )


@dataclass(frozen=True)
class _Passages:
    """Passages beside the cycle: of which orbit (its `u`), when, and how far on the attractor's side."""

    u: Floats
    t: Floats
    height: Floats

    @property
    def crossed(self) -> bool:
        """Whether some are beyond the stable manifold."""
        return bool((self.height < 0.0).any())

    def nearest(self) -> list[tuple[float, float]]:
        """Orbits and times of those furthest beyond the stable manifold or, if none is, next to it."""
        least = self.height.min(initial=np.inf)
        near = np.flatnonzero(self.height <= least + 4.0 * abs(least))
        # The later a passage, the finer are the folds about it.
        early = near[np.argsort(self.t[near])]
        return [(float(self.u[k]), float(self.t[k])) for k in early[:_TIPS]]


class _Search:
    """One side of the unstable manifolds of a branch's saddle cycles."""

    def __init__(self, branch: Branch, side: float, count: int, depth: int) -> None:
        curve = branch._places[0][0]
        assert isinstance(curve, PeriodicOrbitCurve)
        self.branch, self.flow = branch, curve.flow
        self.side, self.count, self.depth = side, count, depth
        self.away, self.loose = _AWAY, 1.0

    def crises(self) -> list[Crisis]:
        """Those between neighbouring cycles of the branch of which one side is shut in."""
        seen: list[tuple[_Saddle, bool] | None] = []
        last: _Saddle | None = None
        for curve, place in self.branch._places:
            assert isinstance(curve, PeriodicOrbitCurve)
            saddle = _saddle_of(curve, place.u)
            if saddle is None:
                seen.append(None)
                continue
            last = saddle = saddle.facing(last)
            seen.append((saddle, self._passages(saddle).crossed))
        found = []
        for one, other in pairwise(seen):
            if one is None or other is None or one[1] == other[1]:
                continue
            shut, open_ = (one[0], other[0]) if other[1] else (other[0], one[0])
            try:
                found.append(self._located(shut, open_))
            except (ModelError, IntegrationError):
                continue  # no fold reaches the stable manifold: passages of another kind
        return found

    def _saddle(self, value: float, like: _Saddle) -> _Saddle:
        """The saddle cycle at a value of the parameter that lies near a known one."""
        near = [one for one in self.branch.at(value) if isinstance(one, PeriodicOrbit)]
        near.sort(key=lambda one: float(like.distance(self.flow.reduced(one.state))))
        for one in near:
            assert one._curve is not None and one._unknowns is not None
            saddle = _saddle_of(one._curve, one._unknowns)
            if saddle is not None:
                return saddle.facing(like)
        raise ModelError(f"no saddle cycle is found at {value:.10g}")

    def _crossings(self, saddle: _Saddle, starts: Floats, time: float) -> tuple[Floats, Floats]:
        """Times (n, k) and states (n, k, r) where orbits cross the cycle's plane, NaN after the last."""
        from udd.chaos.poincare_sections import poincare

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IncompleteWarning)  # they end by the time
            found = poincare(
                self.flow.with_values(saddle.values),
                saddle.plane,
                int(20.0 * time / saddle.period) + 20,
                state0=self.flow.full(starts),
                direction="up",
                transient=0,
                t_max=time,
                rtol=1e-9,
                atol=1e-12,
                progress=False,
            )
        return found.t, self.flow.reduced(found.state)

    def _passages(self, saddle: _Saddle) -> _Passages:
        """Where the manifold comes beside the cycle again, after it has left it."""
        u = (np.arange(self.count) + 0.5) / self.count
        leaves = np.log(1.0 / self.away) / np.log(saddle.multiplier)
        starts = saddle.start(u, self.side, self.away)
        t, x = self._crossings(saddle, starts, (leaves + self.depth) * saddle.period)
        height, away = self.side * saddle.height(x), saddle.distance(x)
        # The first rounds are still those on which it leaves.
        left = (np.log(_LEFT / self.away) / np.log(saddle.multiplier) - u) * saddle.period
        near = (t > left[:, None]) & (away < _NEAR)
        which, first = np.nonzero(near)
        heights = np.full(len(which), np.nan)
        # The plane may be crossed several times in a round: the crossing one period later is what tells.
        for ahead in range(1, min(20, t.shape[1])):
            after = np.minimum(first + ahead, t.shape[1] - 1)
            late = np.abs(t[which, after] - t[which, first] - saddle.period) < 0.1 * saddle.period
            grown = height[which, after] / (saddle.multiplier * height[which, first])
            agrees = late & (away[which, after] < _NEAR) & (grown > 1.0 / _AGREES) & (grown < _AGREES)
            heights[agrees] = height[which, after][agrees] / saddle.multiplier
        told = np.isfinite(heights)
        return _Passages(u[which[told]], t[which[told], first[told]], heights[told])

    def _located(self, shut: _Saddle, open_: _Saddle) -> Crisis:
        """The tangency between a cycle that shuts the attractor in and one that does not."""
        passages = self._passages(shut)
        for _ in range(_HALVINGS):
            if passages.height.min(initial=np.inf) < _CLOSE:
                break
            middle = self._saddle(0.5 * (shut.value + open_.value), shut)
            between = self._passages(middle)
            if between.crossed:
                open_ = middle
            else:
                shut, passages = middle, between
        above, width = shut.value > open_.value, abs(open_.value - shut.value)
        for _ in range(_TRIES):
            tangencies: list[tuple[float, float, float]] = []
            for u, t in passages.nearest():
                try:
                    value, at = self._tangency(shut, u, t, 0, width)
                except (ModelError, IntegrationError):
                    continue
                if abs(value - shut.value) < 10.0 * width:
                    tangencies.append((value, at, t))
            if not tangencies:
                break
            # The first one that is met from where the attractor is shut in.
            first = max(tangencies) if above else min(tangencies)
            value, error, saddle = self._settled(shut, *first)
            aside = max(1e-8 * abs(value), 10.0 * error)
            before = self._saddle(value + (aside if above else -aside), shut)
            passages = self._passages(before)
            if not passages.crossed:
                cycle, side = saddle.cycle, "above" if above else "below"
                count = len(passages.t)
                aside = max(_ASIDE * abs(value), aside)
                kind = self._kind(self._saddle(value + (aside if above else -aside), shut))
                return Crisis(kind, self.branch.parameter, value, error, side, count, cycle)
            # Another fold is beyond the stable manifold there already.
            shut = before
        raise ModelError("no fold of the manifold reaches the stable one first")

    def _settled(self, like: _Saddle, value: float, u: float, t: float) -> tuple[float, float, _Saddle]:
        """The tangency near a value by more and more rounds about the cycle, its error and the cycle."""
        moved, rounds = 1e-6 * abs(value), 0
        for rounds in range(1, _ROUNDS):
            after, u = self._tangency(self._saddle(value, like), u, t, rounds, moved)
            moved, value = abs(after - value), after
            if moved < _STANDS * abs(value):
                break
        error = moved + float(rounding_of(value))
        saddle = self._saddle(value, like)
        try:
            for away, loose in ((10.0 * _AWAY, 1.0), (_AWAY, COARSE)):
                self.away, self.loose = away, loose
                # The same state further out is one that was there earlier.
                other = u - np.log(away / _AWAY) / np.log(saddle.multiplier)
                error += abs(self._tangency(saddle, other, t, rounds, 1e-7 * abs(value))[0] - value)
        finally:
            self.away, self.loose = _AWAY, 1.0
        return value, error, saddle

    def _tangency(self, like: _Saddle, u: float, t: float, rounds: int, step: float) -> tuple[float, float]:
        """The parameter's value at which a fold touches the stable manifold, and where on the manifold."""

        def fold(value: float, near: float, width: float) -> tuple[float, float]:
            return self._fold(self._saddle(value, like), near, t, rounds, width)

        step = max(step, 1e-8 * abs(like.value))
        a, b = like.value, like.value + 0.1 * step
        (fa, u), width = fold(a, u, 1e-3), 1e-4
        fb, u = fold(b, u, width)
        for _ in range(_STEPS):
            if fa == fb:
                break
            a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
            if not np.isfinite(b) or abs(b - like.value) > 20.0 * step:
                raise ModelError("the value does not settle")
            if abs(b - a) < 0.1 * _STANDS * abs(b):
                break
            fb, u = fold(b, u, width)
        return float(b), u

    def _fold(self, saddle: _Saddle, u: float, t: float, rounds: int, width: float) -> tuple[float, float]:
        """The height of the manifold's fold near `u`, some rounds after the time t, and where it is."""
        for _ in range(_FOLDS):
            at = u + width * _STENCIL
            heights = self._heights(saddle, at, t, rounds)
            if not np.isfinite(heights).all():
                width *= 0.1
                continue
            bend, slope, level = np.polyfit(_STENCIL, heights, 2)
            k = int(np.argmin(heights))
            curved = bend > 0.0 and abs(slope) < 2.0 * bend * _STENCIL[-1]
            if not curved:
                # Downhill; the step grows only where the heights lie on a line.
                u, width = float(at[k]), width * (1.6 if k in (0, len(at) - 1) else 0.4)
                continue
            u -= width * slope / (2.0 * bend)
            bottom = float(level - slope**2 / (4.0 * bend))
            misfit = float(np.abs(np.polyval([bend, slope, level], _STENCIL) - heights).max())
            if misfit < 1e-3 * bend and bend < 1e-7 * saddle.multiplier**rounds:
                return bottom, u
            width *= 0.25 if misfit < 1e-2 * bend else 0.1
        raise ModelError("the manifold has no fold there")

    def _heights(self, saddle: _Saddle, u: Floats, t: float, rounds: int) -> Floats:
        """How far orbits of the manifold are from the stable one's tangent, divided by how it grows."""
        flow, rows = self.flow, np.tile(saddle.values, (len(u), 1))

        def flown(x: Floats, spans: Floats) -> Floats:
            return flow.fly_each(rows, x, spans, loose=self.loose)

        x = flown(saddle.start(u, self.side, self.away), np.full(len(u), t))
        for k in range(rounds + 1):
            if k:
                x = flown(x, np.full(len(u), saddle.period))
            for _ in range(20):
                # To the plane across the flow at the cycle's state.
                ahead = ((x - saddle.state) / flow.size) @ saddle.rate
                late = -ahead / (saddle.rate @ saddle.rate)
                if np.abs(late).max() < 1e-13 * flow.clock:
                    break
                x = flown(x, np.clip(late, -0.2 * flow.clock, 0.2 * flow.clock))
            if not saddle.distance(x).max() < 5.0 * _NEAR:
                return np.full(len(u), np.nan)
        heights: Floats = self.side * saddle.height(x)
        return heights

    def _kind(self, saddle: _Saddle) -> str:
        """Return what becomes of the attractor, by where the other side of the manifold goes."""
        flow, u = self.flow, (np.arange(_OTHERS) + 0.5) / _OTHERS
        leaves = np.log(1.0 / self.away) / np.log(saddle.multiplier) * saddle.period
        age = _AGE * flow.clock
        time = leaves + 2.0 * age
        t, x = self._crossings(saddle, saddle.start(u, self.side, self.away), time)
        attractor = x[t > leaves + 0.5 * age]
        outer = saddle.start(u, -self.side, self.away)
        comes = _staying(*self._crossings(saddle, outer, time), attractor, flow.size)
        if flow.mirror is not None and not np.isfinite(comes).any():
            image = self._crossings(saddle, flow.mirror * outer, time)
            if (_staying(*image, attractor, flow.size) < np.inf).mean() > _MOST:
                return "attractor merging crisis"
        # A chaotic transient that leads to the attractor, if slowly, becomes a part of it.
        early, all_ = (comes < leaves + age).mean(), (comes < np.inf).mean()
        return "interior crisis" if all_ > _MOST or all_ > early + _SOME else "boundary crisis"


def _staying(t: Floats, x: Floats, attractor: Floats, size: Floats) -> Floats:
    """When orbits come to an attractor to stay; infinite for those that do not."""
    points = attractor / size
    tree = cKDTree(points)
    gaps = tree.query(points[:: max(1, len(points) // 2000)], k=2)[0][:, 1]
    close = 3.0 * float(np.quantile(gaps, 0.999)) + 1e-6
    there = np.isfinite(t)
    scaled = np.where(there[..., None], x / size, 0.0)
    near = there & (tree.query(scaled, distance_upper_bound=close)[0] < close)
    if near.shape[1] < _STAYS:
        return np.full(len(t), np.inf)
    held = np.all(np.lib.stride_tricks.sliding_window_view(near, _STAYS, axis=1), axis=2)
    first = np.take_along_axis(t, np.argmax(held, axis=1)[:, None], axis=1)[:, 0]
    return np.where(held.any(axis=1), first, np.inf)
