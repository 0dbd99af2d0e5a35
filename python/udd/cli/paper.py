"""`udd paper`: the paper's figures drawn and its claims checked."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .options import new
from .output import CommandResult, status_line


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Draw the paper's figures, check its claims, and write the page that shows both."
    parser = new(
        commands,
        "paper",
        run,
        summary,
        (
            "udd paper --only eigenvalues --no-films",
            "udd paper --out paper --no-films",
        ),
    )
    parser.add_argument(
        "--out", type=Path, default=Path("paper"), metavar="DIR", help="folder (default ./paper)"
    )
    parser.add_argument(
        "--only", action="append", metavar="KEY", help="one figure or claim by its key; repeatable"
    )
    parser.add_argument(
        "--no-films",
        action="store_true",
        help="leave out what needs films, which are made and tracked once (minutes) and then kept in "
        "DIR/films",
    )
    parser.add_argument("--list", action="store_true", help="only list the figures and claims")


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.paper import CLAIMS, FIGURES, reproduce

    if args.list:
        rows = [f"{entry.key:28} {entry.paper}: {entry.title}" for entry in FIGURES.values()]
        rows += [f"{entry.key:28} {entry.place}: {entry.says}" for entry in CLAIMS.values()]
        return CommandResult("\n".join(rows), {"figures": list(FIGURES), "claims": list(CLAIMS)})
    with status_line() as tell:
        made = reproduce(args.out, only=args.only, films=not args.no_films, progress=tell)
    lines = [f"{entry.verdict.verdict:20} {entry.claim.says}" for entry in made.claims]
    if made.left_out:
        lines.append(f"left out, since they need films: {', '.join(entry.key for entry in made.left_out)}")
    text = "\n".join([*lines, f"page: {made.page}"])
    data = {
        "page": made.page,
        "left_out": [entry.key for entry in made.left_out],
        "figures": [
            {
                "key": entry.figure.key,
                "paper": entry.figure.paper,
                "file": entry.path,
                "seconds": entry.seconds,
            }
            for entry in made.figures
        ],
        "claims": [
            {
                "key": entry.claim.key,
                "place": entry.claim.place,
                "says": entry.claim.says,
                "verdict": entry.verdict.verdict,
                "evidence": entry.verdict.evidence,
                "remark": entry.verdict.remark,
                "seconds": entry.seconds,
            }
            for entry in made.claims
        ],
    }
    return CommandResult(text, data)
