"""Crises of chaotic attractors: homoclinic tangencies of the saddle cycle on the edge of the basin."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.memory import require_memory
from udd._util.validation import whole
from udd.errors import IntegrationError, ModelError

from .branch import Branch, cycles_of
from .flow_map import Floats, FlowMap
from .manifold_search import Accuracy, brackets, converge, distinct, secant
from .orbit_geometry import section_of
from .saddle_cycles import SaddleCycle, saddle_at, saddles_of
from .solutions import PeriodicOrbit, as_plain
from .transient_lifetimes import first_stay

__all__ = ["Crisis", "crises"]

_AWAY = 1e-4  # Distance from the cycle, in typical sizes, within which the manifold is straight.
_SLOW = 1.1  # Least multiplier: nearer to its fold the manifold hardly leaves the cycle.
_LEFT = 0.3  # Typical sizes along the manifold at which it has left the cycle.
_NEAR = 0.1  # Largest distance from the cycle of a passage, and of the same orbit one round later.
_AGREES = 2.0  # Largest factor between the growth in this round and the multiplier.
_HALVINGS = 12  # Halvings of an interval until passages lie close to the stable manifold.
_CLOSE = 1e-3  # Typical sizes: folds this near the stable manifold are solved for.
_TIPS = 4  # Folds that are tried at a time, earliest first.
_TRIES = 4  # Rounds of such trials.
_WIDE, _NARROW = 1e-3, 1e-4  # Widths of a fold, in rounds: of a first guess, and at a value near by.
_STENCIL = np.linspace(-1.0, 1.0, 7)
_FOLDS = 40  # Steps to a fold at most.
_STAYS = 20  # Crossings in a row near the attractor of an orbit that stays there.
_AGE = 400  # Typical times for which the manifold's other side is followed, twice.
_OTHERS = 48  # Orbits of the other side.
_MOST, _SOME = 0.9, 0.05  # Shares of these orbits.
_ASIDE = 1e-5  # Relative distance from the crisis at which the attractor is examined.


@dataclass(frozen=True, eq=False)
class Crisis(Drawable):
    """Tangency at which a chaotic attractor meets a saddle cycle.

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
        A bound of the tangency's error: its change with the last round about the cycle, with runs a hundred
        times less accurate, and with a manifold that begins ten times further from the cycle. It does not
        cover an earlier tangency that the `returns` do not show.
    side : {"below", "above"}
        The side of the value on which the attractor is the smaller one.
    returns : int
        The number of passages near the cycle that were examined just before the value. None is beyond the
        stable manifold, so there is no earlier tangency among them.
    cycle : PeriodicOrbit
        The saddle cycle at the value.

    See Also
    --------
    udd.crises : finds it.
    udd.plot.cycle : draw the saddle cycle.
    """

    kind: str
    parameter: str
    value: float
    error: float
    side: str
    returns: int
    cycle: PeriodicOrbit

    def as_dict(self) -> dict[str, Any]:
        """Return the crisis as plain numbers, for JSON.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
        return as_plain(self, "kind", "parameter", "value", "error", "side", "returns") | {
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
    """Find boundary, interior and merging crises of chaotic attractors at the saddle cycles of a branch.

    Parameters
    ----------
    branch : Branch
        Cycles over a parameter, from :func:`udd.continuation`. Its saddle cycles with one multiplier above 1
        are examined, such as those born with a window at its fold.
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

    See Also
    --------
    udd.lifetimes : mean time of a transient.
    udd.cycle_connections : connections with an equilibrium.
    udd.plot.cycle : draw the saddle cycle.

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

    References
    ----------
    C. Grebogi, E. Ott and J. A. Yorke [36, 37].

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
    flow = cycles_of(branch)[0][0].flow
    count, rounds = whole("n", n, 10), whole("depth", depth, 5)
    require_memory(f"{count} orbits of {rounds} rounds", count, rounds, 8, itemsize=8)
    sides = (_Search(branch, flow, side, count, rounds) for side in (1.0, -1.0))
    return distinct([crisis for side in sides for crisis in side.crises()])


@dataclass(frozen=True)
class _Passages:
    """Passages near the cycle: the orbits' `u`, the times, and the heights on the attractor's side."""

    u: Floats
    t: Floats
    height: Floats

    @property
    def crossed(self) -> bool:
        """True if some are beyond the stable manifold."""
        return bool((self.height < 0.0).any())

    def nearest(self) -> list[tuple[float, float]]:
        """Orbits and times of those furthest beyond the stable manifold or, if none is, next to it."""
        least = self.height.min(initial=np.inf)
        near = np.flatnonzero(self.height <= least + 4.0 * abs(least))
        # The later a passage, the finer are the folds about it.
        early = near[np.argsort(self.t[near])]
        return [(float(self.u[k]), float(self.t[k])) for k in early[:_TIPS]]


@dataclass(frozen=True)
class _Search:
    """One side of the unstable manifolds of a branch's saddle cycles."""

    branch: Branch
    flow: FlowMap
    side: float
    count: int
    depth: int

    def crises(self) -> list[Crisis]:
        """Return those between neighbouring cycles of the branch of which one side is shut in."""
        saddles = saddles_of(self.branch, least=_SLOW)
        marks = (None if saddle is None else (saddle, self._passages(saddle).crossed) for saddle in saddles)

        def located(a: tuple[SaddleCycle, bool], b: tuple[SaddleCycle, bool]) -> Crisis:
            return self._located(a[0], b[0]) if b[1] else self._located(b[0], a[0])

        return brackets(marks, lambda a, b: a[1] != b[1], located)

    def _start(self, saddle: SaddleCycle, u: Floats, side: float) -> Floats:
        """Return states on one side of the unstable manifold: after one round `u` is larger by 1."""
        along = side * _AWAY * saddle.multiplier ** u[:, None] * saddle.right
        return np.asarray(saddle.state + self.flow.size * along)

    def _crossings(self, saddle: SaddleCycle, starts: Floats, time: float) -> tuple[Floats, Floats]:
        """Return times (n, k) and states (n, k, r) of crossings of the cycle's plane, NaN after the last."""
        model, most = self.flow.with_values(saddle.values), int(20.0 * time / saddle.period) + 20
        section = section_of(
            model,
            saddle.plane,
            most,
            self.flow.full(starts),
            direction="up",
            t_max=time,
            rtol=1e-9,
            atol=1e-12,
        )
        return section.t, self.flow.reduced(section.state)

    def _passages(self, saddle: SaddleCycle) -> _Passages:
        """Return where the manifold comes near the cycle again, after it has left it."""
        u = (np.arange(self.count) + 0.5) / self.count
        leaves = np.log(1.0 / _AWAY) / np.log(saddle.multiplier)
        t, x = self._crossings(
            saddle, self._start(saddle, u, self.side), (leaves + self.depth) * saddle.period
        )
        height, away = self.side * saddle.height(x), saddle.distance(x)
        # The first rounds are still those on which it leaves.
        left = (np.log(_LEFT / _AWAY) / np.log(saddle.multiplier) - u) * saddle.period
        close = (t > left[:, None]) & (away < _NEAR)
        which, first = np.nonzero(close)
        heights = np.full(len(which), np.nan)
        # The plane may be crossed several times in a round: the crossing one period later decides.
        for ahead in range(1, min(20, t.shape[1])):
            after = np.minimum(first + ahead, t.shape[1] - 1)
            late = np.abs(t[which, after] - t[which, first] - saddle.period) < 0.1 * saddle.period
            grown = height[which, after] / (saddle.multiplier * height[which, first])
            agrees = late & (away[which, after] < _NEAR) & (grown > 1.0 / _AGREES) & (grown < _AGREES)
            heights[agrees] = height[which, after][agrees] / saddle.multiplier
        decided = np.isfinite(heights)
        return _Passages(u[which[decided]], t[which[decided], first[decided]], heights[decided])

    def _located(self, shut: SaddleCycle, open_: SaddleCycle) -> Crisis:
        """Return the tangency between a cycle that shuts the attractor in and one that does not."""
        passages = self._passages(shut)
        for _ in range(_HALVINGS):
            if passages.height.min(initial=np.inf) < _CLOSE:
                break
            middle = saddle_at(self.branch, 0.5 * (shut.value + open_.value), shut)
            between = self._passages(middle)
            if between.crossed:
                open_ = middle
            else:
                shut, passages = middle, between
        above, width = shut.value > open_.value, abs(open_.value - shut.value)
        for _ in range(_TRIES):
            tangencies: list[tuple[float, float, float]] = []
            for u, t in passages.nearest():
                with suppress(ModelError, IntegrationError):
                    guess = np.array([shut.value, u, _WIDE])
                    value, at, _ = self._tangency(shut, t, guess, 0, width, Accuracy(_AWAY))
                    if abs(value - shut.value) < 10.0 * width:
                        tangencies.append((value, at, t))
            if not tangencies:
                break
            # The first one that is met from where the attractor is shut in.
            value, at, t = max(tangencies) if above else min(tangencies)
            x, error, _ = converge(
                partial(self._tangency, shut, t),
                np.array([value, at, _WIDE]),
                1e-6 * abs(value),
                Accuracy(_AWAY),
            )
            value = float(x[0])
            aside = max(1e-8 * abs(value), 10.0 * error)
            before = saddle_at(self.branch, value + (aside if above else -aside), shut)
            passages = self._passages(before)
            if not passages.crossed:
                cycle, side = saddle_at(self.branch, value, shut).cycle, "above" if above else "below"
                aside = max(_ASIDE * abs(value), aside)
                kind = self._kind(saddle_at(self.branch, value + (aside if above else -aside), shut))
                return Crisis(kind, self.branch.parameter, value, error, side, len(passages.t), cycle)
            # Another fold is beyond the stable manifold there already.
            shut = before
        raise ModelError("no fold of the manifold reaches the stable one first")

    def _tangency(
        self, like: SaddleCycle, t: float, x: Floats, rounds: int, step: float, accuracy: Accuracy
    ) -> Floats:
        """Return the value at which a fold touches the stable manifold, its `u`, and its width."""
        # The same orbit further out is the one that began whole rounds earlier.
        earlier = np.ceil(np.log(accuracy.away / _AWAY) / np.log(like.multiplier))

        def fold(y: Floats) -> tuple[float, Floats]:
            saddle = saddle_at(self.branch, float(y[0]), like)
            time = t - float(earlier) * saddle.period
            bottom, u = self._fold(saddle, float(y[1]), time, rounds, float(y[2]), accuracy.loose)
            return bottom, np.array([y[0], u, _NARROW])

        root = secant(fold, np.array([x[0], x[1] + earlier, _WIDE]), step)
        return np.array([root[0], root[1] - earlier, _WIDE])

    def _fold(
        self, saddle: SaddleCycle, u: float, t: float, rounds: int, width: float, loose: float
    ) -> tuple[float, float]:
        """Return the height of the manifold's fold near `u`, some rounds after the time t, and its `u`."""
        for _ in range(_FOLDS):
            at = u + width * _STENCIL
            heights = self._heights(saddle, at, t, rounds, loose)
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

    def _heights(self, saddle: SaddleCycle, u: Floats, t: float, rounds: int, loose: float) -> Floats:
        """Return how far orbits of the manifold are from the stable one's tangent; NaN far from the cycle."""
        x, many = self._start(saddle, u, self.side), np.ones(len(u))
        for span in (t, *[saddle.period] * rounds):
            x = saddle.landed(self.flow.fly_each(saddle.values, x, span * many, loose), loose)
            if not saddle.distance(x).max() < 5.0 * _NEAR:
                return np.full(len(u), np.nan)
        heights: Floats = self.side * saddle.height(x)
        return heights

    def _kind(self, saddle: SaddleCycle) -> str:
        """Return what becomes of the attractor, by where the other side of the manifold goes."""
        flow, u = self.flow, (np.arange(_OTHERS) + 0.5) / _OTHERS
        leaves = np.log(1.0 / _AWAY) / np.log(saddle.multiplier) * saddle.period
        age = _AGE * flow.clock
        time = leaves + 2.0 * age
        t, x = self._crossings(saddle, self._start(saddle, u, self.side), time)
        attractor = x[t > leaves + 0.5 * age]
        outer = self._start(saddle, u, -self.side)
        comes = _arrivals(*self._crossings(saddle, outer, time), attractor, flow.size)
        if flow.mirror is not None and not np.isfinite(comes).any():
            image = self._crossings(saddle, flow.mirror * outer, time)
            if (_arrivals(*image, attractor, flow.size) < np.inf).mean() > _MOST:
                return "attractor merging crisis"
        # A chaotic transient that leads to the attractor, if slowly, becomes a part of it.
        early, all_ = (comes < leaves + age).mean(), (comes < np.inf).mean()
        return "interior crisis" if all_ > _MOST or all_ > early + _SOME else "boundary crisis"


def _arrivals(t: Floats, x: Floats, attractor: Floats, size: Floats) -> Floats:
    """Return when orbits come to an attractor to stay; infinite for those that do not."""
    points = attractor / size
    tree = cKDTree(points)
    gaps = tree.query(points[:: max(1, len(points) // 2000)], k=2)[0][:, 1]
    close = 3.0 * float(np.quantile(gaps, 0.999)) + 1e-6
    there = np.isfinite(t)
    scaled = np.where(there[..., None], x / size, 0.0)
    first, stays = first_stay(there & (tree.query(scaled, distance_upper_bound=close)[0] < close), _STAYS)
    return np.where(stays, t[np.arange(len(t)), first], np.inf)
