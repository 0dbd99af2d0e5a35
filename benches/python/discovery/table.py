"""The tables that a run prints."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import groupby, pairwise

import numpy as np
from scipy.stats import binomtest
from scoring import Score


def line(one: Score) -> str:
    """A record in a line."""
    head = f"{one.batch:8s} {one.title:32s} W {one.W:.4f}  " + ",".join(f"{m:.1f}" for m in one.multiples)
    if one.error:
        return f"{head}  FAILED: {one.error.strip().splitlines()[-1]}"
    pairs = zip(one.forms, one.equations, strict=True)
    right = "".join("f" if form else "e" if equation else "-" for form, equation in pairs)
    others = ", ".join(dict.fromkeys(one.alternatives))
    said = (", ".join(one.found) or "-") + (f" ({others})" if others else "")
    return (
        f"{head}  {right:2s} {one.verdict}: {said}; first {one.best}; chi2/dof {one.scatter:.2f}; "
        f"after/oracle {_ratio(one):.2f}; {one.seconds:.1f} s"
    )


def report(scores: Iterable[Score]) -> str:
    """All tables."""
    by_batch = lambda one: one.batch  # noqa: E731
    parts = []
    for batch, group in groupby(sorted(scores, key=by_batch), by_batch):
        everything = list(group)
        rows = [one for one in everything if not one.error]
        parts.append(f"\n{batch}: {len(everything)} records, {len(everything) - len(rows)} failed")
        if rows:
            parts.append(_nulls(rows) if batch in ("nulls", "sensors", "films") else _effects(rows))
            parts.append(_time(rows))
    return "\n".join(parts)


def _effects(rows: Sequence[Score]) -> str:
    lines = [
        f"  {'':20s} {'n':>4s} {'equation':>22s} {'form or class':>22s} {'named':>9s} {'false':>6s} "
        f"{'after/oracle':>13s} {'before/oracle':>14s}"
    ]
    title = lambda one: one.title  # noqa: E731
    groups = [(name, list(group)) for name, group in groupby(sorted(rows, key=title), title)]
    if rows[0].batch == "pairs":
        groups = []
    for name, group in [*groups, *_by_multiple(rows), ("all", list(rows))]:
        equations, forms, named = ([h for one in group for h in hits(one)] for hits in _HITS)
        after, before = _quantiles(_ratio, group), _quantiles(_ratio_before, group)
        false = sum(one.false > 0 for one in group)
        lines.append(
            f"  {name:20s} {len(group):4d} {_share(equations):>22s} {_share(forms):>22s} "
            f"{sum(named):5d}/{len(named):<3d} {false:6d} {after:>13s} {before:>14s}"
        )
    lines.append(f"  after/oracle: held-out error at 1 s, median and worst decile; {_z(rows)}")
    return "\n".join(lines)


_HITS: tuple[Callable[[Score], list[bool]], ...] = (
    lambda one: one.equations,
    lambda one: one.forms,
    lambda one: one.named,
)


def _by_multiple(rows: Sequence[Score]) -> list[tuple[str, list[Score]]]:
    """Records by the weakest effect's multiple of its detection limit."""
    edges = (0.0, 1.5, 2.0, 3.0, 5.0, np.inf)
    if rows[0].batch == "three":
        return []
    bins = [
        (f"{low:g} to {high:g} limits", [one for one in rows if low <= min(one.multiples) < high])
        for low, high in pairwise(edges)
    ]
    return [(name, group) for name, group in bins if group]


def _nulls(rows: Sequence[Score]) -> str:
    title = lambda one: one.title  # noqa: E731
    lines = [
        f"  {'':24s} {'n':>4s} {'an effect reported':>28s} {'said unexplained':>18s} {'after/oracle':>16s}"
    ]
    for name, group in [
        *((n, list(g)) for n, g in groupby(sorted(rows, key=title), title)),
        ("all", list(rows)),
    ]:
        wrong = [bool(one.found) for one in group]
        doubt = sum("not identified" in one.verdict and not one.found for one in group)
        lines.append(
            f"  {name:24s} {len(group):4d} {_share(wrong):>28s} {doubt:18d} {_quantiles(_ratio, group):>16s}"
        )
    lines.append(f"  {_z(rows)}")
    return "\n".join(lines)


def _share(hits: Sequence[bool]) -> str:
    """A share with its exact 95 % interval (Clopper and Pearson)."""
    k, n = sum(hits), len(hits)
    interval = binomtest(k, n).proportion_ci(0.95, method="exact")
    return f"{k}/{n} ({100 * interval.low:.1f}-{100 * interval.high:.1f} %)"


def _ratio(one: Score) -> float:
    return _against(one, one.after)


def _ratio_before(one: Score) -> float:
    return _against(one, one.before)


def _against(one: Score, errors: Sequence[float]) -> float:
    """Error over the oracle's at a second, or the nearest horizon below."""
    if not errors or not one.oracle_error:
        return float("nan")
    k = max((i for i, h in enumerate(one.horizons) if h <= 1.0), default=0)
    return errors[k] / one.oracle_error[k]


def _quantiles(measure: Callable[[Score], float], group: Sequence[Score]) -> str:
    values = np.array([measure(one) for one in group])
    return f"{np.nanmedian(values):.2f}, {np.nanquantile(values, 0.9):.2f}"


def _z(rows: Sequence[Score]) -> str:
    """Root mean square of errors over standard errors."""
    effects = [z for one in rows for z in one.z.values()]
    parts = [f"coefficients {_rms(effects)} ({len(effects)})"] if effects else []
    for name in dict.fromkeys(name for one in rows for name in one.z_device):
        parts.append(f"{name} {_rms([one.z_device[name] for one in rows if one.z_device])}")
    return "errors over standard errors, r.m.s.: " + ", ".join(parts)


def _rms(values: Sequence[float]) -> str:
    return f"{np.sqrt(np.mean(np.square(values))):.2f}"


def _time(rows: Sequence[Score]) -> str:
    seconds = [one.seconds for one in rows]
    return f"  time per record: median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s"
