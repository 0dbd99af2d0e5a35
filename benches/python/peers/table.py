"""The answer as Markdown."""

from __future__ import annotations

import re
import statistics
from typing import Any

from peers.harness import Result, Row, ratios


def figure(value: float) -> str:
    """A rate with three digits: 1.23e6."""
    if value != value:
        return "-"
    if value < 1000:
        return f"{value:.3g}"
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def standing(row: Row, results: list[Result]) -> tuple[str, str, str]:
    """The best peer, the median ratio to it and its spread."""
    best, values = ratios(results, row.bound)
    if not values:
        return best or "-", "-", "-"
    return best, f"{statistics.median(values):.2f}", f"{min(values):.2f} to {max(values):.2f}"


def limits(text: str) -> dict[str, float]:
    """The rates that one core could reach at most, from what ``make bench ARGS=--limit`` printed.

    The last instruction set is kept, which is the widest.
    """
    lines = re.findall(r"^(.*), Avx\w+ +\S+ +(\S+) +\d+ %$", text, re.MULTILINE)
    return {path: float(most) for path, most in lines}


def summary(rows: list[tuple[Row, list[Result]]], most: dict[str, float]) -> str:
    """One line per row: udd, the best peer, their ratio, and udd's part of the machine's limit."""
    lines = [
        "| row | unit | udd | best peer | its rate | udd / best peer | spread | of the limit |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row, results in rows:
        best, ratio, spread = standing(row, results)
        rate = {result.name: result.rate for result in results}
        own = figure(rate.get("udd", float("nan")))
        peer = figure(rate.get(best, float("nan")))
        limit = row.threads * most.get(row.path, float("nan"))
        part = f"{100 * rate['udd'] / limit:.0f} %" if "udd" in rate and limit == limit else "-"
        cells = (f"{row.number}. {row.title}", row.unit, own, best, peer, ratio, spread, part)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def details(row: Row, results: list[Result]) -> str:
    """One line per code."""
    lines = [
        f"### {row.number}. {row.title}",
        "",
        f"Error: {row.error}, median over starts; what is compared has at most {row.bound:.1e}.",
        "",
        f"| code | {row.unit} | error | setting | note |",
        "|---|---|---|---|---|",
    ]
    for result in results:
        setting = result.entry.setting if result.entry else "-"
        notes = [result.note, result.complaint]
        if result.entry and not result.error <= row.bound:
            notes.append("not accurate enough to be compared")
        error = f"{result.error:.1e}" if result.entry else "-"
        note = "; ".join(n for n in notes if n)
        lines.append(f"| {result.name} | {figure(result.rate)} | {error} | {setting} | {note} |")
    return "\n".join(lines)


def as_data(row: Row, results: list[Result]) -> dict[str, Any]:
    """The same for --json."""
    best, values = ratios(results, row.bound)
    return {
        "row": row.number,
        "title": row.title,
        "unit": row.unit,
        "bound": row.bound,
        "best_peer": best or None,
        "ratios": values,
        "codes": [
            {
                "name": result.name,
                "rates": result.rates,
                "error": None if result.entry is None else result.error,
                "setting": result.entry.setting if result.entry else None,
                "amount": result.amount,
                "note": result.note,
                "complaint": result.complaint,
                "counts": result.counts(row.bound),
            }
            for result in results
        ],
    }
