"""`udd poincare`: where an orbit crosses a surface."""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd.errors import IncompleteWarning, UddError

from .export import TABLES, OutputFile, checked, save_picture
from .model_options import add_models, check_component, check_count, model_of, own_start
from .options import new, numbers
from .output import CommandResult

if TYPE_CHECKING:
    from udd.chaos.poincare_sections import Section


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Poincare section: where an orbit crosses a surface; the table is CSV."
    parser = new(
        commands,
        "poincare",
        run,
        summary,
        (
            'udd poincare --w 1 --section "maxima of z" --points 500 --map cusp.png --out maxima.csv',
            "udd poincare --model own.json --section x --points 20",
        ),
    )
    parser.add_argument(
        "--section",
        action="append",
        metavar="EXPR",
        help='surface: the zero of an expression ("omega - y"), or "maxima of z", "turning points of Y", '
        '"reversal" (default z, Z or theta); repeatable',
    )
    parser.add_argument(
        "--direction",
        choices=("up", "down", "both"),
        help="direction of the crossings (default up; of turning points and reversals both)",
    )
    parser.add_argument("--points", type=int, default=1000, help="number of points (default 1000)")
    parser.add_argument("--transient", type=int, default=100, help="points left out before (default 100)")
    parser.add_argument("--t-max", type=float, help="time at which the orbit ends at the latest")
    parser.add_argument("--rtol", type=float, default=1e-9, help="relative tolerance (default 1e-9)")
    parser.add_argument("--atol", type=float, default=1e-12, help="absolute tolerance (default 1e-12)")
    parser.add_argument("--state", metavar="X,X,X", help="initial state omega,y,z or Omega,Y,Z,beta or ...")
    parser.add_argument(
        "--out",
        type=Path,
        action=OutputFile,
        endings=TABLES,
        metavar="FILE.csv",
        help="file for the table instead of stdout",
    )
    parser.add_argument(
        "--picture", type=Path, action=OutputFile, help="picture of the points: .png, .svg or .pdf"
    )
    parser.add_argument(
        "--map", type=Path, action=OutputFile, metavar="PICTURE", help="picture of the return map"
    )
    parser.add_argument("--component", help="component of the state in the return map")
    add_models(parser)


def run(args: argparse.Namespace) -> CommandResult:
    """Do it; on Ctrl-C what is finished is kept."""
    from udd._util.atomic_files import write_whole
    from udd.chaos.poincare_sections import poincare
    from udd.plot import poincare as draw
    from udd.plot import return_map

    _check(args)
    model = model_of(args, {})
    check_component(model, args.component)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", UserWarning)
        section = poincare(
            model,
            args.section,
            args.points,
            state0=own_start(args) if args.state is None else numbers([args.state], "--state"),
            direction=args.direction,
            transient=args.transient,
            t_max=args.t_max,
            rtol=args.rtol,
            atol=args.atol,
            partial=True,
        )
    for warning in said:
        warnings.warn(warning.message, stacklevel=2)
    files = []
    table = "\n".join(_lines(section))
    if args.out is not None:
        write_whole(args.out, f"{table}\n".encode())
        files.append(args.out)
    for path, make in (
        (args.picture, lambda ax: draw(section, ax)),
        (args.map, lambda ax: return_map(section, ax, component=args.component)),
    ):
        if path is not None:
            save_picture(path, make, (6.4, 4.8))
            files.append(path)
    stopped = any(isinstance(one.message, IncompleteWarning) and one.message.interrupted for one in said)
    data = {
        "model": repr(model),
        "section": section.section,
        "direction": section.direction,
        "points": section.found,
        "residual": section.residual,
        "outcome": section.outcome,
        "mean_return_time": float(_mean_gap(section)),
        "t": section.t,
        "state": section.state,
        "which": section.which,
        "files": files,
    }
    if files and not args.json:
        for path in files:
            print(f"written: {path}", file=sys.stderr)
    return CommandResult(table if args.out is None else "", data, 130 if stopped else 0)


def _mean_gap(section: Section) -> float:
    return float((section.t[-1] - section.t[0]) / (section.found - 1)) if section.found > 1 else float("nan")


def _lines(section: Section) -> list[str]:
    """Return the lines of the table, to the last digit."""
    several = len(section.section) > 1
    head = ["t", *section.model.state_names] + (["section"] if several else [])
    rows = [",".join(head)]
    for t, state, which in zip(
        section.t.tolist(), section.state.tolist(), section.which.tolist(), strict=True
    ):
        cells = [repr(value) for value in (t, *state)] + ([str(which)] if several else [])
        rows.append(",".join(cells))
    return rows


def _check(args: argparse.Namespace) -> None:
    """Refuse what cannot be written, before the work."""
    if args.out is not None and not args.out.parent.is_dir():
        raise UddError(f"{args.out}: there is no folder {args.out.parent}")
    checked([path for path in (args.picture, args.map) if path is not None], ())
    if args.map is not None and args.section is not None and len(args.section) > 1:
        raise UddError("--map takes one --section; give one, or leave out --map")
    check_count("points", args.points, 1)
