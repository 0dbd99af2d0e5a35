"""A system from nothing but a library of terms, by `udd.prune` and by PySINDy.

The library is the same in every equation and for both: the monomials of the states that are no angles, up to
the third degree of one or two states and the second of more; sine and cosine of each angle.
"""

from __future__ import annotations

import itertools
import time
import warnings
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from records import Array, Rates, Record, function
from systems import System


@dataclass
class Library:
    """Result of a record with a library as the only knowledge.

    `outcome` is "recovered" (exactly the true terms), "more" (these and others), "fewer" (some of these),
    "wrong", "refused" or "failed". If the library lacks a true term it is "fits" if R2
    from the other start exceeds 0.9, or "wrong". `missed` and `extra` count terms, `undetermined` those that
    the record does not determine together with others.
    """

    method: str
    number: int
    title: str
    noise: float
    listed: bool
    outcome: str = ""
    kept: list[str] = field(default_factory=list)
    missed: int = 0
    extra: int = 0
    undetermined: int = 0
    off: float = np.nan
    r2: float = np.nan
    seconds: float = 0.0
    error: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON."""
        return {"question": self.method, **asdict(self)}


def texts(system: System) -> list[str]:
    """The terms of the library."""
    plain = [s for s in system.states if s not in system.angles]
    degree = 3 if len(system.states) <= 2 else 2
    powers = (p for d in range(degree + 1) for p in itertools.combinations_with_replacement(plain, d))
    waves = [f"{wave}({angle})" for angle in system.angles for wave in ("sin", "cos")]
    return [_product(p) for p in powers] + waves


def _product(names: tuple[str, ...]) -> str:
    counted = {name: names.count(name) for name in names}
    return "*".join(name if k == 1 else f"{name}^{k}" for name, k in counted.items()) or "1"


def truth(system: System) -> Array | None:
    """The true factors (terms, equations); None where a term is not in the library."""
    listed = texts(system)
    factors = np.zeros((len(listed), len(system.states)))
    for j, own in enumerate(system.equations.values()):
        for factor, text in own:
            if text not in listed:
                return None
            factors[listed.index(text), j] += factor
    return factors


def rates(system: System, factors: Array) -> Rates:
    """The right-hand side with these factors (terms, equations)."""
    used = np.flatnonzero(factors.any(axis=1))
    functions = [function(texts(system)[k], system) for k in used]

    def right(states: Array) -> Array:
        columns = [f(states) for f in functions]
        return np.stack(columns, axis=1) @ factors[used] if columns else 0.0 * states

    return right


def find(method: str, record: Record, noise: float, spread: float | None = None) -> Library:
    """Fit and select by a method, and compare with the truth; `spread` is for :func:`prune`."""
    system = record.system
    true = truth(system)
    result = Library(method, system.number, system.title, noise, true is not None)
    begin = time.process_time()
    factors, result.undetermined = prune(record, spread) if method == "library" else (pysindy(record), 0)
    result.seconds = time.process_time() - begin
    kept = factors != 0
    listed = texts(system)
    result.kept = [
        f"{state}': " + ", ".join(f"{factors[k, j]:.4g} {listed[k]}" for k in np.flatnonzero(kept[:, j]))
        for j, state in enumerate(system.states)
    ]
    result.r2 = record.r2_elsewhere(rates(system, factors))
    if true is None:
        result.outcome = "fits" if result.r2 > 0.9 else "wrong"
        return result
    needed = true != 0
    result.missed, result.extra = int((needed & ~kept).sum()), int((kept & ~needed).sum())
    result.off = float(np.linalg.norm(factors - true) / np.linalg.norm(true))
    outcomes = {(False, False): "recovered", (False, True): "more", (True, False): "fewer"}
    result.outcome = outcomes.get((result.missed > 0, result.extra > 0), "wrong")
    return result


def prune(record: Record, spread: float | None = None) -> tuple[Array, int]:
    """By `udd.prune`, all factors zero at first; and the number of those that were not determined."""
    import udd

    system = record.system
    listed = texts(system)
    names = [[f"k_{state}{k}" for k in range(len(listed))] for state in system.states]
    equations = [" + ".join(f"{n}*{t}" for n, t in zip(own, listed, strict=True)) for own in names]
    model = udd.Model(
        list(system.states),
        equations,
        {n: 0.0 for own in names for n in own},
        angles=list(system.angles),
    )
    pruned = udd.prune(udd.Measurement(record.t, record.columns, sigma=record.sigma), model, spread=spread)
    factors = np.array([[pruned.model.parameters[n] for n in own] for own in names]).T
    return factors, len(pruned.undetermined)


def pysindy(record: Record) -> Array:
    """By PySINDy with its defaults: central differences, sequentially thresholded least squares."""
    import pysindy as ps

    terms = np.stack([function(text, record.system)(record.noisy) for text in texts(record.system)], axis=1)
    optimizer = ps.STLSQ()
    with warnings.catch_warnings():  # that a threshold removes every term is an answer like any other
        warnings.simplefilter("ignore")
        optimizer.fit(terms, ps.FiniteDifference()(record.noisy, t=record.t))
    return np.asarray(optimizer.coef_).T
