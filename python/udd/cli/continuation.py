"""`udd continuation`: branches of equilibria and cycles over a parameter."""

from __future__ import annotations

import argparse
import warnings
from typing import TYPE_CHECKING, Any

from udd._util.json_output import as_json
from udd.errors import ModelError, UddError

from .export import add_out, checked, save_picture
from .model_options import add_models, check_component, model_of
from .options import new, numbers
from .output import CommandResult, status_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from udd.bifurcations import BifurcationPoint, Branch, Equilibrium, PeriodicOrbit
    from udd.models import Model


_DATA = (".json",)


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Follow equilibria or a cycle over a parameter, through folds, and locate bifurcations."
    parser = new(
        commands,
        "continuation",
        run,
        summary,
        (
            "udd continuation w --from 7 --to 9 --out branches.png",
            "udd continuation w --from 5.9 --to 6.1 --at 6 --state 0.72665,-8.82437,0 --crises",
        ),
    )
    parser.add_argument("parameter", help="parameter to vary, such as w, W or relaxation.b")
    parser.add_argument("--from", dest="first", type=float, required=True, help="least value")
    parser.add_argument("--to", dest="last", type=float, required=True, help="largest value")
    parser.add_argument(
        "--at", type=float, help="value at which the start is looked for (default: the middle)"
    )
    parser.add_argument("--of", choices=("cycle", "equilibria"), default="cycle", help="object to follow")
    parser.add_argument(
        "--state", metavar="X,X,X", help="state near the cycle (default: run until it settles)"
    )
    parser.add_argument(
        "--period",
        help="approximate period of the cycle (default: searched), or that of the forcing; may be a formula",
    )
    parser.add_argument(
        "--born",
        type=int,
        default=0,
        metavar="N",
        help="follow the branches that begin at bifurcations on the way, N generations",
    )
    parser.add_argument(
        "--cascade", type=int, metavar="N", help="follow N period doublings from the first one on"
    )
    parser.add_argument(
        "--crises", action="store_true", help="locate the crises of chaotic attractors at the saddle cycles"
    )
    parser.add_argument("--most", type=int, default=2000, help="points at most (default 2000)")
    parser.add_argument("--component", help="component of the state in the picture")
    parser.add_argument(
        "--view",
        choices=("extremes", "section", "period"),
        default="extremes",
        help="values of each cycle that the picture shows (default extremes)",
    )
    add_out(parser, _DATA)
    add_models(parser)


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    checked(args.out, _DATA)
    if not args.first < args.last:
        raise UddError(f"--from must be below --to, not {args.first:g} and {args.last:g}")
    at = 0.5 * (args.first + args.last) if args.at is None else args.at
    model = model_of(args, {args.parameter: at})
    model = model.with_parameters({args.parameter: at})
    check_component(model, args.component)
    if args.born < 0:
        raise UddError(f"--born must not be below 0, not {args.born}")
    branches = _branches(args, model)
    data: dict[str, Any] = {
        "model": repr(model),
        "parameter": args.parameter,
        "branches": [branch.as_dict() for branch in branches],
    }
    lines = [_text(branch) for branch in branches]
    if args.cascade is not None:
        result, said = _cascade(args, branches)
        data["cascade"] = result
        lines.append(said)
    if args.crises:
        data["crises"], said = _crises(branches)
        lines.append(said)
    _save(args, branches, data)
    data["files"] = args.out
    return CommandResult("\n".join([*lines, *(f"written: {path}" for path in args.out)]), data)


def _branches(args: argparse.Namespace, model: Model) -> list[Branch]:
    from udd.bifurcations import continuation, equilibria, periodic_orbit
    from udd.bifurcations.branch_diagram import descendants

    bounds = (args.first, args.last)
    starts: list[Equilibrium | PeriodicOrbit] = []
    if args.of == "equilibria":
        rests = equilibria(model)
        if not rests:
            raise UddError(f"no equilibrium to follow was found by {rests.search}; try another value of --at")
        starts += rests
    else:
        guess = None if args.state is None else numbers([args.state], "--state")
        try:
            starts.append(periodic_orbit(model, guess, period=_period(args.period)))
        except ModelError as error:
            raise ModelError(
                f"{error} (a cycle at {args.parameter} = {model.parameters[args.parameter]:g} is wanted: "
                "try another --at, or say --state and --period)"
            ) from None
    branches = [continuation(start, args.parameter, bounds, max_points=args.most) for start in starts]

    def missed(point: BifurcationPoint, error: ModelError) -> None:
        warnings.warn(f"{point.parameter} = {point.value:.10g}: {error}", stacklevel=2)

    with status_line() as tell:
        return descendants(
            branches,
            args.born,
            begun=lambda point: tell(f"following what is born at {point.parameter} = {point.value:.10g}"),
            missed=missed,
            bounds=bounds,
            max_points=args.most,
        )


def _period(text: str | None) -> float | str | None:
    """Read a number, or a formula of the parameters."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return text


def _cascade(args: argparse.Namespace, branches: list[Branch]) -> tuple[dict[str, Any], str]:
    from udd.bifurcations import cascade

    points = [point for branch in branches for point in branch.points]
    ways = [p for p in points if p.kind == "period doubling"] or [
        p for p in points if p.kind == "symmetry breaking"
    ]
    if not ways:
        raise UddError(
            "--cascade needs a period doubling or symmetry breaking, and none was found; widen --from, --to"
        )
    doublings = cascade(ways[0], bounds=(args.first, args.last), n=args.cascade)
    data = {
        "values": doublings.values.tolist(),
        "errors": doublings.errors.tolist(),
        "ratios": doublings.ratios.tolist(),
        "limit": doublings.limit,
        "limit_error": doublings.limit_error,
    }
    lines = [f"period doublings over {doublings.parameter}:"]
    for k, (value, error) in enumerate(zip(doublings.values, doublings.errors, strict=True)):
        ratio = f"   ratio {doublings.ratios[k - 2]:.6g}" if k >= 2 else ""
        lines.append(f"  {value:.12g} (error below {error:.1g}){ratio}")
    lines.append(f"  they accumulate at {doublings.limit:.11g} (error below {doublings.limit_error:.1g})")
    return data, "\n".join(lines)


def _crises(branches: list[Branch]) -> tuple[list[dict[str, Any]], str]:
    from udd.bifurcations import crises

    cycles = [branch for branch in branches if branch.kind == "cycle"]
    if not cycles:
        raise UddError("there is no branch of cycles at which a crisis could be")
    with status_line() as tell:
        tell("looking for crises")
        all_crises = [crisis for branch in cycles for crisis in crises(branch)]
    lines = [f"  {str(crisis)[1:-1]}" for crisis in all_crises] or ["  none was found"]
    return [crisis.as_dict() for crisis in all_crises], "\n".join(["crises:", *lines])


def _text(branch: Branch) -> str:
    name = branch.parameter
    what = "equilibria" if branch.kind == "equilibrium" else "cycles"
    what = f"symmetric {what}" if branch.symmetric else what
    lines = [
        f"{what}, {name} = {branch.values.min():.6g} to {branch.values.max():.6g}, {len(branch)} points, "
        f"{100 * float(branch.stable.mean()):.0f} % of them stable; ends: {'; '.join(branch.ends)}"
    ]
    lines += [f"  {str(point)[1:-1]}" for point in branch.points]
    return "\n".join(lines)


def _save(args: argparse.Namespace, branches: list[Branch], data: dict[str, Any]) -> None:
    from udd._util.atomic_files import write_whole

    def draw(ax: Axes) -> None:
        from udd.plot import branches as draw_branches

        draw_branches(branches, ax, component=args.component, view=args.view)

    for path in args.out:
        if path.suffix == ".json":
            write_whole(path, as_json(data).encode())
        else:
            save_picture(path, draw)
