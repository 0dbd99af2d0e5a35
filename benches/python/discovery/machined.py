"""Results of machines' records, and their table."""

from __future__ import annotations

import re
import time
import traceback
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import groupby
from typing import Any

import driven_machines
import machines
import numpy as np
from machines import MachineCase, drawn

import udd

#: Names that the answer may use for each kind of missing term.
_MEANS = {
    "dry": r"coulomb|stribeck|dry_.*|tanh_.*",
    "viscous": r"[vw]_in_[vw]|.*viscous.*",
    "offset": r"constant_in_v",
    "joints": r"viscous_friction_(along_a|between_a_and_b)",
    "quadratic": r"quadratic_drag|abs_v_v_in_v|v2_in_v",
    "cubic": r"cubic_drag|v3_in_v",
    "cubic spring": r"[xy]3_in_v",
    "late": r"delay_of_torque",
    "dead zone": r"dead_zone_of_torque_in_v",
    "play": r"dead_zone_of_x_in_v",
}


@dataclass
class MachineScore:
    """Result of a record."""

    title: str
    number: int
    options: str
    lacks: list[str] = field(default_factory=list)
    verdict: str = ""
    found: list[str] = field(default_factory=list)
    alternatives: list[str] = field(default_factory=list)
    right: bool = False  # the effects are the missing terms, each by name
    in_class: bool = False  # or a named form that the data cannot distinguish
    before: float = np.nan
    after: float = np.nan
    low: float = np.nan
    high: float = np.nan
    floor: float = np.nan
    scatter: float = np.nan
    noise: float = np.nan  # found over true
    seconds: float = 0.0
    error: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON."""
        return asdict(self)


def machine_score(case: MachineCase, seed: int) -> MachineScore:
    """Draw the record, look for what its model lacks, compare with the truth."""
    result = MachineScore(case.title, case.number, case.options)
    try:
        machine = drawn(case, seed, machines.KINDS | driven_machines.KINDS)
        result.lacks = list(machine.lacks)
        measurement, options = machine.asked(case.options)
        begin = time.perf_counter()
        answer = udd.discover(measurement, machine.known, **options)
        result.seconds = time.perf_counter() - begin
        _judge(result, answer, machine.sigma)
    except Exception:  # one record's failure is a result too, and must not end the others
        result.error = traceback.format_exc(limit=-3)
    return result


def _judge(result: MachineScore, discovery: udd.Discovery, sigma: dict[str, float]) -> None:
    result.verdict = discovery.verdict
    names = [f.effect.name for f in discovery.effects]
    result.found = [f.title for f in discovery.effects]
    result.alternatives = [a.title for a in discovery.alternatives]
    result.right = _matches(result.lacks, names)
    swapped = [
        [a.effect.name if a.instead_of == name else name for name in names] for a in discovery.alternatives
    ]
    result.in_class = result.right or any(_matches(result.lacks, some) for some in swapped)
    before, after = discovery.error_before, discovery.error_after
    if before.unit == "rad":
        result.before, result.after, result.floor = before.whole, after.whole, float(after.floor[-1])
    else:
        k = before.horizons.index(discovery.horizon)
        result.before, result.after = float(before.median[k]), float(after.median[k])
        result.floor = float(after.floor[k])
    _value, result.low, result.high = discovery.ratio
    fit = discovery.fit
    result.scatter = float(fit.scatter)
    told = [one.frame_noise / sigma[one.name] for one in discovery.noise if one.name in sigma]
    result.noise = float(np.median(told))


def _matches(lacks: Sequence[str], names: Sequence[str]) -> bool:
    """Whether each effect is one of what is missing, and nothing is left over."""
    if lacks in (["joints"], ["viscous"]):  # one in each joint or equation
        return len(set(names)) == 2 and all(re.fullmatch(_MEANS[lacks[0]], name) for name in names)
    if len(lacks) != len(names):
        return False
    left = list(names)
    for kind in lacks:
        hit = next((name for name in left if re.fullmatch(_MEANS[kind], name)), None)
        if hit is None:
            return False
        left.remove(hit)
    return True


def machine_line(one: MachineScore) -> str:
    """A record in a line."""
    head = f"{one.title:28s} {one.number:2d} {one.options:8s}"
    if one.error:
        return f"{head} FAILED: {one.error.strip().splitlines()[-1]}"
    mark = "R" if one.right else "c" if one.in_class else "-"
    said = ", ".join(one.found) or "-"
    others = f" ({', '.join(one.alternatives)})" if one.alternatives else ""
    return (
        f"{head} {mark} {one.verdict}: {said}{others}; {one.before:.3g} -> {one.after:.3g}, floor "
        f"{one.floor:.3g}; chi2/dof {one.scatter:.2f}; noise/true {one.noise:.2f}; {one.seconds:.0f} s"
    )


def machine_report(scores: Iterable[MachineScore]) -> str:
    """The table: of each kind under each of the options."""
    key = lambda one: (one.title, one.options)  # noqa: E731
    lines = [
        f"\n  {'':28s} {'options':8s} {'n':>3s} {'right':>6s} {'class':>6s} {'worse':>6s} {'before':>9s} "
        f"{'after':>9s} {'floor':>9s}  verdicts"
    ]
    everything = list(scores)
    for (title, options), group in groupby(sorted(everything, key=key), key):
        own = list(group)
        rows = [one for one in own if not one.error]
        failed = f"  {len(own) - len(rows)} FAILED" if len(rows) < len(own) else ""
        if not rows:
            lines.append(f"  {title:28s} {options:8s} {0:3d}{failed}")
            continue
        said = {v: sum(one.verdict == v for one in rows) for v in sorted({one.verdict for one in rows})}
        median = [float(np.median([getattr(one, k) for one in rows])) for k in ("before", "after", "floor")]
        right, near = sum(one.right for one in rows), sum(one.in_class for one in rows)
        worse = sum(one.after > 1.05 * one.before for one in rows)
        lines.append(
            f"  {title:28s} {options:8s} {len(rows):3d} {right:6d} {near:6d} {worse:6d} {median[0]:9.3g} "
            f"{median[1]:9.3g} {median[2]:9.3g}  " + "; ".join(f"{n} {v}" for v, n in said.items()) + failed
        )
    by_record: dict[tuple[str, int], set[tuple[str, ...]]] = {}
    for one in everything:
        by_record.setdefault((one.title, one.number), set()).add((one.verdict, *sorted(one.found)))
    same = sum(len(said) == 1 for said in by_record.values())
    lines.append(
        f"  one verdict and one list of effects under all options: {same} of {len(by_record)} records"
    )
    return "\n".join(lines)
