"""`udd discover`: which effect the model lacks."""

from __future__ import annotations

import argparse
import gc
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd._util import background_import

from .export import OutputFile
from .fit import options
from .inputs import add_input, check_early, inputs_of
from .options import new
from .output import CommandResult, status_line

if TYPE_CHECKING:
    from udd.discovery import Discovery


def add(commands: Any) -> None:
    """Add the command."""
    parser = new(
        commands,
        "discover",
        run,
        "Find the effect that the model lacks, from a film or a measurement, or from several jointly.",
    )
    add_input(parser, several=True)
    parser.add_argument(
        "--budget",
        type=float,
        metavar="SECONDS",
        help="end the search after so long, with what it has by then",
    )
    parser.add_argument(
        "--report", type=Path, action=OutputFile, metavar="HTML", help="page to write, pictures first"
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    # Modules, fits and figures are many objects that stay: to search them for garbage takes a second.
    gc.set_threshold(100_000, 20, 100)
    from udd.discovery import discover

    check_early(args)
    given = inputs_of(args)
    if args.report is not None:
        background_import.importing(
            "matplotlib.figure", "matplotlib.backends.backend_svg", "matplotlib.backends.backend_agg"
        )
    with status_line() as tell:
        found = discover(*given.measured, budget=args.budget, progress=tell, **options(args))
        if args.report is not None:
            tell("writing the report")
            command = shlex.join(["udd", *sys.argv[1:]])
            found.report(args.report, film=given.films[0], source=given.files[0], command=command)
    text, data = describe(found), {**given.told, **found.to_dict()}
    data["hints"] = [hint.to_dict() for hint in found.hints]
    if args.report is not None:
        text += f"\nreport: {args.report}"
        data["report"] = args.report
    return CommandResult(text, data)


def describe(found: Discovery) -> str:
    """A discovery in a few lines, the verdict first."""
    from udd.report import wording

    numbers = wording.headline(found)
    lines = [f"{found.verdict}: {wording.verdict(found)}"]
    lines += [f"  remark: {plain(remark)}" for remark in found.remarks]
    for effect in found.effects:
        unit = {p.name: p.unit for p in effect.effect.spec.parameters}
        is_spline = wording.is_spline(effect.effect)
        values = ", ".join(
            " ".join(filter(None, [f"{name} = {_with_error(value, effect.errors.get(name))}", unit[name]]))
            for name, value in effect.parameters.items()
        )
        lines.append(f"  {effect.title}: {effect.equation}" + ("" if is_spline else f", {values}"))
    span, at = plain(numbers.span), plain(numbers.floor_at)
    if found.effects:
        lines.append(f"  held-out error {span}: {numbers.before} -> {numbers.after}")
        lines.append(f"  ratio {numbers.ratio}, 95 % interval {numbers.interval}")
    else:
        lines.append(f"  held-out error {span}: {numbers.before}")
    lines += [f"  nearest: {plain(sentence)}" for sentence in wording.rejected(found)]
    lines.append(f"  noise floor after {at}: {numbers.floor}")
    lines.append(f"  noise: {wording.noise(found)}")
    for other in found.alternatives:
        lines.append(f"  could equally be {other.title}: {other.effect.expression}. {wording.limit(other)}")
    if found.hint is not None:
        lines.append(f"  to tell: {found.hint.text}")
    return "\n".join(lines)


def plain(text: str) -> str:
    """For terminals of any encoding."""
    return text.replace("\u00a0", " ").replace("χ²", "chi2")


def _with_error(value: float, error: float | None) -> str:
    return f"{value:.5g}" if error is None else f"{value:.5g} +- {error:.2g}"
