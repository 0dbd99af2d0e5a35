"""One record from its draw to its score."""

from __future__ import annotations

import time
import traceback
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from cases import Case, Record, draw
from laws import Law
from oracle import oracle
from sensors import sensed

import udd

_EQUATIONS = {"lateral": "dY", "vertical": "dZ", "torque": "dOmega", "friction": "dOmega"}
_DEVICE = ("k0", "k1", "k2", "W")


@dataclass
class Score:
    """Result of a record."""

    batch: str
    title: str
    number: int
    W: float = 0.0
    multiples: list[float] = field(default_factory=list)
    truth: list[dict[str, Any]] = field(default_factory=list)
    verdict: str = ""
    found: list[str] = field(default_factory=list)
    alternatives: list[str] = field(default_factory=list)
    equations: list[bool] = field(default_factory=list)
    forms: list[bool] = field(default_factory=list)
    named: list[bool] = field(default_factory=list)  # the truth was chosen, not only listed as an alternative
    false: int = 0  # reported effects that are neither in the truth nor equivalent to one
    z: dict[str, float] = field(default_factory=dict)
    z_device: dict[str, float] = field(default_factory=dict)
    horizons: list[float] = field(default_factory=list)
    before: list[float] = field(default_factory=list)
    after: list[float] = field(default_factory=list)
    oracle_error: list[float] = field(default_factory=list)
    floor: list[float] = field(default_factory=list)
    scatter: float = 0.0
    level: int = -1
    best: str = ""
    seconds: float = 0.0
    error: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON."""
        return asdict(self)


def score(case: Case, seed: int, duration: float, precise: bool) -> Score:
    """Draw the record, look for what its model lacks, compare with the truth."""
    result = Score(case.batch, case.title, case.number)
    try:
        if case.batch == "sensors":
            _sense(result, case, seed, duration)
            return result
        drawn = draw(case, seed, duration, precise=precise)
        result.W, result.multiples = float(drawn.known.W), list(drawn.multiples)
        for law in drawn.world.laws:
            values = dict(zip(law.kind.amplitudes, law.amplitudes, strict=True))
            result.truth.append({"name": law.kind.name, "momentum": law.momentum, **values, **law.shape})
        begin = time.process_time()
        answer = udd.discover(drawn.measurement, drawn.known)
        result.seconds = time.process_time() - begin
        _judge(result, drawn, answer)
    except Exception:  # one record's failure is a result too, and must not end the others
        result.error = traceback.format_exc(limit=3)
    return result


def _sense(result: Score, case: Case, seed: int, duration: float) -> None:
    """A record of a sensor with a fault, whose model lacks nothing."""
    measured, known = sensed(case.names[0], case.defect, duration, case.generator(seed))
    begin = time.process_time()
    discovery = udd.discover(measured, known)
    result.seconds = time.process_time() - begin
    result.W = float(known.parameters.get("W", 0.0))
    _say(result, discovery)
    result.false = len(discovery.effects)


def _say(result: Score, answer: udd.Discovery) -> None:
    result.verdict = answer.verdict
    result.found = [f.effect.name for f in answer.effects]
    result.alternatives = [a.effect.name for a in answer.alternatives]
    result.scatter, result.level = float(answer.fit.scatter), int(answer.fit.level)
    first = answer.scans[0][:1] if answer.scans else []
    result.best = ", ".join(f"{s.candidate.title} chi2 {s.chi2:.0f}" for s in first)
    after, before = answer.error_after, answer.error_before
    result.horizons = list(after.horizons)
    result.before, result.after = before.median.tolist(), after.median.tolist()
    result.floor = after.floor.tolist()


def _judge(result: Score, drawn: Record, discovery: udd.Discovery) -> None:
    _say(result, discovery)
    named = [f.effect for f in discovery.effects] + [a.effect for a in discovery.alternatives]
    entered = {_EQUATIONS[slot] for effect in named for slot in effect.slots}
    laws = drawn.world.laws
    result.equations = [bool(set(law.kind.equations) & entered) for law in laws]
    same = [{law.kind.name} | _otherwise(discovery, law) for law in laws]
    result.forms = [bool(own & {e.name for e in named}) for own in same]
    result.named = [bool(own & set(result.found)) for own in same]
    result.false = len(_unexplained(discovery, set().union(*same)))
    _measure(result, drawn, discovery)
    best = oracle(drawn)
    result.oracle_error = [best[h] for h in result.horizons]


def _otherwise(answer: udd.Discovery, law: Law) -> set[str]:
    """Return other names of the law: the wheel's ripple is one of the drive at that frequency."""
    if law.kind.name != "wheel_ripple":
        return set()
    turns = answer.fit.parameters["W"] / (2 * np.pi * law.shape["r"])
    line = 0.5 / float(np.ptp(answer.measurement.t))
    ripples = [f.effect for f in answer.effects if f.effect.name == "drive_ripple"]
    return {"drive_ripple"} if any(abs(r.parameters["f"] - turns) < line for r in ripples) else set()


def _unexplained(answer: udd.Discovery, true: set[str]) -> list[str]:
    """Effects that are not the truth's and for which none of the truth's is named as an alternative."""
    left = []
    for one in answer.effects:
        others = {a.effect.name for a in answer.alternatives if a.instead_of == one.effect.name}
        if not true & {one.effect.name, *others}:
            left.append(one.effect.name)
    return left


def _measure(result: Score, drawn: Record, discovery: udd.Discovery) -> None:
    """Coefficients over their standard errors, and the device's constants where the form is the truth's."""
    missed = False
    for law in drawn.world.laws:
        matching = [one for one in discovery.effects if _same(one.effect, law)]
        missed = missed or not matching
        for one in matching:
            for name, value in zip(law.kind.amplitudes, law.amplitudes, strict=True):
                error = one.errors.get(name, np.nan)
                result.z[f"{law.kind.name}.{name}"] = float((one.parameters[name] - value) / error)
    if missed or len(discovery.effects) != len(drawn.world.laws):
        return
    for name in _DEVICE:
        off = discovery.fit.parameters[name] - getattr(drawn.world.device, name)
        result.z_device[name] = float(off / discovery.fit.errors[name])


def _same(effect: udd.effects.Effect, law: Law) -> bool:
    """Whether udd's effect is the law, but for the amplitudes; a scanned frequency is nearly the law's."""
    shapes = all(abs(effect.parameters.get(n, np.inf) - v) < 0.02 * v for n, v in law.shape.items())
    return effect.name == law.kind.name and effect.momentum == law.momentum and shapes
