"""ODEBench's 63 systems and those of dysts: a missing term, and whole systems from a library of terms.

    python benches/python/odebench [--from dysts] [--systems 1-23,54] [--noise 0 0.01]
                                   [--only missing,hidden,library] [--jobs 2] [--json out.json]

Each record is the motion from the system's first start, 512 samples over t = 0 to 10 (of dysts, over five
periods) by SciPy's DOP853, with multiplicative white noise as ODEFormer's authors have it (`--additive`: a
share of each state's standard deviation). Questions:

missing   a term, drawn from all terms, is taken out of the known model, and each constant of the rest starts
          at 0.8 to 1.25 times its value: does `udd.discover` name that term? All states are seen.
hidden    the same, but a drawn state is not observed; udd gets its start.
library   only a library of terms is given: does `udd.prune` leave the true ones?
pysindy   the same question to PySINDy with its defaults; in an environment that has it, which needs no udd.

The truth is computed without udd; all draws are from seeds that were fixed before the first run.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import traceback
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # the jobs are what runs in parallel
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import table
from dysts import DYSTS
from records import record
from systems import SYSTEMS, System

SOURCES = {"odebench": SYSTEMS, "dysts": DYSTS}
QUESTIONS = ("missing", "hidden", "library", "pysindy")


@dataclass(frozen=True)
class Case:
    """A question to a record, and the seconds of the processor after which it is given up."""

    source: str
    question: str
    number: int
    noise: float
    additive: bool
    told: bool
    draw: int
    spread: float | None
    limit: float


def main() -> int:
    """Score the records, print the tables; 1 where one failed."""
    parser = argparse.ArgumentParser(
        prog="odebench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--from", dest="source", choices=SOURCES, default="odebench")
    parser.add_argument("--systems", help="numbers and ranges, as in 1-23,54")
    parser.add_argument("--noise", type=float, nargs="+", default=[0.0, 0.01, 0.05, 0.1])
    parser.add_argument("--additive", action="store_true", help="noise of a share of the standard deviation")
    parser.add_argument("--told", action="store_true", help="give udd the standard deviation of each sample")
    parser.add_argument("--only", default="missing,hidden,library", help=f"of {', '.join(QUESTIONS)}")
    parser.add_argument("--draw", type=int, default=0, help="the number of the noise's draw")
    parser.add_argument("--spread", type=float, help="for udd.prune: of the factors' prior")
    parser.add_argument("--limit", type=float, default=180.0, help="s of the processor for a record")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path, help="write every record's score there too")
    given = parser.parse_args()
    questions = given.only.split(",")
    if unknown := set(questions) - set(QUESTIONS):
        parser.error(f"there is no question {', '.join(sorted(unknown))}; there are {', '.join(QUESTIONS)}")
    try:
        systems = SOURCES[given.source]
        numbers = _numbers(given.systems, systems) if given.systems else list(systems)
    except ValueError as wrong:
        parser.error(str(wrong))
    cases = [
        Case(
            given.source,
            question,
            number,
            noise,
            given.additive,
            given.told,
            given.draw,
            given.spread,
            given.limit,
        )
        for question in questions
        for noise in given.noise
        for number in numbers
        if question != "hidden" or len(systems[number].states) > 1
    ]
    rows: list[dict[str, Any]] = []
    with ProcessPoolExecutor(given.jobs) as pool:
        for job in as_completed([pool.submit(score, case) for case in cases]):
            rows.append(job.result())
            print(table.line(rows[-1]), file=sys.stderr, flush=True)
            if given.json:
                part = given.json.with_suffix(".part")
                part.write_text(json.dumps({"additive": given.additive, "told": given.told, "records": rows}))
                part.replace(given.json)
    print(table.report(rows))
    return int(any(row["outcome"] == "failed" for row in rows))


def _numbers(text: str, systems: Mapping[int, System]) -> list[int]:
    """The systems that are asked for."""
    result: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        if not (first.isdigit() and (last or first).isdigit()):
            raise ValueError(f"systems are numbers and ranges, as in 1-23,54, not {text!r}")
        result += range(int(first), int(last or first) + 1)
    if unknown := sorted(set(result) - set(systems)):
        raise ValueError(f"there is no system {unknown[0]}; there are 1 to {len(systems)}")
    return result


@contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in what takes longer, where the operating system has such a signal."""

    def ring(_number: int, _frame: Any) -> None:
        raise TimeoutError(f"given up after {seconds:g} s")

    if not hasattr(signal, "SIGPROF"):
        yield
        return
    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def score(case: Case) -> dict[str, Any]:
    """Draw the record and put the question; a record's failure is a result too."""
    system = SOURCES[case.source][case.number]
    try:
        hidden = case.question == "hidden"
        own = record(system, case.noise, hidden, case.additive, case.told, case.draw)
        with _at_most(case.limit):
            if case.question in ("missing", "hidden"):
                import missing

                return missing.search(own, case.noise).to_dict() | {"question": case.question}
            import library

            return library.find(case.question, own, case.noise, case.spread).to_dict()
    except Exception as raised:  # a sentence of udd's is an answer, anything else is not
        refused = "UddError" in [kind.__name__ for kind in type(raised).__mro__]
        return {
            "question": case.question,
            "number": case.number,
            "title": system.title,
            "noise": case.noise,
            "outcome": "refused" if refused else "failed",
            "error": traceback.format_exc(limit=-4),
            "said": f"{type(raised).__name__}: {raised}",
            "seconds": 0.0,
        }


if __name__ == "__main__":
    sys.exit(main())
