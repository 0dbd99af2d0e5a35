"""`udd basins`: which initial states end where."""

from __future__ import annotations

import argparse
import warnings
from typing import TYPE_CHECKING, Any

from udd._util.number_text import number_in
from udd.errors import IncompleteWarning, ModelError, UddError

from .export import PICTURES, add_out, checked, save
from .model_options import add_models, add_runs, axis_of, model_of, runs_of, starts_of
from .options import new
from .output import CommandResult, shown_progress

if TYPE_CHECKING:
    import xarray as xr

    from udd.models import Model


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Basins of attraction: which initial states end on which attractor."
    parser = new(
        commands,
        "basins",
        run,
        summary,
        (
            "udd basins omega=-4:4:40 z=-4:4:40 --w 7.6 --out basins.png",
            "udd basins omega=-4:4:12 y=-4:4:12 --w 9",
        ),
    )
    parser.add_argument(
        "grid",
        nargs="+",
        metavar="NAME=FIRST:LAST:N",
        help="one to three components of the state with their values at the start, such as omega=-3:3:100",
    )
    parser.add_argument(
        "--cycles",
        action="store_true",
        help="solve for each attractor that is a cycle: its period with an error bound, its multipliers",
    )
    add_runs(parser, 100)
    add_out(parser)
    add_models(parser)


def run(args: argparse.Namespace) -> CommandResult:
    """Do it; on Ctrl-C what is finished is kept."""
    from udd.attractors import basins
    from udd.plot import basins as draw

    checked(args.out)
    grid = dict(_component(text) for text in args.grid)
    if len(grid) < len(args.grid):
        raise UddError("a component of the grid is given twice")
    if len(grid) != 2 and any(path.suffix in PICTURES for path in args.out):
        raise UddError("a picture of basins needs a grid over two components")
    starts = starts_of(args)
    if starts is not None and len(starts) != 1:
        raise UddError("basins take one --state, for the components that are not on the grid")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", UserWarning)
        result = basins(
            model_of(args, {}),
            grid,
            state0=None if starts is None else starts[0],
            progress=shown_progress(),
            **runs_of(args),
            partial=True,
        )
    cycles = _cycles(model_of(args, {}), result) if args.cycles else {}
    for warning in said:
        warnings.warn(warning.message, stacklevel=2)
    save(args.out, result, lambda ax: draw(result, ax))
    stopped = any(isinstance(warning.message, IncompleteWarning) for warning in said)
    data = {**summary_of(result), "complete": not stopped, "files": args.out}
    for one in data["attractors"]:
        if one["number"] in cycles:
            one["cycle"] = cycles[one["number"]]
    return CommandResult(_text(data), data, 130 if stopped else 0)


def _cycles(model: Model, result: xr.Dataset) -> dict[int, dict[str, Any]]:
    """Return the cycle of each periodic attractor."""
    from udd.bifurcations import periodic_orbit

    cycles = {}
    for k in result["number"].to_numpy():
        one = result.sel(number=k)
        if not float(one["period_time"]) > 0.0:
            continue
        try:
            orbit = periodic_orbit(model, one)
        except ModelError as error:
            warnings.warn(f"attractor {k}: {error}", stacklevel=2)
            continue
        cycles[int(k)] = {
            "period": orbit.period,
            "period_error": orbit.period_error,
            "symmetric": orbit.symmetric,
            "multipliers": [[value.real, value.imag] for value in orbit.multipliers.tolist()],
            "state": orbit.state.tolist(),
        }
    return cycles


def _component(text: str) -> tuple[str, Any]:
    name, equals, span = text.partition("=")
    parts = span.split(":")
    try:
        if not equals or len(parts) != 3:
            raise ValueError
        first, last, n = number_in(parts[0]), number_in(parts[1]), int(parts[2])
    except ValueError:
        raise UddError(
            f"a component of the grid is given as NAME=FIRST:LAST:N, with decimal points, not {text}"
        ) from None
    return name, axis_of(first, last, n)


def summary_of(result: xr.Dataset) -> dict[str, Any]:
    """Return the basins without the grid: the attractors, the fractions, the exponent."""
    kinds = str(result["kind"].attrs["flag_meanings"]).split()
    table = [
        {
            "number": int(attractor["number"]),
            "kind": kinds[int(attractor["kind"])],
            "period": int(attractor["period"]),
            "period_time": float(attractor["period_time"]),
            "mirror": int(attractor["mirror"]),
        }
        for attractor in (result.sel(number=k) for k in result["number"].to_numpy())
    ]
    fractions = [
        {"ending": str(ending), "fraction": float(share), "standard_error": float(error)}
        for ending, share, error in zip(
            result["ending"].to_numpy(),
            result["fraction"].to_numpy(),
            result["fraction_error"].to_numpy(),
            strict=True,
        )
    ]
    exponent = {
        "value": float(result["uncertainty_exponent"]),
        "standard_error": float(result["uncertainty_exponent_error"]),
    }
    return {
        "model": result.attrs["model"],
        "grid": {name: result.sizes[name] for name in result.attrs["grid"].split()},
        "attractors": table,
        "fractions": fractions,
        "uncertainty_exponent": exponent,
    }


def _cycle_text(cycle: dict[str, Any]) -> str:
    multipliers = ", ".join(
        f"{complex(*value):.6g}" if value[1] else f"{value[0]:.6g}" for value in cycle["multipliers"]
    )
    kind = "symmetric cycle" if cycle["symmetric"] else "cycle"
    period = f"{cycle['period']:.13g} (error below {cycle['period_error']:.1g})"
    return f"{kind} of period {period}, multipliers {multipliers}"


def _text(data: dict[str, Any]) -> str:
    size = " x ".join(f"{n} {name}" for name, n in data["grid"].items())
    lines = [f"{data['model']}, {size}"]
    for k, end in enumerate(data["fractions"]):
        what = end["ending"]
        if k < len(data["attractors"]):
            attractor = data["attractors"][k]
            what += f", {attractor['kind']}"
            what += (
                f" {attractor['period']}, T = {attractor['period_time']:.8g}"
                if attractor["kind"] == "periodic"
                else ""
            )
            what += (
                f", mirror image of {attractor['mirror']}"
                if attractor["mirror"] not in (0, attractor["number"])
                else ""
            )
            if "cycle" in attractor:
                what += f"; {_cycle_text(attractor['cycle'])}"
        lines.append(f"  {100 * end['fraction']:.4g} +- {100 * end['standard_error']:.2g} %: {what}")
    exponent = data["uncertainty_exponent"]
    if exponent["value"] == exponent["value"]:
        lines.append(f"  uncertainty exponent {exponent['value']:.3g} +- {exponent['standard_error']:.2g}")
    return "\n".join(lines + [f"written: {path}" for path in data["files"]])
