"""`udd bifurcation`: section points over a parameter."""

from __future__ import annotations

import argparse
import warnings
from typing import TYPE_CHECKING, Any

from udd.errors import IncompleteWarning

from .export import add_out, checked, save
from .model_options import (
    add_models,
    add_runs,
    axis_of,
    check_component,
    model_of,
    runs_of,
    starts_of,
)
from .options import new
from .output import CommandResult, shown_progress

if TYPE_CHECKING:
    import xarray as xr

_MANY = 12  # stretches that are worth a line each


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Bifurcation diagram: where motions cross a section, over a parameter, and on which attractor."
    parser = new(
        commands,
        "bifurcation",
        run,
        summary,
        (
            "udd bifurcation w --from 5 --to 8 --n 40 --path both --out diagram.png --out diagram.nc",
            "udd bifurcation mu --model own.json --from 0.5 --to 2 --n 8 --section x",
        ),
    )
    parser.add_argument("parameter", help="parameter to vary, such as w, W or relaxation.b")
    parser.add_argument("--from", dest="first", type=float, required=True, help="first value")
    parser.add_argument("--to", dest="last", type=float, required=True, help="last value")
    parser.add_argument("--n", type=int, default=200, help="number of values (default 200)")
    parser.add_argument(
        "--path",
        choices=("independent", "up", "down", "both"),
        default="independent",
        help="start each value at the end of the run before it (up, down), or independently (the default)",
    )
    add_runs(parser, 200)
    parser.add_argument(
        "--component", help="component of the state in the picture (default: one that varies)"
    )
    add_out(parser)
    add_models(parser)


def run(args: argparse.Namespace) -> CommandResult:
    """Do it; on Ctrl-C what is finished is kept."""
    from udd.attractors import bifurcation
    from udd.plot import bifurcation as draw

    checked(args.out)
    values = axis_of(args.first, args.last, args.n)
    model = model_of(args, {args.parameter: float(values[0])})
    check_component(model, args.component)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", UserWarning)
        diagram = bifurcation(
            model,
            args.parameter,
            values,
            initial_states=starts_of(args),
            path=args.path,
            progress=shown_progress(),
            **runs_of(args),
            partial=True,
        )
    for warning in said:
        warnings.warn(warning.message, stacklevel=2)
    save(args.out, diagram, lambda ax: draw(diagram, ax, component=args.component))
    stopped = any(isinstance(warning.message, IncompleteWarning) for warning in said)
    data = {**summary_of(diagram), "complete": not stopped, "files": args.out}
    return CommandResult(_text(data), data, 130 if stopped else 0)


def summary_of(diagram: xr.Dataset) -> dict[str, Any]:
    """Return the diagram without its points: outcomes, stretches of one period, hysteresis."""
    parameter = diagram.attrs["parameter"]
    outcomes = diagram["outcome"]
    names = str(outcomes.attrs["flag_meanings"]).split()
    counts = {name: int((outcomes == k).sum()) for k, name in enumerate(names)}
    stretches = []
    for path in diagram["path"].to_numpy():
        for start in diagram["start"].to_numpy():
            one = diagram.sel(path=path, start=start)
            stretches += [{"path": str(path), "start": int(start), **s} for s in _stretches(one, parameter)]
    intervals = (
        diagram["hysteresis_interval"].to_numpy().tolist() if "hysteresis_interval" in diagram else None
    )
    return {
        "model": diagram.attrs["model"],
        "parameter": parameter,
        "shape": dict(
            zip(("path", "start", "value", "point"), (*outcomes.shape, diagram.sizes["point"]), strict=True)
        ),
        "outcomes": {name: count for name, count in counts.items() if count},
        "attractors": int(diagram["attractor"].max()),
        "stretches": stretches,
        "hysteresis": intervals,
    }


def _stretches(path_data: xr.Dataset, parameter: str) -> list[dict[str, Any]]:
    """Neighbouring values with the same kind, period and attractor."""
    rows: list[dict[str, Any]] = []
    names = str(path_data["kind"].attrs["flag_meanings"]).split()
    keys = (parameter, "kind", "period", "attractor", "symmetric")
    columns = (path_data[name].to_numpy().tolist() for name in keys)
    for value, kind, period, attractor, symmetric in zip(*columns, strict=True):
        word = names[kind].replace("_", " ")
        now = {"kind": word, "period": period, "attractor": attractor, "symmetric": symmetric}
        if rows and all(rows[-1][key] == what for key, what in now.items()):
            rows[-1]["last"] = value
        else:
            rows.append({"first": value, "last": value, **now})
    return rows


def _text(data: dict[str, Any]) -> str:
    name, shape = data["parameter"], data["shape"]
    ends = ", ".join(f"{count} {end.replace('_', ' ')}" for end, count in data["outcomes"].items())
    lines = [
        f"{data['model']}, {shape['value']} values of {name}: {ends}; {data['attractors']} attractors",
    ]
    if len(data["stretches"]) <= _MANY:
        for s in data["stretches"]:
            what = "no verdict" if s["kind"] == "none" else s["kind"]
            what += f" of period {s['period']}" if s["kind"] == "cycle" and s["period"] > 0 else ""
            on = f", attractor {s['attractor']}" if s["attractor"] else ""
            on += ", its own mirror image" if s["symmetric"] == 1 else ""
            way = f"{s['path']}: " if shape["path"] > 1 else ""
            lines.append(f"  {way}{name} = {s['first']:.6g} to {s['last']:.6g}: {what}{on}")
    for first, last in data["hysteresis"] or []:
        lines.append(f"  hysteresis: {name} = {first:.6g} to {last:.6g}")
    return "\n".join(lines + [f"written: {path}" for path in data["files"]])
