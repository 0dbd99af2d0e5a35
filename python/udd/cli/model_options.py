"""Options of `udd bifurcation` and `udd basins`: the model, the runs, the initial states."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from udd.errors import UddError

from .options import add_disk, add_pendulum, disk, numbers, pendulum

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from udd.models import Model


def add_models(parser: argparse.ArgumentParser) -> None:
    """Any of the models."""
    parser.add_argument("--w", type=float, help="drive of the dimensionless equations (DLE)")
    parser.add_argument("--B", type=float, default=0.0, help="their damping (default 0)")
    add_disk(parser, "drive speed of the disk [m/s]")
    parser.add_argument(
        "--ignore-edge", action="store_true", help="follow the disk's equations beyond its edge"
    )
    add_pendulum(parser)


def model_of(args: argparse.Namespace, varied: Mapping[str, float]) -> Model:
    """The model; a drive that is varied says which, and has its first value."""
    from udd.models import DLE

    drives = {name: getattr(args, name) for name in ("W", "w", "pendulum")}
    for name in ("W", "w"):
        if name in varied:
            drives[name] = varied[name]
    given = [name for name, value in drives.items() if value is not None]
    if len(given) != 1:
        raise UddError("say which model: --W (the disk), --w (the DLE) or --pendulum, one of them")
    if given == ["w"]:
        return DLE(drives["w"], args.B)
    if given == ["pendulum"]:
        return pendulum(args)
    model = disk(args, drives["W"], 0.08 if args.R is None else args.R)
    return model.replace(edge="ignore") if args.ignore_edge else model


def check_component(model: Model, name: str | None) -> None:
    """Refuse a component that cannot be drawn, before the work."""
    if name is not None and name not in model.state_names:
        raise UddError(f"the state has no component {name!r}; it has {', '.join(model.state_names)}")


def add_runs(parser: argparse.ArgumentParser, points: int) -> None:
    """How every motion is followed."""
    parser.add_argument(
        "--points", type=int, default=points, help=f"section points of each motion (default {points})"
    )
    parser.add_argument(
        "--transient", type=int, default=points, help=f"points left out before (default {points})"
    )
    parser.add_argument("--section", help="surface, such as z or 'maxima of z' (default z, Z or theta)")
    parser.add_argument("--direction", choices=("up", "down", "both"), help="how it is crossed (default up)")
    parser.add_argument("--extend", type=int, help="how many times as far what is not clear is followed")
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
    options = {own: getattr(args, name) for name, own in names.items()}
    extend = {} if args.extend is None else {"max_extension": args.extend}
    return {**options, **extend, "rtol": args.rtol, "atol": args.atol}


def check_count(name: str, value: int, least: int) -> None:
    """Refuse too few by the option's own name."""
    if value < least:
        raise UddError(f"--{name} must be at least {least}, not {value}")


def starts_of(args: argparse.Namespace) -> list[list[float]] | None:
    """The initial states, if any are given."""
    return None if args.state is None else [numbers([text], "--state") for text in args.state]


def axis_of(first: float, last: float, n: int) -> NDArray[np.float64]:
    """Equally spaced values."""
    import numpy as np

    if n < 1:
        raise UddError(f"at least one value is needed, not {n}")
    if not np.isfinite([first, last]).all():
        raise UddError(f"the first and last value must be finite, not {first} and {last}")
    return np.linspace(first, last, n)
