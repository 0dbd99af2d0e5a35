"""Whether `udd.discover` names a term that was taken out of a system."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from records import SEED, Rates, Record, function
from systems import System

import udd

_SAME = 1e-6  # of the added rates' size: what differs by so little is the same form


@dataclass
class Missing:
    """Result of a record whose model lacks a term.

    Attributes
    ----------
    term : str
        The removed term.
    listed : bool
        Whether the library of `udd.discover` holds its form.
    outcome : str
        "recovered": what was added is that term, and nothing else. "unsure": it is, but the verdict is that
        the form is not identified. "beside": another form was added, and this one is named as one that the
        data cannot tell from it. "wrong": another form is said to be identified. "located": something is said
        to be missing, its form not identified. "unconfirmed", "silent" (nothing is said to be missing),
        "refused" (with what udd says) and "failed" (with what else was raised).
    off : float
        Relative error of the term's factor, where it was recovered.
    before, after : float
        Error of free runs over held-out data, in standard deviations, by the known and the final model.
    r2_before, r2_after : float
        R2 of a free run from the system's other start, against SciPy's motion.
    seconds : float
        Of the processor, of all threads.
    """

    number: int
    title: str
    noise: float
    hidden: bool
    term: str
    listed: bool = False
    outcome: str = ""
    verdict: str = ""
    found: list[str] = field(default_factory=list)
    alternatives: list[str] = field(default_factory=list)
    off: float = np.nan
    before: float = np.nan
    after: float = np.nan
    r2_before: float = np.nan
    r2_after: float = np.nan
    scatter: float = np.nan
    seconds: float = 0.0
    error: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON."""
        return {"question": "missing", **asdict(self)}


def drawn(system: System) -> tuple[str, int]:
    """The term that is taken out."""
    terms = list(system.terms())
    return terms[int(np.random.default_rng([SEED, system.number, 2]).integers(len(terms)))]


def known(system: System, out: tuple[str, int]) -> udd.Model:
    """The system without a term; each constant starts at 0.8 to 1.25 times its value."""
    draw = np.random.default_rng([SEED, system.number, 3])
    values: dict[str, float] = {}
    equations = []
    for state, own in system.equations.items():
        texts = []
        for k, (factor, text) in enumerate(own):
            value = factor * 1.25 ** draw.uniform(-1, 1)
            if (state, k) == out:
                continue
            if isinstance(factor, int):
                # A bare state is left as it is: that says that one state is the rate of another.
                texts.append(text if factor == 1 else f"{factor}*({text})")
            else:
                values[f"k_{state}{k}"] = value
                texts.append(f"k_{state}{k}*({text})")
        equations.append(" + ".join(texts) or "0")
    kept = " ".join(equations)
    shapes = {name: value * 1.25 ** draw.uniform(-1, 1) for name, value in system.shapes.items()}
    used = {name: value for name, value in shapes.items() if _names(kept, name)}
    return udd.Model(list(system.states), equations, values | used, angles=list(system.angles))


def _names(text: str, name: str) -> bool:
    cleared = "".join(c if c.isalnum() or c == "_" else " " for c in text)
    return name in cleared.split()


def search(record: Record, noise: float) -> Missing:
    """Look for the term that is missing, and compare with the truth."""
    system = record.system
    state, k = drawn(system)
    factor, text = system.equations[state][k]
    result = Missing(
        system.number,
        system.title,
        noise,
        len(record.seen) < len(system.states),
        f"{state}' = ... + {factor:g}*{text}",
    )
    model = known(system, (state, k))
    truth = np.zeros((400, len(system.states)))
    truth[:, system.states.index(state)] = factor * function(text, system)(record.points())
    begin = time.process_time()
    # A fit of what was not seen has to begin somewhere.
    hidden = {s: x for s, x in zip(system.states, system.starts[0], strict=True) if s not in record.seen}
    discovery = udd.discover(
        udd.Measurement(record.t, record.columns, sigma=record.sigma),
        model,
        state0=hidden or None,
    )
    result.seconds = time.process_time() - begin
    _judge(result, record, model, discovery, truth)
    return result


def _added(model: udd.Model, effects: list[Any], points: np.ndarray) -> np.ndarray:
    """Return the contribution of effects to the rates."""
    values = dict(model.values)
    plain = udd.Model(list(model.state_names), model.texts, values, angles=list(model.angles))
    return plain.with_effects(effects).rates(0.0, points) - plain.rates(0.0, points)


def _factor(added: np.ndarray, truth: np.ndarray) -> float:
    """By what the truth has to be multiplied to be what was added; NaN where the form is another."""
    if not np.isfinite(added).all() or not added.any():
        return float("nan")
    factor = float((added * truth).sum() / (truth**2).sum())
    same = np.linalg.norm(added - factor * truth) <= _SAME * np.linalg.norm(added)
    return factor if same and factor else float("nan")


def _judge(
    result: Missing, record: Record, model: udd.Model, discovery: udd.Discovery, truth: np.ndarray
) -> None:
    points = record.points()
    result.verdict = discovery.verdict
    result.scatter = float(discovery.fit.scatter)
    result.found = [f"{f.equation} | {f.expression}" for f in discovery.effects]
    result.alternatives = [f"{a.instead_of}: {a.title}" for a in discovery.alternatives]
    result.listed = any(
        np.isfinite(_factor(_unit(model, one.candidate.effect, points), truth))
        for one in (discovery.scans[0] if discovery.scans else [])
        if not one.candidate.effect.spec.shaped
    )
    effects = [f.effect for f in discovery.effects]
    factor = _factor(_added(model, effects, points), truth) if effects else np.nan
    result.off = abs(factor - 1)
    sure = discovery.verdict == "effect identified"
    beside = any(np.isfinite(_factor(_unit(model, a.effect, points), truth)) for a in discovery.alternatives)
    if np.isfinite(factor):
        result.outcome = "recovered" if sure else "unsure"
    elif discovery.effects:
        result.outcome = "beside" if beside else "wrong" if sure else "located"
    elif discovery.verdict == "nothing missing":
        result.outcome = "silent"
    else:
        result.outcome = "unconfirmed" if "not confirmed" in discovery.verdict else "located"
    result.before, result.after = _held_out(discovery)
    result.r2_before = record.r2_elsewhere(_rates(discovery.baseline.model))
    result.r2_after = record.r2_elsewhere(_rates(discovery.model))


def _unit(model: udd.Model, effect: Any, points: np.ndarray) -> np.ndarray:
    """Return the contribution of a candidate to the rates with its amplitudes at 1."""
    values = {
        p.name: 1.0 if p.role == "amplitude" else effect.parameters[p.name] for p in effect.spec.parameters
    }
    return _added(model, [effect.replace(**values)], points)


def _rates(model: udd.Model) -> Rates:
    return lambda states: model.rates(0.0, states) if np.isfinite(states).all() else states * np.nan


def _held_out(answer: udd.Discovery) -> tuple[float, float]:
    horizon = answer.horizon
    if horizon is None:
        return answer.error_before.whole, answer.error_after.whole
    k = answer.error_before.horizons.index(horizon)
    return float(answer.error_before.median[k]), float(answer.error_after.median[k])
