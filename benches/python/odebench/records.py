"""Records of ODEBench's systems: SciPy's motion, noise, states that were not seen; their errors elsewhere.

What is true is evaluated by NumPy from the table: no code is shared with udd.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from systems import System

LAST, SAMPLES = 10.0, 512
SEED = 20240101
_TOLERANCE = 1e-11
_LONGEST = 100_000  # evaluations of a right-hand side
_FAR = 1e6  # in units of the true motion's largest state: from there a free run is lost

Array = np.ndarray
Rates = Callable[[Array], Array]  # of states (n, d)


def function(text: str, system: System) -> Rates:
    """A function of the states (n, d), as the table writes it."""
    code = compile(text.replace("^", "**"), text, "eval")
    known = {name: getattr(np, name) for name in ("sin", "cos", "exp", "log", "abs")} | dict(system.shapes)

    def value(states: Array) -> Array:
        columns = dict(zip(system.states, states.T, strict=True))
        return np.broadcast_to(eval(code, {"__builtins__": {}}, known | columns), len(states))

    return value


def rates(system: System) -> Rates:
    """The true right-hand side, of states (n, d)."""
    equations = [[(c, function(text, system)) for c, text in own] for own in system.equations.values()]
    return lambda states: np.stack([sum(c * f(states) for c, f in own) for own in equations], axis=1)


class _TooLongError(Exception):
    """A run takes more evaluations than any that is worth while."""


def run(
    right: Rates, start: Array, times: Array, limit: float = np.inf, tolerance: float = _TOLERANCE
) -> Array | None:
    """A motion by DOP853, (n, d); None where it ends before the last time."""
    left = _LONGEST

    def single(_t: float, state: Array) -> Array:
        nonlocal left
        left -= 1
        if not left:
            raise _TooLongError
        return right(state[None])[0]

    def far(_t: float, state: Array) -> float:
        return limit - float(np.abs(state).max())

    far.terminal = True  # type: ignore[attr-defined]
    scale = tolerance * max(1.0, float(np.abs(start).max()))
    options = {"method": "DOP853", "t_eval": times, "rtol": tolerance, "atol": scale}
    try:
        with np.errstate(all="ignore"):
            done = solve_ivp(single, (times[0], times[-1]), start, events=far, **options)
    except _TooLongError:
        return None
    whole = done.status == 0 and np.isfinite(done.y).all()
    return done.y.T if whole else None


@dataclass(frozen=True)
class Record:
    """What was measured: a column for each state, those of `seen` only were looked at.

    `told` is the noise's standard deviation in every sample, where a method may know it.
    """

    system: System
    t: Array
    clean: Array
    noisy: Array
    seen: tuple[str, ...]
    told: Array | None = None

    @property
    def columns(self) -> dict[str, Array]:
        """The noisy samples of the states that were seen."""
        return self._seen(self.noisy)

    @property
    def sigma(self) -> dict[str, Array] | None:
        """The standard deviations of these, where they are told."""
        return None if self.told is None else self._seen(self.told)

    def _seen(self, table: Array) -> dict[str, Array]:
        columns = zip(self.system.states, table.T, strict=True)
        return {name: column for name, column in columns if name in self.seen}

    def points(self) -> Array:
        """Points in the box that the motion fills: there, not only on the orbit, forms are compared."""
        low, high = self.clean.min(axis=0), self.clean.max(axis=0)
        return low + (high - low) * np.random.default_rng(SEED).uniform(size=(400, len(low)))

    def r2_elsewhere(self, right: Rates) -> float:
        """1 - (squared error)/(squared deviation from the mean), all states together, from the other start.

        NaN where the true motion ends there before the last time, -inf where the other one does.
        """
        start = np.array(self.system.starts[1])
        truth = run(rates(self.system), start, self.t)
        if truth is None:
            return float("nan")
        found = run(right, start, self.t, _FAR * max(1.0, float(np.abs(truth).max())), 1e-7)
        if found is None:
            return float("-inf")
        return float(1 - ((found - truth) ** 2).sum() / ((truth - truth.mean(axis=0)) ** 2).sum())


def record(
    system: System,
    noise: float,
    hidden: bool = False,
    additive: bool = False,
    told: bool = False,
    number: int = 0,
) -> Record:
    """A record from the system's first start.

    Noise is white: multiplicative as ODEFormer's authors have it, x (1 + noise N(0, 1)), or, additive, a
    share of each state's standard deviation. `number` draws it anew. Of a record with a hidden state, which
    is drawn, all others are seen.
    """
    t = np.linspace(0.0, LAST, SAMPLES)
    clean = run(rates(system), np.array(system.starts[0]), t)
    if clean is None:
        raise RuntimeError(f"the motion of system {system.number} ends before {LAST:g}")
    drawn = np.random.default_rng([SEED, system.number, number]).standard_normal(clean.shape)
    size = noise * (clean.std(axis=0) if additive else np.abs(clean))
    seen = list(system.states)
    if hidden:
        seen.pop(int(np.random.default_rng([SEED, system.number, 1]).integers(len(seen))))
    # No sample is exact: where a state goes through zero it is told as known to a thousandth of its size.
    least = np.maximum(size, noise * 1e-3 * clean.std(axis=0))
    return Record(system, t, clean, clean + size * drawn, tuple(seen), least if told and noise else None)
