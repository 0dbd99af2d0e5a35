"""Options of `udd bifurcation` and `udd basins`: the model, the runs, the initial states."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd.errors import UddError

from .inputs import own_model, start_of
from .options import add_disk, add_pendulum, disk, numbers, pendulum, refuse_others

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from udd.models import Model


def add_models(parser: argparse.ArgumentParser) -> None:
    """Any of the models."""
    add_dle(parser)
    add_others(parser)


def add_others(parser: argparse.ArgumentParser) -> None:
    """Add the models other than the dimensionless equations."""
    add_disk(parser, "drive speed of the disk [m/s]")
    parser.add_argument(
        "--ignore-edge", action="store_true", help="follow the disk's equations beyond its edge"
    )
    add_pendulum(parser)
    add_own(parser)


def add_own(parser: argparse.ArgumentParser) -> None:
    """Add the options of a user's own model."""
    parser.add_argument(
        "--model",
        type=Path,
        metavar="FILE",
        help='a model of your own, as JSON or TOML: {"states": ["x", "v"], "equations": {"x": "v", '
        '"v": "-k*x"}, "parameters": {"k": 1.0}, "state0": {"x": 1.0, "v": 0.0}}',
    )


def add_dle(parser: argparse.ArgumentParser) -> None:
    """Add the options of the dimensionless equations."""
    parser.add_argument("--w", type=float, help="drive of the dimensionless equations (DLE)")
    parser.add_argument("--B", type=float, help="their damping (default 0)")


def model_of(args: argparse.Namespace, varied: Mapping[str, float]) -> Model:
    """Make the model; a varied drive has its first value, and selects the model."""
    drives = {name: getattr(args, name) for name in ("W", "w", "pendulum")}
    for name in ("W", "w"):
        if name in varied and getattr(args, "model", None) is None:
            drives[name] = varied[name]
    return chosen(args, drives)


def chosen(args: argparse.Namespace, drives: Mapping[str, float | None]) -> Model:
    """Make the model whose drive or length is given, and refuse options of other models."""
    from udd.models import DLE

    w, length, W = drives["w"], drives["pendulum"], drives["W"]
    model_file = getattr(args, "model", None)
    if sum(value is not None for value in (*drives.values(), model_file)) != 1:
        raise UddError(
            "say which model: --disk W, --w (the DLE), --pendulum LENGTH or --model FILE, one of them"
        )
    if model_file is not None:
        return own_model(args)
    if w is not None:
        refuse_others(args, "dle")
        return DLE(w, 0.0 if args.B is None else args.B)
    if length is not None:
        refuse_others(args, "pendulum")
        return pendulum(args, length, args.inertia)
    assert W is not None
    refuse_others(args, "disk")
    model = disk(args, W, 0.08 if args.R is None else args.R)
    return model.replace(edge="ignore") if getattr(args, "ignore_edge", False) else model


def check_component(model: Model, name: str | None) -> None:
    """Refuse a component that cannot be drawn, before the work."""
    if name is not None and name not in model.state_names:
        raise UddError(f"the state has no component {name!r}; it has {', '.join(model.state_names)}")


def add_runs(parser: argparse.ArgumentParser, points: int) -> None:
    """Add the options of runs."""
    parser.add_argument(
        "--points", type=int, default=points, help=f"section points of each motion (default {points})"
    )
    parser.add_argument(
        "--transient", type=int, default=points, help=f"points left out before (default {points})"
    )
    parser.add_argument("--section", help="surface, such as z or 'maxima of z' (default z, Z or theta)")
    parser.add_argument(
        "--direction", choices=("up", "down", "both"), help="direction of the crossings (default up)"
    )
    parser.add_argument("--extend", type=int, help="follow an unclear motion N times as long")
    parser.add_argument("--rtol", type=float, default=1e-9, help="relative tolerance (default 1e-9)")
    parser.add_argument("--atol", type=float, default=1e-12, help="absolute tolerance (default 1e-12)")
    parser.add_argument(
        "--state",
        action="append",
        metavar="X,X,X",
        help="initial state omega,y,z or Omega,Y,Z,beta or Omega,theta; repeatable",
    )


def runs_of(args: argparse.Namespace) -> dict[str, Any]:
    """Options of `udd.bifurcation` and `udd.basins`."""
    for name, least in (("points", 12), ("transient", 0)):
        check_count(name, getattr(args, name), least)
    names = {"section": "section", "direction": "direction", "points": "n", "transient": "transient"}
    options = {option: getattr(args, name) for name, option in names.items()}
    extend = {} if args.extend is None else {"max_extension": args.extend}
    return {**options, **extend, "rtol": args.rtol, "atol": args.atol}


def check_count(name: str, value: int, least: int) -> None:
    """Refuse too few by the option's own name."""
    if value < least:
        raise UddError(f"--{name} must be at least {least}, not {value}")


def starts_of(args: argparse.Namespace) -> list[list[float]] | None:
    """Return the given initial states, or that of the user's own model."""
    if args.state is not None:
        return [numbers([text], "--state") for text in args.state]
    start = own_start(args)
    return None if start is None else [start]


def own_start(args: argparse.Namespace) -> list[float] | None:
    """Return the initial state in the file of the user's own model, None if it gives none.

    Raises
    ------
    UddError
        There is neither that nor a state on the command line.
    """
    if getattr(args, "model", None) is None:
        return None
    names, start = own_model(args).state_names, start_of(args)
    if isinstance(start, dict) and set(names) <= set(start):
        return [float(start[name]) for name in names]
    raise UddError(f'say where the motion starts: --state {",".join(names)}, or "state0" in {args.model}')


def axis_of(first: float, last: float, n: int) -> NDArray[np.float64]:
    """Equally spaced values."""
    import numpy as np

    if n < 1:
        raise UddError(f"at least one value is needed, not {n}")
    if not np.isfinite([first, last]).all():
        raise UddError(f"the first and last value must be finite, not {first} and {last}")
    return np.linspace(first, last, n)
