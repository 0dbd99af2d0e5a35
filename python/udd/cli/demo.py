"""`udd demo`: from the film that ships with the package to a page."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .options import new
from .output import CommandResult, shown_progress


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Track the sample film, find the effect that the model lacks, and write the report."
    parser = new(
        commands,
        "demo",
        run,
        summary,
        (
            "udd demo",
            "udd demo --null --out null",
        ),
    )
    parser.add_argument(
        "--out", type=Path, default=Path("demo"), metavar="DIR", help="folder (default ./demo)"
    )
    parser.add_argument("--null", action="store_true", help="the film of a disk without any effect")


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.demo.pipeline import demo
    from udd.report import as_text, summary_of

    made = demo(args.out, null=args.null, progress=shown_progress())
    verdict = as_text(summary_of(made.discovery))
    text = f"{verdict}\nmeasurement: {made.measurement}\nreport: {made.report}"
    data = {"measurement": made.measurement, "report": made.report, **made.discovery.to_dict()}
    return CommandResult(text, data)
