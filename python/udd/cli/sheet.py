"""`udd sheet`: marks or tags for the disk, to print."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .export import OutputFile
from .options import new
from .output import CommandResult


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "sheet",
        run,
        "Write a sheet to print (PDF): the disk's marks or tags at true scale, a ruler, and their layout.",
        ("udd sheet marks --radius 0.08", "udd sheet tags --radius 0.1 --paper A3 --out tags.pdf"),
    )
    parser.add_argument("kind", choices=("marks", "tags"), help="four colour marks, or four ArUco tags")
    parser.add_argument("--radius", type=float, default=0.08, metavar="M", help="of the disk (default 0.08)")
    parser.add_argument("--paper", default="A4", metavar="SIZE", help="A4 (default), A3 or letter")
    parser.add_argument(
        "--out",
        type=Path,
        action=OutputFile,
        endings=(".pdf",),
        metavar="PDF",
        help="file to write (default: marks.pdf or tags.pdf); the layout is written to a .toml next to it",
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Write the sheet."""
    from udd.report.sheet import write_sheet

    path = Path(f"{args.kind}.pdf") if args.out is None else args.out
    page, config = write_sheet(args.kind, path, radius=args.radius, paper=args.paper)
    text = f"written: {page}\nwritten: {config}\nnext: udd track FILM --config {config.name}"
    return CommandResult(text, {"file": page, "config": config})
