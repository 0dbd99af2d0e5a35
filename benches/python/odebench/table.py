"""The lines and tables of what came out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from typing import Any

import numpy as np

Row = dict[str, Any]


def line(row: Row) -> str:
    """A record in a line."""
    head = f"{row['question']:8s} {row['number']:2d} {row['title'][:26]:26s} {row['noise']:5.1%}"
    head += f" {row['outcome']:11s}"
    if "said" in row:
        return f"{head} {row['said']}"
    if "term" in row:
        return (
            f"{head} {'' if row['listed'] else '(not listed) '}{row['term']} <- "
            f"{'; '.join(row['found']) or '-'} [{row['verdict']}; {'; '.join(row['alternatives'])}] "
            f"off {row['off']:.1g}, "
            f"{row['before']:.2g} -> {row['after']:.2g}, R2 {row['r2_before']:.3g} -> {row['r2_after']:.3g}, "
            f"chi2/dof {row['scatter']:.2g}, {row['seconds']:.1f} s"
        )
    return (
        f"{head} {'' if row['listed'] else '(not listed) '}-{row['missed']} +{row['extra']} "
        f"{' | '.join(row['kept'])}; {row['undetermined']} not determined, R2 {row['r2']:.3g}, "
        f"{row['seconds']:.1f} s"
    )


def report(rows: Sequence[Row]) -> str:
    """For each question and noise, how often what came out."""
    lines = []
    key = lambda row: (row["question"], row["noise"])  # noqa: E731
    for (question, noise), group in groupby(sorted(rows, key=key), key):
        own = list(group)
        done = [row for row in own if "said" not in row]
        counts = Counter(row["outcome"] for row in own)
        lines.append(
            f"\n{question}, noise {noise:.1%}: {len(own)} records, {counts['refused']} refused, "
            f"{counts['failed']} failed"
        )
        for listed in (True, False):
            some = [row for row in done if row["listed"] == listed]
            if some:
                counted = Counter(row["outcome"] for row in some).most_common()
                where = "in" if listed else "not in"
                lines.append(
                    f"  {len(some):2d} {where} the library: "
                    + ", ".join(f"{n} {outcome}" for outcome, n in counted)
                )
        lines += _numbers(done)
    return "\n".join(lines)


def _numbers(done: Sequence[Row]) -> list[str]:
    if not done:
        return []
    lines = [f"  seconds: median {_median(done, 'seconds'):.1f}, most {max(r['seconds'] for r in done):.1f}"]
    right = [row for row in done if row["outcome"] in ("recovered", "unsure")]
    if right:
        lines.append(f"  where recovered: relative error of factors, median {_median(right, 'off'):.1g}")
    if "term" in done[0]:
        lines.append(
            f"  held-out error, median: {_median(done, 'before'):.2g} -> {_median(done, 'after'):.2g}"
        )
        sides = [_good(done, name) for name in ("r2_before", "r2_after")]
        lines.append(f"  R2 over 0.9 from the other start: {sides[0]} -> {sides[1]}")
    else:
        told = Counter(row["outcome"] for row in done if row["undetermined"])
        if told:
            counted = ", ".join(f"{n} {outcome}" for outcome, n in told.most_common())
            lines.append(f"  terms said not to be determined: {counted}")
        lines.append(f"  R2 over 0.9 from the other start: {_good(done, 'r2')}")
    return lines


def _good(rows: Sequence[Row], name: str) -> str:
    """How many free runs from the other start explain nine tenths; of those whose truth can be run there."""
    values = np.array([row[name] for row in rows])
    return f"{int((values > 0.9).sum())} of {int((~np.isnan(values)).sum())}"


def _median(rows: Sequence[Row], name: str) -> float:
    return float(np.nanmedian([row[name] for row in rows]))
