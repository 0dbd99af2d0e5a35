"""`udd sweep`: a quantity over a grid, into a store that outlives the run."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd.errors import IncompleteWarning, UddError

from .option_names import OPTIONS
from .options import new
from .output import CommandResult, shown_progress

if TYPE_CHECKING:
    import xarray as xr

    from udd.sweeps import SweepSpec

_EXAMPLE = """\
A spec in TOML, of the exponents at 1000 drives:

  quantity = "lyapunov"            # or spectrum, final_state, outcome
  model = {kind = "dle", w = 1.0}  # or {kind = "disk", W = 0.039, edge = "ignore"}, ...
  chunk = 64
  [over]                           # one to three parameters or initial values
  w = {from = 0.05, to = 10.0, n = 1000}
  [options]
  tol = 0.005
"""


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Sweep a quantity over a grid; run again, it goes on where it stopped."
    parser = new(
        commands,
        "sweep",
        run,
        summary,
        (
            "udd sweep sweep.toml --store exponents.zarr",
            "udd sweep sweep.toml --store exponents.zarr --json",
        ),
        _EXAMPLE,
    )
    parser.add_argument("spec", type=Path, metavar="SPEC", help="what to compute (TOML or JSON, see below)")
    parser.add_argument(
        "--store", type=Path, required=True, metavar="ZARR", help="folder for the result; made if new"
    )
    parser.add_argument(
        OPTIONS["limit"],
        dest="limit",
        type=float,
        metavar="BYTES",
        help="bytes of memory that the spec may take (default: 1e9)",
    )
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="scheduler of a Dask cluster, such as tcp://host:8786"
    )


def run(args: argparse.Namespace) -> CommandResult:
    """Do it; on Ctrl-C what is finished is in the store."""
    from udd.sweeps import SweepSpec, sweep

    spec = SweepSpec.read(args.spec, **({} if args.limit is None else {"limit": args.limit}))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", UserWarning)
        if args.dask is None:
            result = sweep(spec, store=args.store, progress=shown_progress(), partial=True)
        else:
            with _client(args.dask) as client:
                result = sweep(
                    spec, client.get_executor(), args.store, progress=shown_progress(), partial=True
                )
    for warning in said:
        warnings.warn(warning.message, stacklevel=2)
    unfinished = [w.message for w in said if isinstance(w.message, IncompleteWarning)]
    data = {**_counted(result), "complete": not unfinished, "store": args.store, "spec_sha256": spec.sha256}
    code = 0 if not unfinished else 130 if unfinished[0].interrupted else 1
    return CommandResult(_text(spec, data), data, code)


def _counted(result: xr.Dataset) -> dict[str, Any]:
    """Count the trajectories of each outcome."""
    outcome = result["outcome"]
    ends = outcome.to_numpy()  # a byte each
    names = str(outcome.attrs["flag_meanings"]).split()
    flags = zip(names, outcome.attrs["flag_values"], strict=True)
    counts = {name: int((ends == value).sum()) for name, value in flags}
    outcomes = {name: count for name, count in counts.items() if count}
    return {"quantity": result.attrs["quantity"], "shape": outcome.shape, "outcomes": outcomes}


def _text(spec: SweepSpec, data: dict[str, Any]) -> str:
    outcomes = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in data["outcomes"].items())
    return f"{spec.quantity} over {', '.join(spec.over)}: {outcomes}\nwritten: {data['store']}"


def _client(address: str) -> Any:
    from distributed import Client

    try:
        return Client(address, timeout=10)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise UddError(f"no Dask scheduler answers at {address}: {error}") from None
