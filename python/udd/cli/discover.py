"""`udd discover`: which effect the model lacks."""

from __future__ import annotations

import argparse
import gc
import shlex
import sys
from pathlib import Path
from typing import Any

from udd._util import background_import
from udd.errors import UddError

from .export import PAGES, OutputFile
from .fit import options
from .inputs import add_input, check_early, inputs_of
from .options import new
from .output import CommandResult, status_line


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "discover",
        run,
        "Find the effect that the model lacks, from a film or a measurement, or from several jointly.",
        (
            "udd discover disk.csv --report report.html",
            "udd discover slow.csv fast.csv --budget 20 --held-out fast.csv",
        ),
    )
    add_input(parser, several=True)
    parser.add_argument(
        "--held-out",
        action="append",
        metavar="FILE",
        help="of several files one that no fit sees, by its name or its number from 0, instead of the last "
        "40 %% of each; repeatable",
    )
    parser.add_argument(
        "--budget",
        type=float,
        metavar="SECONDS",
        help="end the search after this time, with the result that it has by then",
    )
    parser.add_argument(
        "--report",
        type=Path,
        action=OutputFile,
        endings=PAGES,
        metavar="HTML",
        help="page to write, pictures first",
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    # Modules, fits and figures are many objects that stay: to search them for garbage takes a second.
    gc.set_threshold(100_000, 20, 100)
    from udd.discovery import discover
    from udd.report import as_text, summary_of

    check_early(args)
    held_out = held_out_of(args)
    given = inputs_of(args)
    if args.report is not None:
        background_import.importing(
            "matplotlib.figure", "matplotlib.backends.backend_svg", "matplotlib.backends.backend_agg"
        )
    with status_line() as tell:
        discovery = discover(
            *given.measured, held_out=held_out, budget=args.budget, progress=tell, **options(args)
        )
        if args.report is not None:
            tell("writing the report")
            command = shlex.join(["udd", *sys.argv[1:]])
            # The page shows the first record that was fitted.
            shown = next(k for k in range(len(given.files)) if k not in discovery.held_out)
            discovery.report(args.report, film=given.films[shown], source=given.files[shown], command=command)
    text, data = as_text(summary_of(discovery)), {**given.file_entry, **discovery.to_dict()}
    data["hints"] = [hint.to_dict() for hint in discovery.hints]
    if args.report is not None:
        text += f"\nreport: {args.report}"
        data["report"] = args.report
    return CommandResult(text, data)


def held_out_of(args: argparse.Namespace) -> list[int] | None:
    """Return the numbers of the held-out files; errors come before films are tracked."""
    if args.held_out is None:
        return None
    if args.each is not None:
        raise UddError(
            "--held-out does not go with --each: the parameters of a held-out file would be undetermined"
        )
    if len(args.files) == 1:
        raise UddError("--held-out needs several files; in one file the last part serves as held-out data")
    names = [str(file) for file in args.files]
    numbers = {str(k): k for k in range(len(names))} | {name: k for k, name in enumerate(names)}
    held_out = set()
    for text in args.held_out:
        if str(Path(text)) not in numbers:
            raise UddError(
                f"--held-out {text} is none of the files {', '.join(names)}, "
                f"nor a number from 0 to {len(names) - 1}"
            )
        held_out.add(numbers[str(Path(text))])
    if len(held_out) == len(names):
        raise UddError("--held-out names all files: none is left to fit")
    return sorted(held_out)
