"""Records of ODEBench's systems: SciPy's motion, noise, states that were not seen; their errors elsewhere.

NumPy evaluates the truth from the table: no code is shared with udd.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from systems import System

SAMPLES = 512
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


def _single(system: System) -> Callable[[float, Array], Array]:
    """The true right-hand side, of a time and a state (d,); NaN where it has no value."""
    sums = (" + ".join(f"({c!r})*({text})" for c, text in own) for own in system.equations.values())
    code = compile(f"({', '.join(sums)},)".replace("^", "**"), "rates", "eval")
    known = {name: getattr(math, name) for name in ("sin", "cos", "exp", "log")} | dict(system.shapes)
    scope = {"__builtins__": {}, "abs": abs} | known

    def value(_t: float, state: Array) -> Array:
        try:
            values = eval(code, scope, dict(zip(system.states, state.tolist(), strict=True)))
            return np.array(values, dtype=float)
        except (ArithmeticError, TypeError, ValueError):  # TypeError: of a complex number
            return np.full(len(state), np.nan)

    return value


def motion(system: System, start: Sequence[float], times: Array) -> Array | None:
    """The true motion, (n, d); None where it ends before the last time."""
    return _solved(_single(system), np.array(start), times, np.inf, _TOLERANCE)


class _TooLongError(Exception):
    """A run takes more evaluations than any that is worth while."""


def run(right: Rates, start: Array, times: Array, limit: float, tolerance: float) -> Array | None:
    """A motion by another right-hand side, as :func:`motion`; None too where a state exceeds a limit."""
    return _solved(lambda _t, state: right(state[None])[0], start, times, limit, tolerance)


def _solved(
    single: Callable[[float, Array], Array], start: Array, times: Array, limit: float, tolerance: float
) -> Array | None:
    """By DOP853."""
    left = _LONGEST

    def counted(t: float, state: Array) -> Array:
        nonlocal left
        left -= 1
        if not left:
            raise _TooLongError
        return single(t, state)

    def far(_t: float, state: Array) -> float:
        return limit - float(np.abs(state).max())

    far.terminal = True  # type: ignore[attr-defined]
    scale = tolerance * max(1.0, float(np.abs(start).max()))
    options = {"method": "DOP853", "t_eval": times, "rtol": tolerance, "atol": scale}
    if np.isfinite(limit):
        options["events"] = far
    try:
        with np.errstate(all="ignore"):
            done = solve_ivp(counted, (times[0], times[-1]), start, **options)
    except _TooLongError:
        return None
    whole = done.status == 0 and np.isfinite(done.y).all()
    return done.y.T if whole else None


@dataclass(frozen=True)
class Record:
    """A measured record: a column for each state, of which `seen` lists the observed ones.

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
        """Return the standard deviations of these, if they are given."""
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
        truth = motion(self.system, start, self.t)
        if truth is None:
            return float("nan")
        result = run(right, start, self.t, _FAR * max(1.0, float(np.abs(truth).max())), 1e-7)
        if result is None:
            return float("-inf")
        return float(1 - ((result - truth) ** 2).sum() / ((truth - truth.mean(axis=0)) ** 2).sum())


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
    share of each state's standard deviation. `number` draws another one. In a record with a hidden state,
    which is drawn, all others are observed.
    """
    t = np.linspace(0.0, system.last, SAMPLES)
    clean = motion(system, system.starts[0], t)
    if clean is None:
        raise RuntimeError(f"the motion of system {system.number} ends before {system.last:g}")
    drawn = np.random.default_rng([SEED, system.number, number]).standard_normal(clean.shape)
    size = noise * (clean.std(axis=0) if additive else np.abs(clean))
    seen = list(system.states)
    if hidden:
        seen.pop(int(np.random.default_rng([SEED, system.number, 1]).integers(len(seen))))
    # No sample is exact: the error of a state near zero is a thousandth of its size.
    least = np.maximum(size, noise * 1e-3 * clean.std(axis=0))
    return Record(system, t, clean, clean + size * drawn, tuple(seen), least if told and noise else None)
