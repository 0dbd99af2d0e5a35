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
    parser.add_argument("--list", action="store_true", help="only say which figures and claims there are")


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.paper import CLAIMS, FIGURES, reproduce

    if args.list:
        rows = [f"{one.key:28} {one.paper}: {one.title}" for one in FIGURES.values()]
        rows += [f"{one.key:28} {one.place}: {one.says}" for one in CLAIMS.values()]
        return CommandResult("\n".join(rows), {"figures": list(FIGURES), "claims": list(CLAIMS)})
    with status_line() as tell:
        made = reproduce(args.out, only=args.only, films=not args.no_films, progress=tell)
    lines = [f"{one.verdict.verdict:20} {one.claim.says}" for one in made.claims]
    if made.left_out:
        lines.append(f"left out, since they need films: {', '.join(one.key for one in made.left_out)}")
    text = "\n".join([*lines, f"page: {made.page}"])
    data = {
        "page": made.page,
        "left_out": [one.key for one in made.left_out],
        "figures": [
            {"key": one.figure.key, "paper": one.figure.paper, "file": one.path, "seconds": one.seconds}
            for one in made.figures
        ],
        "claims": [
            {
                "key": one.claim.key,
                "place": one.claim.place,
                "says": one.claim.says,
                "verdict": one.verdict.verdict,
                "evidence": one.verdict.evidence,
                "remark": one.verdict.remark,
                "seconds": one.seconds,
            }
            for one in made.claims
        ],
    }
    return CommandResult(text, data)
