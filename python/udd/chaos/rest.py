"""Test for an equilibrium: Newton's method, the eigenvalues there, and the orbit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.errors import UddError
from udd.models import Model
from udd.simulation.sampling import states_along

__all__ = ["Equilibrium", "RestTest", "equilibrium_near"]

_Floats = NDArray[np.float64]

_STEPS = 300  # Iterations of Newton's method: near a multiple root each removes but a part of the distance.
_SAME = 1e-10  # An iteration below this part of the state, or of all steps, is the last.
_REST = 1e-6  # Share of the first rates that may remain.
_ROUNDING = 1e-14  # Share of the largest component: no step is more accurate.
_TINY = 1e-290  # Relative errors mean nothing near the smallest numbers.
_ZERO = 1e-8  # Real parts below this part of the largest eigenvalue are zero.
_SPANS = 10.0  # Times of the slowest decay for which an orbit is followed.
_LEAVES = 40.0  # The same of the slowest growth: rounding is large then, if no symmetry forbids it.
_LEFT = 0.1  # Share of the largest distance that may remain then.
_SAMPLES = 200
_FAINT = 1e-3  # Part of the speed of an approach: smaller eigenvalues are zero for it.
_PARTS = np.geomspace(0.1, 1.0, 30)  # Shares of the distance at which the rate must have one sign.
_TIMES = (0.0, 0.7371)  # in typical times: an equilibrium of rates that depend on time is there at both


class Equilibrium(NamedTuple):
    """A state (r,) in the components that count, and the slopes (r, r) of the rates and their eigenvalues."""

    state: _Floats
    slopes: _Floats
    eigenvalues: NDArray[np.complex128]

    @property
    def repels(self) -> bool:
        """Return True if an eigenvalue has a positive real part: no attractor has one."""
        return bool((self.eigenvalues.real > _ZERO * np.abs(self.eigenvalues).max(initial=0.0)).any())


def equilibrium_near(model: Model, state: _Floats, kept: NDArray[np.intp], t: float) -> Equilibrium | None:
    """Find the equilibrium near a state (dim,) by Newton's method, with the components `kept`."""
    place, gone = np.array(state, dtype=np.float64), np.zeros(len(kept))
    first: _Floats | None = None
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            try:
                here = _core.expansion(model, t, place.tolist(), False)
            except UddError:
                return None
            rate, slopes = here["rate"][kept], here["by_state"][np.ix_(kept, kept)]
            first = np.abs(rate) if first is None else first
            if not (np.isfinite(rate).all() and np.isfinite(slopes).all()):
                return None
            # Directions in which the rates do not change, as along a line of equilibria, stay as they are.
            step = -np.linalg.lstsq(slopes, rate, rcond=1e-12)[0]
            place[kept] += step
            gone = np.maximum(gone, np.abs(step))
            size = np.maximum(np.abs(place[kept]), gone)
            if (np.abs(step) <= _SAME * size + _ROUNDING * size.max() + _TINY).all():
                break
        else:
            return None
        rounding = _ROUNDING * (np.abs(slopes) @ (100.0 * size + 10.0 * size.max()))
        left = np.abs(rate + slopes @ step)
        if not np.isfinite(place).all() or (left > rounding + _REST * first + _TINY).any():
            return None
    return Equilibrium(place[kept], slopes, np.linalg.eigvals(slopes).astype(complex))


@dataclass(frozen=True)
class RestTest:
    """Test for orbits of a model that settle at an attracting equilibrium, or rest on another.

    An equilibrium is one of the components `kept`: angles on which nothing depends may turn. Distances are
    compared with those that the orbit itself passes through, so that neither the origin nor the units count.

    Attributes
    ----------
    model : Model
    kept : ndarray of int (r,)
        Components of an equilibrium. The others are angles that may turn.
    clock : float
        A typical time. It is used only if the rates depend on time.
    longest : float
        The longest time for which an orbit is followed.
    rtol, atol : float
    """

    model: Model
    kept: NDArray[np.intp]
    clock: float
    longest: float
    rtol: float
    atol: float

    def __call__(self, state: _Floats, attracts: bool = False) -> Equilibrium | None:
        """Return the equilibrium at which the orbit from a state (dim,) settles, or None.

        With `attracts`, one that repels is none, even if the orbit rests on it.
        """
        rest = equilibrium_near(self.model, state, self.kept, 0.0)
        if rest is None:
            return None
        # Runs no longer come nearer then: the error of a component moves the others.
        noise = 10.0 * (self.atol + self.rtol * np.abs(rest.state))
        fastest = float(np.abs(rest.eigenvalues).max(initial=0.0))
        if fastest > 0.0:
            noise = noise + np.abs(rest.slopes) @ noise / fastest
        if self.model.names_time:
            later = equilibrium_near(self.model, state, self.kept, _TIMES[1] * self.clock)
            off = np.abs(state[self.kept] - rest.state)
            if later is None or (np.abs(later.state - rest.state) > _LEFT * off + noise).any():
                return None
        if rest.repels and attracts:
            return None
        end = self._settled(state, rest, noise)
        return rest if end is None and self._creeps(state, rest, noise) else end

    def _settled(self, state: _Floats, rest: Equilibrium, noise: _Floats) -> Equilibrium | None:
        """Return the equilibrium that an orbit is near after several times its slowest decay."""
        if not rest.repels and (np.abs(state[self.kept] - rest.state) <= noise).all():
            return rest
        real = rest.eigenvalues.real
        least = _ZERO * np.abs(rest.eigenvalues).max(initial=0.0)
        rates = np.concatenate([-real[real < -least] / _SPANS, real[real > least] / _LEAVES])
        if not len(rates):
            return None
        span = min(1.0 / float(rates.min()), self.longest)
        states = states_along(self.model, span, _SAMPLES + 1, state, self.rtol, self.atol)
        if states is None:
            return None
        # On a line of equilibria it may be another.
        end = equilibrium_near(self.model, states[-1], self.kept, 0.0)
        if end is None or end.repels != rest.repels:
            return None
        away = np.abs(states[:, self.kept] - end.state)
        quarter = _SAMPLES // 4
        first, late = away[:quarter].max(axis=0), away[-quarter:].max(axis=0)
        # One that leaves may happen to be near again at the end.
        stays = (away[quarter:].max(axis=0) <= first + noise).all()
        return end if stays and (late <= _LEFT * first + noise).all() else None

    def _creeps(self, state: _Floats, rest: Equilibrium, noise: _Floats) -> bool:
        """Return True if an orbit comes along slow directions, in each of which the rates lead to the end.

        Such a decay may be slower than any exponential, as that of x' = -x^3, and last for any time.
        """
        numbers, right = np.linalg.eig(rest.slopes)
        least = _ZERO * np.abs(numbers).max(initial=0.0)
        begin, speed = np.abs(state[self.kept] - rest.state), np.abs(self.model.rates(0.0, state)[self.kept])
        # Eigenvalues far below the present speed do not say how the distance changes.
        present = _FAINT * (speed[begin > noise] / begin[begin > noise]).max(initial=0.0)
        slow = np.abs(numbers) <= max(least, present, float(np.abs(numbers).min(initial=np.inf)))
        decay = -numbers[~slow].real
        if rest.repels or (numbers[slow].imag != 0.0).any() or (decay <= least).any():
            return False
        # The fast directions decay meanwhile.
        span = min(_SPANS / float(decay.min()) if len(decay) else self.clock, self.longest)
        states = states_along(self.model, span, _SAMPLES + 1, state, self.rtol, self.atol)
        if states is None:
            return False
        away = states[_SAMPLES // 4 :, self.kept] - rest.state
        if (np.abs(away[1:]) > np.abs(away[:-1]) + noise).any():
            return False
        along = np.linalg.pinv(right)[slow].real
        sides = along @ away[-1]
        moving = np.abs(sides) > np.abs(along) @ noise
        places = np.repeat(states[-1:], len(_PARTS), axis=0)
        places[:, self.kept] = rest.state + _PARTS[:, None] * away[-1]
        times = _TIMES if self.model.names_time else _TIMES[:1]
        rates = [self.model.rates(np.full(len(places), t * self.clock), places)[:, self.kept] for t in times]
        return bool(moving.any() and ((np.array(rates) @ along.T * sides)[..., moving] < 0.0).all())
