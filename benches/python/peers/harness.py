"""Rows of entries, which are timed and compared in turns."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


class Missing(Exception):
    """A peer that cannot take part, and why."""


@dataclass(frozen=True)
class Entry:
    """One code at one setting, ready to run (compiled and warm).

    `work(n)` does n units of the row's work and returns (done, answer), where `done` is what the rate counts;
    `probe()` is the error of the same code at the same setting. An entry with a note says what it does
    otherwise than the row.
    """

    setting: str
    work: Callable[[int], tuple[float, Any]]
    probe: Callable[[], float]
    note: str = ""
    least: int = 0
    """The least work that shows its speed: a code that runs many lanes needs them filled."""


@dataclass(frozen=True)
class Row:
    """One line of the table.

    `inspect` looks at an answer and returns what is wrong with it, or nothing. `bound` is the error that
    every entry must meet to be compared. `path` is the same work for one thread among the core's own paths
    (`make bench`), and `threads` how many take part.
    """

    number: int
    title: str
    unit: str
    bound: float
    error: str
    full: int
    smallest: int
    entries: dict[str, Callable[[], Entry]]
    inspect: Callable[[Any], str] = lambda answer: ""
    path: str = ""
    threads: int = 1


@dataclass
class Result:
    """Result of an entry of a row."""

    name: str
    entry: Entry | None
    note: str
    error: float = float("nan")
    amount: int = 0
    rates: list[float] = field(default_factory=list)
    complaint: str = ""

    @property
    def rate(self) -> float:
        return statistics.median(self.rates) if self.rates else float("nan")

    def counts(self, bound: float) -> bool:
        """Whether its speed may be compared: it ran, is accurate, and its answer is right."""
        return bool(self.rates) and self.error <= bound and not self.complaint


def timed(entry: Entry, amount: int) -> tuple[float, float, Any]:
    """Seconds, the work done, and the answer."""
    begin = time.perf_counter()
    done, answer = entry.work(amount)
    return time.perf_counter() - begin, done, answer


def fitting_amount(entry: Entry, row: Row, seconds: float) -> int:
    """The amount of work that takes about this long, at most the row's."""
    least = max(row.smallest, entry.least)
    amount = least
    while True:
        spent, _, _ = timed(entry, amount)
        if amount >= row.full:
            return row.full
        if spent > 0.25 * seconds:
            return max(least, min(row.full, int(amount * seconds / spent)))
        amount = min(row.full, 4 * amount)


def prepare(row: Row, only: set[str]) -> list[Result]:
    """Compile, measure the accuracy of and warm all entries of a row."""
    results = []
    for name, make in row.entries.items():
        if only and name not in only:
            continue
        try:
            entry = make()
            result = Result(name, entry, entry.note)
            result.error = entry.probe()
        except (Missing, ImportError) as problem:
            result = Result(name, None, f"not measured: {problem}")
        except (Exception, SystemExit) as problem:
            if name == "udd":
                raise
            result = Result(name, None, f"failed: {type(problem).__name__}: {problem}".splitlines()[0])
        results.append(result)
    return results


def measure(row: Row, only: set[str], repeats: int, seconds: float) -> list[Result]:
    """Run all entries of a row in turn, A B C A B C, so that what else the machine does hits all alike."""
    results = prepare(row, only)
    ready = [result for result in results if result.entry is not None]
    for result in ready:
        assert result.entry is not None
        result.amount = fitting_amount(result.entry, row, seconds)
    for _ in range(repeats):
        for result in ready:
            assert result.entry is not None
            spent, done, answer = timed(result.entry, result.amount)
            result.rates.append(done / spent)
            result.complaint = result.complaint or row.inspect(answer)
    return results


def ratios(results: list[Result], bound: float) -> tuple[str, list[float]]:
    """The best peer, and udd's rate over its rate in every turn."""
    own = next((r for r in results if r.name == "udd" and r.rates), None)
    peers = [r for r in results if r.name != "udd" and r.counts(bound)]
    if not peers:
        return "", []
    best = max(peers, key=lambda r: r.rate)
    if own is None:
        return best.name, []
    return best.name, [a / b for a, b in zip(own.rates, best.rates, strict=True)]
