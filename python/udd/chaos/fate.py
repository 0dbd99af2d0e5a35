"""The end of an orbit: rest, a cycle, infinity, or a motion that does not come back."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import IncompleteWarning, ToleranceWarning
from udd.models import Model
from udd.models.state_scaling import Coordinates, coordinates_of, depends_on_time
from udd.simulation.sampling import states_along

from .recurrence import SETTLING, Tightness, periods, tightness
from .rest import RestTest, equilibrium_near

if TYPE_CHECKING:
    from .poincare_sections import Section

__all__ = ["Fate", "Orbit"]

_Floats = NDArray[np.float64]

_FOLLOWED = 36_000  # Section points for which chaos is followed. The longest look has half of them.
_LATE = 4  # Further looks at a motion that nearly comes back.
_POINTS = 600  # Section points in which a periodic motion is recognised.
_RETURNS = 20.0  # Mean times between section points that show the size of a motion.
_SAMPLES = 2000
_NOISE = 100.0  # Times the tolerance: a component that moves less is at rest.
_GROWS = 1.3  # Growth of an unbounded motion each time that the time doubles.
_DOUBLINGS, _SLOWEST = 8, 100  # Doublings of the time; the second for a motion that has hardly begun.
_BEGUN = 0.5  # Share of its state by which a motion must move to show its growth.
_FAR = 1e12  # Times its first size: a motion that grew so far is unbounded.


@dataclass(frozen=True)
class Fate:
    """The motion on which an orbit is: a verdict, "settling" or "aperiodic".

    From `state` on, after the time `t`, if it is ordered. `clock` is the mean time between section points,
    NaN where there are none.
    """

    kind: str
    period: float
    state: _Floats
    t: float
    clock: float = float("nan")

    @property
    def ordered(self) -> bool:
        """Return True if the orbit returns, rests, or goes to infinity."""
        return self.kind in ("equilibrium", "periodic orbit", "escapes")


@dataclass(frozen=True)
class Orbit:
    """Orbits of a model, run with these tolerances and this longest step."""

    model: Model
    rtol: float
    atol: float
    longest: float = np.inf

    @cached_property
    def kept(self) -> NDArray[np.intp]:
        """The components of the state on which the rates depend, and those that are no angles."""
        return np.flatnonzero(np.isfinite(self._coordinates.size))

    @cached_property
    def timed(self) -> bool:
        """Return True if the rates depend on time."""
        size = np.where(np.isfinite(self._coordinates.size), self._coordinates.size, 1.0)
        return depends_on_time(self.model, size, 0.7371 * self._coordinates.clock)

    @cached_property
    def _coordinates(self) -> Coordinates:
        return coordinates_of(self.model, np.ones((1, len(self.model.state_names))))

    def points(self, start: _Floats, section: str | Sequence[str] | None = None, **few: Any) -> Section:
        """Return the crossings of a surface from here on."""
        from .poincare_sections import poincare

        options = {"n": _POINTS, "transient": 0, "rtol": self.rtol, "atol": self.atol, "threads": 1, **few}
        if np.isfinite(self.longest):
            options["max_step"] = self.longest
        return poincare(self.model, section, state0=start, **options)

    def points_if_any(
        self, start: _Floats, section: str | Sequence[str] | None = None, **few: Any
    ) -> Section:
        """Return the crossings of a surface, without a warning if there are fewer."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IncompleteWarning)
            warnings.simplefilter("ignore", ToleranceWarning)
            return self.points(start, section, **few)

    def fate(self, start: _Floats, longest: float = 0.0) -> Fate:
        """Return the fate of the orbit from here on: 600 section points, and more for the time `longest`."""
        rests = RestTest(
            self.model, self.kept, self._coordinates.clock, max(longest, 2e5 * self.model.time_scale),
            self.rtol, self.atol,
        )  # fmt: skip
        if rests(start) is not None:
            return Fate("equilibrium", np.nan, start, 0.0)
        # A section that is not crossed for a long time is left at once for one across the flow.
        crossed = self.points_if_any(start, n=1).outcome != "time ran out"
        section = None
        if not crossed:
            start = self._turned_back(start)
            section = self._across(start)
        state, spent, seen, skip, late = start, 0.0, 0, 0, 0
        while True:
            points = self.points_if_any(state, section, transient=skip)
            state, spent = points.end, spent + float(points.t_end)
            if points.outcome in ("escaped", "failed"):
                return Fate("escapes" if self.unbounded(start) else "aperiodic", np.nan, start, spent)
            if points.outcome != "finished":
                if rests(state) is not None:
                    return Fate("equilibrium", np.nan, state, spent)
                if section is None:
                    section = self._across(state)
                    continue
                return Fate("escapes" if self.unbounded(start) else "aperiodic", np.nan, state, spent)
            clock = float(points.t[-1] - points.t[0]) / (len(points.t) - 1)
            coordinates, tight = self._compared(points.state[-1], clock)
            places = coordinates(points.state)
            period = int(periods(places[None], tight)[0])
            if period > 0:
                # An equilibrium on the section, and the slow spiral into it, have the period 1.
                if period == 1 and rests(state) is not None:
                    return Fate("equilibrium", np.nan, state, spent)
                if self.unbounded(state, clock):
                    return Fate("escapes", np.nan, state, spent)
                time = float(points.t[-1] - points.t[-1 - period])
                last = period * (len(places) // period - 1)
                moved = np.abs(places[last : last + period] - places[:period]).max(initial=0.0)
                there = skip == 0 and moved < tight.same
                return Fate("periodic orbit", time, *((start, 0.0) if there else (state, spent)), clock)
            seen += skip + _POINTS
            enough = spent >= longest or seen >= _FOLLOWED
            if enough and (period != SETTLING or late == _LATE):
                if self.unbounded(state, clock):
                    return Fate("escapes", np.nan, state, spent)
                if rests(state) is not None:
                    return Fate("equilibrium", np.nan, state, spent)
                return Fate("settling" if period == SETTLING else "aperiodic", np.nan, state, spent, clock)
            # Intermittent chaos nearly comes back for a while: it is looked at again, a little later.
            late += enough
            skip = _POINTS if late else 2 * skip + _POINTS

    def _turned_back(self, state: _Floats) -> _Floats:
        """Return the state without whole turns of its angles, which cost digits."""
        angle = np.array([name in self.model.angles for name in self.model.state_names])
        return np.where(angle, np.arctan2(np.sin(state), np.cos(state)), state)

    def _across(self, state: _Floats) -> str:
        """Return the plane through a state across the flow, modulo turns: recurrent orbits cross it."""
        names, rates = self.model.state_names, self.model.rates(0.0, state)
        largest = np.abs(rates[self.kept]).max(initial=0.0) or 1.0
        terms = []
        for k in self.kept:
            away = f"({names[k]} - ({float(state[k])!r}))"
            away = f"sin{away}" if names[k] in self.model.angles else away
            terms.append(f"({float(rates[k] / largest)!r})*{away}")
        return " + ".join(terms)

    def _compared(self, state: _Floats, clock: float) -> tuple[Coordinates, Tightness]:
        """Return the coordinates of comparison: by the extent of the motion, if the model has no sizes."""
        if self.model.profile.dynamics.sizes is not None:
            return coordinates_of(self.model, state[None]), tightness(self.rtol)
        run = self._sampled(state, _RETURNS * clock)
        if run is None:
            return coordinates_of(self.model, state[None]), tightness(self.rtol)
        extent, largest = 0.5 * np.ptp(run, axis=0), np.abs(run).max(axis=0)
        angle = np.array([name in self.model.angles for name in self.model.state_names])
        moves = extent > _NOISE * (self.atol + self.rtol * largest)
        free = ~np.isfinite(self._coordinates.size)
        size = np.where(free | ~(moves | angle), np.inf, extent)
        # Errors are relative to the state, which may be larger than the motion.
        worse = (largest / np.where(moves, extent, np.inf))[~angle].max(initial=1.0)
        return replace(self._coordinates, size=size), tightness(self.rtol * min(worse, 1e3))

    def _sampled(self, state: _Floats, span: float) -> _Floats | None:
        """States along the orbit, or None if it ends before."""
        return states_along(self.model, span, _SAMPLES + 1, state, self.rtol, self.atol)

    def unbounded(self, state: _Floats, clock: float | None = None) -> bool:
        """Return True if a component, not an angle, grows without bound each time that the time doubles."""
        plain = [k for k, name in enumerate(self.model.state_names) if name not in self.model.angles]
        span = _RETURNS * (self._coordinates.clock if clock is None else clock)
        first = last = None
        size = np.zeros(len(plain))
        for number in range(_SLOWEST):
            # A drift that has moved the state little is nearly linear in time, whether or not it ends.
            if number >= _DOUBLINGS and (size > _BEGUN * np.abs(state[plain])).any():
                break
            run = self._sampled(state, span)
            if run is None:
                return True
            size = np.abs(run[:, plain] - state[plain]).max(axis=0)
            if first is not None and last is not None:
                if not (size > _GROWS * last).any():
                    return False
                if (size > _FAR * np.maximum(first, np.abs(state[plain]))).any():
                    return True
            first, last, span = size if first is None else first, size, 2.0 * span
        return run is not None and not self._may_stay(state, run[-1])

    def _may_stay(self, state: _Floats, end: _Floats) -> bool:
        """Return True if the orbit is about an equilibrium, and nearer to it in some component at the end."""
        rest = equilibrium_near(self.model, state, self.kept, 0.0)
        if rest is None or rest.repels:
            return False
        before, after = (np.abs(x[self.kept] - rest.state) for x in (state, end))
        noise = _NOISE * (self.atol + self.rtol * np.abs(state[self.kept]))
        return bool((after < before - noise).any() and (after < 2.0 * before + noise).all())
